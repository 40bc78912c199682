/** The same in Node, with a worker thread: for scripts and tests. */
import { existsSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';
import { Worker, type TransferListItem } from 'node:worker_threads';
import { Client, type ConnectOptions } from './client.js';
import type { Transport } from './link.js';

export * from './exports.js';

/** A worker thread as a transport. */
export function nodeTransport(worker: Worker): Transport {
  return {
    post: (message, transfer) => worker.postMessage(message, transfer as TransferListItem[]),
    listen: (message, ended) => {
      worker.on('message', message);
      worker.on('error', error => ended(`The worker ended: ${error.message}`));
      worker.on('exit', code => ended(`The worker ended with code ${code}.`));
    },
    terminate: () => void worker.terminate(),
  };
}

/** The first of the files beside this one that is there. */
function beside(...names: string[]): URL {
  const urls = names.map(name => new URL(name, import.meta.url));
  return urls.find(url => existsSync(fileURLToPath(url))) ?? urls[0]!;
}

/** A client whose worker and module lie beside this file. */
export async function connect(options: Partial<ConnectOptions> = {}): Promise<Client> {
  const compile = async (file: URL) => WebAssembly.compile(await readFile(file));
  const full = () => compile(beside('./full.wasm', '../../wasm/pkg/full_bg.wasm'));
  const wasm = options.wasm ?? { core: await compile(beside('./core.wasm', '../../wasm/pkg/core_bg.wasm')), full };
  const spawn = () => nodeTransport(new Worker(beside('./node-worker.js')));
  const client = new Client({ spawn, ...options, wasm });
  await client.version;
  return client;
}
