/** The model as a tree, and its parameters. */
import { choose, expect, floaters, type Look, look, openFormula, rest, saved, test, value } from './studio.ts';

const rows = (page: import('@playwright/test').Page) => page.getByRole('treeitem');

test('a shape is found by searching, added, renamed, duplicated and deleted', async ({ studio }) => {
  await openFormula(studio, 'sphere(1)');
  await studio.keyboard.press('a');
  await studio.getByRole('dialog').getByLabel('Search').fill('tor');
  await studio.keyboard.press('Enter');
  await expect(studio.getByRole('treeitem', { name: 'Torus' })).toBeVisible();
  await expect(studio.getByRole('treeitem', { name: 'Union' })).toBeVisible();

  await choose(studio, 'Torus');
  await studio.keyboard.press('F2');
  await studio.getByLabel('Name', { exact: true }).fill('ring');
  await studio.keyboard.press('Enter');
  await expect(studio.getByRole('treeitem', { name: 'Ring' })).toBeVisible();
  expect((await saved(studio)).model.nodes.some(n => n.kind === 'torus' && n.name === 'ring')).toBe(true);

  await choose(studio, 'Ring');
  await studio.getByRole('treeitem', { name: 'Ring' }).press('d');
  await expect(rows(studio)).toHaveCount(4);
  await studio.getByRole('treeitem', { name: /Ring/ }).last().click();
  await studio.getByRole('treeitem', { name: /Ring/ }).last().press('Delete');
  await expect(rows(studio)).toHaveCount(3);
  await studio.getByRole('button', { name: 'Undo', exact: true }).first().click();
  await expect(rows(studio)).toHaveCount(4);
});

test('a part is put into an operator, and the operator is taken off', async ({ studio }) => {
  await openFormula(studio, 'box(1, 1, 2)');
  const before = await look(studio);
  await studio.keyboard.press('w');
  await studio.getByRole('dialog').getByLabel('Search').fill('twist');
  await studio.keyboard.press('Enter');
  await expect(studio.getByRole('treeitem', { name: 'Twist' })).toBeVisible();
  await rest(studio);
  expect(Math.abs((await look(studio)).covered - before.covered)).toBeGreaterThan(1e-4);
  await studio.getByRole('treeitem', { name: 'Twist' }).hover();
  await studio.getByRole('button', { name: 'More for Twist' }).click();
  await studio.getByRole('menuitem', { name: 'Take the operator off' }).click();
  await expect(studio.getByRole('treeitem', { name: 'Twist' })).toHaveCount(0);
});

test('a hidden part is gone from the surface and comes back', async ({ studio }) => {
  await openFormula(studio, 'sphere(1) | translate(box(1, 1, 1), x=2)');
  const both = await look(studio);
  const many = await floaters(studio);
  await choose(studio, 'Translate');
  await studio.getByRole('button', { name: 'Hide Translate' }).click();
  await expect(studio.getByRole('treeitem', { name: 'Translate, hidden' })).toBeVisible();
  await rest(studio);
  expect((await look(studio)).covered).toBeLessThan(0.85 * both.covered);
  expect(await floaters(studio)).toBeLessThan(0.9 * many);
  // It keeps its parameters, and they can be changed.
  const x = studio.getByLabel('x', { exact: true }).getByRole('textbox');
  expect(await value(studio, 'translate/x')).toBe(2);
  await x.fill('2.1');
  await x.press('Enter');
  const { text } = await saved(studio);
  await studio.getByRole('button', { name: 'Show Translate' }).click();
  await expect.poll(async () => (await look(studio)).covered, { timeout: 20_000 }).toBeGreaterThan(0.9 * both.covered);
  expect(await value(studio, 'translate/x')).toBe(2.1);
  await studio.keyboard.press('Control+z');
  await expect(studio.getByRole('treeitem', { name: 'Translate, hidden' })).toBeVisible();
  await studio.keyboard.press('Control+Shift+z');
  await expect(studio.getByRole('treeitem', { name: 'Translate', exact: true })).toBeVisible();
  await studio.locator('#open-file').setInputFiles({ name: 'hidden.iso.json', mimeType: 'application/json', buffer: Buffer.from(text) });
  await expect(studio.getByRole('treeitem', { name: 'Translate, hidden' })).toBeVisible();
  await choose(studio, 'Translate, hidden');
  expect(await value(studio, 'translate/x')).toBe(2.1);
});

test('what would leave nothing of the model is not hidden, and says why', async ({ studio }) => {
  await openFormula(studio, 'sphere(1) | translate(box(1, 1, 1), x=2)');
  await choose(studio, 'Translate');
  await studio.getByRole('treeitem', { name: 'Translate' }).press('h');
  await expect(studio.getByRole('treeitem', { name: 'Translate, hidden' })).toBeVisible();
  await choose(studio, 'Sphere');
  await studio.getByRole('treeitem', { name: 'Sphere' }).press('h');
  await expect(studio.getByText(/every part of the model is hidden/i)).toBeVisible();
  await expect(studio.getByRole('treeitem', { name: 'Sphere', exact: true })).toBeVisible();
  await choose(studio, 'Union');
  await studio.getByRole('treeitem', { name: 'Union' }).press('h');
  await expect(studio.getByText('The whole model cannot be hidden')).toBeVisible();
});

test('operands change places', async ({ studio }) => {
  await openFormula(studio, 'difference(sphere(1), translate(sphere(0.9), x=0.6))');
  await choose(studio, 'Translate');
  await studio.getByRole('treeitem', { name: 'Translate' }).press('Alt+ArrowUp');
  await expect(rows(studio).nth(1)).toHaveAccessibleName('Translate');
  const { model } = await saved(studio);
  expect(model.nodes.map(n => n.kind).filter(k => k !== 'difference').at(-1)).toBe('sphere');
});

test('a row dropped on another part moves there', async ({ studio }) => {
  await openFormula(studio, 'union(union(sphere(1), translate(box(1, 1, 1), x=1)), translate(torus(1, 0.2), z=1))');
  await expect(rows(studio)).toHaveCount(7);
  await studio.getByRole('treeitem', { name: 'Translate' }).last().dragTo(studio.getByRole('treeitem', { name: 'Union' }).last());
  await expect(studio.locator('[role=treeitem][aria-level="3"]')).toHaveCount(3);
});

const widthOf = ({ box }: Look) => box.right - box.left;
const heightOf = ({ box }: Look) => box.bottom - box.top;
const within = (given: number, expected: number) => Math.abs(given / expected - 1);
/** From where the camera is at first: how wide an ellipsoid is seen to be, and how high, beside the unit ball; what is nearer is seen
 * larger, by up to 8 % here. */
const [FROM_X, FROM_Y, FROM_Z] = [6, -9, 5];
const across = Math.hypot(FROM_X, FROM_Y);
const seenWidth = (rx: number) => Math.hypot((FROM_Y / across) * rx, FROM_X / across);
const seenHeight = (rz: number) => Math.hypot(FROM_Z, across * rz) / Math.hypot(FROM_Z, across);

test('a slider, a number and a lock', async ({ studio }) => {
  await openFormula(studio, 'ellipsoid(1, 1, 1)');
  const before = await look(studio);
  const slider = studio.getByLabel('rx, slider');
  const box = (await slider.boundingBox())!;
  await studio.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await studio.mouse.down();
  await studio.mouse.move(box.x + 0.65 * box.width, box.y + box.height / 2, { steps: 8 });
  await studio.mouse.up();
  await rest(studio);
  const slid = await value(studio, 'ellipsoid/rx');
  expect(slid).toBeGreaterThan(1.1);
  const wide = await look(studio);
  expect(within(widthOf(wide) / widthOf(before), seenWidth(slid))).toBeLessThan(0.1);
  expect(within(heightOf(wide) / heightOf(before), 1)).toBeLessThan(0.06);
  // The whole pull is one step of undo.
  await studio.keyboard.press('Control+z');
  await expect.poll(() => value(studio, 'ellipsoid/rx')).toBe(1);

  const field = studio.getByLabel('rz', { exact: true }).getByRole('textbox');
  await field.fill('0.6');
  await field.press('Enter');
  await rest(studio);
  expect(await value(studio, 'ellipsoid/rz')).toBe(0.6);
  const flat = await look(studio);
  expect(within(heightOf(flat) / heightOf(before), seenHeight(0.6))).toBeLessThan(0.1);
  expect(within(widthOf(flat) / widthOf(before), 1)).toBeLessThan(0.04);

  await field.fill('-1');
  await field.press('Enter');
  await expect(studio.getByRole('alert')).toContainText('More than 0');
  await field.press('Escape');
  expect(await value(studio, 'ellipsoid/rz')).toBe(0.6);

  await studio.getByRole('button', { name: /^Lock ry/ }).click();
  await expect(studio.getByRole('button', { name: /^Let ry follow/ })).toBeVisible();
  expect((await saved(studio)).text).toContain('"frozen":true');
});

test('a formula with a typo shows where, and a right one replaces the model', async ({ studio }) => {
  const field = studio.getByRole('textbox', { name: 'Formula' });
  await field.fill('sphere(1) | bux(1, 1, 1)');
  await expect(studio.locator('.fault')).toContainText('bux');
  const marked = await studio.locator('.fault pre').innerText();
  const [line, caret] = marked.split('\n');
  expect(line!.slice(caret!.indexOf('^'))).toMatch(/^bux/);
  await expect(studio.getByRole('button', { name: 'Replace the model' })).toBeDisabled();
  await field.fill('torus(1, 0.3)');
  await expect(studio.locator('.fault')).toHaveCount(0);
  await field.press('Enter');
  await expect(studio.getByRole('treeitem', { name: 'Torus' })).toBeVisible();
  await studio.keyboard.press('Escape');
  await studio.getByRole('button', { name: 'Undo', exact: true }).click();
  await expect(studio.getByRole('treeitem', { name: 'Torus' })).toHaveCount(0);
});

test('spacing and curvature change how dense the discs are', async ({ studio }) => {
  await openFormula(studio, 'ellipsoid(2, 0.5, 0.5)');
  const before = await floaters(studio);
  const spacing = studio.getByLabel('Spacing', { exact: true });
  const now = Number(await spacing.inputValue());
  await spacing.fill(String(now * 0.7));
  await spacing.press('Enter');
  await expect.poll(() => floaters(studio), { timeout: 20_000 }).toBeGreaterThan(1.6 * before);
  const even = await floaters(studio);
  const slider = studio.getByLabel('Denser where the surface is curved');
  await slider.focus();
  await slider.press('End');
  await expect.poll(() => floaters(studio), { timeout: 20_000 }).not.toBe(even);
});

test('time stands still, goes a step, and starts again', async ({ studio }) => {
  await openFormula(studio, 'sphere(1)');
  await studio.keyboard.press(' ');
  await expect(studio.getByRole('button', { name: 'Let time pass' })).toBeVisible();
  const clock = async () => JSON.parse((await saved(studio)).text).clock as number;
  const before = await clock();
  await rest(studio);
  expect(await clock()).toBe(before);
  await studio.getByRole('button', { name: 'One step' }).click();
  await expect.poll(clock).toBe(before + 1);
  await studio.getByLabel('r', { exact: true }).getByRole('textbox').fill('1.7');
  await studio.keyboard.press('Enter');
  await studio.getByRole('button', { name: /^Start again/ }).click();
  await expect.poll(() => value(studio, 'sphere/r')).toBe(1);
});

test('the strip tells how the floaters are', async ({ studio }) => {
  await rest(studio);
  const strip = studio.getByRole('contentinfo', { name: 'Figures' }).or(studio.locator('footer.figures-panel'));
  await expect(strip.first()).toContainText('Floaters');
  const shown = Number((await strip.first().locator('dd').first().innerText()).replaceAll(',', ''));
  expect(Math.abs(shown - (await floaters(studio)))).toBeLessThan(100);
  const evenness = Number(await strip.first().locator('dd').nth(2).innerText());
  expect(evenness).toBeGreaterThan(0);
  expect(evenness).toBeLessThan(0.4);
});
