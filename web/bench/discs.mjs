/** Frames of 20,000 discs at 900 x 700 under software WebGL: elapsed time, and processor time for machines that are busy. */
import { readdirSync, readFileSync } from 'node:fs';
import { chromium } from '@playwright/test';
import { createServer } from 'vite';

const FRAMES = 30;

/** Processor time of a process and all its descendants so far (ms); NaN where the system does not tell. */
function spent(root) {
  const children = new Map();
  const time = new Map();
  for (const pid of readdirSync('/proc').filter(name => /^\d+$/.test(name))) {
    try {
      const stat = readFileSync(`/proc/${pid}/stat`, 'utf8');
      const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ');
      children.set(fields[1], [...(children.get(fields[1]) ?? []), pid]);
      time.set(pid, 10 * (Number(fields[11]) + Number(fields[12])));
    } catch {
      // It has ended meanwhile.
    }
  }
  const sum = pid => (time.get(pid) ?? 0) + (children.get(pid) ?? []).reduce((s, child) => s + sum(child), 0);
  return sum(String(root)) - (time.get(String(root)) ?? 0);
}

const median = values => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

export async function discs(root, picture) {
  const server = await createServer({ root, logLevel: 'error', server: { host: '127.0.0.1', port: 0 } });
  await server.listen();
  const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });
  const page = await browser.newPage({ viewport: { width: 900, height: 700 } });
  page.on('pageerror', error => console.error(error));
  await page.goto(`http://127.0.0.1:${server.httpServer.address().port}/bench/discs.html`);
  await page.waitForFunction(() => window.ready, null, { timeout: 120_000 });
  const found = {};
  for (const [name, all] of [['moving', false], ['resting', true]]) {
    await page.evaluate(all => [0, 1, 2].map(k => window.draw(k, all)), all);
    const before = spent(process.pid);
    const times = await page.evaluate(([n, all]) => Array.from({ length: n }, (_, k) => window.draw(k, all)), [FRAMES, all]);
    found[name] = { elapsed: median(times), processor: (spent(process.pid) - before) / FRAMES };
  }
  if (picture) await page.screenshot({ path: picture });
  await browser.close();
  await server.close();
  return found;
}

if (process.argv[1] === import.meta.filename) console.log(await discs(new URL('..', import.meta.url).pathname, process.argv[2]));
