/** Figures of the core in headless Chromium: `npm run bench`. Prints JSON with --json. */
import { createReadStream, existsSync, readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync, gzipSync } from 'node:zlib';
import { chromium } from '@playwright/test';
import { discs } from './discs.mjs';

const root = fileURLToPath(new URL('..', import.meta.url));
const types = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const server = createServer((request, response) => {
  const file = join(root, normalize(new URL(request.url, 'http://localhost').pathname));
  if (!file.startsWith(root) || !existsSync(file)) return response.writeHead(404).end();
  response.writeHead(200, { 'Content-Type': types[extname(file)] ?? 'application/octet-stream' });
  createReadStream(file).pipe(response);
});
await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
const address = `http://127.0.0.1:${server.address().port}/bench/measure.html`;

const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });
const page = await browser.newPage();
page.on('pageerror', error => console.error(error));
await page.goto(address);
await page.waitForFunction(() => 'figures' in window);
const found = await page.evaluate(() => window.figures());

/** Milliseconds from the address to the first floaters in the picture, with files and compiled code in the cache. */
async function pageLoad() {
  const place = `${address.replace('/bench/measure.html', '/dist/studio/index.html')}`;
  const context = await browser.newContext({ viewport: { width: 900, height: 700 } });
  const times = [];
  for (let k = 0; k < 4; k++) {
    const tab = await context.newPage();
    const start = performance.now();
    await tab.goto(place);
    await tab.waitForFunction(() => Number(document.querySelector('canvas.stage')?.dataset.floaters) > 20, null, { polling: 'raf' });
    times.push(performance.now() - start);
    await tab.close();
  }
  await context.close();
  return Math.min(...times.slice(1));
}
if (existsSync(join(root, 'dist/studio/index.html'))) found.page = await pageLoad();
await browser.close();
server.close();
found.discs = await discs(root);

const sizeOf = name => {
  const wasm = readFileSync(join(root, `wasm/pkg/${name}_bg.wasm`));
  return { raw: wasm.length, gzip: gzipSync(wasm, { level: 9 }).length, brotli: brotliCompressSync(wasm).length };
};
const size = sizeOf('core');
const full = sizeOf('full');
const inKb = ({ gzip, brotli }) => `${(gzip / 1024).toFixed(0)} KB gzip, ${(brotli / 1024).toFixed(0)} KB brotli`;
if (process.argv.includes('--json')) console.log(JSON.stringify({ ...found, size, full }, null, 2));
else {
  const rows = [
    ['whole step, 16 blobs, 20,000 floaters', `${found.steps20.rate.toFixed(0)} steps/s (${found.steps20.floaters} floaters)`, '≥ 60'],
    ['whole step, 16 blobs, 50,000 floaters', `${found.steps50.rate.toFixed(0)} steps/s (${found.steps50.floaters} floaters)`, '(40)'],
    ['hand to moved surface, 5,000 floaters', `${found.drag5.median.toFixed(1)} ms median, ${found.drag5.worst.toFixed(1)} worst`, '≤ 50 ms (25)'],
    ['core loaded, then first floaters (4,000), warm', `${found.warm.load.toFixed(0)} ms, ${found.warm.discs.toFixed(0)} ms`, '≤ 1500 ms (700)'],
    ['the Studio, to first discs, warm', found.page ? `${found.page.toFixed(0)} ms` : 'not built', '≤ 1500 ms (700)'],
    ['frame, software WebGL, 20,000 discs, 900 x 700', `${found.discs.moving.elapsed.toFixed(1)} ms (processor ${found.discs.moving.processor.toFixed(1)}); at rest, both sides ${found.discs.resting.elapsed.toFixed(1)} ms`, '≤ 20 ms'],
    ['module that a page starts with', inKb(size), '≤ 400 KB (200)'],
    ['module with meshes and files, when they are needed', inKb(full), ''],
  ];
  for (const row of rows) console.log(row.join('  |  '));
}
