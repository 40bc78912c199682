/** What goes wrong: each time a sentence with a way on, and the scene survives. */
import type { Page } from '@playwright/test';
import { centre, expect, floaters, look, middle, openFormula, pinAt, pull, rest, saved, surface, test, value, watch } from './studio.ts';

/** Tells the worker to stop, as a defect would. */
async function provoke(page: Page, what: 'panic' | 'memory'): Promise<void> {
  await page.evaluate(w => {
    const { workers } = window as unknown as { workers: Worker[] };
    workers.at(-1)!.postMessage({ type: 'request', id: 1e9, name: 'provoke', input: { what: w } });
  }, what);
}

test.describe('the core', () => {
  test.use({ expected: [/panick|RuntimeError|unreachable|memory/i] });
  test.beforeEach(async ({ page }) => {
    await page.addInitScript(() => {
      const workers: Worker[] = [];
      Object.assign(window, { workers });
      window.Worker = class extends Worker {
        constructor(...args: ConstructorParameters<typeof Worker>) {
          super(...args);
          workers.push(this);
        }
      };
    });
  });

  test('stops and is started again; the scene is as it was', async ({ studio }) => {
    await openFormula(studio, 'torus(1, 0.3)');
    const at = await look(studio);
    await pinAt(studio, (at.box.left + at.box.right) / 2, at.box.bottom - 30);
    await studio.waitForTimeout(1000);
    const before = await saved(studio);
    for (const what of ['panic', 'memory'] as const) {
      await provoke(studio, what);
      // What asks the core next finds out.
      await studio.keyboard.press('.');
      await expect(studio.locator('.toast.warn')).toContainText('started again', { timeout: 60_000 });
      await surface(studio);
      const after = await saved(studio);
      expect(after.model).toEqual(before.model);
      expect(after.pins).toEqual(before.pins);
      await studio.getByRole('button', { name: 'Close this note' }).first().click();
    }
    // And it goes on working.
    const pin = studio.locator('button.pin');
    await pull(studio, await centre(pin), 0, 40);
    expect(await value(studio, 'torus/major')).not.toBe(1);
  });
});

test('a change that leaves no surface is refused with a sentence', async ({ studio }) => {
  await openFormula(studio, 'offset(sphere(1), d=0)');
  const field = studio.getByLabel('d', { exact: true }).getByRole('textbox');
  await field.fill('-2');
  await field.press('Enter');
  await expect(studio.locator('.toast.warn')).toContainText(/surface/);
  expect(await floaters(studio)).toBeGreaterThan(50);
  expect((await saved(studio)).text).toContain('"offset"');
});

test('a formula without a surface says so', async ({ studio }) => {
  await studio.keyboard.press('g');
  await studio.getByRole('dialog').getByRole('textbox', { name: 'Formula' }).fill('x^2 + y^2 + z^2 + 1');
  await studio.getByRole('dialog').getByRole('textbox', { name: 'Formula' }).press('Enter');
  await expect(studio.locator('.toast.warn')).toBeVisible();
});

test('a model that asks for too many floaters is refused, not frozen', async ({ studio }) => {
  await openFormula(studio, 'sphere(1)');
  const spacing = studio.getByLabel('Spacing', { exact: true });
  await spacing.fill('0.00001');
  await spacing.press('Enter');
  await expect(studio.getByRole('alert').first()).toBeVisible();
  await spacing.press('Escape');
  await rest(studio);
  expect(await floaters(studio)).toBeLessThan(20_000);
});

test('a lost context is told, and the picture comes back', async ({ studio }) => {
  const before = await look(studio);
  await studio.evaluate(() => {
    const gl = document.querySelector('canvas')!.getContext('webgl2')!;
    const lose = gl.getExtension('WEBGL_lose_context')!;
    (window as unknown as { lose: WEBGL_lose_context }).lose = lose;
    lose.loseContext();
  });
  await expect(studio.getByText('dropped the picture')).toBeVisible();
  await studio.evaluate(() => (window as unknown as { lose: WEBGL_lose_context }).lose.restoreContext());
  await expect(studio.getByText('dropped the picture')).toHaveCount(0);
  await rest(studio);
  expect((await look(studio)).covered).toBeGreaterThan(0.9 * before.covered);
});

test('without WebGL the page says so and everything else works', async ({ page }) => {
  const wrong = watch(page);
  await page.addInitScript(() => {
    HTMLCanvasElement.prototype.getContext = () => null;
  });
  await page.goto('./');
  await expect(page.getByRole('alert')).toContainText('WebGL');
  await expect.poll(() => floaters(page), { timeout: 30_000 }).toBeGreaterThan(20);
  expect((await saved(page)).model.nodes.length).toBeGreaterThan(1);
  expect(wrong).toEqual([]);
});

test('a pin does not survive outside what is shown', async ({ studio }) => {
  const at = await middle(studio);
  await pinAt(studio, at.x, at.y);
  await studio.keyboard.press('Delete');
  await expect(studio.locator('button.pin')).toHaveCount(0);
});
