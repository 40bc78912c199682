/** Processor time of whole steps in V8, for machines that are busy: `node bench/processor.mjs`. The main thread runs the module; no worker. */
import { readFileSync } from 'node:fs';
import init, { Core } from '../wasm/pkg/core.js';

globalThis.isoswarmPanicked = message => console.error(message);
const memory = new WebAssembly.Memory({ initial: 96, maximum: 16384 });
await init({ module_or_path: readFileSync(new URL('../wasm/pkg/core_bg.wasm', import.meta.url)), memory });

/** Sixteen blobs along a trefoil knot. */
function blobs() {
  const numbers = [];
  for (let i = 0; i < 16; i++) {
    const t = (i / 16) * 2 * Math.PI;
    const p = [Math.sin(t) + 2 * Math.sin(2 * t), Math.cos(t) - 2 * Math.cos(2 * t), -Math.sin(3 * t)];
    numbers.push(...p.map(v => (0.45 * v).toFixed(3)), '0.5');
  }
  return `blobs(0.5, ${numbers.join(', ')})`;
}

const spent = () => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000;
};

for (const count of [5_000, 20_000, 50_000]) {
  const before = spent();
  const core = Core.open(JSON.stringify({ text: blobs(), settings: { amount: { count } } }), new Float64Array());
  const opened = spent();
  core.advance(30, () => true);
  const runs = [];
  for (let k = 0; k < 5; k++) {
    const start = spent();
    core.advance(10, () => true);
    runs.push((spent() - start) / 10);
  }
  const step = Math.min(...runs);
  const start = spent();
  const { births, deaths, count: floaters } = JSON.parse(core.frame());
  core.positions(), core.normals(), core.radii(), core.ids();
  const frame = spent() - start;
  console.log(
    `${floaters} floaters: open ${(opened - before).toFixed(0)} ms, step ${step.toFixed(2)} ms (${(1000 / step).toFixed(0)} a second), ` +
      `frame ${frame.toFixed(1)} ms, ${births} births, ${deaths} deaths`,
  );
  if (count === 5_000) {
    const hit = JSON.parse(core.pick(0, 0, 10, 0.05, 0.12, -1)) ?? { at: [...core.positions().slice(0, 3)] };
    const { pin } = JSON.parse(core.apply(JSON.stringify({ do: 'pin', at: hit.at }), () => false));
    const times = [];
    for (let k = 1; k <= 40; k++) {
      const begin = spent();
      const to = [hit.at[0], hit.at[1], hit.at[2] + 0.004 * k];
      core.apply(JSON.stringify({ do: 'grab', hands: [{ pin, to }] }), () => false);
      core.advance(1, () => true);
      JSON.parse(core.frame());
      core.positions(), core.normals(), core.radii(), core.ids();
      times.push(spent() - begin);
    }
    console.log(`a hand's move to a frame: ${times.sort((a, b) => a - b)[20].toFixed(1)} ms (median)`);
  }
  core.free();
}
