/** Keyboard, themes, contrast, small screens, touch. */
import type { Page } from '@playwright/test';
import { expect, look, middle, openFormula, rest, surface, test, watch } from './studio.ts';

test('the tree is one stop of the Tab key and is walked with arrows', async ({ studio }) => {
  await openFormula(studio, 'sphere(1) | translate(box(1, 1, 1), x=1)');
  await expect(studio.locator('[role=treeitem][tabindex="0"]')).toHaveCount(1);
  await studio.locator('[role=treeitem][tabindex="0"]').focus();
  await studio.keyboard.press('End');
  await expect(studio.locator(':focus')).toHaveAccessibleName('Box');
  await studio.keyboard.press('ArrowLeft');
  await expect(studio.locator(':focus')).toHaveAccessibleName('Translate');
  await studio.keyboard.press('ArrowLeft');
  await expect(studio.locator(':focus')).toHaveAttribute('aria-expanded', 'false');
  await studio.keyboard.press('ArrowRight');
  await expect(studio.locator(':focus')).toHaveAttribute('aria-expanded', 'true');
});

test('menus and dialogs: Escape closes, focus comes back', async ({ studio }) => {
  const button = studio.getByRole('button', { name: 'Export' });
  await button.focus();
  await studio.keyboard.press('Enter');
  await expect(studio.getByRole('menu')).toBeVisible();
  await expect(studio.locator(':focus')).toHaveAttribute('role', 'menuitem');
  await studio.keyboard.press('Escape');
  await expect(studio.getByRole('menu')).toHaveCount(0);
  await expect(button).toBeFocused();
  await studio.keyboard.press('?');
  await expect(studio.getByRole('dialog', { name: 'Help' })).toContainText('undo');
  await studio.keyboard.press('Escape');
  await expect(studio.getByRole('dialog')).toHaveCount(0);
});

test('everything that can be pressed has a name', async ({ studio }) => {
  const nameless = await studio.evaluate(() =>
    [...document.querySelectorAll('button, input, textarea, select, [role=button]')]
      .filter(e => {
        const labelled = e.getAttribute('aria-label') ?? e.textContent?.trim();
        return !labelled && !(e as HTMLInputElement).labels?.length;
      })
      .map(e => e.outerHTML.slice(0, 120)),
  );
  expect(nameless).toEqual([]);
});

/** The lowest contrast of text on what lies behind it. */
function contrast(page: Page): Promise<{ ratio: number; text: string }[]> {
  return page.evaluate(() => {
    const parse = (c: string) => c.match(/[\d.]+/g)!.map(Number);
    const luminance = (c: number[]) => {
      const [r, g, b] = c.slice(0, 3).map(v => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4)) as [number, number, number];
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const behind = (e: Element | null): number[] => {
      for (let at = e; at; at = at.parentElement) {
        const c = parse(getComputedStyle(at).backgroundColor);
        if (c.length < 4 || c[3]! > 0.95) return c;
      }
      return parse(getComputedStyle(document.body).backgroundColor);
    };
    const low: { ratio: number; text: string }[] = [];
    for (const e of document.querySelectorAll('h2, h3, p, span, small, dt, dd, button, label, input, textarea, strong, output')) {
      const own = [...e.childNodes].some(n => n.nodeType === 3 && n.textContent!.trim() !== '') || e.matches('input, textarea');
      const style = getComputedStyle(e);
      if (!own || !(e as HTMLElement).offsetParent || e.closest(':disabled') || Number(style.opacity) < 1 || e.closest('.hidden-part')) continue;
      const [a, b] = [luminance(parse(style.color)), luminance(behind(e))];
      const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
      if (ratio < 4.5) low.push({ ratio, text: e.outerHTML.slice(0, 80) });
    }
    return low;
  });
}

test('text can be read in both themes', async ({ studio }) => {
  const at = await middle(studio);
  await studio.mouse.click(at.x, at.y);
  for (const theme of ['Light', 'Dark']) {
    await studio.getByRole('button', { name: 'Theme' }).click();
    await studio.getByRole('menuitemradio', { name: theme }).click();
    await expect(studio.locator('html')).toHaveAttribute('data-theme', theme.toLowerCase());
    await rest(studio);
    expect(await contrast(studio), theme).toEqual([]);
    expect((await look(studio)).covered).toBeGreaterThan(0.1);
    await studio.keyboard.press('g');
    await rest(studio);
    expect(await contrast(studio), `${theme}, gallery`).toEqual([]);
    await studio.keyboard.press('Escape');
  }
});

test('the theme follows the system, and the choice is kept', async ({ page }) => {
  const wrong = watch(page);
  await page.emulateMedia({ colorScheme: 'dark' });
  await page.goto('./');
  await surface(page);
  await expect(page.locator('html')).toHaveAttribute('data-theme', 'dark');
  await page.emulateMedia({ colorScheme: 'light' });
  await expect(page.locator('html')).toHaveAttribute('data-theme', 'light');
  await page.getByRole('button', { name: 'Theme' }).click();
  await page.getByRole('menuitemradio', { name: 'Dark' }).click();
  await page.reload();
  await surface(page);
  await expect(page.locator('html')).toHaveAttribute('data-theme', 'dark');
  expect(wrong).toEqual([]);
});

test('a phone: sheets from below, a tap sets a pin, nothing sticks out', async ({ browser, baseURL }) => {
  const context = await browser.newContext({ baseURL: baseURL!, viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  const page = await context.newPage();
  const wrong = watch(page);
  await page.goto('./');
  await surface(page);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  expect(wide).toBeLessThanOrEqual(390);
  await page.getByRole('button', { name: 'Parameters', exact: true }).tap();
  await expect(page.getByRole('complementary', { name: 'Parameters' })).toBeVisible();
  await page.getByRole('button', { name: 'Parameters', exact: true }).tap();
  await expect(page.getByRole('complementary', { name: 'Parameters' })).toHaveCount(0);
  await page.getByRole('button', { name: 'Model', exact: true }).tap();
  await expect(page.getByRole('tree')).toBeVisible();
  await page.getByRole('button', { name: 'Model', exact: true }).tap();
  const view = (await page.locator('main.view').boundingBox())!;
  await page.touchscreen.tap(view.x + view.width / 2, view.y + view.height / 2 - 20);
  await expect(page.locator('button.pin')).toHaveCount(1);
  expect(wrong).toEqual([]);
  await context.close();
});

test('panels go away and come back', async ({ studio }) => {
  await studio.keyboard.press('\\');
  await expect(studio.getByRole('tree')).toHaveCount(0);
  await rest(studio);
  expect((await look(studio)).covered).toBeGreaterThan(0.05);
  await studio.keyboard.press('\\');
  await expect(studio.getByRole('tree')).toBeVisible();
});
