/** The worker of Node. */
import { parentPort, type TransferListItem } from 'node:worker_threads';
import { Host } from './host.js';
import type { ToWorker } from './protocol.js';

const port = parentPort;
if (port) {
  const host = new Host((message, transfer) => port.postMessage(message, transfer as TransferListItem[]));
  port.on('message', (message: ToWorker) => void host.receive(message));
}
