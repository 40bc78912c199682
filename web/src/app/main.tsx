import './styles/index.css';
import { effect } from '@preact/signals';
import { render } from 'preact';
import { connect } from '../client/index.ts';
import { embed, isEmbedded } from '../widget/embedded.ts';
import { App } from './App.tsx';
import { first } from './gallery/scenes.ts';
import { startAutosave } from './state/autosave.ts';
import { beginning } from './state/beginning.ts';
import { open } from './state/files.ts';
import { apply, ask, connectTo, kinds, title } from './state/session.ts';
import { listenForKeys } from './state/shortcuts.ts';
import { say } from './state/ui.ts';

async function start(): Promise<void> {
  const client = connect();
  const root = document.getElementById('app')!;
  root.replaceChildren();
  render(<App />, root);
  listenForKeys();
  effect(() => {
    document.title = `${title.value} – isoswarm Studio`;
  });
  const core = await client;
  connectTo(core);
  if (isEmbedded()) {
    await embed(core, { open: text => open({ text }, 'Notebook'), apply });
  } else {
    startAutosave();
    await beginning(first);
  }
  kinds.value = await ask('kinds', {});
}

start().catch((error: unknown) => {
  say(`The Studio could not start: ${error instanceof Error ? error.message : String(error)}. It needs WebAssembly with SIMD.`, {
    tone: 'warn',
    action: { label: 'Try again', run: () => location.reload() },
  });
});
