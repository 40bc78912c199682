/** The last minute of a few figures, for the charts of the strip. */
import { signal } from '@preact/signals';
import type { Frame } from '../../client/protocol.ts';

export interface Sample {
  floaters: number;
  off: number;
  births: number;
  deaths: number;
  steps: number;
}

const LENGTH = 90;
/** Milliseconds that a sample stands for. */
const EACH = 300;

export const samples = signal<readonly Sample[]>([]);

let since = 0;
let sum = { births: 0, deaths: 0, steps: 0, ms: 0, off: 0 };

/** Adds a frame. */
export function follow(frame: Frame): void {
  const { births, deaths, steps, stepMs, off } = frame.stats;
  sum = { births: sum.births + births, deaths: sum.deaths + deaths, steps: sum.steps + steps, ms: sum.ms + stepMs, off: Math.max(sum.off, off) };
  const now = performance.now();
  if (now - since < EACH) return;
  since = now;
  const sample = {
    floaters: frame.count,
    off: sum.off,
    births: sum.births,
    deaths: sum.deaths,
    steps: sum.ms > 0 ? (1000 * sum.steps) / sum.ms : 0,
  };
  samples.value = [...samples.value.slice(1 - LENGTH), sample];
  sum = { births: 0, deaths: 0, steps: 0, ms: 0, off: 0 };
}

/** Another scene. */
export function forget(): void {
  samples.value = [];
  since = 0;
}
