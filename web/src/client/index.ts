/** The isoswarm core in a worker: see `web/README.md`. */
import { browserTransport } from './browser.js';
import { Client, type ConnectOptions } from './client.js';

export { browserTransport } from './browser.js';
export * from './exports.js';

/** A client whose worker and module lie beside this file. Resolves when the core is loaded. */
export async function connect(options: Partial<ConnectOptions> = {}): Promise<Client> {
  const spawn = () => browserTransport(new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' }));
  const wasm = options.wasm ?? (await compile(new URL('../../wasm/pkg/core_bg.wasm', import.meta.url)));
  const client = new Client({ spawn, ...options, wasm });
  await client.version;
  return client;
}

/** Compiled once, for all workers. */
async function compile(url: URL): Promise<WebAssembly.Module> {
  const response = fetch(url);
  try {
    return await WebAssembly.compileStreaming(response);
  } catch {
    // A host that does not call it application/wasm.
    return WebAssembly.compile(await (await fetch(url)).arrayBuffer());
  }
}
