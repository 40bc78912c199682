import { expect, test } from 'vitest';
import { Latest } from '../../src/client/latest.js';

test('one under way, one that waits: the others give way', async () => {
  const latest = new Latest();
  const order: number[] = [];
  let go!: () => void;
  const gate = new Promise<void>(resolve => (go = resolve));
  const task = (n: number) => async () => {
    await gate;
    order.push(n);
    return n;
  };
  const runs = [1, 2, 3, 4].map(n => latest.run('key', task(n)));
  const other = latest.run('other', task(9));
  go();
  expect(await Promise.all(runs)).toEqual([1, null, null, 4]);
  expect(await other).toBe(9);
  expect(order.filter(n => n !== 9)).toEqual([1, 4]);
  expect(await latest.run('key', async () => 5)).toBe(5);
});

test('a task that fails lets the next one run', async () => {
  const latest = new Latest();
  const first = latest.run('key', () => Promise.reject(new Error('no')));
  const second = latest.run('key', async () => 2);
  await expect(first).rejects.toThrow('no');
  expect(await second).toBe(2);
});
