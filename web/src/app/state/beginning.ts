/** What the page begins with: a shared link, a file beside the page, what was kept last, or a scene of the gallery. */
import type { GalleryScene } from '../gallery/scenes.ts';
import { lastScene } from './autosave.ts';
import { open } from './files.ts';
import { decode, isShared } from './share.ts';
import { dialog, say } from './ui.ts';
import { complain } from './session.ts';

export async function beginning(first: GalleryScene): Promise<void> {
  if (isShared(location.hash) && (await openShared())) return;
  if (await openNamed()) return;
  const kept = await lastScene();
  if (kept && (await open({ text: kept.scene }, kept.title))) return;
  try {
    await open(await first.source(), first.title);
  } catch (error) {
    complain(error);
  }
}

async function openShared(): Promise<boolean> {
  try {
    const shared = decode(location.hash);
    return await open({ text: shared.scene }, shared.title);
  } catch (error) {
    say((error as Error).message, { tone: 'warn', action: { label: 'Open the gallery', run: () => (dialog.value = 'gallery') } });
    return false;
  } finally {
    // The address is not the scene's any more once it is changed.
    history.replaceState(null, '', location.pathname + location.search);
  }
}

/** `?model=scene.iso.json`: a file at an address relative to the page. */
async function openNamed(): Promise<boolean> {
  const name = new URLSearchParams(location.search).get('model');
  if (name === null) return false;
  try {
    const reply = await fetch(name);
    if (!reply.ok) throw new Error(`${name} could not be read: the server answers ${reply.status}.`);
    const title = name.split('/').at(-1)!.replace(/(\.iso)?\.json$/, '');
    return await open({ text: await reply.text() }, title);
  } catch (error) {
    complain(error);
    return false;
  }
}
