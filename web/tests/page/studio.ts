/** What the tests of the page share: a page whose errors fail the test, and ways to see what a person sees. */
import { readFileSync } from 'node:fs';
import { test as base, expect, type Download, type Locator, type Page } from '@playwright/test';

export { expect };

interface Fixtures {
  /** Messages of the console that this test expects. */
  expected: RegExp[];
  studio: Page;
}

/** A page with the Studio open on its first scene. Errors and warnings in the console fail the test. */
export const test = base.extend<Fixtures>({
  expected: [[], { option: true }],
  studio: async ({ page, expected }, use) => {
    const wrong = watch(page, expected);
    await page.goto('./');
    await surface(page);
    await use(page);
    expect(wrong).toEqual([]);
  },
});

/** Collects what a page complains about. */
export function watch(page: Page, expected: RegExp[] = []): string[] {
  const wrong: string[] = [];
  const note = (text: string) => {
    // SwiftShader tells that reading pixels is slow.
    if (/GPU stall due to ReadPixels/.test(text) || expected.some(e => e.test(text))) return;
    wrong.push(text);
  };
  page.on('console', m => (m.type() === 'error' || m.type() === 'warning') && note(m.text()));
  page.on('pageerror', e => note(String(e)));
  return wrong;
}

/** The number of discs that the page shows. */
export async function floaters(page: Page): Promise<number> {
  return Number(await page.locator('canvas.stage').getAttribute('data-floaters'));
}

/** Waits until there is a surface. */
export async function surface(page: Page): Promise<void> {
  await expect.poll(() => floaters(page), { timeout: 120_000 }).toBeGreaterThan(20);
  await rest(page);
}

/** Waits until the surface has come to rest, and the picture has been drawn. */
export async function rest(page: Page): Promise<void> {
  await page.waitForTimeout(300);
  await expect(page.locator('canvas.stage')).toHaveAttribute('data-moving', 'false', { timeout: 60_000 });
  await page.waitForTimeout(400);
}

export interface Look {
  /** Part of the pixels that are not background. */
  covered: number;
  /** Their mean colour, 0 to 255. */
  colour: [number, number, number];
  /** How much their colours vary. */
  spread: number;
  /** The box around them, in pixels of the window. */
  box: { left: number; top: number; right: number; bottom: number };
}

/** The part of the window where the surface is, without tools and panels. */
export async function clip(page: Page): Promise<{ x: number; y: number; width: number; height: number }> {
  const view = (await page.locator('main.view').boundingBox())!;
  return { x: view.x + 70, y: view.y + 70, width: view.width - 170, height: view.height - 170 };
}

/** What the picture looks like: counted pixels. */
export async function look(page: Page): Promise<Look> {
  const area = await clip(page);
  const shot = await page.screenshot({ clip: area });
  return page.evaluate(
    async ({ png, area }) => {
      const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
      const canvas = new OffscreenCanvas(image.width, image.height);
      const context = canvas.getContext('2d')!;
      context.drawImage(image, 0, 0);
      const { data } = context.getImageData(0, 0, image.width, image.height);
      const probe = document.createElement('i');
      probe.style.color = 'var(--paper)';
      document.body.append(probe);
      const paper = getComputedStyle(probe).color.match(/\d+/g)!.map(Number);
      probe.remove();
      const sum = [0, 0, 0];
      let [n, squares] = [0, 0];
      const box = { left: Infinity, top: Infinity, right: -Infinity, bottom: -Infinity };
      for (let i = 0; i < data.length; i += 4) {
        const [r, g, b] = [data[i]!, data[i + 1]!, data[i + 2]!];
        if (Math.abs(r - paper[0]!) + Math.abs(g - paper[1]!) + Math.abs(b - paper[2]!) < 60) continue;
        const [x, y] = [area.x + ((i / 4) % image.width), area.y + Math.floor(i / 4 / image.width)];
        box.left = Math.min(box.left, x);
        box.right = Math.max(box.right, x);
        box.top = Math.min(box.top, y);
        box.bottom = Math.max(box.bottom, y);
        sum[0]! += r;
        sum[1]! += g;
        sum[2]! += b;
        squares += ((r + g + b) / 3) ** 2;
        n++;
      }
      const colour = sum.map(s => s / Math.max(n, 1)) as [number, number, number];
      const mean = (colour[0] + colour[1] + colour[2]) / 3;
      return { covered: n / (data.length / 4), colour, spread: Math.sqrt(Math.max(0, squares / Math.max(n, 1) - mean * mean)), box };
    },
    { png: shot.toString('base64'), area },
  );
}

/** The middle of the surface as it is seen. */
export async function middle(page: Page): Promise<{ x: number; y: number }> {
  const { box } = await look(page);
  return { x: (box.left + box.right) / 2, y: (box.top + box.bottom) / 2 };
}

/** Sets a pin with a click on the surface. */
export async function pinAt(page: Page, x: number, y: number): Promise<Locator> {
  const before = await page.locator('button.pin').count();
  await page.mouse.click(x, y);
  await expect(page.locator('button.pin')).toHaveCount(before + 1);
  return page.locator('button.pin').nth(before);
}

export async function centre(of: Locator): Promise<{ x: number; y: number }> {
  const box = (await of.boundingBox())!;
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

/** Drags with the mouse, in steps as a hand does. */
export async function pull(page: Page, from: { x: number; y: number }, dx: number, dy: number): Promise<void> {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  for (let i = 1; i <= 12; i++) {
    await page.mouse.move(from.x + (dx * i) / 12, from.y + (dy * i) / 12);
    await page.waitForTimeout(40);
  }
  await page.waitForTimeout(300);
  await page.mouse.up();
  await rest(page);
}

/** The value in a parameter's field. */
export async function value(page: Page, path: string): Promise<number> {
  return Number(await page.locator(`[data-parameter="${path}"] input.field`).inputValue());
}

/** Chooses a row of the tree by what it says. */
export async function choose(page: Page, name: string | RegExp): Promise<void> {
  await page.getByRole('treeitem', { name }).first().click();
}

/** Picks an item of the Export menu and gives the file. */
export async function exported(page: Page, item: RegExp): Promise<Buffer> {
  await page.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download', { timeout: 60_000 });
  await page.getByRole('menuitem', { name: item }).click();
  return contents(await download);
}

export async function contents(download: Download): Promise<Buffer> {
  return readFileSync(await download.path());
}

/** What Save gives. */
export async function saved(page: Page): Promise<{ model: { nodes: { kind: string; name?: string }[] }; pins: { at: number[] }[]; text: string }> {
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save', exact: true }).click();
  const text = (await contents(await download)).toString();
  return { ...JSON.parse(text), text };
}

/** Opens a scene of the gallery, and waits until its surface rests. */
export async function fromGallery(page: Page, title: string): Promise<void> {
  await openFromGallery(page, title);
  await surface(page);
}

/** Opens a scene of the gallery. */
export async function openFromGallery(page: Page, title: string): Promise<void> {
  await page.keyboard.press('g');
  await page.getByRole('dialog').getByRole('button', { name: title, exact: false }).first().click();
  await expect(page.getByLabel('Name of the scene')).toHaveValue(title, { timeout: 100_000 });
}

/** Types a formula in the gallery and opens it. */
export async function openFormula(page: Page, formula: string): Promise<void> {
  await page.keyboard.press('g');
  const dialog = page.getByRole('dialog');
  await dialog.getByRole('textbox', { name: 'Formula' }).fill(formula);
  await dialog.getByRole('textbox', { name: 'Formula' }).press('Enter');
  await expect(dialog).toBeHidden({ timeout: 60_000 });
  await surface(page);
}
