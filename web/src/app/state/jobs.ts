/** What takes long has a bar, with a way to cancel it. */
import type { RequestOptions } from '../../client/index.ts';
import { type Job, job } from './ui.ts';

/** Runs a job; its bar comes after so many milliseconds. */
export async function withBar<T>(title: string, run: (options: RequestOptions) => Promise<T>, after = 0): Promise<T> {
  const abort = new AbortController();
  const bar: Job = { title, done: null, cancel: () => abort.abort() };
  let mine = bar;
  let shown = false;
  const show = () => {
    shown = true;
    job.value = mine;
  };
  const timer = setTimeout(show, after);
  try {
    return await run({
      signal: abort.signal,
      onProgress: p => {
        if (p.of > 0) mine = { ...bar, done: Math.min(1, p.done / p.of) };
        if (shown) job.value = mine;
      },
    });
  } finally {
    clearTimeout(timer);
    if (job.value?.cancel === bar.cancel) job.value = null;
  }
}
