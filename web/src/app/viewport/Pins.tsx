/** Pins over the picture: buttons that can be dragged, and reached and moved with the keyboard. */
import { useRef, useState } from 'preact/hooks';
import type { PinState, Vec3 } from '../../client/protocol.ts';
import { deletePins } from '../state/actions.ts';
import { drag, frame, hands, pins, release } from '../state/session.ts';
import { chosenPins, lockedPins, say, toggle } from '../state/ui.ts';
import { isHidden } from './occlusion.ts';
import type { Stage } from './stage.ts';
import { drawn, stage } from './Viewport.tsx';

const AXES: readonly { name: string; of: Vec3 }[] = [
  { name: 'x', of: [1, 0, 0] },
  { name: 'y', of: [0, 1, 0] },
  { name: 'z', of: [0, 0, 1] },
];

/** Length of an axis handle, in pixels. */
const HANDLE = 58;

export const add = (a: Vec3, b: Vec3, t = 1): Vec3 => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];
const minus = (a: Vec3, b: Vec3): Vec3 => add(a, b, -1);
const length = (a: Vec3) => Math.hypot(...a);

/** Model units of a pixel at a point. */
export function pixelAt(on: Stage, p: Vec3): number {
  const [x, y] = on.eye.toScreen(p);
  return length(minus(on.eye.onViewPlane(x + 10, y, p), p)) / 10;
}

/** How far along an axis through a point a pointer has moved. */
export function along(on: Stage, at: Vec3, axis: Vec3, dx: number, dy: number): number {
  const unit = 50 * pixelAt(on, at);
  const [x0, y0] = on.eye.toScreen(at);
  const [x1, y1] = on.eye.toScreen(add(at, axis, unit));
  const [ux, uy] = [x1 - x0, y1 - y0];
  const square = ux * ux + uy * uy;
  return square < 16 ? 0 : (unit * (dx * ux + dy * uy)) / square;
}

export function Pins() {
  drawn.value;
  const on = stage.value;
  const now = frame.value;
  if (!on || !now || pins.value.length === 0) return null;
  const eye = on.eye.camera.position.toArray();
  const chosen = pins.value.filter(p => chosenPins.value.has(p.id));
  const only = chosen.length === 1 && !lockedPins.value.has(chosen[0]!.id) ? chosen[0]! : null;
  return (
    <div class="overlay" role="group" aria-label="Pins">
      <svg class="overlay-lines" aria-hidden="true">
        {pins.value.map(p => (
          <Reach key={p.id} on={on} pin={p} />
        ))}
      </svg>
      {only && <AxisHandles on={on} pin={only} />}
      {pins.value.map(p => (
        <Handle key={p.id} on={on} pin={p} hidden={isHidden(now, p.at, eye)} />
      ))}
    </div>
  );
}

/** The line to the hand where the pin lags behind, and an arrow along which it has slipped over the surface. */
function Reach({ on, pin }: { on: Stage; pin: PinState }) {
  const hand = hands.value.find(h => h.pin === pin.id);
  const [x, y] = on.eye.toScreen(pin.at);
  const lines = [];
  if (hand) {
    const [hx, hy] = on.eye.toScreen(hand.to);
    if (Math.hypot(hx - x, hy - y) > 6) {
      lines.push(<line class="reach" x1={x} y1={y} x2={hx} y2={hy} />, <circle class="reach-end" cx={hx} cy={hy} r={4} />);
    }
  }
  if (pin.slip && length(pin.slip) > 1e-2 * (frame.value?.size ?? 1)) {
    const [sx, sy] = on.eye.toScreen(minus(pin.at, pin.slip));
    const far = Math.hypot(sx - x, sy - y);
    if (far > 24) {
      const [ux, uy] = [(x - sx) / far, (y - sy) / far];
      const [ex, ey] = [x - 13 * ux, y - 13 * uy];
      const head = `${ex},${ey} ${ex - 8 * ux - 4.5 * uy},${ey - 8 * uy + 4.5 * ux} ${ex - 8 * ux + 4.5 * uy},${ey - 8 * uy - 4.5 * ux}`;
      lines.push(<line class="slip" x1={sx} y1={sy} x2={ex - 6 * ux} y2={ey - 6 * uy} />, <polygon class="slip-head" points={head} />);
    }
  }
  return <>{lines}</>;
}

interface Grip {
  x: number;
  y: number;
  /** Where each pin that is moved was. */
  from: Map<number, Vec3>;
  axis: Vec3 | null;
  moved: boolean;
}

/** Pins that move with this one: all that are chosen, unless locked. */
function moving(pin: PinState): PinState[] {
  const together = chosenPins.value.has(pin.id) ? pins.value.filter(p => chosenPins.value.has(p.id)) : [pin];
  return together.filter(p => !lockedPins.value.has(p.id));
}

function useDrag(on: Stage, pin: PinState, axis: Vec3 | null) {
  const grip = useRef<Grip | null>(null);
  const down = (event: PointerEvent) => {
    if (event.button !== 0) return;
    event.stopPropagation();
    (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
    const wasChosen = chosenPins.value.has(pin.id);
    if (event.shiftKey && !axis) chosenPins.value = toggle(chosenPins.value, pin.id);
    else if (!wasChosen) chosenPins.value = new Set([pin.id]);
    const from = new Map(moving(pin).map(p => [p.id, p.at] as const));
    grip.current = { x: event.clientX, y: event.clientY, from, axis, moved: false };
  };
  const move = (event: PointerEvent) => {
    const held = grip.current;
    if (!held) return;
    const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
    if (!held.moved && Math.hypot(dx, dy) < 4) return;
    if (!held.moved && held.from.size === 0) {
      grip.current = null;
      say('This pin is locked: unlock it in the list of pins to move it.');
      return;
    }
    held.moved = true;
    const start = held.from.get(pin.id) ?? pin.at;
    let by: Vec3;
    if (held.axis) {
      by = add([0, 0, 0], held.axis, along(on, start, held.axis, dx, dy));
    } else {
      const [x, y] = on.eye.toScreen(start);
      by = minus(on.eye.onViewPlane(x + dx, y + dy, start), start);
      if (event.shiftKey) by = strongest(by);
    }
    drag([...held.from].map(([id, at]) => ({ pin: id, to: add(at, by) })));
  };
  const up = () => {
    const held = grip.current;
    grip.current = null;
    if (held?.moved) void release();
  };
  return { onPointerDown: down, onPointerMove: move, onPointerUp: up, onPointerCancel: up };
}

/** Only the largest component: Shift keeps to an axis. */
function strongest(by: Vec3): Vec3 {
  const k = by.map(Math.abs).indexOf(Math.max(...by.map(Math.abs)));
  return by.map((v, i) => (i === k ? v : 0)) as Vec3;
}

function Handle({ on, pin, hidden }: { on: Stage; pin: PinState; hidden: boolean }) {
  const [x, y, depth] = on.eye.toScreen(pin.at);
  const locked = lockedPins.value.has(pin.id);
  const chosen = chosenPins.value.has(pin.id);
  const handlers = useDrag(on, pin, null);
  const [nudged, setNudged] = useState<Vec3 | null>(null);
  if (depth > 1) return null;

  const key = (event: KeyboardEvent) => {
    const by = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] }[event.key];
    if (event.key === 'Delete' || event.key === 'Backspace') {
      event.stopPropagation();
      void deletePins(chosen ? [...chosenPins.value] : [pin.id]);
    } else if (by && !locked) {
      event.preventDefault();
      event.stopPropagation();
      const from = nudged ?? pin.at;
      const [sx, sy] = on.eye.toScreen(from);
      const step = event.altKey ? 0.2 : 1;
      const to = on.eye.onViewPlane(sx + step * by[0]!, sy + step * by[1]!, from);
      setNudged(to);
      drag([{ pin: pin.id, to }]);
    } else if (event.key === 'Enter' || event.key === ' ') {
      event.preventDefault();
      event.stopPropagation();
      chosenPins.value = event.shiftKey ? toggle(chosenPins.value, pin.id) : new Set([pin.id]);
    }
  };
  const letGo = () => {
    if (!nudged) return;
    setNudged(null);
    void release();
  };
  const name = pin.name ?? `Pin ${pin.id + 1}`;
  const classes = ['pin', chosen && 'chosen', hidden && 'behind', locked && 'locked', pin.held && 'held'].filter(Boolean).join(' ');
  return (
    <button
      type="button"
      class={classes}
      style={{ transform: `translate(${x}px, ${y}px)` }}
      aria-label={`${name}${locked ? ', locked' : ''}: arrow keys move it, Delete removes it`}
      aria-pressed={chosen}
      title={name}
      onKeyDown={key}
      onKeyUp={letGo}
      onBlur={letGo}
      {...handlers}
    />
  );
}

function AxisHandles({ on, pin }: { on: Stage; pin: PinState }) {
  return (
    <svg class="overlay-handles" aria-hidden="true">
      {AXES.map(a => (
        <AxisHandle key={a.name} on={on} pin={pin} axis={a} />
      ))}
    </svg>
  );
}

function AxisHandle({ on, pin, axis }: { on: Stage; pin: PinState; axis: { name: string; of: Vec3 } }) {
  const handlers = useDrag(on, pin, axis.of);
  const [x, y] = on.eye.toScreen(pin.at);
  const [ax, ay] = on.eye.toScreen(add(pin.at, axis.of, HANDLE * pixelAt(on, pin.at)));
  const far = Math.hypot(ax - x, ay - y);
  if (far < 14) return null;
  const [ux, uy] = [(ax - x) / far, (ay - y) / far];
  const head = `${ax + 5 * ux},${ay + 5 * uy} ${ax - 5 * ux - 4.5 * uy},${ay - 5 * uy + 4.5 * ux} ${ax - 5 * ux + 4.5 * uy},${ay - 5 * uy - 4.5 * ux}`;
  return (
    <g class={`axis axis-${axis.name}`} {...handlers}>
      <line class="grip" x1={x + 10 * ux} y1={y + 10 * uy} x2={ax} y2={ay} />
      <line x1={x + 10 * ux} y1={y + 10 * uy} x2={ax} y2={ay} />
      <polygon points={head} />
    </g>
  );
}
