/** What is chosen: its parameters, deformations, pins, and how the surface is sampled. */
import type { ComponentChildren } from 'preact';
import { useState } from 'preact/hooks';
import type { AdapterName } from '../../client/protocol.ts';
import { labelOf, startAdapter, together } from '../state/actions.ts';
import { apply, kinds, scene, values } from '../state/session.ts';
import { chosen } from '../state/ui.ts';
import { IconButton } from '../ui/controls.tsx';
import { Icon, type IconName, kindIcon } from '../ui/Icon.tsx';
import { ParameterRow } from './ParameterRow.tsx';
import { PinList } from './PinList.tsx';
import { Sampling } from './Sampling.tsx';

/** Rows of parameters shown at once; the others at a click. */
const MOST = 40;

export function Inspector() {
  if (!scene.value) return null;
  return (
    <div class="inspector scroll">
      <Parameters />
      <Deform />
      <PinList />
      <Sampling />
    </div>
  );
}

export function Fold(props: { title: string; note?: string; tools?: ComponentChildren; open?: boolean; children: ComponentChildren }) {
  const [open, setOpen] = useState(props.open ?? true);
  return (
    <section class="fold-section" aria-label={props.title}>
      <header>
        <h3>
          <button type="button" aria-expanded={open} onClick={() => setOpen(!open)}>
            <span class={open ? 'fold open' : 'fold'}>
              <Icon name="chevron" size={12} />
            </span>
            {props.title}
            {props.note && <small>{props.note}</small>}
          </button>
        </h3>
        {open && props.tools}
      </header>
      {open && <div class="fold-body">{props.children}</div>}
    </section>
  );
}

function Parameters() {
  const [all, setAll] = useState(false);
  const state = scene.value!;
  const node = state.nodes.find(n => n.path === chosen.value) ?? state.nodes[0];
  if (!node) return null;
  const kind = kinds.value.find(k => k.name === node.kind);
  const own = node.parameters.map(i => ({ p: state.parameters[i]!, value: values.value[i] ?? state.parameters[i]!.value }));
  const frozen = own.length > 0 && own.every(({ p }) => p.frozen || p.discrete);
  const shown = all ? own : own.slice(0, MOST);
  return (
    <section class="chosen-node" aria-label="The chosen part">
      <header>
        <span class="chosen-icon">
          <Icon name={kindIcon(node.kind, node.category)} size={20} />
        </span>
        <div>
          <h2>{labelOf(node)}</h2>
          <p>{node.name ? node.kind.replaceAll('_', ' ') : node.path}</p>
        </div>
        {own.length > 0 && (
          <IconButton
            small
            icon={frozen ? 'lock' : 'unlock'}
            label={frozen ? 'Let all of its parameters follow the pins' : 'Lock all of its parameters'}
            pressed={frozen}
            onClick={() => void freezeAll(own.map(({ p }) => p.path), !frozen)}
          />
        )}
      </header>
      {node.hidden && <p class="quiet">Hidden: the model is as if it were not there. Its parameters stay.</p>}
      {kind && <p class="doc">{kind.doc}</p>}
      {shown.map(({ p, value }) => (
        <ParameterRow key={p.path} parameter={p} value={value} />
      ))}
      {own.length > shown.length && (
        <button type="button" class="button" onClick={() => setAll(true)}>
          Show all {own.length} parameters
        </button>
      )}
      {own.length === 0 && <p class="quiet">It has no parameters of its own.</p>}
    </section>
  );
}

/** All of a node's parameters, in one step where a pattern fits only them. */
async function freezeAll(paths: string[], frozen: boolean): Promise<void> {
  const stem = paths[0]!.slice(0, paths[0]!.lastIndexOf('/') + 1);
  const all = scene.value!.parameters.filter(p => p.path.startsWith(stem));
  if (stem && all.length === paths.length) await apply({ do: 'freeze', pattern: `${stem}*`, frozen });
  else await apply(together(paths.map(pattern => ({ do: 'freeze', pattern, frozen }))));
}

export const ADAPTERS: readonly { name: AdapterName; label: string; icon: IconName }[] = [
  { name: 'mover', label: 'Move', icon: 'move' },
  { name: 'rotate', label: 'Turn', icon: 'turn' },
  { name: 'scale', label: 'Scale', icon: 'scale' },
  { name: 'twist', label: 'Twist', icon: 'twist' },
  { name: 'bend', label: 'Bend', icon: 'bend' },
  { name: 'taper', label: 'Taper', icon: 'taper' },
];

function Deform() {
  const on = scene.value?.adapter;
  return (
    <Fold title="Deform">
      <div class="adapters">
        {ADAPTERS.map(a => (
          <button
            type="button"
            class="adapter"
            key={a.name}
            disabled={on !== null && on !== undefined}
            onClick={() => void startAdapter(chosen.value ?? '', a.name)}
          >
            <Icon name={a.icon} />
            {a.label}
          </button>
        ))}
      </div>
      <p class="quiet">Pull the handles; the part's own parameters follow. Accept, keep or cancel below the surface.</p>
    </Fold>
  );
}
