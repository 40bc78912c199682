/**
 * Loads the WebAssembly modules: `core`, with all that shaping a surface takes, and `full`, the same with meshes and files of points.
 */
import initCore, * as core from '../../wasm/pkg/core.js';
import initFull, * as full from '../../wasm/pkg/full.js';
import type { Witness } from './failure.js';
import type { Wasm } from './protocol.js';

export type Core = core.Core;
export type FullCore = full.Core;

/** A loaded module: its functions, its memory, and what it said before it stopped. */
export interface Module extends Witness {
  readonly open: (source: string, floaters: Float64Array) => Core;
  readonly version: typeof core.version;
  readonly kinds: typeof core.kinds;
  readonly adapters: typeof core.adapters;
  readonly check: typeof core.check;
  readonly provoke: typeof core.provoke;
}

export interface FullModule extends Module {
  readonly open: (source: string, floaters: Float64Array) => FullCore;
  readonly Live: typeof full.Live;
  readonly pointsFile: typeof full.points_file;
}

/** Bytes of a page of memory. */
const PAGE = 65536;
/** Pages with which a module starts: what the linker lays out, and some more. */
const FIRST = 96;

/** What a module of this worker said last. */
let words: string | null = null;

function prepare(limit: number): Witness {
  Object.assign(globalThis, {
    isoswarmPanicked: (message: string) => {
      words = message;
    },
  });
  const maximum = Math.min(Math.max(Math.floor(limit / PAGE), FIRST), 65536);
  const memory = new WebAssembly.Memory({ initial: FIRST, maximum });
  return { memory, limit, lastWords: () => words };
}

/**
 * Loads `core` from its bytes, compiled form or address. Its memory grows to at most `limit` bytes.
 * One a worker: a module that has stopped is gone with its worker.
 */
export async function loadCore(wasm: Wasm, limit: number): Promise<Module> {
  const witness = prepare(limit);
  await initCore({ module_or_path: wasm, memory: witness.memory });
  const { Core, version, kinds, adapters, check, provoke } = core;
  return { ...witness, open: Core.open, version, kinds, adapters, check, provoke };
}

/** The same for `full`, which has a memory of its own. */
export async function loadFull(wasm: Wasm, limit: number): Promise<FullModule> {
  const witness = prepare(limit);
  await initFull({ module_or_path: wasm, memory: witness.memory });
  const { Core, version, kinds, adapters, check, provoke, Live, points_file } = full;
  return { ...witness, open: Core.open, version, kinds, adapters, check, provoke, Live, pointsFile: points_file };
}
