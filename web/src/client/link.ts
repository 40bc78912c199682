/** One worker and the requests that are under way in it. */
import { CoreError } from './failure.js';
import type { Failure, FromWorker, Input, Output, Progress, RequestName, ToWorker, Wasm } from './protocol.js';

/** How messages travel: a Worker of the browser or of Node. */
export interface Transport {
  post(message: ToWorker, transfer: Transferable[]): void;
  /** Called once; messages, and the reason if the worker ends by itself. */
  listen(message: (m: FromWorker) => void, ended: (reason: string) => void): void;
  terminate(): void;
}

export interface RequestOptions {
  signal?: AbortSignal;
  onProgress?: (progress: Progress) => void;
  transfer?: Transferable[];
}

interface Pending {
  name: RequestName;
  resolve: (value: never) => void;
  reject: (error: CoreError) => void;
  onProgress?: ((progress: Progress) => void) | undefined;
}

export class Link {
  /** Resolves once the module is loaded. */
  readonly ready: Promise<string>;
  /** When the worker was last heard of (ms). */
  heard = performance.now();
  #pending = new Map<number, Pending>();
  #next = 1;
  #ended: Failure | null = null;
  #cancel: Int32Array | null = null;
  #fail: (failure: Failure) => void = () => undefined;

  constructor(
    private readonly transport: Transport,
    wasm: Wasm,
    /** Gets the module that has meshes and files; null: `wasm` has them. */
    full: (() => Promise<Wasm>) | null,
    memoryLimit: number,
    private readonly broken: (failure: Failure) => void,
  ) {
    const shared =
      typeof SharedArrayBuffer === 'function' && (globalThis as { crossOriginIsolated?: boolean }).crossOriginIsolated !== false
        ? new SharedArrayBuffer(4)
        : null;
    this.#cancel = shared ? new Int32Array(shared) : null;
    this.ready = new Promise((resolve, reject) => {
      this.#fail = failure => reject(new CoreError(failure));
      transport.listen(
        message => {
          this.heard = performance.now();
          if (message.type === 'ready') resolve(message.version);
          else if (message.type === 'wants') void this.#send(full);
          else if (message.type === 'failure' && message.id === -1) this.#break(message.failure);
          else this.#receive(message);
        },
        reason => this.#break({ kind: 'stopped', message: reason }),
      );
    });
    this.ready.catch(() => undefined);
    transport.post({ type: 'start', wasm, full: full === null, memoryLimit, ...(shared ? { cancel: shared } : {}) }, []);
  }

  /** Requests that have not been answered. */
  get waiting(): number {
    return this.#pending.size;
  }

  /** Whether a command can be ended between steps, without ending the worker. */
  get canCancel(): boolean {
    return this.#cancel !== null;
  }

  request<N extends RequestName>(name: N, input: Input<N>, options: RequestOptions = {}): Promise<Output<N>> {
    if (this.#ended) return Promise.reject(new CoreError(this.#ended));
    const { signal } = options;
    if (signal?.aborted) return Promise.reject(new CoreError(cancelled()));
    const id = this.#next++;
    if (this.#pending.size === 0) this.heard = performance.now();
    const reply = new Promise<Output<N>>((resolve, reject) => {
      this.#pending.set(id, { name, resolve: resolve as (value: never) => void, reject, onProgress: options.onProgress });
    });
    const abort = () => {
      if (this.#cancel) Atomics.store(this.#cancel, 0, id);
    };
    signal?.addEventListener('abort', abort, { once: true });
    const done = () => signal?.removeEventListener('abort', abort);
    reply.then(done, done);
    this.transport.post({ type: 'request', id, name, input }, options.transfer ?? []);
    return reply;
  }

  /** Ends the worker; what is under way is rejected. */
  end(failure: Failure): void {
    this.#ended ??= failure;
    this.#fail(this.#ended);
    this.transport.terminate();
    const pending = [...this.#pending.values()];
    this.#pending.clear();
    for (const p of pending) p.reject(new CoreError(this.#ended));
  }

  async #send(full: (() => Promise<Wasm>) | null): Promise<void> {
    const wasm = await full?.().catch((error: unknown) => notLoaded(error));
    if (wasm && !this.#ended) this.transport.post({ type: 'full', wasm }, []);
  }

  #receive(message: Exclude<FromWorker, { type: 'ready' | 'wants' }>): void {
    const pending = this.#pending.get(message.id);
    if (!pending) return;
    if (message.type === 'progress') return pending.onProgress?.(message.progress);
    this.#pending.delete(message.id);
    if (message.type === 'reply') return pending.resolve(message.value as never);
    const { failure } = message;
    if (failure.kind === 'stopped' || failure.kind === 'memory') {
      pending.reject(new CoreError(failure));
      this.#break(failure);
    } else pending.reject(new CoreError(failure));
  }

  #break(failure: Failure): void {
    if (this.#ended) return;
    this.end(failure);
    this.broken(failure);
  }
}

/** What is said where the module that has meshes and files cannot be fetched: the scene goes on without. */
export function notLoaded(error: unknown): Failure {
  const reason = error instanceof Error ? error.message : String(error);
  return { kind: 'input', message: `Meshes and files could not be loaded: ${reason}` };
}

export function cancelled(): Failure {
  return { kind: 'cancelled', message: 'Cancelled.' };
}
