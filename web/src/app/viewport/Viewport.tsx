import { effect, signal, untracked } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { alive, ask, complain, frame, opening, scene, working } from '../state/session.ts';
import { setPin } from '../state/actions.ts';
import { chosenPins, say, sheet, tool } from '../state/ui.ts';
import { dark, section, view } from '../state/view.ts';
import { AdapterHandles } from './AdapterHandles.tsx';
import { AxisGizmo } from './AxisGizmo.tsx';
import { Legend } from './Legend.tsx';
import { Pins } from './Pins.tsx';
import { insets } from './insets.ts';
import { liveMesh } from './liveMesh.ts';
import { Stage } from './stage.ts';

/** The picture, once there is one. */
export const stage = signal<Stage | null>(null);
/** Counts pictures: what is drawn over them follows. */
export const drawn = signal(0);
const trouble = signal<'none' | 'no webgl' | 'lost'>('none');

/** A press that moves farther than this, in pixels, is no click. */
const CLICK = 5;

export function Viewport() {
  const canvas = useRef<HTMLCanvasElement>(null);
  const fitted = useRef<unknown>(null);

  useEffect(() => {
    let made: Stage;
    try {
      made = new Stage(canvas.current!);
    } catch {
      trouble.value = 'no webgl';
      return;
    }
    made.onDraw = () => drawn.value++;
    made.onLost = lost => {
      trouble.value = lost ? 'lost' : 'none';
    };
    stage.value = made;
    const resize = () => made.resize(innerWidth, innerHeight, insets());
    const observer = new ResizeObserver(resize);
    observer.observe(document.documentElement);
    const effects = [
      effect(() => {
        view.value;
        sheet.value;
        untracked(resize);
      }),
      effect(() => made.look(view.value, section.value, dark.value, scene.value?.axes === 2)),
      effect(() => {
        const now = frame.value;
        if (!now) return;
        made.setFrame(now, view.value);
        const key = untracked(() => opening.value);
        if (fitted.current === key) return;
        fitted.current = key;
        made.fit(scene.value?.axes === 2 ? [0, -0.001, 1] : [2.2, -3, 1.7]);
      }),
      effect(() => made.setMoving(alive.value)),
      liveMesh(made),
    ];
    return () => {
      for (const stop of effects) stop();
      observer.disconnect();
      made.dispose();
      stage.value = null;
    };
  }, []);

  const press = useRef<[number, number] | null>(null);
  const down = (event: PointerEvent) => {
    press.current = event.isPrimary && event.button === 0 ? [event.clientX, event.clientY] : null;
  };
  const up = (event: PointerEvent) => {
    const from = press.current;
    press.current = null;
    if (!from || Math.hypot(event.clientX - from[0], event.clientY - from[1]) > CLICK) return;
    void click(event.clientX, event.clientY);
  };

  return (
    <>
      <canvas
        ref={canvas}
        class={tool.value === 'pin' ? 'stage pinning' : 'stage'}
        role="img"
        aria-label={description()}
        data-floaters={frame.value?.count ?? 0}
        data-moving={alive.value || working.value > 0}
        onPointerDown={down}
        onPointerUp={up}
        onDblClick={event => event.preventDefault()}
      />
      {trouble.value === 'none' ? (
        <>
          <Pins />
          <AdapterHandles />
          <AxisGizmo />
          <Legend />
        </>
      ) : (
        <Trouble lost={trouble.value === 'lost'} />
      )}
    </>
  );
}

function description(): string {
  const count = frame.value?.count ?? 0;
  return count === 0 ? 'The surface is being covered with discs' : `A surface covered with ${count.toLocaleString('en')} discs`;
}

function Trouble({ lost }: { lost: boolean }) {
  return (
    <div class="trouble" role="alert">
      <h2>{lost ? 'The graphics card has dropped the picture' : 'This browser cannot draw the surface'}</h2>
      <p>
        {lost
          ? 'Your scene is safe. The picture comes back by itself in a moment; if it does not, reload the page.'
          : 'The Studio draws with WebGL 2, which is missing or switched off here. Switch on hardware acceleration, or try a current Firefox, Chrome, Edge or Safari. Parameters, formulas and exports still work.'}
      </p>
      {lost && (
        <button type="button" class="button outline" onClick={() => location.reload()}>
          Reload the page
        </button>
      )}
    </div>
  );
}

/** A click: on the surface it sets a pin, beside it nothing is chosen any more. */
async function click(x: number, y: number): Promise<void> {
  const on = stage.value;
  if (!on || !scene.value || tool.value !== 'pin') return;
  const ray = on.eye.ray(x, y);
  const [nx, ny, nz, offset] = on.cut(section.value);
  if (section.value.on) {
    // Only what is shown can be clicked: the ray begins where it comes out of what is cut away.
    const height = nx * ray.origin[0] + ny * ray.origin[1] + nz * ray.origin[2] - offset;
    const fall = nx * ray.direction[0] + ny * ray.direction[1] + nz * ray.direction[2];
    if (height > 0) {
      if (fall >= 0) return;
      const t = -height / fall;
      ray.origin = [0, 1, 2].map(a => ray.origin[a]! + t * ray.direction[a]!) as typeof ray.origin;
    }
  }
  try {
    const hit = await ask('pick', ray);
    if (!hit) {
      chosenPins.value = new Set();
      return;
    }
    await setPin(hit.at);
  } catch (error) {
    complain(error);
  }
}

/** A file with the picture as it is. */
export async function picture(): Promise<Blob | null> {
  if (!stage.value) {
    say('There is no picture to export without WebGL.', { tone: 'warn' });
    return null;
  }
  return stage.value.png(2, getComputedStyle(document.documentElement).getPropertyValue('--paper').trim());
}
