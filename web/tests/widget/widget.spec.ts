import { existsSync, readFileSync } from 'node:fs';
import { expect, test, type Page } from '@playwright/test';

/** A scene of a sphere of this radius, as Python writes it. */
function sphere(radius: number): string {
  return JSON.stringify({
    format: 'isoswarm scene',
    version: 1,
    model: {
      format: 'isoswarm model',
      version: 1,
      nodes: [{ kind: 'sphere', params: [{ name: 'r', value: radius }] }],
    },
    settings: { amount: { count: 300 } },
    pins: [{ id: 0, at: [radius, 0, 0], name: 'hand' }],
  });
}

/** A host that implements what anywidget gives a widget, and keeps what it has been told. */
const HOST = `<!doctype html><meta charset="utf-8"><title>a notebook</title><div id="cell"></div>
<script type="module">
  import widget from './widget.js';
  const values = window.values = ${JSON.stringify({ height: 620, parameters: { 'sphere/r': 1 }, pins: [], revision: 0, revision_of: 'document' })};
  values.document = ${JSON.stringify(sphere(1))};
  const handlers = new Map();
  window.saves = 0;
  window.model = {
    get: name => values[name],
    set: (name, value) => { values[name] = value; },
    save_changes: () => { window.saves++; },
    on: (event, handler) => handlers.set(event, [...(handlers.get(event) ?? []), handler]),
    off: (event, handler) => handlers.set(event, (handlers.get(event) ?? []).filter(h => h !== handler)),
  };
  window.fire = event => (handlers.get(event) ?? []).forEach(handler => handler());
  window.unmount = widget.render({ model: window.model, el: document.getElementById('cell') });
</script>`;

interface Host {
  values: { document: string; parameters: Record<string, number>; pins: { at: number[] }[] } & Record<string, unknown>;
  saves: number;
  fire: (event: string) => void;
  unmount: () => void;
}

async function notebook(page: Page): Promise<string[]> {
  const file = new URL('../../dist/widget/widget.js', import.meta.url);
  if (!existsSync(file)) throw new Error('dist/widget/widget.js is missing: npm run build:widget');
  const errors: string[] = [];
  page.on('pageerror', error => errors.push(error.message));
  await page.route('**/notebook/', route => route.fulfill({ contentType: 'text/html', body: HOST }));
  await page.route('**/notebook/widget.js', route =>
    route.fulfill({ contentType: 'text/javascript', body: readFileSync(file, 'utf8') }),
  );
  await page.goto('/notebook/');
  return errors;
}

const values = (page: Page) => page.evaluate(() => (window as unknown as Host).values);

test('the scene of Python is shown, changes go both ways, and it goes away without a trace', async ({ page }) => {
  const errors = await notebook(page);
  const studio = page.frameLocator('iframe[title="isoswarm Studio"]');
  const floaters = async () => Number(await studio.locator('canvas.stage').getAttribute('data-floaters'));
  await expect.poll(floaters, { timeout: 30_000 }).toBeGreaterThan(200);
  await expect(studio.getByText('sphere').first()).toBeVisible();

  // Python sets a value.
  await page.evaluate(() => {
    const host = window as unknown as Host;
    Object.assign(host.values, { parameters: { 'sphere/r': 1.5 }, pins: [{ id: 0, name: 'hand', at: [1.5, 0, 0] }] });
    Object.assign(host.values, { revision_of: 'values', revision: 1 });
    host.fire('change:revision');
  });
  // What came from Python is not told back as the page's own.
  await page.waitForTimeout(1500);
  expect(await page.evaluate(() => (window as unknown as Host).saves)).toBe(0);

  // The page undoes it: that is told.
  await studio.locator('body').click({ position: { x: 5, y: 5 } });
  await studio.locator('body').press('Control+z');
  await expect.poll(async () => (await values(page)).parameters['sphere/r'], { timeout: 15_000 }).toBe(1);
  expect(JSON.parse((await values(page)).document).model.nodes[0].params[0].value).toBe(1);
  expect((await values(page)).pins[0]!.at[0]).toBeCloseTo(1, 9);
  expect(await page.evaluate(() => (window as unknown as Host).saves)).toBeGreaterThan(0);

  await page.evaluate(() => (window as unknown as Host).unmount());
  await expect(page.locator('iframe')).toHaveCount(0);
  expect(errors).toEqual([]);
});
