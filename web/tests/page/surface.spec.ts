/** What is seen: discs, points, mesh, colours, camera, section. */
import { choose, clip, expect, floaters, look, middle, openFormula, openFromGallery, rest, test } from './studio.ts';

test('the first scene is a lit surface of discs in the middle of the picture', async ({ studio }) => {
  const seen = await look(studio);
  expect(seen.covered).toBeGreaterThan(0.1);
  expect(seen.covered).toBeLessThan(0.9);
  // Clay, lit from one side.
  expect(seen.colour[0]).toBeGreaterThan(seen.colour[2] + 30);
  expect(seen.spread).toBeGreaterThan(12);
  const area = await clip(studio);
  const at = await middle(studio);
  expect(Math.abs(at.x - (area.x + area.width / 2))).toBeLessThan(90);
  expect(Math.abs(at.y - (area.y + area.height / 2))).toBeLessThan(90);
});

test('discs, points and mesh cover the same place', async ({ studio }) => {
  const discs = await look(studio);
  await studio.getByRole('radio', { name: 'Points' }).click();
  await rest(studio);
  const points = await look(studio);
  expect(points.covered).toBeLessThan(0.8 * discs.covered);
  expect(points.covered).toBeGreaterThan(0.02 * discs.covered);
  await studio.getByRole('radio', { name: 'Mesh' }).click();
  await expect(studio.getByRole('radio', { name: 'Wireframe' })).toBeVisible();
  await expect.poll(async () => (await look(studio)).covered, { timeout: 30_000 }).toBeGreaterThan(0.9 * discs.covered);
  const mesh = await look(studio);
  // Above it the choice of looks has come up.
  for (const side of ['left', 'right', 'bottom'] as const) expect(Math.abs(mesh.box[side] - discs.box[side])).toBeLessThan(12);
  await studio.getByRole('radio', { name: 'Wireframe' }).click();
  await rest(studio);
  const wire = await look(studio);
  expect(Math.abs(wire.colour[0] - mesh.colour[0])).toBeGreaterThan(2);
  await studio.getByRole('radio', { name: 'Flat' }).click();
  await rest(studio);
  expect((await look(studio)).covered).toBeGreaterThan(0.9 * discs.covered);
});

test('each colouring shows, with its legend', async ({ studio }) => {
  const plain = await look(studio);
  for (const [name, legend] of [
    ['Normal', 'Normal'],
    ['Curvature', 'Mean curvature'],
    ['Radius', 'Radius of the discs'],
    ['Off the surface', 'Distance off the surface'],
  ] as const) {
    await studio.getByRole('button', { name: /^Colour:/ }).click();
    await studio.getByRole('menuitemradio', { name }).click();
    await expect(studio.locator('figure.legend')).toContainText(legend);
    await rest(studio);
    const seen = await look(studio);
    expect(seen.covered).toBeGreaterThan(0.8 * plain.covered);
    const apart = Math.hypot(...seen.colour.map((c, i) => c - plain.colour[i]!));
    expect(apart, name).toBeGreaterThan(15);
  }
});

test('the camera orbits, zooms, fits, looks along axes and becomes orthographic', async ({ studio }) => {
  const before = await look(studio);
  const area = await clip(studio);
  await studio.mouse.move(area.x + 30, area.y + 30);
  await studio.mouse.down();
  await studio.mouse.move(area.x + 230, area.y + 90, { steps: 6 });
  await studio.mouse.up();
  await rest(studio);
  const turned = await look(studio);
  expect(Math.abs(turned.box.left - before.box.left) + Math.abs(turned.box.right - before.box.right)).toBeGreaterThan(4);

  await studio.mouse.move(area.x + area.width / 2, area.y + area.height / 2);
  await studio.mouse.wheel(0, 600);
  await rest(studio);
  const far = await look(studio);
  expect(far.covered).toBeLessThan(0.8 * turned.covered);
  await studio.keyboard.press('f');
  await rest(studio);
  expect((await look(studio)).covered).toBeGreaterThan(1.2 * far.covered);

  await studio.getByRole('button', { name: 'Look from Z', exact: true }).click();
  await studio.keyboard.press('o');
  await rest(studio);
  await expect(studio.getByRole('button', { name: /Orthographic/ })).toBeVisible();
  const flat = await look(studio);
  expect(flat.covered).toBeGreaterThan(0.05);
});

test('keys move the camera, and show what is chosen', async ({ studio }) => {
  await openFormula(studio, 'sphere(1) | translate(sphere(0.3), x=3)');
  await studio.getByRole('button', { name: 'Look from −Y' }).click();
  await rest(studio);
  const before = await look(studio);
  for (let k = 0; k < 4; k++) await studio.keyboard.press('+');
  await rest(studio);
  const near = await look(studio);
  expect(near.covered).toBeGreaterThan(1.3 * before.covered);
  for (let k = 0; k < 4; k++) await studio.keyboard.press('-');
  // A quarter turn to the right: the small ball comes before the large one.
  for (let k = 0; k < 12; k++) await studio.keyboard.press('ArrowRight');
  await rest(studio);
  const aside = await look(studio);
  expect(aside.box.right - aside.box.left).toBeLessThan(0.75 * (before.box.right - before.box.left));

  await choose(studio, 'Translate');
  await studio.keyboard.press('Shift+F');
  await rest(studio);
  const shown = await look(studio);
  expect(shown.covered).toBeGreaterThan(2 * aside.covered);
  // In the tree, arrows go through the tree.
  await studio.locator('[role=treeitem][tabindex="0"]').focus();
  await studio.keyboard.press('ArrowUp');
  await rest(studio);
  const same = await look(studio);
  expect(Math.abs(same.box.left - shown.box.left)).toBeLessThan(3);
});

test('the section plane opens a ball and shows its inside', async ({ studio }) => {
  await openFormula(studio, 'sphere(1)');
  await studio.getByRole('button', { name: 'Look from −Y' }).click();
  await rest(studio);
  const whole = await look(studio);
  await studio.keyboard.press('x');
  await rest(studio);
  const cut = await look(studio);
  // The inside is darker and greyer than clay, where the ball was.
  expect(Math.abs(cut.covered - whole.covered)).toBeLessThan(0.25 * whole.covered + 0.02);
  expect(cut.colour[0] - cut.colour[2]).toBeLessThan(whole.colour[0] - whole.colour[2] - 15);
  await studio.getByRole('radio', { name: 'X', exact: true }).click();
  await rest(studio);
  expect((await look(studio)).covered).toBeLessThan(0.75 * whole.covered);
});

test('every scene of the gallery shows a surface', async ({ studio }) => {
  test.setTimeout(480_000);
  await studio.keyboard.press('g');
  const titles = await studio.locator('.card strong').allTextContents();
  await studio.keyboard.press('Escape');
  expect(titles.length).toBeGreaterThan(15);
  for (const title of titles) {
    await openFromGallery(studio, title);
    await expect.poll(() => floaters(studio), { message: title, timeout: 60_000 }).toBeGreaterThan(100);
    const least = title === 'Cassini oval' ? 0.002 : 0.04;
    await expect.poll(async () => (await look(studio)).covered, { message: title, timeout: 60_000 }).toBeGreaterThan(least);
  }
});

test('nothing is drawn while nothing moves', async ({ studio }) => {
  await studio.keyboard.press(' ');
  await studio.waitForTimeout(1500);
  const drawn = await studio.evaluate(async () => {
    let calls = 0;
    const proto = WebGL2RenderingContext.prototype;
    const { drawArrays, drawElements } = proto;
    proto.drawArrays = function (...args) {
      calls++;
      return drawArrays.apply(this, args);
    };
    proto.drawElements = function (...args) {
      calls++;
      return drawElements.apply(this, args);
    };
    await new Promise(done => setTimeout(done, 1500));
    Object.assign(proto, { drawArrays, drawElements });
    return calls;
  });
  expect(drawn).toBe(0);
});
