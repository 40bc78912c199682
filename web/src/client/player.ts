/** The loop of a page: steps and frames, one request ahead, with the newest hands. */
import type { Client } from './client.js';
import { CoreError } from './failure.js';
import type { Column, Frame, Hand } from './protocol.js';

export interface PlayOptions {
  /** Gets each frame; its arrays are the caller's. */
  onFrame: (frame: Frame) => void;
  /** Errors of steps, which end the loop until `poke` or `resume`. */
  onError?: (error: CoreError) => void;
  columns?: Column[];
  /** Milliseconds that the core steps for a frame, default 12. */
  budget?: number;
  /** Most steps for a frame, default 4. */
  steps?: number;
  /** Steps after the last change until floaters are left alone, default 150; `Infinity`: never. */
  quiet?: number;
  /** Waits for the moment at which the next frame is wanted; a page gives its animation frame. */
  pace?: () => Promise<void>;
}

export class Player {
  columns: Column[];
  steps: number;
  budget: number;
  readonly #client: Client;
  readonly #options: PlayOptions;
  #hands: Hand[] | undefined;
  #radius: number | undefined;
  #paused = false;
  #once = 0;
  #stopped = false;
  #running = false;
  /** Steps since something changed. */
  #idle = 0;
  #released: (() => void)[] = [];
  #holding = false;

  constructor(client: Client, options: PlayOptions) {
    this.#client = client;
    this.#options = options;
    this.columns = options.columns ?? [];
    this.steps = options.steps ?? 4;
    this.budget = options.budget ?? 12;
    this.poke();
  }

  get paused(): boolean {
    return this.#paused;
  }

  /** Where held pins are now: as often as the mouse moves, for only the last counts. Pins that are not held are taken hold of. */
  drag(hands: Hand[], radius?: number): void {
    this.#hands = hands;
    this.#radius = radius;
    this.#holding = true;
    this.poke();
  }

  /** Lets go; resolves when that has been done. */
  release(): Promise<void> {
    if (!this.#holding) return Promise.resolve();
    this.#holding = false;
    this.#hands = [];
    return new Promise(resolve => {
      this.#released.push(resolve);
      this.poke();
    });
  }

  pause(): void {
    this.#paused = true;
  }

  resume(): void {
    this.#paused = false;
    this.poke();
  }

  /** Takes so many steps although it is paused. */
  step(count = 1): void {
    this.#once += count;
    this.poke();
  }

  /** Something has changed: a frame is wanted, and the floaters may have to settle. */
  poke(): void {
    this.#idle = 0;
    if (!this.#running && !this.#stopped && this.#client.isOpen) void this.#run();
  }

  /** Ends the loop. */
  stop(): void {
    this.#stopped = true;
  }

  async #run(): Promise<void> {
    this.#running = true;
    const quiet = this.#options.quiet ?? 150;
    try {
      let first = true;
      while (!this.#stopped) {
        const hands = this.#hands;
        const released = hands?.length === 0 ? this.#released.splice(0) : [];
        const held = this.#holding;
        const steps = this.#paused && !held ? Math.min(this.#once, this.steps) : this.steps;
        if (!first && steps === 0 && hands === undefined && this.#idle > 0) break;
        if (!first && !held && hands === undefined && this.#once === 0 && this.#idle > quiet) break;
        first = false;
        this.#hands = undefined;
        if (this.#paused) this.#once -= steps;
        const idle = this.#idle;
        const frame = await this.#client.advance({
          steps,
          ms: this.budget,
          columns: this.columns,
          ...(hands ? { hands } : {}),
          ...(this.#radius !== undefined ? { radius: this.#radius } : {}),
        });
        if (this.#stopped) break;
        const moved = frame.moving || held || frame.stats.births + frame.stats.deaths > 0;
        // Poked meanwhile: that counts, too.
        this.#idle = moved || this.#idle < idle ? 0 : this.#idle + Math.max(frame.stats.steps, 1);
        this.#options.onFrame(frame);
        for (const resolve of released) resolve();
        await this.#options.pace?.();
      }
    } catch (error) {
      this.#holding = false;
      this.#hands = undefined;
      for (const resolve of this.#released.splice(0)) resolve();
      if (error instanceof CoreError) this.#options.onError?.(error);
      else throw error;
    } finally {
      this.#running = false;
    }
  }
}
