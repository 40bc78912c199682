/** The scene that is open, and its life: commands, frames, drags. The only place that speaks to the core. */
import { batch, computed, effect, signal } from '@preact/signals';
import type { Client, Player, RequestOptions } from '../../client/index.ts';
import type {
  Change,
  Column,
  Command,
  Evenness,
  Failure,
  Frame,
  Hand,
  Input,
  Kind,
  Output,
  RequestName,
  SceneState,
  Source,
  Vec3,
} from '../../client/protocol.ts';
import { follow, forget } from './history.ts';
import { withBar } from './jobs.ts';
import { chosen, chosenPins, hush, say } from './ui.ts';
import { view } from './view.ts';

export const scene = signal<SceneState | null>(null);
export const frame = signal<Frame | null>(null);
/** Values of the parameters as they are now; another array only where one differs. */
export const values = signal<Float64Array>(new Float64Array());
export const kinds = signal<readonly Kind[]>([]);
export const evenness = signal<Evenness | null>(null);
/** Whether time passes. */
export const playing = signal(true);
/** Whether anything has moved in the last frames. */
export const alive = signal(false);
/** Commands under way. */
export const working = signal(0);
export const title = signal('Untitled');
/** Where held pins are dragged to. */
export const hands = signal<readonly Hand[]>([]);
/** Which opening of a scene this is: each is shown as a whole once. */
export const opening = signal(0);

export const pins = computed(() => frame.value?.pins ?? scene.value?.pins ?? []);

/** What takes longer than so many milliseconds has a bar. */
const LONG = 600;
/** Milliseconds without a frame after which all is at rest. */
const QUIET = 700;
/** Milliseconds between looks at how even the floaters are. */
const LOOK = 900;

let client: Client | null = null;
let player: Player | null = null;
let looked = 0;
/** Scenes that are being opened. */
let opens = 0;
/** The note that the core is busy, to be taken away when it answers. */
let busyNote = 0;

/** Takes the client over, once it is there. */
export function connectTo(to: Client): void {
  client = to;
  to.on('restarted', ({ state, failure }) => {
    if (state) adopt(state);
    if (failure.kind === 'cancelled') return;
    const why = failure.kind === 'memory' ? 'The model needed more memory than there is' : 'The core stopped';
    say(`${why} and was started again. Your scene is as it was.`, { tone: 'warn' });
  });
  to.on('silent', () => {
    busyNote = say('The core has been busy for a while: the model may be too heavy.', {
      tone: 'warn',
      action: { label: 'Stop and go back', run: () => void to.restart() },
    });
  });
  player = to.play({
    onFrame: show,
    onError: error => {
      hands.value = [];
      if (error.kind === 'input' || error.kind === 'vanished') setPlaying(false);
      complain(error);
    },
    pace: () => new Promise(done => requestAnimationFrame(() => done())),
    columns: columns(),
  });
  effect(() => {
    player!.columns = columns();
    player!.poke();
  });
  effect(() => (playing.value ? player!.resume() : player!.pause()));
}

const JOBS = ['mesh', 'exportMesh', 'exportSamples'] as const;

/** Asks the core; rejects with what it says. */
export function ask<N extends RequestName>(name: N, input: Input<N>, options?: RequestOptions): Promise<Output<N>> {
  if (!client) return Promise.reject(new Error('The core has not started yet: a moment, please.'));
  const job = JOBS.find(j => j === name);
  if (job) return client.job(job, input as Input<typeof job>, options) as Promise<Output<N>>;
  if (name === 'apply') {
    working.value++;
    const done = client.apply((input as Input<'apply'>).command, options);
    void done.catch(() => undefined).then(() => working.value--);
    return done as Promise<Output<N>>;
  }
  if (name === 'open') return client.open(input as Source, options) as Promise<Output<N>>;
  return client.request(name, input, options);
}

/** Calls back with the scene's text when it has been saved outside the worker. */
export function onSaved(keep: (scene: string) => void): void {
  client?.on('saved', saved => keep(saved.scene));
}

export function failureOf(error: unknown): Failure {
  const { kind, message, position } = error as Partial<Failure>;
  const text = message ?? String(error);
  return { kind: kind ?? 'input', message: text, ...(position === undefined ? {} : { position }) };
}

/** Says what went wrong, with a way on. */
export function complain(error: unknown, way?: { label: string; run: () => void }): void {
  const failure = failureOf(error);
  // That the core has stopped is said once it is back.
  if (failure.kind === 'cancelled' || failure.kind === 'stopped' || failure.kind === 'memory') return;
  const sentence = failure.message.charAt(0).toUpperCase() + failure.message.slice(1);
  const text = /[.!?]$/.test(sentence) ? sentence : `${sentence}.`;
  const undoable = failure.kind === 'vanished' && (scene.value?.undo ?? 0) > 0;
  if (way) say(text, { tone: 'warn', action: way });
  else say(text, { tone: 'warn', ...(undoable ? { action: { label: 'Undo the last change', run: () => void undo() } } : {}) });
}

/** Whether a surface goes on for ever, or nobody knows where it ends. */
function needsBox(error: unknown): boolean {
  return failureOf(error).message.includes('give `bounds`');
}

/** A box around the surface, half as large again. */
function roomy(): [Vec3, Vec3] {
  const [lo, hi] = scene.value?.bounds ?? [[-1, -1, -1], [1, 1, 1]];
  const most = Math.max(...hi.map((h, a) => h - lo[a]!));
  return [lo.map(v => v - most / 4) as Vec3, hi.map(v => v + most / 4) as Vec3];
}

/** Opens another scene; on an error the present one stays. */
export async function open(source: Source, name: string): Promise<boolean> {
  opens++;
  try {
    const state = await withBar(`Opening ${name}`, options => ask('open', source, options), LONG);
    batch(() => {
      scene.value = state;
      frame.value = null;
      opening.value++;
      title.value = name;
      chosen.value = state.nodes[0]?.path ?? null;
      chosenPins.value = new Set();
      hands.value = [];
      evenness.value = null;
    });
    forget();
    return true;
  } catch (error) {
    const { settings } = source;
    const boxed: Source = { ...source, settings: { ...settings, bounds: [[-2, -2, -2], [2, 2, 2]] } };
    complain(error, needsBox(error) && !settings?.bounds ? { label: 'Open it in a box', run: () => void open(boxed, name) } : undefined);
    return false;
  } finally {
    opens--;
    poke();
  }
}

/** Takes over what the core says the scene is. */
export function adopt(state: SceneState): void {
  batch(() => {
    scene.value = state;
    if (chosen.value !== null && !state.nodes.some(n => n.path === chosen.value)) chosen.value = state.nodes[0]?.path ?? null;
    const known = new Set(state.pins.map(p => p.id));
    const left = [...chosenPins.value].filter(id => known.has(id));
    if (left.length < chosenPins.value.size) chosenPins.value = new Set(left);
  });
  poke();
}

/** Carries a command out; null, and a sentence in the page, where it fails. */
export async function apply(command: Command): Promise<Change | null> {
  try {
    const { change, state } = await withBar('Working', options => ask('apply', { command }, options), LONG);
    adopt(state);
    const lost = change.lost.length;
    if (lost > 0) {
      const pins = lost === 1 ? 'A pin is taken away: the surface is no longer there.' : `${lost} pins are taken away: the surface is no longer there.`;
      say(pins, { action: { label: 'Undo', run: () => void undo() } });
    }
    return change;
  } catch (error) {
    const settings = { ...scene.value?.settings, bounds: roomy() };
    const boxed: Command = { do: 'together', commands: [{ do: 'settings', settings }, command] };
    const way = needsBox(error) && command.do !== 'together' ? { label: 'Do it in a box', run: () => void apply(boxed) } : undefined;
    complain(error, way);
    return null;
  }
}

export async function undo(): Promise<void> {
  if (scene.value?.undo) await apply({ do: 'undo' });
}

export async function redo(): Promise<void> {
  if (scene.value?.redo) await apply({ do: 'redo' });
}

/** Something has changed: frames are wanted again. */
export function poke(): void {
  player?.poke();
}

export function setPlaying(on: boolean): void {
  playing.value = on;
}

/** One step while time stands still. */
export function stepOnce(): void {
  playing.value = false;
  player?.step(1);
}

/** Tells where pins are dragged to; only the last word before the next frame counts. */
export function drag(to: readonly Hand[]): void {
  hands.value = to;
  player?.drag([...to]);
}

/** Lets go of them; resolves when the surface has settled. */
export async function release(): Promise<void> {
  if (hands.value.length === 0) return;
  hands.value = [];
  try {
    await player?.release();
    adopt(await ask('state', {}));
  } catch (error) {
    complain(error);
  }
}

function columns(): Column[] {
  const { colouring } = view.value;
  return colouring === 'curvature' || colouring === 'error' ? [colouring] : [];
}

function show(next: Frame): void {
  // A frame of a scene whose tree is not known yet.
  if (opens > 0) return;
  if (!frame.peek()) requestAnimationFrame(() => performance.mark('first-discs'));
  hush(busyNote);
  batch(() => {
    frame.value = next;
    const known = values.value;
    if (known.length !== next.values.length || next.values.some((v, i) => v !== known[i])) values.value = next.values;
    alive.value = next.stats.steps > 0;
  });
  clearTimeout(resting);
  resting = window.setTimeout(() => {
    alive.value = false;
    void lookAtEvenness(true);
  }, QUIET);
  follow(next);
  void lookAtEvenness(false);
}

let resting = 0;

/** How the floaters lie, now and then. */
async function lookAtEvenness(now: boolean): Promise<void> {
  if (!view.value.figures || (!now && performance.now() - looked < LOOK)) return;
  looked = performance.now();
  try {
    evenness.value = await ask('evenness', {});
  } catch {
    evenness.value = null;
  }
}
