/** Loads the WebAssembly module. */
import init, * as bindings from '../../wasm/pkg/core.js';
import type { Witness } from './failure.js';

export type Core = bindings.Core;

/** The loaded module: its functions, its memory, and what it said before it stopped. */
export interface Module extends Witness {
  readonly Core: typeof bindings.Core;
  readonly version: typeof bindings.version;
  readonly kinds: typeof bindings.kinds;
  readonly adapters: typeof bindings.adapters;
  readonly check: typeof bindings.check;
  readonly provoke: typeof bindings.provoke;
}

/** Bytes of a page of memory. */
const PAGE = 65536;
/** Pages with which the module starts: what the linker lays out, and some more. */
const FIRST = 96;

/**
 * Loads the module from its bytes, compiled form or address. Its memory grows to at most `limit` bytes.
 * One a thread: a module that has stopped is gone with its worker.
 */
export async function load(wasm: WebAssembly.Module | BufferSource | string, limit: number): Promise<Module> {
  let words: string | null = null;
  Object.assign(globalThis, {
    isoswarmPanicked: (message: string) => {
      words = message;
    },
  });
  const maximum = Math.min(Math.max(Math.floor(limit / PAGE), FIRST), 65536);
  const memory = new WebAssembly.Memory({ initial: FIRST, maximum });
  await init({ module_or_path: wasm, memory });
  const { Core, version, kinds, adapters, check, provoke } = bindings;
  return { Core, version, kinds, adapters, check, provoke, memory, limit, lastWords: () => words };
}
