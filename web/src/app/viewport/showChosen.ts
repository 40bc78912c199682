/** Shows what is chosen: pins, else a part of the model, else all. */
import type { Vec3 } from '../../client/protocol.ts';
import { ask, pins, scene, values } from '../state/session.ts';
import { chosen, chosenPins } from '../state/ui.ts';
import { placement } from './placement.ts';
import { stage } from './Viewport.tsx';

/** How near pins are looked at, as a part of the surface's size. */
const AROUND_PINS = 0.12;

export async function showChosen(): Promise<void> {
  const on = stage.value;
  const state = scene.value;
  if (!on || !state) return;
  const held = pins.value.filter(p => chosenPins.value.has(p.id)).map(p => p.at);
  const points = held.length > 0 ? held : await corners();
  if (points.length === 0) return on.fit();
  const { centre, radius } = ball(points);
  on.fitAround(centre, Math.max(radius, held.length > 0 ? AROUND_PINS * state.size : 0.5 * state.spacing));
}

/** Corners of the box around the chosen part, in the world; none where it has no box. */
async function corners(): Promise<Vec3[]> {
  const state = scene.value;
  const node = state?.nodes.find(n => n.path === chosen.value);
  if (!state || !node || node.parent < 0) return [];
  const box = await ask('box', { path: node.path }).catch(() => null);
  if (!box) return [];
  const place = placement(state, values.value, node);
  return Array.from({ length: 8 }, (_, k) => place([0, 1, 2].map(a => box[(k >> a) & 1]![a]!) as Vec3));
}

function ball(points: readonly Vec3[]): { centre: Vec3; radius: number } {
  const span = [0, 1, 2].map(a => {
    const all = points.map(p => p[a]!);
    return [Math.min(...all), Math.max(...all)] as const;
  });
  const centre = span.map(([lo, hi]) => (lo + hi) / 2) as Vec3;
  const radius = Math.max(...points.map(p => Math.hypot(...p.map((v, a) => v - centre[a]!))));
  return { centre, radius };
}
