import { effect, untracked } from '@preact/signals';
import { alive, ask, complain, frame, scene } from '../state/session.ts';
import { withBar } from '../state/jobs.ts';
import { setView, view } from '../state/view.ts';
import type { Stage } from './stage.ts';

/** Milliseconds between meshes of a surface that moves. */
const EACH = 400;
/** A mesh that takes longer than this shows a bar. */
const LONG = 700;

/** Keeps the stage's mesh that of the surface, as long as the mesh is shown. Returns what stops it. */
export function liveMesh(stage: Stage): () => void {
  let shown = -1;
  let busy = false;
  let timer = 0;

  const refresh = async () => {
    const clock = frame.value?.clock ?? -1;
    if (busy || !scene.value || view.value.mode !== 'mesh' || clock === shown) return;
    busy = true;
    try {
      const mesh = await withBar('Making the mesh', options => ask('mesh', {}, options), LONG);
      shown = clock;
      stage.setMesh(mesh, view.value);
    } catch (error) {
      setView({ mode: 'discs' });
      complain(error);
    } finally {
      busy = false;
    }
    if (frame.value && frame.value.clock !== shown) later();
  };
  const later = () => {
    clearTimeout(timer);
    timer = window.setTimeout(refresh, alive.value ? EACH : 0);
  };
  const stop = effect(() => {
    frame.value;
    scene.value;
    if (view.value.mode === 'mesh') untracked(() => !busy && later());
  });
  return () => {
    stop();
    clearTimeout(timer);
  };
}
