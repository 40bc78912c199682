/** Draws thumbnails that the gallery lacks: `THUMBNAILS=1 npx playwright test thumbnails`, then build again. */
import { existsSync, writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { expect, fromGallery, test } from './studio.ts';

const folder = fileURLToPath(new URL('../../src/app/gallery/', import.meta.url));

test('thumbnails', async ({ studio }) => {
  test.setTimeout(600_000);
  await studio.setViewportSize({ width: 800, height: 600 });
  await studio.keyboard.press('g');
  const cards = await studio.locator('.card').evaluateAll(all => all.map(c => ({ id: c.getAttribute('data-scene')!, title: c.querySelector('strong')!.textContent! })));
  await studio.keyboard.press('Escape');
  await studio.keyboard.press('\\');
  await studio.addStyleTag({
    content: 'html, body, .stage { background: transparent !important } .studio > :not(main, dialog), main > :not(canvas), .overlay { visibility: hidden !important }',
  });
  // Nothing moves: scenes open with floaters that lie evenly.
  await studio.keyboard.press(' ');
  for (const { id, title } of cards) {
    if (existsSync(`${folder}${id}.webp`)) continue;
    await fromGallery(studio, title);
    await studio.keyboard.press('f');
    await studio.waitForTimeout(2000);
    const png = (await studio.screenshot({ omitBackground: true })).toString('base64');
    const webp = await studio.evaluate(async data => {
      const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
      const canvas = new OffscreenCanvas(352, 264);
      const context = canvas.getContext('2d')!;
      context.imageSmoothingQuality = 'high';
      context.drawImage(image, 0, 0, 352, 264);
      const blob = await canvas.convertToBlob({ type: 'image/webp', quality: 0.82 });
      return btoa(String.fromCharCode(...new Uint8Array(await blob.arrayBuffer())));
    }, png);
    const bytes = Buffer.from(webp, 'base64');
    expect(bytes.length).toBeGreaterThan(600);
    writeFileSync(`${folder}${id}.webp`, bytes);
  }
});
