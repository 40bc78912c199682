/** What the page begins with: a shared link, else what was kept last, else a scene of the gallery. */
import type { GalleryScene } from '../gallery/scenes.ts';
import { lastScene } from './autosave.ts';
import { open } from './files.ts';
import { decode, isShared } from './share.ts';
import { dialog, say } from './ui.ts';
import { complain } from './session.ts';

export async function beginning(first: GalleryScene): Promise<void> {
  if (isShared(location.hash) && (await openShared())) return;
  const kept = await lastScene();
  if (kept && (await open({ text: kept.scene }, kept.title))) return;
  try {
    await open(await first.source(), first.title);
  } catch (error) {
    complain(error);
  }
}

async function openShared(): Promise<boolean> {
  try {
    const shared = decode(location.hash);
    return await open({ text: shared.scene }, shared.title);
  } catch (error) {
    say((error as Error).message, { tone: 'warn', action: { label: 'Open the gallery', run: () => (dialog.value = 'gallery') } });
    return false;
  } finally {
    // The address is not the scene's any more once it is changed.
    history.replaceState(null, '', location.pathname + location.search);
  }
}
