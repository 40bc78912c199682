/** The scene is kept in the browser, a moment after each change. */
import { effect } from '@preact/signals';
import { onSaved, title } from './session.ts';
import { type Shared, isLinkOf, isShared } from './share.ts';

const DATABASE = 'isoswarm';
const STORE = 'scenes';
const KEY = 'last';

function database(): Promise<IDBDatabase> {
  return new Promise((done, fail) => {
    const asked = indexedDB.open(DATABASE, 1);
    asked.onupgradeneeded = () => asked.result.createObjectStore(STORE);
    asked.onsuccess = () => done(asked.result);
    asked.onerror = () => fail(asked.error);
  });
}

async function withStore<T>(mode: IDBTransactionMode, use: (store: IDBObjectStore) => IDBRequest<T>): Promise<T> {
  const db = await database();
  try {
    return await new Promise((done, fail) => {
      const request = use(db.transaction(STORE, mode).objectStore(STORE));
      request.onsuccess = () => done(request.result);
      request.onerror = () => fail(request.error);
    });
  } finally {
    db.close();
  }
}

/** What was kept last; null where there is nothing or the browser does not let us. */
export async function lastScene(): Promise<Shared | null> {
  try {
    return ((await withStore('readonly', s => s.get(KEY))) as Shared | undefined) ?? null;
  } catch {
    return null;
  }
}

async function keep(shared: Shared): Promise<void> {
  try {
    await withStore('readwrite', s => s.put(shared, KEY));
    document.documentElement.dataset.kept = String(Number(document.documentElement.dataset.kept ?? 0) + 1);
  } catch {
    // The next change tries again; a browser without storage keeps nothing.
  }
}

/** Keeps the scene whenever the client has saved it, and its name. */
export function startAutosave(): void {
  let text = '';
  onSaved(scene => {
    text = scene;
    // A link in the address goes when the scene is another one.
    if (isShared(location.hash) && !isLinkOf(scene)) history.replaceState(null, '', location.pathname + location.search);
    void keep({ title: title.value, scene });
  });
  effect(() => {
    const name = title.value;
    if (text) void keep({ title: name, scene: text });
  });
}
