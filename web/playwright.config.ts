import { existsSync } from 'node:fs';
import { defineConfig } from '@playwright/test';

const port = Number(process.env.STUDIO_PORT ?? 4183);
const chromium = process.env.CHROMIUM ?? '/usr/bin/chromium';

/** The built page in Debian's Chromium: `npx vite build` first. */
export default defineConfig({
  testDir: 'tests',
  testMatch: ['page/**/*.spec.ts', 'widget/**/*.spec.ts'],
  // No test: it draws pictures of the gallery's scenes anew.
  testIgnore: process.env.THUMBNAILS ? [] : ['**/thumbnails.spec.ts'],
  outputDir: '../build/page-tests',
  workers: 1,
  // On a machine that does other things, too.
  timeout: 120_000,
  forbidOnly: true,
  reporter: [['line']],
  expect: { timeout: 20_000, toHaveScreenshot: { maxDiffPixelRatio: 0.02 } },
  use: {
    baseURL: `http://127.0.0.1:${port}/`,
    viewport: { width: 1440, height: 900 },
    launchOptions: {
      ...(existsSync(chromium) ? { executablePath: chromium } : {}),
      args: [
        '--no-sandbox',
        '--disable-quic',
        '--no-first-run',
        '--disable-background-networking',
        '--disable-component-update',
        '--disable-sync',
        '--use-angle=swiftshader',
        '--enable-unsafe-swiftshader',
      ],
    },
  },
  webServer: {
    command: `npx vite preview --port ${port} --strictPort`,
    url: `http://127.0.0.1:${port}/`,
    reuseExistingServer: false,
    timeout: 120_000,
  },
});
