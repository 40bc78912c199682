/** Of what follows a hand, only the last: never more than one of a key under way, and one that waits. */
export class Latest {
  #under = new Map<string, Promise<unknown>>();
  #next = new Map<string, { task: () => Promise<unknown>; settle: (value: Promise<unknown> | null) => void }>();

  /** Runs the task now, or after the one under way; null where a later one took its place. */
  run<T>(key: string, task: () => Promise<T>): Promise<T | null> {
    if (!this.#under.has(key)) return this.#start(key, task);
    this.#next.get(key)?.settle(null);
    return new Promise<T | null>(resolve => {
      this.#next.set(key, { task, settle: value => resolve(value as Promise<T> | null) });
    });
  }

  #start<T>(key: string, task: () => Promise<T>): Promise<T> {
    const run = task();
    this.#under.set(key, run);
    const after = () => {
      this.#under.delete(key);
      const next = this.#next.get(key);
      this.#next.delete(key);
      if (next) next.settle(this.#start(key, next.task));
    };
    run.then(after, after);
    return run;
  }
}
