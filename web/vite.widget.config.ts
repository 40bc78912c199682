import { fileURLToPath } from 'node:url';
import { build, defineConfig, type Plugin, type Rolldown } from 'vite';
import studio from './vite.config.ts';

const path = (name: string) => fileURLToPath(new URL(name, import.meta.url));

/** The Studio as one HTML text, with its script, styles, worker and WebAssembly inside. */
async function wholeStudio(): Promise<string> {
  const result = (await build({
    ...studio,
    configFile: false,
    logLevel: 'warn',
    resolve: { alias: [{ find: /^\.\/places\.js$/, replacement: path('src/client/places-inline.ts') }] },
    build: {
      ...studio.build,
      write: false,
      assetsInlineLimit: () => true,
      cssCodeSplit: false,
      modulePreload: false,
      rolldownOptions: { output: { codeSplitting: false } },
    },
  })) as Rolldown.RolldownOutput;
  let html = '';
  const texts = new Map<string, string>();
  for (const part of result.output) {
    if (part.type === 'chunk') texts.set(part.fileName, part.code);
    else if (part.fileName.endsWith('.html')) html = String(part.source);
    else texts.set(part.fileName, String(part.source));
  }
  const text = (name: string) => texts.get(name.replace(/^\.\//, '')) ?? '';
  return html
    .replace(/<link rel="stylesheet"[^>]*href="([^"]+)"[^>]*>/g, (_, name: string) => `<style>${text(name)}</style>`)
    .replace(
      /<script type="module"[^>]*src="([^"]+)"[^>]*><\/script>/g,
      (_, name: string) => `<script type="module">${text(name).replaceAll('</script', '<\\/script')}</script>`,
    );
}

const embedStudio: Plugin = {
  name: 'studio',
  resolveId: id => (id === 'virtual:studio' ? `\0${id}` : null),
  load: async id => (id === '\0virtual:studio' ? `export default ${JSON.stringify(await wholeStudio())};` : null),
};

/** The notebook's widget: one ES module, dist/widget/widget.js. */
export default defineConfig({
  plugins: [embedStudio],
  build: {
    outDir: 'dist/widget',
    target: 'es2022',
    lib: { entry: path('src/widget/widget.ts'), formats: ['es'], fileName: () => 'widget.js' },
  },
});
