import { readFileSync } from 'node:fs';
import { expect, test } from 'vitest';
import { connect, type Settings } from '../../dist/client/node.js';

interface Case {
  name: string;
  text?: string;
  model?: string;
  settings?: Settings;
  script?: string;
  steps: number;
}

const root = new URL('../../../', import.meta.url);
const read = (path: string) => readFileSync(new URL(path, root), 'utf8');
const cases = JSON.parse(read('tests/parity/cases.json')) as Case[];
/** Made by `cargo run -p isoswarm --example parity > build/parity.json`. */
const native = JSON.parse(read('build/parity.json')) as Record<string, string>;

/** FNV-1a over 64-bit words, as in tests/parity/native.rs. */
function hash(...columns: BigUint64Array[]): string {
  let h = 0xcbf29ce484222325n;
  for (const column of columns) {
    for (const word of column) h = BigInt.asUintN(64, (h ^ word) * 0x100000001b3n);
  }
  return h.toString(16).padStart(16, '0');
}

const bits = (column: Float64Array) => new BigUint64Array(column.buffer);

test.each(cases)('the same bits as native: $name', async ({ name, text, model, settings, script, steps }) => {
  const client = await connect();
  try {
    await client.open({
      text: text ?? read(`models/${model}.iso.json`),
      ...(settings ? { settings } : {}),
      ...(script ? { script: read(`models/${script}.script.json`) } : {}),
    });
    await client.apply({ do: 'step', count: steps });
    const frame = await client.frame(['exact']);
    const ids = BigUint64Array.from(frame.ids, BigInt);
    expect(hash(bits(frame.exact!), ids, bits(frame.values))).toBe(native[name]);
  } finally {
    client.close();
  }
});
