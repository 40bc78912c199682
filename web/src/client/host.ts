/** The worker's side: carries requests out, one after the other. Knows nothing of how messages travel. */
import type { ColumnName, Failure, FromWorker, Input, Output, RequestName, ToWorker, Wasm } from './protocol.js';
import { failureOf, isFailure } from './failure.js';
import { loadCore, loadFull, type Core, type FullCore, type FullModule, type Module } from './core.js';

/** Milliseconds between two reports of progress. */
const REPORT_EVERY = 50;

type Post = (message: FromWorker, transfer: Transferable[]) => void;

/** What a request gives: a value, and the buffers in it. */
interface Answer<T> {
  value: T;
  transfer?: Transferable[];
}

export class Host {
  #module: Module | null = null;
  /** The module that has meshes and files, once it is needed; the same as `#module` in a worker for long jobs. */
  #full: Promise<FullModule> | null = null;
  #core: Core | null = null;
  /** Triangles that follow the floaters. */
  #live: InstanceType<FullModule['Live']> | null = null;
  #limit = 0;
  #given: (wasm: Wasm | Failure) => void = () => undefined;
  #cancel: Int32Array | null = null;
  #dead: Failure | null = null;
  #queue: Promise<void> = Promise.resolve();

  constructor(private readonly post: Post) {}

  /** Takes a message; they are carried out in order. */
  receive(message: ToWorker): Promise<void> {
    if (message.type === 'full') {
      this.#given(message.wasm);
      return this.#queue;
    }
    this.#queue = this.#queue.then(() => this.#carryOut(message));
    return this.#queue;
  }

  async #carryOut(message: Exclude<ToWorker, { type: 'full' }>): Promise<void> {
    if (message.type === 'start') {
      this.#cancel = message.cancel ? new Int32Array(message.cancel) : null;
      try {
        this.#limit = message.memoryLimit;
        if (message.full) this.#full = loadFull(message.wasm, this.#limit);
        this.#module = await (this.#full ?? loadCore(message.wasm, this.#limit));
        this.post({ type: 'ready', version: this.#module.version() }, []);
      } catch (error) {
        this.#dead = { kind: 'stopped', message: `The core could not be loaded: ${String(error)}` };
        this.post({ type: 'failure', id: -1, failure: this.#dead }, []);
      }
      return;
    }
    const { id, name } = message;
    if (this.#dead) return this.post({ type: 'failure', id, failure: this.#dead }, []);
    try {
      if (!this.#module) throw protocol('the worker has not been started');
      if (!Object.hasOwn(this.#handlers, name)) throw protocol(`there is no request called \`${String(name)}\``);
      const handler = this.#handlers[name] as (input: unknown, id: number) => Answer<unknown> | Promise<Answer<unknown>>;
      const { value, transfer } = await handler(message.input, id);
      this.post({ type: 'reply', id, name, value }, transfer ?? []);
    } catch (error) {
      const failure = failureOf(error, this.#module);
      if (failure.kind === 'stopped' || failure.kind === 'memory') this.#dead = failure;
      this.post({ type: 'failure', id, failure }, []);
    }
  }

  get #scene(): Core {
    if (!this.#core) throw protocol('no scene is open');
    return this.#core;
  }

  /** The module that has meshes and files. */
  #getFull(): Promise<FullModule> {
    this.#full ??= new Promise<Wasm>((resolve, reject) => {
      this.#given = wasm => (isFailure(wasm) ? reject(wasm) : resolve(wasm));
      this.post({ type: 'wants' }, []);
    }).then(wasm => loadFull(wasm, this.#limit));
    this.#full.catch(() => (this.#full = null));
    return this.#full;
  }

  /** Does a job on the scene, or on a copy of it where it is in the other module. */
  async #withFull<T>(job: (scene: FullCore) => T): Promise<T> {
    const module = await this.#getFull();
    if (module === this.#module) return job(this.#scene as FullCore);
    const copy = module.open(JSON.stringify({ text: this.#scene.save() }), this.#scene.exact());
    try {
      return job(copy);
    } finally {
      copy.free();
    }
  }

  /** Tells how far a command is, and whether it is to end. */
  #teller(id: number): (done: number, of: number, remaining: number) => boolean {
    let last = performance.now();
    return (done, of, remaining) => {
      const now = performance.now();
      if (now - last > REPORT_EVERY) {
        last = now;
        this.post({ type: 'progress', id, progress: { done, of, remaining } }, []);
      }
      return this.#isCancelled(id);
    };
  }

  #isCancelled(id: number): boolean {
    return this.#cancel !== null && Atomics.load(this.#cancel, 0) === id;
  }

  readonly #handlers: { [N in RequestName]: (input: Input<N>, id: number) => Answer<Output<N>> | Promise<Answer<Output<N>>> } = {
    open: ({ points, ...source }) => {
      const next = this.#module!.open(JSON.stringify(source), points ?? new Float64Array());
      this.#core?.free();
      this.#live?.free();
      [this.#core, this.#live] = [next, null];
      return { value: parse(next.state()) };
    },
    apply: ({ command }, id) => {
      const change = parse<Output<'apply'>['change']>(this.#scene.apply(JSON.stringify(command), this.#teller(id)));
      return { value: { change, state: parse(this.#scene.state()) } };
    },
    advance: (input, id) => this.#advance(input, id),
    state: () => ({ value: parse(this.#scene.state()) }),
    kinds: () => ({ value: parse(this.#module!.kinds()) }),
    adapters: () => ({ value: parse(this.#module!.adapters()) }),
    pick: ({ origin, direction }) => ({ value: parse(this.#scene.pick(...origin, ...direction)) }),
    project: ({ point }) => ({ value: parse(this.#scene.project(...point)) }),
    check: ({ text, parameters }) => ({
      value: parse(this.#module!.check(text, JSON.stringify(parameters ?? {}))),
    }),
    part: ({ path }) => ({ value: this.#scene.part(path) }),
    box: ({ path }) => ({ value: parse(this.#scene.part_box(path)) }),
    save: () => {
      const points = this.#scene.exact();
      return { value: { scene: this.#scene.save(), log: this.#scene.log(), points }, transfer: [points.buffer] };
    },
    evenness: () => ({ value: parse(this.#scene.evenness()) }),
    exportPoints: async ({ format }) => {
      const { pointsFile } = await this.#getFull();
      const core = this.#scene;
      return file(pointsFile(format, core.exact(), core.exact_normals(), core.exact_radii()));
    },
    exportSamples: ({ format, count }) => this.#withFull(core => file(core.export_samples(format, count ?? 0))),
    mesh: ({ spacing }, id) =>
      this.#withFull(core => {
        const mesh = core.mesh(spacing ?? 0, this.#teller(id));
        const [positions, normals, indices] = [mesh.positions(), mesh.normals(), mesh.indices()];
        const value = { positions, normals, indices, ...parse<{ closed: boolean; report: string }>(mesh.report()) };
        mesh.free();
        return { value, transfer: [positions.buffer, normals.buffer, indices.buffer] };
      }),
    exportMesh: ({ format, spacing }, id) =>
      this.#withFull(core => {
        const mesh = core.mesh(spacing ?? 0, this.#teller(id));
        try {
          return file(mesh.file(format));
        } finally {
          mesh.free();
        }
      }),
    provoke: ({ what }) => {
      while (what === 'hang');
      this.#module!.provoke(what);
      return { value: null };
    },
  };

  async #faces(): Promise<Uint32Array> {
    this.#live ??= new (await this.#getFull()).Live();
    const core = this.#scene;
    return this.#live.faces(core.bounds(), core.exact(), core.exact_normals(), core.ids(), core.spacing());
  }

  async #advance(input: Input<'advance'>, id: number): Promise<Answer<Output<'advance'>>> {
    const core = this.#scene;
    const never = () => false;
    if (input.hands?.length) {
      core.apply(JSON.stringify({ do: 'grab', hands: input.hands, radius: input.radius }), never);
    } else if (input.hands && core.is_held()) {
      core.apply('{"do":"release"}', never);
    }
    const start = performance.now();
    const end = start + (input.ms ?? Infinity);
    const steps = core.advance(input.steps ?? 1, () => performance.now() < end && !this.#isCancelled(id));
    const stepMs = performance.now() - start;
    const { births, deaths, off, ...rest } = parse<Output<'advance'> & Output<'advance'>['stats']>(core.frame());
    const columns: Partial<Record<ColumnName, Float32Array | Float64Array | Uint32Array>> = {
      positions: core.positions(),
      normals: core.normals(),
      radii: core.radii(),
      ids: core.ids(),
      values: core.values(),
    };
    for (const name of input.columns ?? []) columns[name] = name === 'faces' ? await this.#faces() : core[name]();
    const memory = this.#module!.memory.buffer.byteLength;
    const stats = { steps, stepMs, births, deaths, off, memory };
    return {
      value: { ...rest, ...columns, stats } as Output<'advance'>,
      transfer: Object.values(columns).map(column => column.buffer),
    };
  }
}

function parse<T>(json: string): T {
  return JSON.parse(json) as T;
}

function protocol(message: string): Failure {
  return { kind: 'protocol', message };
}

function file(bytes: Uint8Array): Answer<ArrayBuffer> {
  const buffer = bytes.buffer as ArrayBuffer;
  return { value: buffer, transfer: [buffer] };
}
