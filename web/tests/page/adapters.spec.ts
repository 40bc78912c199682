/** Deformations as handles, accepted, kept or cancelled. */
import { centre, choose, expect, fromGallery, look, openFormula, pull, rest, saved, test, value } from './studio.ts';

test('a mover is pulled along an axis; the quadric takes it on', async ({ studio }) => {
  await openFormula(studio, 'quadric()');
  const before = await look(studio);
  const start = { q6: await value(studio, 'quadric/q6'), q2: await value(studio, 'quadric/q2') };
  await studio.getByRole('toolbar', { name: 'Tools' }).getByRole('button', { name: /^Move/ }).click();
  const bar = studio.getByRole('region', { name: 'Move the part' });
  await expect(bar).toBeVisible();
  const tip = studio.locator('[data-handle="z"] polygon');
  const from = await centre(tip);
  await pull(studio, from, 0, -80);
  const moved = Number(await bar.getByLabel('Move z').inputValue());
  // The handle is where the hand has let go of it,
  const to = await centre(tip);
  expect(Math.hypot(to.x - from.x, to.y - (from.y - 80))).toBeLessThan(4);
  await expect(bar).toContainText('follows exactly');
  await expect(bar).toContainText(/rank \d+ of 10/);
  await bar.getByRole('button', { name: 'Accept' }).click();
  await expect(bar).toBeHidden();
  await rest(studio);
  // and the ball has gone along with it, as far as is seen of z from the first camera. (Its upper edge leaves what is looked at.)
  const after = await look(studio);
  const [small, large] = [before, after].map(({ box }) => (box.right - box.left) / 2) as [number, number];
  const seen = moved * ((small + large) / 2) * (Math.hypot(6, 9) / Math.hypot(6, 9, 5));
  expect(Math.abs(before.box.bottom - small - (after.box.bottom - large) - seen)).toBeLessThan(6);
  expect(Math.abs(before.box.left + small - (after.box.left + large))).toBeLessThan(4);
  // Moved along z: what belongs to y stays.
  expect(Math.abs((await value(studio, 'quadric/q6')) - start.q6)).toBeLessThan(1e-5);
  expect(Math.abs((await value(studio, 'quadric/q2')) - start.q2)).toBeLessThan(1e-5);
  expect(Math.abs(await value(studio, 'quadric/q3'))).toBeGreaterThan(0.1);
});

test('an adapter that is cancelled leaves everything as it was', async ({ studio }) => {
  await openFormula(studio, 'quadric()');
  const before = (await saved(studio)).model;
  await studio.keyboard.press('s');
  const bar = studio.getByRole('region', { name: 'Scale the part' });
  await bar.getByLabel('Scale sx').fill('1.8');
  await bar.getByLabel('Scale sx').press('Enter');
  await rest(studio);
  await bar.getByRole('button', { name: 'Cancel' }).click();
  await expect(bar).toBeHidden();
  expect((await saved(studio)).model).toEqual(before);
});

test('what a part cannot express shows its residual and can be kept as an operator', async ({ studio }) => {
  await openFormula(studio, 'box(1, 1, 2)');
  await studio.keyboard.press('t');
  const bar = studio.getByRole('region', { name: 'Twist the part' });
  await bar.getByLabel('Twist rate').fill('60');
  await bar.getByLabel('Twist rate').press('Enter');
  await expect(bar).toContainText(/off by/);
  await bar.getByRole('button', { name: 'Keep as operator' }).click();
  await expect(studio.getByRole('treeitem', { name: /Adapter|Twist/ })).toBeVisible();
});

test('a chosen part is turned by a ring', async ({ studio }) => {
  await openFormula(studio, 'sphere(1) | quadric(q0=-1, q1=-6, q4=2, q6=4, q9=9)');
  await choose(studio, 'Quadric');
  await studio.keyboard.press('r');
  const bar = studio.getByRole('region', { name: 'Turn the part' });
  await expect(bar).toBeVisible();
  await expect(studio.locator('.adapter .axis')).toHaveCount(3);
  const field = bar.getByRole('textbox').nth(2);
  await field.fill('40');
  await field.press('Enter');
  await expect(bar).toContainText('follows exactly');
  await studio.keyboard.press('Escape');
});

test('the ellipsoid of the paper moves without its shape', async ({ studio }) => {
  await fromGallery(studio, 'Ellipsoid to move');
  const nodes = (await saved(studio)).model.nodes;
  expect(nodes.some(n => n.kind === 'quadric')).toBe(true);
});
