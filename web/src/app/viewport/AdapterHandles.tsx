/** The adapter that is on, as handles over the picture: arrows that move or stretch, rings that turn. */
import { signal } from '@preact/signals';
import { useRef } from 'preact/hooks';
import type { ParameterState, SceneState, Vec3 } from '../../client/protocol.ts';
import { setParameters } from '../state/actions.ts';
import { endGesture } from '../state/gesture.ts';
import { scene, values } from '../state/session.ts';
import { add, along, pixelAt } from './Pins.tsx';
import { placement } from './placement.ts';
import type { Stage } from './stage.ts';
import { drawn, stage } from './Viewport.tsx';

const UNIT: readonly Vec3[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];
const NAMES = ['x', 'y', 'z'];
/** Lengths in pixels. */
const ARM = 84;
const RING = 72;

export interface AdapterState {
  kind: string;
  path: string;
  /** The parameters that are the adapter's own, with their present values. */
  own: (ParameterState & { at: number })[];
  /** In the world, as are the directions of the part's axes. */
  centre: Vec3;
  directions: readonly Vec3[];
  axis: number;
}

/** The middle of the part that an adapter has been put on, in the part's coordinates. */
export const middle = signal<Vec3 | null>(null);

/** The adapter that is on. */
export function adapterOf(state: SceneState, values: Float64Array): AdapterState | null {
  const node = state.adapter && state.nodes.find(n => n.path === state.adapter!.path);
  if (!node) return null;
  const all = node.parameters.map(i => ({ ...state.parameters[i]!, at: values[i] ?? state.parameters[i]!.value }));
  const own = all.filter(p => !p.frozen && !p.discrete);
  const value = (name: string) => all.find(p => p.name === name)?.at;
  const [lo, hi] = state.bounds;
  const fallback = [0, 1, 2].map(a => (lo[a]! + hi[a]!) / 2) as Vec3;
  const [mx, my, mz] = middle.value ?? fallback;
  const fixed: Vec3 = [value('cx') ?? mx, value('cy') ?? my, value('cz') ?? mz];
  const local = node.kind === 'translate' ? add(fixed, own.map(p => p.at) as Vec3) : fixed;
  const place = placement(state, values, node);
  const centre = place(local);
  const directions = UNIT.map(u => unit(add(place(add(local, u)), centre, -1)));
  return { kind: node.kind, path: node.path, own, centre, directions, axis: value('axis') ?? 2 };
}

function unit(v: Vec3): Vec3 {
  const length = Math.hypot(...v) || 1;
  return v.map(c => c / length) as Vec3;
}

export function AdapterHandles() {
  drawn.value;
  const on = stage.value;
  const adapter = scene.value && adapterOf(scene.value, values.value);
  if (!on || !adapter || adapter.own.length > 3) return null;
  const { kind, own } = adapter;
  return (
    <svg class="overlay-handles adapter" aria-hidden="true">
      {own.map((p, i) => {
        const axis = own.length === 1 ? adapter.axis : i;
        const turns = kind.startsWith('rotate') || kind.startsWith('twist') || kind.startsWith('bend');
        const Part = turns ? Ring : Arrow;
        return <Part key={p.path} on={on} adapter={adapter} parameter={p} axis={axis} />;
      })}
    </svg>
  );
}

interface PartProps {
  on: Stage;
  adapter: AdapterState;
  parameter: AdapterState['own'][number];
  axis: number;
}

/** Follows a pointer: `change` says what the value is when it has moved by so much. */
function usePull(start: () => number, path: string, change: (from: number, dx: number, dy: number, x: number, y: number) => number) {
  const grip = useRef<{ x: number; y: number; from: number } | null>(null);
  const up = () => {
    if (grip.current) endGesture();
    grip.current = null;
  };
  return {
    onPointerDown: (event: PointerEvent) => {
      event.stopPropagation();
      (event.currentTarget as Element).setPointerCapture(event.pointerId);
      grip.current = { x: event.clientX, y: event.clientY, from: start() };
    },
    onPointerMove: (event: PointerEvent) => {
      const held = grip.current;
      if (!held) return;
      setParameters({ [path]: change(held.from, event.clientX - held.x, event.clientY - held.y, event.clientX, event.clientY) });
    },
    onPointerUp: up,
    onPointerCancel: up,
  };
}

function Arrow({ on, adapter, parameter, axis }: PartProps) {
  const direction = adapter.directions[axis]!;
  const arm = ARM * pixelAt(on, adapter.centre);
  const anchor = useRef(adapter.centre);
  const pull = usePull(
    () => {
      anchor.current = adapter.centre;
      return parameter.at;
    },
    parameter.path,
    (from, dx, dy) => {
      const moved = along(on, anchor.current, direction, dx, dy);
      if (adapter.kind === 'translate') return from + moved;
      if (adapter.kind.startsWith('scale')) return Math.max(0.02, from * (1 + moved / arm));
      return from + moved / (arm * (scene.value?.size ?? 1));
    },
  );
  const [x, y] = on.eye.toScreen(adapter.centre);
  const [ax, ay] = on.eye.toScreen(add(adapter.centre, direction, arm));
  const far = Math.hypot(ax - x, ay - y);
  if (far < 16) return null;
  const [ux, uy] = [(ax - x) / far, (ay - y) / far];
  const boxed = !(adapter.kind === 'translate');
  const head = `${ax + 8 * ux},${ay + 8 * uy} ${ax - 5 * ux - 6 * uy},${ay - 5 * uy + 6 * ux} ${ax - 5 * ux + 6 * uy},${ay - 5 * uy - 6 * ux}`;
  return (
    <g class={`axis axis-${NAMES[axis]}`} data-handle={parameter.name} {...pull}>
      <line class="grip" x1={x} y1={y} x2={ax} y2={ay} />
      <line x1={x} y1={y} x2={ax} y2={ay} />
      {boxed ? <rect x={ax - 5.5} y={ay - 5.5} width={11} height={11} rx={2} /> : <polygon points={head} />}
    </g>
  );
}

function Ring({ on, adapter, parameter, axis }: PartProps) {
  const radius = RING * pixelAt(on, adapter.centre);
  const [u, v] = [adapter.directions[(axis + 1) % 3]!, adapter.directions[(axis + 2) % 3]!];
  const points = Array.from({ length: 49 }, (_, i) => {
    const a = (i / 48) * 2 * Math.PI;
    const [x, y] = on.eye.toScreen(add(add(adapter.centre, u, radius * Math.cos(a)), v, radius * Math.sin(a)));
    return `${x.toFixed(1)},${y.toFixed(1)}`;
  }).join(' ');
  const [cx, cy] = on.eye.toScreen(adapter.centre);
  const sight = on.eye.camera.getWorldDirection(on.eye.controls.target.clone()).toArray();
  const towards = adapter.directions[axis]!.reduce((sum, d, a) => sum + d * sight[a]!, 0) > 0 ? 1 : -1;
  const turned = useRef({ last: 0, sum: 0 });
  const pull = usePull(
    () => {
      turned.current = { last: NaN, sum: 0 };
      return parameter.at;
    },
    parameter.path,
    (from, _dx, _dy, x, y) => {
      const now = Math.atan2(y - cy, x - cx);
      const t = turned.current;
      if (!Number.isNaN(t.last)) t.sum += Math.atan2(Math.sin(now - t.last), Math.cos(now - t.last));
      t.last = now;
      const rate = parameter.unit === 'angle' ? 1 : 2 / (scene.value?.size ?? 1);
      return from + towards * t.sum * rate;
    },
  );
  return (
    <g class={`axis axis-${NAMES[axis]}`} data-handle={parameter.name} {...pull}>
      <polyline class="grip" points={points} />
      <polyline points={points} />
    </g>
  );
}
