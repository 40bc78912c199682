/** Taking hold of the surface. */
import { centre, choose, expect, look, middle, openFormula, pinAt, pull, rest, saved, test, value } from './studio.ts';

test('a click sets a pin, a drag moves the surface, undo brings it back', async ({ studio }) => {
  await openFormula(studio, 'sphere(1)');
  const before = await value(studio, 'sphere/r');
  const ball = await look(studio);
  const at = await middle(studio);
  const pin = await pinAt(studio, ball.box.right - 25, at.y);
  await pull(studio, await centre(pin), 90, 0);
  const after = await value(studio, 'sphere/r');
  expect(after).toBeGreaterThan(before + 0.15);
  expect((await look(studio)).box.right).toBeGreaterThan(ball.box.right + 30);
  // The pin is under the hand, and on the surface.
  expect(Math.abs((await centre(pin)).x - (ball.box.right - 25 + 90))).toBeLessThan(20);
  const { pins } = await saved(studio);
  expect(Math.hypot(...pins[0]!.at)).toBeCloseTo(after, 2);

  await studio.keyboard.press('Control+z');
  await expect.poll(() => value(studio, 'sphere/r')).toBe(before);
  await studio.keyboard.press('Control+z');
  await expect(studio.locator('button.pin')).toHaveCount(0);
  await studio.keyboard.press('Control+Shift+z');
  await expect(studio.locator('button.pin')).toHaveCount(1);
});

test('a pin goes with the part that it is on, and the page offers it back', async ({ studio }) => {
  await openFormula(studio, 'sphere(1) | translate(sphere(0.5), x=2)');
  await choose(studio, 'Translate');
  const at = await middle(studio);
  const { box } = await look(studio);
  await pinAt(studio, box.right - 40, at.y);
  await studio.getByRole('button', { name: 'Hide Translate' }).click();
  await expect(studio.locator('button.pin')).toHaveCount(0);
  const said = studio.locator('.toast', { hasText: 'A pin is taken away' });
  await said.getByRole('button', { name: 'Undo' }).click();
  await expect(studio.locator('button.pin')).toHaveCount(1);
  await expect(studio.getByRole('treeitem', { name: 'Translate', exact: true })).toBeVisible();
});

test('a click beside the surface sets nothing, and so does the look tool', async ({ studio }) => {
  const area = await look(studio);
  await studio.mouse.click(area.box.right + 60, area.box.top - 20);
  await studio.keyboard.press('l');
  const at = await middle(studio);
  await studio.mouse.click(at.x, at.y);
  await rest(studio);
  await expect(studio.locator('button.pin')).toHaveCount(0);
});

test('an axis handle keeps to its axis', async ({ studio }) => {
  await openFormula(studio, 'translate(sphere(1))');
  const at = await middle(studio);
  await pinAt(studio, at.x + 20, at.y + 10);
  const before = (await saved(studio)).pins[0]!.at;
  const handle = await centre(studio.locator('.overlay-handles .axis-z polygon').first());
  await pull(studio, handle, 0, -70);
  const after = (await saved(studio)).pins[0]!.at;
  expect(after[2]! - before[2]!).toBeGreaterThan(0.1);
  expect(Math.abs(after[0]! - before[0]!)).toBeLessThan(0.02);
  expect(Math.abs(after[1]! - before[1]!)).toBeLessThan(0.02);
});

test('several chosen pins move together', async ({ studio }) => {
  await openFormula(studio, 'translate(ellipsoid(1, 1, 1))');
  const at = await middle(studio);
  const first = await pinAt(studio, at.x - 50, at.y);
  const second = await pinAt(studio, at.x + 50, at.y);
  const from = [await centre(first), await centre(second)];
  await studio.keyboard.down('Shift');
  await studio.mouse.click(from[0]!.x, from[0]!.y);
  await studio.keyboard.up('Shift');
  await expect(studio.locator('button.pin.chosen')).toHaveCount(2);
  await pull(studio, from[1]!, 0, -60);
  const to = [await centre(first), await centre(second)];
  for (const i of [0, 1]) {
    expect(to[i]!.y - from[i]!.y).toBeLessThan(-40);
    expect(Math.abs(to[i]!.x - from[i]!.x)).toBeLessThan(15);
  }
});

test('a locked pin stays, and says so', async ({ studio }) => {
  const at = await middle(studio);
  const pin = await pinAt(studio, at.x, at.y);
  await studio.getByRole('button', { name: /^Lock Pin/ }).click();
  const before = await centre(pin);
  await studio.mouse.move(before.x, before.y);
  await studio.mouse.down();
  await studio.mouse.move(before.x + 60, before.y + 40, { steps: 4 });
  await expect(studio.getByText('This pin is locked')).toBeVisible();
  await studio.mouse.up();
  await rest(studio);
  expect(Math.abs((await centre(pin)).x - before.x)).toBeLessThan(3);
});

test('a pin can be moved and removed with the keyboard alone', async ({ studio }) => {
  await openFormula(studio, 'translate(sphere(1))');
  const at = await middle(studio);
  const pin = await pinAt(studio, at.x, at.y);
  await pin.focus();
  const before = await centre(pin);
  await studio.keyboard.down('ArrowRight');
  await studio.waitForTimeout(400);
  await studio.keyboard.up('ArrowRight');
  await rest(studio);
  expect((await centre(pin)).x).toBeGreaterThan(before.x + 6);
  await studio.keyboard.press('Delete');
  await expect(studio.locator('button.pin')).toHaveCount(0);
});

test('a pin that cannot follow shows how far it is behind, and why', async ({ studio }) => {
  await openFormula(studio, 'sphere(1)');
  await studio.getByRole('button', { name: /^Lock r/ }).click();
  const at = await middle(studio);
  const pin = await pinAt(studio, at.x, at.y);
  const from = await centre(pin);
  await studio.mouse.move(from.x, from.y);
  await studio.mouse.down();
  await studio.mouse.move(from.x + 40, from.y - 220, { steps: 10 });
  await expect(studio.locator('.reach')).toBeVisible();
  await expect(studio.getByText(/behind the hand/)).toBeVisible();
  await studio.mouse.up();
});
