import { copyFileSync } from 'node:fs';
import { defineConfig } from 'rolldown';

/** Files that lie elsewhere in the sources than in the package. */
const PLACES = [
  ["'./worker.ts'", "'./worker.js'"],
  ["'../../wasm/pkg/core_bg.wasm'", "'./core.wasm'"],
  ["'../../wasm/pkg/full_bg.wasm'", "'./full.wasm'"],
];

/** The npm package: dist/client. */
export default defineConfig({
  input: {
    index: 'src/client/index.ts',
    worker: 'src/client/worker.ts',
    node: 'src/client/node.ts',
    'node-worker': 'src/client/node-worker.ts',
  },
  platform: 'neutral',
  external: /^node:/,
  output: { dir: 'dist/client', format: 'es', chunkFileNames: '[name].js', minify: false },
  plugins: [
    {
      name: 'places',
      transform(code, id) {
        if (!id.includes('/src/client/')) return null;
        return { code: PLACES.reduce((text, [from, to]) => text.replaceAll(from, to), code), map: null };
      },
      writeBundle() {
        for (const name of ['core', 'full']) copyFileSync(`wasm/pkg/${name}_bg.wasm`, `dist/client/${name}.wasm`);
      },
    },
  ],
});
