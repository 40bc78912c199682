/** The worker of a browser. */
import { Host } from './host.js';
import type { ToWorker } from './protocol.js';

const scope = globalThis as unknown as {
  postMessage(message: unknown, transfer: Transferable[]): void;
  onmessage: ((event: MessageEvent<ToWorker>) => void) | null;
};
const host = new Host((message, transfer) => scope.postMessage(message, transfer));
scope.onmessage = event => void host.receive(event.data);
