/** The same where one file holds everything: a notebook's widget. */
import { browserTransport } from './browser.js';
import type { Transport } from './link.js';
import InlineWorker from './worker.ts?worker&inline';
import inlined from '../../wasm/pkg/full_bg.wasm?url&inline';

export function spawn(): Transport {
  return browserTransport(new InlineWorker());
}

export async function wasm(): Promise<WebAssembly.Module> {
  const text = atob(inlined.slice(inlined.indexOf(',') + 1));
  return WebAssembly.compile(Uint8Array.from(text, c => c.charCodeAt(0)));
}
