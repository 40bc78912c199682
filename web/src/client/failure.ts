/** What goes wrong, as a value and as an error. */
import type { Failure } from './protocol.js';

/** What requests reject with. */
export class CoreError extends Error {
  readonly kind: Failure['kind'];
  readonly position: number | undefined;

  constructor(failure: Failure) {
    super(failure.message);
    this.name = 'CoreError';
    this.kind = failure.kind;
    this.position = failure.position;
  }
}

/** The core's memory, its limit (bytes), and what it said before it stopped. */
export interface Witness {
  readonly memory: WebAssembly.Memory;
  readonly limit: number;
  readonly lastWords: () => string | null;
}

/** What was thrown while a request was carried out. */
export function failureOf(thrown: unknown, witness: Witness | null): Failure {
  if (typeof thrown === 'string') {
    try {
      return JSON.parse(thrown) as Failure;
    } catch {
      return { kind: 'input', message: thrown };
    }
  }
  if (isFailure(thrown)) return thrown;
  const words = witness?.lastWords() ?? null;
  // A panic says something first; what ends without a word is an allocation that failed.
  const wordless = words === null && thrown instanceof WebAssembly.RuntimeError && thrown.message.includes('unreachable');
  if (wordless || words?.includes('memory allocation') || words?.includes('capacity overflow')) {
    const limit = witness ? Math.round(witness.limit / 2 ** 20) : 0;
    return {
      kind: 'memory',
      message: `This takes more than the ${limit} MB that the core may use. Use fewer floaters or a larger spacing.`,
    };
  }
  return { kind: 'stopped', message: `The core stopped: ${words ?? String(thrown)}` };
}

export function isFailure(value: unknown): value is Failure {
  return typeof value === 'object' && value !== null && 'kind' in value && 'message' in value;
}
