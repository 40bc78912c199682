/** The isoswarm core in a worker: see `web/README.md`. */
import { Client, type ConnectOptions } from './client.js';
import { spawn, wasm } from './places.js';

export { browserTransport } from './browser.js';
export * from './exports.js';

/** A client whose worker and module lie beside this file. Resolves when the core is loaded. */
export async function connect(options: Partial<ConnectOptions> = {}): Promise<Client> {
  const client = new Client({ spawn, ...options, wasm: options.wasm ?? (await wasm()) });
  await client.version;
  return client;
}
