import { defineConfig } from 'vite';

/** The Studio as static files for any host: `dist/studio`. */
export default defineConfig({
  base: './',
  oxc: { jsx: { runtime: 'automatic', importSource: 'preact' } },
  // The gallery reads models/ of the repository.
  server: { fs: { allow: ['..'] } },
  build: { outDir: 'dist/studio', target: 'es2022', chunkSizeWarningLimit: 1200 },
  worker: { format: 'es' },
  preview: { host: '127.0.0.1', port: 4173 },
});
