/** The Studio's side where it is part of another page, such as a notebook: it takes scenes from there and tells what has changed. */
import type { Client, Command } from '../client/exports.js';
import type { FromStudio, Shared, SharedPin, ToStudio } from './messages.js';

/** Whether this page is part of another one that said so (`#embedded`). */
export function isEmbedded(): boolean {
  return window.parent !== window && (location.hash === '#embedded' || document.documentElement.dataset.embedded === 'true');
}

/** What the page does with what comes from outside. */
export interface Page {
  open(text: string): Promise<unknown>;
  apply(command: Command): Promise<unknown>;
}

/**
 * Connects the client to the page around it. Resolves when a scene has come from there and is open.
 * Scenes and commands go through the page, so that it shows them as it shows its own.
 */
export function embed(client: Client, page: Page): Promise<void> {
  const send = (message: FromStudio) => window.parent.postMessage(message, '*');
  let last = '';
  /** Changes from outside that are being taken over: they are not told back. */
  let taking = 0;
  const tell = async (silently: boolean) => {
    const shared = await sharedOf(client);
    // Steps alone change nothing that is shared.
    const text = JSON.stringify({ ...shared, document: shared.document.replace(/"clock": \d+/, '') });
    if (text === last) return;
    last = text;
    if (!silently) send({ type: 'isoswarm-changed', ...shared });
  };
  const takeOver = async (work: Promise<unknown>) => {
    taking++;
    try {
      await work;
      await client.save();
      await tell(true);
    } finally {
      taking--;
    }
  };
  return new Promise((resolve, reject) => {
    window.addEventListener('message', event => {
      if (event.source !== window.parent) return;
      const message = event.data as ToStudio;
      const work = take(page, message);
      if (work) takeOver(work).then(resolve, reject);
    });
    client.on('saved', () => {
      if (taking === 0) void tell(false).catch(() => undefined);
    });
    send({ type: 'isoswarm-ready' });
  });
}

function take(page: Page, message: ToStudio): Promise<unknown> | null {
  switch (message?.type) {
    case 'isoswarm-open':
      return page.open(message.document);
    case 'isoswarm-assign':
      return page.apply({
        do: 'assign',
        values: message.values,
        pins: message.pins.map(pin => ({ pin: pin.id, to: pin.at })),
      });
    default:
      return null;
  }
}

async function sharedOf(client: Client): Promise<Shared> {
  const state = await client.state();
  const pins: SharedPin[] = state.pins.map(({ id, name, at }) => ({ id, name, at }));
  const values = Object.fromEntries(state.parameters.filter(p => !p.discrete).map(p => [p.path, p.value]));
  return { document: client.saved?.scene ?? '', values, pins };
}
