/** Workers of the browser. */
import type { Transport } from './link.js';

/** A worker as a transport. */
export function browserTransport(worker: Worker): Transport {
  return {
    post: (message, transfer) => worker.postMessage(message, transfer),
    listen: (message, ended) => {
      worker.onmessage = event => message(event.data as never);
      worker.onerror = event => {
        event.preventDefault();
        ended(`The worker ended: ${event.message || 'it could not be loaded'}`);
      };
      worker.onmessageerror = () => ended('The worker sent what cannot be read.');
    },
    terminate: () => worker.terminate(),
  };
}
