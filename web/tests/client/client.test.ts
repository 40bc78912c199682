import { readFile } from 'node:fs/promises';
import { afterEach, expect, test } from 'vitest';
import { connect, CoreError, type Client, type Frame } from '../../dist/client/node.js';

const clients: Client[] = [];
async function start(options: Parameters<typeof connect>[0] = {}): Promise<Client> {
  const client = await connect({ saveAfter: 20, ...options });
  clients.push(client);
  return client;
}
afterEach(() => {
  for (const client of clients.splice(0)) client.close();
});

async function failure(promise: Promise<unknown>): Promise<CoreError> {
  const error = await promise.then(
    () => null,
    (e: unknown) => e,
  );
  expect(error).toBeInstanceOf(CoreError);
  return error as CoreError;
}

const length = (v: ArrayLike<number>, i = 0) => Math.hypot(v[i]!, v[i + 1]!, v[i + 2]!);

test('a sphere: floaters lie on it, normals point out, columns have one row each', async () => {
  const client = await start();
  const state = await client.open({ text: 'sphere(r=2)', settings: { amount: { count: 300 } } });
  expect(state.parameters.map(p => [p.path, p.value, p.unit])).toEqual([['sphere/r', 2, 'length']]);
  expect(state.nodes.map(n => [n.path, n.kind, n.parent, n.parameters])).toEqual([['sphere', 'sphere', -1, [0]]]);
  const frame = await client.advance({ steps: 3, columns: ['curvature', 'error', 'exact'] });
  expect(frame.stats.steps).toBe(3);
  expect(frame.clock).toBe(3);
  expect(frame.count).toBeGreaterThan(250);
  expect(frame.ids.length).toBe(frame.count);
  expect(new Set(frame.ids).size).toBe(frame.count);
  for (let i = 0; i < frame.count; i++) {
    expect(length(frame.positions, 3 * i)).toBeCloseTo(2, 3);
    expect(length(frame.normals, 3 * i)).toBeCloseTo(1, 6);
    const out = [0, 1, 2].reduce((sum, a) => sum + frame.positions[3 * i + a]! * frame.normals[3 * i + a]!, 0);
    expect(out).toBeCloseTo(2, 3);
    expect(frame.curvature![i]).toBeCloseTo(0.5, 3);
    expect(frame.exact![3 * i]).toBeCloseTo(frame.positions[3 * i]!, 6);
  }
  expect([...frame.values]).toEqual([2]);
});

test('what makes no sense is said, with its place, and the scene stays', async () => {
  const client = await start();
  const text = 'sphere(r=1) + spehre(r=2)';
  const error = await failure(client.open({ text }));
  expect(error.kind).toBe('input');
  expect(error.message).toContain('did you mean `sphere`');
  expect(error.position).toBe(14);
  await client.open({ text: 'sphere(r=1)' });
  expect((await failure(client.open({ text: 'x^2 + 1' }))).message).toMatch(/surface/);
  expect((await failure(client.apply({ do: 'set', path: 'sphere/r', value: -1 }))).kind).toBe('input');
  expect((await failure(client.apply({ do: 'undo' }))).message).toContain('nothing to undo');
  expect((await client.state()).parameters[0]!.value).toBe(1);
  expect((await failure(client.check('sphere(')))).toMatchObject({ kind: 'input' });
  expect(await client.check('sphere(1) | box(1, 2, 3)')).toMatchObject({ parameters: 4 });
});

test('picking, pinning, dragging: the surface follows the hand', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 200 } } });
  const hit = (await client.pick({ origin: [0.1, 0.2, 5], direction: [0, 0, -2] }))!;
  expect(hit.at[2]).toBeCloseTo(Math.sqrt(1 - 0.05), 9);
  expect(hit.t).toBeCloseTo((5 - hit.at[2]) / 2, 9);
  expect(await client.pick({ origin: [3, 0, 5], direction: [0, 0, -1] })).toBeNull();
  const { change } = await client.apply({ do: 'pin', at: [0, 0, 1], name: 'top' });
  const frames: Frame[] = [];
  const player = client.play({ onFrame: frame => frames.push(frame) });
  for (let k = 1; k <= 20; k++) {
    player.drag([{ pin: change.pin!, to: [0, 0, 1 + k / 20] }]);
    await new Promise(resolve => setTimeout(resolve, 5));
  }
  // The newest hand, not one before it.
  const radius = async () => (await client.state()).parameters[0]!.value;
  await expect.poll(radius, { timeout: 20_000 }).toBeCloseTo(2, 6);
  await expect.poll(() => frames.at(-1)?.drag?.distance ?? 1).toBeLessThan(1e-6);
  expect(frames.at(-1)!.drag).toMatchObject({ ending: 'held', rank: 1, pins: 1 });
  await player.release();
  player.stop();
  const state = await client.state();
  expect(state.held).toBe(false);
  expect(state.parameters[0]!.value).toBeCloseTo(2, 6);
  // One drag is one step back.
  expect((await client.undo()).parameters[0]!.value).toBe(1);
  expect((await client.redo()).parameters[0]!.value).toBeCloseTo(2, 6);
});

test('the tree is edited: added, renamed, copied, moved as one, undone', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 200 } } });
  await client.apply({ do: 'add', model: 'translate(sphere(r=0.5), x=1)', name: 'head' });
  let { state } = await client.apply({ do: 'duplicate', path: 'head', name: 'ear' });
  expect(state.nodes.map(n => n.path)).toContain('ear');
  ({ state } = await client.apply({ do: 'rename', path: 'ear', name: 'tail' }));
  expect(state.nodes.map(n => n.path)).toContain('tail');
  const part = await client.part('tail');
  const before = state.undo;
  ({ state } = await client.apply({
    do: 'together',
    commands: [
      { do: 'remove', path: 'tail' },
      { do: 'add', path: '', model: part, name: 'fin' },
    ],
  }));
  expect(state.undo).toBe(before + 1);
  expect(state.nodes.map(n => n.path)).toContain('fin');
  expect((await client.undo()).nodes.map(n => n.path)).toContain('tail');
  const kinds = await client.request('kinds', {});
  expect(kinds.find(k => k.name === 'torus')!.params.map(p => p.name)).toContain('major');
  expect((await client.request('adapters', {})).map(a => a.name)).toContain('twist');
});

test('an adapter that is on is saved, and is on again after the core has been started anew', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 100 } } });
  await client.apply({ do: 'adapt', path: 'sphere', adapter: 'mover' });
  await client.apply({ do: 'set', path: 'adapter/x', value: 0.25, continued: false });
  await client.save();
  expect((JSON.parse(client.saved!.scene) as { version: number }).version).toBe(2);
  const state = await client.restart();
  expect(state!.adapter!.path).toBe('adapter');
  expect(state!.parameters.find(p => p.path === 'adapter/x')!.value).toBe(0.25);
});

test('a slider is one step back, and only its last value counts', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 100 } } });
  const runs = await Promise.all(
    Array.from({ length: 30 }, (_, k) =>
      client.applyLatest('r', { do: 'set', path: 'sphere/r', value: 1 + (k + 1) / 30, continued: true }),
    ),
  );
  expect(runs.filter(run => run !== null).length).toBeLessThan(4);
  const state = await client.state();
  expect(state.parameters[0]!.value).toBe(2);
  expect(state.undo).toBe(1);
  expect((await client.undo()).parameters[0]!.value).toBe(1);
});

test('saved and opened again: the same model to the last bit', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r) | translate(sphere(0.5), x=1)', parameters: { r: 0.9 } });
  await client.apply({ do: 'set', path: 'r', value: 0.1 + 0.2 });
  const { scene, log } = await client.save();
  expect(JSON.parse(log).commands).toHaveLength(1);
  const other = await start();
  const state = await other.open({ text: scene });
  expect(state.parameters.find(p => p.path === 'r')!.value).toBe(0.1 + 0.2);
});

test('a core that panics is started again with the scene, and the scene goes on', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 100 } } });
  await client.apply({ do: 'set', path: 'sphere/r', value: 1.5 });
  const restarted = new Promise<void>(resolve => client.on('restarted', () => resolve()));
  const error = await failure(client.request('provoke', { what: 'panic' }));
  expect(error).toMatchObject({ kind: 'stopped' });
  expect(error.message).toContain('asked to stop');
  await restarted;
  expect((await client.state()).parameters[0]!.value).toBe(1.5);
  expect((await client.advance({ steps: 2 })).count).toBeGreaterThan(80);
});

test('memory has a limit, and what goes past it loses nothing', async () => {
  const client = await start({ memoryLimit: 64 * 2 ** 20 });
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 100 } } });
  const error = await failure(client.request('provoke', { what: 'memory' }));
  expect(error).toMatchObject({ kind: 'memory' });
  expect(error.message).toContain('64 MB');
  expect((await client.state()).parameters[0]!.value).toBe(1);
  const large = await failure(client.apply({ do: 'settings', settings: { amount: { count: 2_000_000 } } }));
  expect(large.kind).toBe('memory');
  expect((await client.state()).settings.amount).toEqual({ count: 100 });
});

test('a worker that hangs is noticed, and ended', async () => {
  const client = await start({ patience: 200 });
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 100 } } });
  const silent = new Promise<number>(resolve => client.on('silent', resolve));
  const hanging = failure(client.request('provoke', { what: 'hang' }));
  expect(await silent).toBeGreaterThan(200);
  const state = await client.restart();
  expect((await hanging).kind).toBe('stopped');
  expect(state!.parameters[0]!.value).toBe(1);
});

test('a command is cancelled, and the scene can go on', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 2000 } } });
  const controller = new AbortController();
  const done: number[] = [];
  const long = client.apply(
    { do: 'step', count: 1_000_000 },
    { signal: controller.signal, onProgress: p => done.push(p.done) && done.length === 2 && controller.abort() },
  );
  await long.catch(() => undefined);
  expect(done.length).toBeLessThan(20);
  expect((await client.advance()).count).toBeGreaterThan(1500);
});

test('files: PLY of the floaters, CSV of even samples from a worker of its own', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 100 } } });
  const ply = new TextDecoder('latin1').decode(await client.exportPoints('ply'));
  expect(ply).toMatch(/^ply\nformat binary_little_endian 1.0\n/);
  const csv = new TextDecoder().decode(await client.exportSamples('csv', 64));
  expect(csv.trim().split('\n')).toHaveLength(65);
  const controller = new AbortController();
  const cancelled = failure(client.exportSamples('csv', 1_000_000, { signal: controller.signal }));
  controller.abort();
  expect((await cancelled).kind).toBe('cancelled');
  expect((await client.advance()).count).toBeGreaterThan(80);
});

test('triangles: closed, counter-clockwise, with the volume of a sphere; files of them', async () => {
  const client = await start();
  await client.open({ text: 'sphere(r=1)', settings: { amount: { spacing: 0.15 } } });
  const mesh = await client.mesh();
  expect(mesh.closed).toBe(true);
  expect(volume(mesh.positions, mesh.indices)).toBeCloseTo((4 / 3) * Math.PI, 1);
  const stl = await client.exportMesh('stl');
  const triangles = new DataView(stl).getUint32(80, true);
  expect(stl.byteLength).toBe(84 + 50 * triangles);
  expect(new TextDecoder('latin1').decode(await client.exportMesh('glb')).slice(0, 4)).toBe('glTF');
  expect(new TextDecoder('latin1').decode(await client.exportMesh('3mf')).slice(0, 2)).toBe('PK');
  // The mesh that follows the floaters.
  await client.advance({ steps: 100 });
  const { faces, positions, count } = await client.advance({ steps: 1, columns: ['faces'] });
  expect(faces!.length / 3).toBe(2 * count - 4);
  expect(volume(positions, faces!)).toBeCloseTo((4 / 3) * Math.PI, 1);
});

function volume(p: Float32Array, faces: Uint32Array): number {
  let sum = 0;
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map(k => [...p.subarray(3 * faces[f + k]!, 3 * faces[f + k]! + 3)] as [number, number, number]);
    const [x, y, z] = [0, 1, 2].map(i => b![(i + 1) % 3]! * c![(i + 2) % 3]! - b![(i + 2) % 3]! * c![(i + 1) % 3]!);
    sum += (a![0] * x! + a![1] * y! + a![2] * z!) / 6;
  }
  return sum;
}

test('shaping needs the first module alone; meshes and files fetch the second, once', async () => {
  const compile = async (name: string) =>
    WebAssembly.compile(await readFile(new URL(`../../dist/client/${name}.wasm`, import.meta.url)));
  let asked = 0;
  const full = () => {
    asked++;
    return compile('full');
  };
  const client = await start({ wasm: { core: await compile('core'), full } });
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 200 } } });
  const hit = await client.pick({ origin: [0, 0, 5], direction: [0, 0, -1] });
  const { change } = await client.apply({ do: 'pin', at: hit!.at });
  await client.advance({ steps: 2, hands: [{ pin: change.pin!, to: [0, 0, 1.1] }] });
  await client.apply({ do: 'release' });
  await client.apply({ do: 'add', model: 'sphere(0.3)' });
  await client.undo();
  await client.save();
  expect(asked).toBe(0);
  const { positions, indices } = await client.mesh();
  expect(indices.length / 3).toBe((2 * positions.length) / 3 - 4);
  await client.exportPoints('csv');
  await client.advance({ columns: ['faces'] });
  expect((await client.exportMesh('stl')).byteLength).toBeGreaterThan(1000);
  expect(asked).toBe(1);
});

test('a second module that cannot be fetched is said, and fetched again when it is needed again', async () => {
  const compile = async (name: string) =>
    WebAssembly.compile(await readFile(new URL(`../../dist/client/${name}.wasm`, import.meta.url)));
  let asked = 0;
  const full = async () => {
    if (asked++ === 0) throw new Error('the network is gone');
    return compile('full');
  };
  const client = await start({ wasm: { core: await compile('core'), full } });
  await client.open({ text: 'sphere(r=1)', settings: { amount: { count: 200 } } });
  await expect(client.mesh()).rejects.toThrow('the network is gone');
  expect((await client.mesh()).indices.length).toBeGreaterThan(100);
});
