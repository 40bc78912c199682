/** Where the worker and the module lie: files beside the page. */
import { browserTransport } from './browser.js';
import type { Modules } from './client.js';
import type { Transport } from './link.js';

export function spawn(): Transport {
  return browserTransport(new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' }));
}

/** Each is compiled once, for all workers. */
export async function wasm(): Promise<Modules> {
  const full = () => compile(new URL('../../wasm/pkg/full_bg.wasm', import.meta.url));
  return { core: await compile(new URL('../../wasm/pkg/core_bg.wasm', import.meta.url)), full };
}

async function compile(url: URL): Promise<WebAssembly.Module> {
  try {
    return await WebAssembly.compileStreaming(fetch(url));
  } catch {
    // A host that does not call it application/wasm.
    return WebAssembly.compile(await (await fetch(url)).arrayBuffer());
  }
}
