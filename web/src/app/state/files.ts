/** Scenes come in: from the gallery, files, drops, formulas; and go out as `.iso.json`. */
import type { Source } from '../../client/protocol.ts';
import { download, fileName } from './exports.ts';
import { ask, complain, open as openSource, title } from './session.ts';
import { dialog, say } from './ui.ts';

/** Larger files are not read. */
const MOST_BYTES = 32e6;

let last: { source: Source; name: string } | null = null;

/** Opens a scene and remembers how to open it again. */
export async function open(source: Source, name: string): Promise<boolean> {
  const done = await openSource(source, name);
  if (done) last = { source, name };
  return done;
}

/** As the scene was when it was opened. */
open.again = async (): Promise<void> => {
  if (!last) return;
  const before = await ask('save', {}).catch(() => null);
  const name = title.value;
  if (!(await openSource(last.source, name)) || !before) return;
  say('The scene is as it was when it was opened.', {
    action: { label: 'Go back', run: () => void openSource({ text: before.scene }, name) },
  });
};

const withoutEnding = (name: string) => name.replace(/\.(iso\.)?(json|txt|iso)$/i, '');

export async function openFile(file: File): Promise<void> {
  if (file.size > MOST_BYTES) {
    say(`${file.name} has ${Math.round(file.size / 1e6)} MB; the Studio opens files up to 32 MB.`, { tone: 'warn' });
    return;
  }
  try {
    const text = await file.text();
    if (await open({ text }, withoutEnding(file.name))) {
      dialog.value = null;
      say(`${file.name} is open.`);
    }
  } catch (error) {
    complain(error);
  }
}

export async function saveFile(): Promise<void> {
  try {
    const { scene } = await ask('save', {});
    download(scene, 'iso.json');
    say(`${fileName('iso.json')} is in your downloads.`, { tone: 'good' });
  } catch (error) {
    complain(error);
  }
}
