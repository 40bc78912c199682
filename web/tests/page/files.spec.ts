/** Scenes come and go: autosave, files, drops, links, exports. */
import { expect, exported, floaters, fromGallery, look, middle, openFormula, pinAt, rest, saved, surface, test, value, watch } from './studio.ts';

test('a reload brings the scene back', async ({ studio }) => {
  await openFormula(studio, 'torus(1, 0.4)');
  const at = await look(studio);
  await pinAt(studio, (at.box.left + at.box.right) / 2, at.box.bottom - 40);
  await studio.getByLabel('Name of the scene').fill('My ring');
  await studio.keyboard.press('Enter');
  const before = await saved(studio);
  await studio.waitForTimeout(1500);
  await studio.reload();
  await surface(studio);
  await expect(studio.getByLabel('Name of the scene')).toHaveValue('My ring');
  await expect(studio.locator('button.pin')).toHaveCount(1);
  expect((await saved(studio)).model).toEqual(before.model);
});

test('a saved file opens again, by choosing it and by dropping it', async ({ studio }) => {
  await fromGallery(studio, 'Quartic');
  const { text } = await saved(studio);
  for (const way of ['choose', 'drop'] as const) {
    await openFormula(studio, 'sphere(1)');
    if (way === 'choose') {
      await studio.locator('#open-file').setInputFiles({ name: 'mine.iso.json', mimeType: 'application/json', buffer: Buffer.from(text) });
    } else {
      const data = await studio.evaluateHandle(t => {
        const transfer = new DataTransfer();
        transfer.items.add(new File([t], 'mine.iso.json', { type: 'application/json' }));
        return transfer;
      }, text);
      await studio.dispatchEvent('body', 'dragover', { dataTransfer: data });
      await expect(studio.locator('.drop')).toBeVisible();
      await studio.dispatchEvent('body', 'drop', { dataTransfer: data });
    }
    await expect(studio.getByLabel('Name of the scene')).toHaveValue('mine');
    await expect(studio.getByRole('treeitem', { name: 'Algebraic' })).toBeVisible();
    expect((await saved(studio)).model).toEqual(JSON.parse(text).model);
  }
});

test('a file that is none gives a sentence, and the scene stays', async ({ studio }) => {
  const before = await saved(studio);
  await studio.locator('#open-file').setInputFiles({ name: 'notes.txt', mimeType: 'text/plain', buffer: Buffer.from('hello, world (') });
  await expect(studio.locator('.toast.warn')).toBeVisible();
  expect((await saved(studio)).model).toEqual(before.model);
});

test('a link brings the whole scene into a fresh profile', async ({ studio, browser, baseURL }) => {
  await openFormula(studio, 'smooth_union(sphere(1), translate(torus(1, 0.2), z=0.5), k=0.1)');
  const at = await middle(studio);
  await pinAt(studio, at.x, at.y);
  const before = await saved(studio);
  await studio.getByRole('button', { name: 'Share' }).click();
  await expect(studio.locator('.toast.good').last()).toContainText('link');
  const link = studio.url();
  expect(link).toContain('#s1=');
  const fresh = await browser.newContext({ baseURL: baseURL!, viewport: { width: 1440, height: 900 } });
  const page = await fresh.newPage();
  const wrong = watch(page);
  await page.goto(link);
  await surface(page);
  // The pin holds the surface while time goes on: the last digits may move.
  const rounded = (model: unknown) =>
    JSON.parse(JSON.stringify(model), (_, v) => (typeof v === 'number' ? Number(v.toFixed(12)) + 0 : v));
  expect(rounded((await saved(page)).model)).toEqual(rounded(before.model));
  await expect(page.locator('button.pin')).toHaveCount(1);
  expect(wrong).toEqual([]);
  await fresh.close();
});

test('a broken link gives a sentence with a way on', async ({ studio }) => {
  await studio.goto('about:blank');
  await studio.goto('./#s1=eNpLy8kvSk0BAAvCAzE');
  await surface(studio);
  await expect(studio.getByRole('alert')).toContainText('link');
  await studio.getByRole('alert').getByRole('button', { name: 'Open the gallery' }).click();
  await expect(studio.getByRole('dialog')).toBeVisible();
});

test('points and pictures leave the page', async ({ studio }) => {
  const ply = (await exported(studio, /^Points with normals/)).toString('latin1');
  expect(ply).toMatch(/^ply/);
  const count = Number(/element vertex (\d+)/.exec(ply)![1]);
  expect(Math.abs(count - (await floaters(studio)))).toBeLessThan(60);
  const png = await exported(studio, /^Picture/);
  expect(png.subarray(1, 4).toString()).toBe('PNG');
  expect(png.readUInt32BE(16)).toBe(2880);
});

test('meshes leave the page in every format', async ({ studio }) => {
  await openFormula(studio, 'sphere(1)');
  await studio.getByRole('radio', { name: 'Mesh' }).click();
  const obj = (await exported(studio, /Mesh\s*OBJ/)).toString();
  const vertices = obj.split('\n').filter(l => l.startsWith('v '));
  const faces = obj.split('\n').filter(l => l.startsWith('f '));
  // Euler's formula for a closed surface without holes: F = 2V − 4.
  expect(faces.length).toBe(2 * vertices.length - 4);
  for (const v of vertices) expect(Math.hypot(...v.split(/\s+/).slice(1, 4).map(Number))).toBeCloseTo(1, 3);
  const stl = await exported(studio, /Mesh\s*STL/);
  expect(stl.readUInt32LE(80)).toBe((stl.length - 84) / 50);
  const glb = await exported(studio, /GLB/);
  expect(glb.subarray(0, 4).toString()).toBe('glTF');
  const threeMf = await exported(studio, /3MF/);
  expect(threeMf.subarray(0, 2).toString()).toBe('PK');
  const ply = await exported(studio, /^Mesh\s*PLY/);
  expect(ply.subarray(0, 3).toString()).toBe('ply');
});

test('a parameter survives the way out and in to the last bit', async ({ studio }) => {
  await openFormula(studio, 'sphere(1)');
  const field = studio.getByLabel('r', { exact: true }).getByRole('textbox');
  await field.fill('1.2345678901234567');
  await field.press('Enter');
  await rest(studio);
  expect((await saved(studio)).text).toContain('1.2345678901234567');
  expect(await value(studio, 'sphere/r')).toBeCloseTo(1.235, 6);
});
