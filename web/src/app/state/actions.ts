/** What a person does to the scene, in terms of commands. */
import type { AdapterName, Command, Kind, NodeState, PinState, Settings, Vec3 } from '../../client/protocol.ts';
import { middle } from '../viewport/AdapterHandles.tsx';
import { sendLatest } from './gesture.ts';
import { apply, ask, complain, scene } from './session.ts';
import { chosen, chosenPins, lockedPins, say } from './ui.ts';
import { setView, view } from './view.ts';

/** A pin on the surface; it becomes the chosen one. */
export async function setPin(at: Vec3): Promise<void> {
  const change = await apply({ do: 'pin', at });
  if (change?.pin === null || change?.pin === undefined) return;
  chosenPins.value = new Set([change.pin]);
  if (!view.value.knowsPins) setView({ knowsPins: true });
}

export async function deletePins(ids: readonly number[]): Promise<void> {
  if (ids.length === 0) return;
  await apply(together(ids.map(pin => ({ do: 'unpin', pin }))));
  lockedPins.value = new Set([...lockedPins.value].filter(id => !ids.includes(id)));
}

export async function addShape(path: string, model: string): Promise<void> {
  const before = new Set(scene.value?.nodes.map(n => n.path));
  const change = await apply({ do: 'add', path, model });
  if (!change) return;
  const added = scene.value?.nodes.filter(n => !before.has(n.path)) ?? [];
  chosen.value = added.at(-1)?.path ?? chosen.value;
}

/** A formula for a new part of a kind, of the size of the scene. */
export function templateOf(kind: Kind, size: number): string {
  const r = Number((size / 6).toPrecision(2)) || 0.5;
  switch (kind.name) {
    case 'algebraic':
      return `algebraic(c=-1, c_x4=${r ** -4}, c_y4=${r ** -4}, c_z4=${r ** -4})`;
    case 'quadric':
      return `quadric(q4=${r ** -2}, q6=${r ** -2}, q9=${r ** -2})`;
    case 'blobs':
    case 'metaballs':
      return `${kind.name}(0.25, ${-0.6 * r}, 0, 0, ${r}, ${0.6 * r}, 0, 0, ${r})`;
    case 'gaussians':
      return `gaussians(1, 2, ${-0.6 * r}, 0, 0, ${r}, ${0.6 * r}, 0, 0, ${r})`;
    case 'blobby_cylinders':
      return `blobby_cylinders(0.5, ${-r}, 0, 0, ${r}, 0, 0, ${0.6 * r})`;
    case 'plane':
      return 'plane()';
  }
  const lengths = kind.params.filter(p => p.unit === 'length' && p.default > 0);
  const scale = r / Math.max(...lengths.map(p => p.default), 1e-9);
  const values = lengths.map(p => `${p.name}=${Number((p.default * scale).toPrecision(3))}`);
  const periodic = kind.params.some(p => p.name === 'period');
  const text = `${kind.name}(${values.join(', ')})`;
  return periodic ? `(${text} & sphere(${2 * r}))` : text;
}

/** Puts a part into an operator; one of two operands gets a ball as the second. */
export async function wrapNode(node: NodeState, kind: Kind): Promise<void> {
  const needsTwo = 'exactly' in kind.operands && kind.operands.exactly === 2;
  const r = Number(((scene.value?.size ?? 2) / 8).toPrecision(2));
  const command: Command = needsTwo
    ? { do: 'replace', path: node.path, model: `${kind.name}(${node.text}, sphere(${r}))` }
    : { do: 'wrap', path: node.path, kind: kind.name };
  const place = scene.value?.nodes.findIndex(n => n.path === node.path) ?? 0;
  if (await apply(command)) chosen.value = scene.value?.nodes[place]?.path ?? null;
}

/** Takes a part out of the operator above, or brings it back. */
export async function hideNode(node: NodeState): Promise<void> {
  if (node.parent < 0) return void say('The whole model cannot be hidden: only one of its parts can.');
  await apply({ do: 'hide', path: node.path, hidden: !node.hidden });
}

export async function removeNode(node: NodeState): Promise<void> {
  if (node.parent < 0) return void say('The whole model cannot be removed: open another from the gallery, or type a formula.');
  if (await apply({ do: 'remove', path: node.path })) {
    say(`${labelOf(node)} is removed.`, { action: { label: 'Undo', run: () => void apply({ do: 'undo' }) } });
  }
}

/** Moves an operand up or down among its neighbours. */
export async function shiftNode(node: NodeState, by: -1 | 1): Promise<void> {
  const above = scene.value?.nodes[node.parent];
  if (!above) return;
  await placeNode(node, node.place + by);
}

/** Moves an operand to another place of the same operator. */
export async function placeNode(node: NodeState, place: number): Promise<void> {
  const above = scene.value?.nodes[node.parent];
  if (!above || place < 0 || place >= above.operands || place === node.place) return;
  const order = Array.from({ length: above.operands }, (_, i) => i);
  order.splice(place, 0, ...order.splice(node.place, 1));
  await apply({ do: 'reorder', path: above.path, order });
}

export function labelOf(node: NodeState): string {
  const name = node.name ?? node.kind.replaceAll('_', ' ');
  return name.charAt(0).toUpperCase() + name.slice(1);
}

export async function startAdapter(path: string, adapter: AdapterName, axis: 0 | 1 | 2 = 2): Promise<void> {
  if (scene.value?.adapter) await apply({ do: 'cancel' });
  const box = await ask('box', { path }).catch(() => null);
  middle.value = box && ([0, 1, 2].map(a => (box[0][a]! + box[1][a]!) / 2) as Vec3);
  await apply({ do: 'adapt', path, adapter, axis });
}

/** Several commands as one step of undo. */
export function together(commands: Command[]): Command {
  return commands.length === 1 ? commands[0]! : { do: 'together', commands };
}

/** Gives parameters values, as often as a slider or a handle moves; until `endGesture` it is one step of undo. */
export function setParameters(values: Record<string, number>): void {
  sendLatest(together(Object.entries(values).map(([path, value]) => ({ do: 'set', path, value }))));
}

/** Changes settings, as often as a slider moves. */
export function changeSettings(change: Partial<Settings>): void {
  const now = scene.value?.settings;
  if (now) sendLatest({ do: 'settings', settings: { ...now, ...change } });
}

/** Another weight: the pin is set again where it is, and gets another number. */
export async function weighPin(pin: PinState, weight: number): Promise<void> {
  const { id, at, name, softness, along, grip } = pin;
  const again: Command = {
    do: 'pin',
    at,
    weight,
    softness,
    ...(name === null ? {} : { name }),
    ...(along === null ? {} : { along }),
    ...(grip === null ? {} : { grip }),
  };
  await apply(together([{ do: 'unpin', pin: id }, again]));
  const set = scene.value?.pins.at(-1);
  if (set) chosenPins.value = new Set([set.id]);
}

/** Takes a part out and puts it beside another. */
export async function moveNode(path: string, to: string): Promise<void> {
  try {
    const model = await ask('part', { path });
    await apply(together([{ do: 'add', path: to, model }, { do: 'remove', path }]));
  } catch (error) {
    complain(error);
  }
}
