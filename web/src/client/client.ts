/** A scene in a worker, kept safe outside it. */
import { CoreError } from './failure.js';
import { Latest } from './latest.js';
import { cancelled, Link, notLoaded, type RequestOptions, type Transport } from './link.js';
import { Player, type PlayOptions } from './player.js';
import { inForce } from './tail.js';
import type {
  Budget,
  Change,
  Column,
  Command,
  Failure,
  Frame,
  Hand,
  Hit,
  Input,
  MeshData,
  MeshFormat,
  Output,
  PointFormat,
  RequestName,
  Saved,
  SceneState,
  Source,
  Vec3,
  Wasm,
} from './protocol.js';

/** The WebAssembly module in two: what a page starts with, and, when it is first needed, the same with meshes and files. */
export interface Modules {
  core: Wasm;
  full: () => Promise<Wasm>;
}

export interface ConnectOptions {
  /** Starts a worker. */
  spawn: () => Transport;
  /** The WebAssembly module in two, or `full` alone. */
  wasm: Modules | Wasm;
  /** Bytes that the core may use, default 1 GiB. */
  memoryLimit?: number;
  /** Milliseconds after a change until the scene is saved outside the worker, default 300. */
  saveAfter?: number;
  /** Milliseconds without a sign of life, while a request is under way, after which `silent` is told; default 10,000. */
  patience?: number;
}

/** What a client tells. */
export interface Events {
  /** The scene has changed other than by steps. */
  state: SceneState;
  /** A saved form is there, outside the worker. */
  saved: Saved;
  /** The core has stopped; it is started again from what was saved. */
  stopped: Failure;
  /** It is back. `state` is null where no scene was open. */
  restarted: { state: SceneState | null; failure: Failure };
  /** The worker has not answered for so many milliseconds: wait, or `restart()`. */
  silent: number;
}

type Handler<T> = (value: T) => void;

/** Requests that do not change the scene and run in a worker of their own. */
type JobName = 'mesh' | 'exportMesh' | 'exportSamples';

const MEMORY_LIMIT = 2 ** 30;

/** The core is started again at most so many times within so many milliseconds; then `restart()` is up to the page. */
const MOST_STOPS = 3;
const STOPS_WITHIN = 60_000;

/** Commands after which there is nothing new to save. */
const HARMLESS = new Set<Command['do']>(['step', 'grab']);

export class Client {
  readonly #options: Required<ConnectOptions>;
  readonly #handlers: { [K in keyof Events]: Set<Handler<Events[K]>> } = {
    state: new Set(),
    saved: new Set(),
    stopped: new Set(),
    restarted: new Set(),
    silent: new Set(),
  };
  #link: Link;
  /** The module for long jobs, from the first one on. */
  #full: Promise<Wasm> | null = null;
  /** Resolves when requests can be sent. */
  #ready: Promise<unknown>;
  #saved: Saved | null = null;
  /** Commands that are not in `#saved` yet. */
  #tail: Command[] = [];
  #saver: ReturnType<typeof setTimeout> | null = null;
  #watch: ReturnType<typeof setInterval>;
  #told = false;
  #closed = false;
  #latest = new Latest();
  #player: Player | null = null;
  #open = false;
  /** When the core has stopped lately (ms). */
  #stops: number[] = [];

  constructor(options: ConnectOptions) {
    this.#options = { memoryLimit: MEMORY_LIMIT, saveAfter: 300, patience: 10_000, ...options };
    this.#link = this.#start();
    this.#ready = this.#link.ready;
    this.#watch = setInterval(() => this.#look(), 1000);
    (this.#watch as { unref?: () => void }).unref?.();
  }

  /** The version of the core, once it is loaded. */
  get version(): Promise<string> {
    return this.#link.ready;
  }

  /** The scene as it was last saved outside the worker. */
  get saved(): Saved | null {
    return this.#saved;
  }

  /** Whether a scene has been opened. */
  get isOpen(): boolean {
    return this.#open;
  }

  /** Calls `handler` on each event, until the function that comes back is called. */
  on<K extends keyof Events>(event: K, handler: Handler<Events[K]>): () => void {
    this.#handlers[event].add(handler);
    return () => this.#handlers[event].delete(handler);
  }

  /** Sends a request; what all methods are made of. */
  async request<N extends RequestName>(name: N, input: Input<N>, options: RequestOptions = {}): Promise<Output<N>> {
    await this.#ready;
    const output = await this.#send(name, input, options);
    await this.#note(name, input, output);
    return output;
  }

  async #send<N extends RequestName>(name: N, input: Input<N>, options: RequestOptions): Promise<Output<N>> {
    const link = this.#link;
    const { signal } = options;
    if (!signal || link.canCancel) return link.request(name, input, options);
    // Without shared memory the only way to stop it is to end the worker; what was saved is opened again.
    const abort = () => {
      if (this.#link === link) void this.restart(cancelled());
    };
    signal.addEventListener('abort', abort, { once: true });
    try {
      return await link.request(name, input, options);
    } finally {
      signal.removeEventListener('abort', abort);
    }
  }

  /** Keeps what is needed to start again, and tells what has changed. */
  async #note<N extends RequestName>(name: N, input: Input<N>, output: Output<N>): Promise<void> {
    if (name === 'open') {
      this.#tail = [];
      this.#saved = null;
      this.#open = true;
      await this.save().catch(() => undefined);
      this.#changed(output as SceneState);
    } else if (name === 'apply') {
      const { command } = input as Input<'apply'>;
      const { state } = output as Output<'apply'>;
      if (!HARMLESS.has(command.do)) {
        this.#tail.push(command);
        // What goes back beyond the last saved scene cannot be told by commands: that is saved at once.
        this.#saveSoon(command.do === 'undo' || command.do === 'redo' ? 0 : this.#options.saveAfter);
      }
      this.#changed(state);
    } else if (name === 'advance' && ((input as Input<'advance'>).hands || (output as Frame).moving)) {
      this.#saveSoon();
    }
  }

  #changed(state: SceneState): void {
    this.#player?.poke();
    this.#tell('state', state);
  }

  /** Opens a scene; the old one stays where that fails. */
  open(source: Source, options: RequestOptions = {}): Promise<SceneState> {
    return this.request('open', source, options);
  }

  /** Carries a command out. */
  apply(command: Command, options: RequestOptions = {}): Promise<{ change: Change; state: SceneState }> {
    return this.request('apply', { command }, options);
  }

  /**
   * The same for what follows a hand, such as a slider: while one is under way only the last of those with the same key is kept.
   * Resolves to null where a later one took its place.
   */
  applyLatest(key: string, command: Command): Promise<{ change: Change; state: SceneState } | null> {
    return this.#latest.run(key, () => this.apply(command));
  }

  undo(): Promise<SceneState> {
    return this.apply({ do: 'undo' }).then(done => done.state);
  }

  redo(): Promise<SceneState> {
    return this.apply({ do: 'redo' }).then(done => done.state);
  }

  /** Lets time pass and gives a frame; see `play` for a loop. */
  advance(input: Budget & { hands?: Hand[]; radius?: number; columns?: Column[] } = {}): Promise<Frame> {
    return this.request('advance', input);
  }

  frame(columns: Column[] = []): Promise<Frame> {
    return this.request('advance', { steps: 0, columns });
  }

  state(): Promise<SceneState> {
    return this.request('state', {});
  }

  pick(ray: { origin: Vec3; direction: Vec3 }): Promise<Hit | null> {
    return this.request('pick', ray);
  }

  part(path = ''): Promise<string> {
    return this.request('part', { path });
  }

  check(text: string, parameters?: Record<string, number>): Promise<Output<'check'>> {
    return this.request('check', parameters ? { text, parameters } : { text });
  }

  /** Steps on and on, and gives frames as fast as they are drawn. One loop a client: a second one ends the first. */
  play(options: PlayOptions): Player {
    this.#player?.stop();
    this.#player = new Player(this, options);
    return this.#player;
  }

  /** Saves the scene outside the worker, now. */
  async save(): Promise<Saved> {
    if (this.#saver) clearTimeout(this.#saver);
    this.#saver = null;
    const given = this.#tail.length;
    const saved = await this.request('save', {});
    this.#saved = saved;
    this.#tail.splice(0, given);
    this.#tell('saved', saved);
    return saved;
  }

  mesh(input: { spacing?: number } = {}, options: RequestOptions = {}): Promise<MeshData> {
    return this.job('mesh', input, options);
  }

  exportPoints(format: PointFormat): Promise<ArrayBuffer> {
    return this.request('exportPoints', { format });
  }

  exportSamples(format: PointFormat, count?: number, options: RequestOptions = {}): Promise<ArrayBuffer> {
    return this.job('exportSamples', count === undefined ? { format } : { format, count }, options);
  }

  exportMesh(format: MeshFormat, input: { spacing?: number } = {}, options: RequestOptions = {}): Promise<ArrayBuffer> {
    return this.job('exportMesh', { format, ...input }, options);
  }

  /** A long request on a snapshot, in a worker of its own: cancelling ends that one at once, and the scene goes on meanwhile. */
  async job<N extends JobName>(name: N, input: Input<N>, options: RequestOptions = {}): Promise<Output<N>> {
    if (options.signal?.aborted) throw new CoreError(cancelled());
    const { scene, points } = await this.request('save', {});
    const link = await this.#worker();
    const abort = () => link.end(cancelled());
    options.signal?.addEventListener('abort', abort, { once: true });
    if (options.signal?.aborted) abort();
    try {
      await link.ready;
      await link.request('open', { text: scene, points });
      const { onProgress } = options;
      return await link.request(name, input, onProgress ? { onProgress } : {});
    } finally {
      options.signal?.removeEventListener('abort', abort);
      link.end(cancelled());
    }
  }

  /** Ends the worker and starts another from what was saved and the commands since. */
  async restart(failure: Failure = { kind: 'stopped', message: 'The core was started again.' }): Promise<SceneState | null> {
    this.#link.end(failure);
    this.#told = false;
    const link = (this.#link = this.#start());
    let opened!: () => void;
    this.#ready = new Promise<void>(resolve => (opened = resolve));
    let state: SceneState | null = null;
    try {
      await link.ready;
      if (this.#saved) {
        const { scene, points } = this.#saved;
        state = await link.request('open', { text: scene, points: points.slice() });
        for (const command of inForce(this.#tail)) {
          // What cannot be done again is left out: the rest is worth more.
          state = await link.request('apply', { command }).then(
            done => done.state,
            () => state,
          );
        }
      }
    } finally {
      if (this.#link === link) opened();
    }
    this.#open = state !== null;
    this.#tell('restarted', { state, failure });
    if (state) this.#tell('state', state);
    this.#player?.poke();
    return state;
  }

  /** Ends the worker for good. */
  close(): void {
    this.#closed = true;
    this.#player?.stop();
    clearInterval(this.#watch);
    if (this.#saver) clearTimeout(this.#saver);
    this.#link.end(cancelled());
  }

  /** The module for long jobs, fetched once. */
  readonly #getFull = (): Promise<Wasm> => {
    const { wasm } = this.#options;
    this.#full ??= isModules(wasm) ? wasm.full() : Promise.resolve(wasm);
    this.#full.catch(() => (this.#full = null));
    return this.#full;
  };

  /** A worker for a long job. */
  async #worker(): Promise<Link> {
    const { spawn, memoryLimit } = this.#options;
    const wasm = await this.#getFull().catch((error: unknown) => {
      throw new CoreError(notLoaded(error));
    });
    return new Link(spawn(), wasm, null, memoryLimit, () => undefined);
  }

  #start(): Link {
    const { spawn, wasm, memoryLimit } = this.#options;
    let loaded = false;
    const [first, full] = isModules(wasm) ? [wasm.core, this.#getFull] : [wasm, null];
    const link = new Link(spawn(), first, full, memoryLimit, failure => {
      if (this.#closed) return;
      this.#tell('stopped', failure);
      // What cannot be loaded, or stops again and again, is not started for ever.
      const now = performance.now();
      this.#stops = [...this.#stops.filter(at => now - at < STOPS_WITHIN), now];
      if (loaded && this.#stops.length <= MOST_STOPS) void this.restart(failure).catch(() => undefined);
    });
    link.ready.then(
      () => (loaded = true),
      () => undefined,
    );
    return link;
  }

  #saveSoon(after = this.#options.saveAfter): void {
    if (this.#closed) return;
    if (this.#saver) {
      if (after > 0) return;
      clearTimeout(this.#saver);
    }
    this.#saver = setTimeout(() => {
      this.#saver = null;
      void this.save().catch(() => undefined);
    }, after);
    (this.#saver as { unref?: () => void }).unref?.();
  }

  #look(): void {
    const silent = performance.now() - this.#link.heard;
    if (this.#link.waiting === 0 || silent < this.#options.patience) {
      this.#told = false;
    } else if (!this.#told) {
      this.#told = true;
      this.#tell('silent', silent);
    }
  }

  #tell<K extends keyof Events>(event: K, value: Events[K]): void {
    for (const handler of this.#handlers[event]) handler(value);
  }
}

function isModules(wasm: Modules | Wasm): wasm is Modules {
  return typeof wasm === 'object' && 'full' in wasm;
}
