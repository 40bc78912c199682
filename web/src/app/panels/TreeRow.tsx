import { useEffect, useRef, useState } from 'preact/hooks';
import type { AdapterName } from '../../client/protocol.ts';
import { hideNode, labelOf, removeNode, shiftNode, startAdapter } from '../state/actions.ts';
import { apply, scene } from '../state/session.ts';
import { chosen, dialog } from '../state/ui.ts';
import { Icon, kindIcon } from '../ui/Icon.tsx';
import { Menu, type MenuItems } from '../ui/Menu.tsx';
import type { Row } from './Tree.tsx';

interface TreeRowProps {
  row: Row;
  folded: boolean;
  focusable: boolean;
  renaming: boolean;
  onFold: (shut: boolean) => void;
  onRename: (on: boolean) => void;
  onDrop: (path: string) => void;
}

export function TreeRow({ row, folded, focusable, renaming, onFold, onRename, onDrop }: TreeRowProps) {
  const { node, hidden, children } = row;
  const { level } = node;
  const [over, setOver] = useState(false);
  const isChosen = chosen.value === node.path;
  const adapting = scene.value?.adapter?.path === node.path;
  const classes = ['row', isChosen && 'chosen', hidden && 'hidden-part', over && 'over'].filter(Boolean).join(' ');
  return (
    <li
      role="treeitem"
      aria-level={level + 1}
      aria-selected={isChosen}
      aria-expanded={children ? !folded : undefined}
      aria-label={`${labelOf(node)}${hidden ? ', hidden' : ''}`}
      tabIndex={focusable ? 0 : -1}
      class={classes}
      style={{ '--level': level }}
      data-path={node.path}
      draggable={!renaming && node.parent >= 0}
      onClick={() => (chosen.value = node.path)}
      onDblClick={() => onRename(true)}
      onDragStart={event => event.dataTransfer?.setData('text/x-isoswarm-node', node.path)}
      onDragOver={event => {
        if (!event.dataTransfer?.types.includes('text/x-isoswarm-node')) return;
        event.preventDefault();
        setOver(true);
      }}
      onDragLeave={() => setOver(false)}
      onDrop={event => {
        const path = event.dataTransfer?.getData('text/x-isoswarm-node');
        setOver(false);
        if (!path) return;
        event.preventDefault();
        event.stopPropagation();
        onDrop(path);
      }}
    >
      {children ? (
        <button
          type="button"
          class={folded ? 'fold' : 'fold open'}
          tabIndex={-1}
          aria-label={folded ? 'Unfold' : 'Fold'}
          onClick={event => {
            event.stopPropagation();
            onFold(!folded);
          }}
        >
          <Icon name="chevron" size={12} />
        </button>
      ) : (
        <span class="fold" />
      )}
      <span class="row-icon">
        <Icon name={adapting ? 'lattice' : kindIcon(node.kind, node.category)} size={16} />
      </span>
      {renaming ? <Rename path={node.path} name={node.name ?? ''} done={() => onRename(false)} /> : <Name row={row} />}
      <span class="row-tools">
        {level > 0 && (
          <button
            type="button"
            class="icon-button small"
            tabIndex={-1}
            aria-label={node.hidden ? `Show ${labelOf(node)}` : `Hide ${labelOf(node)}`}
            title={node.hidden ? 'Show (H)' : 'Hide (H)'}
            onClick={event => {
              event.stopPropagation();
              void hideNode(node);
            }}
          >
            <Icon name={node.hidden ? 'hidden' : 'look'} size={15} />
          </button>
        )}
        <Menu class="icon-button small" label={`More for ${labelOf(node)}`} side="right" items={itemsFor(row, () => onRename(true))}>
          <Icon name="more" size={15} />
        </Menu>
      </span>
    </li>
  );
}

function Name({ row: { node } }: { row: Row }) {
  return (
    <span class="row-name">
      {labelOf(node)}
      {node.name && <small>{node.kind.replaceAll('_', ' ')}</small>}
    </span>
  );
}

function Rename({ path, name, done }: { path: string; name: string; done: () => void }) {
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => input.current?.select(), []);
  const commit = () => {
    const given = input.current?.value.trim() ?? name;
    done();
    if (given === name) return;
    const place = scene.value?.nodes.findIndex(n => n.path === path) ?? 0;
    void apply({ do: 'rename', path, name: given }).then(ok => {
      if (ok) chosen.value = scene.value?.nodes[place]?.path ?? null;
    });
  };
  return (
    <input
      ref={input}
      class="field rename"
      aria-label="Name"
      value={name}
      placeholder="a name"
      onClick={e => e.stopPropagation()}
      onBlur={commit}
      onKeyDown={event => {
        event.stopPropagation();
        if (event.key === 'Enter') event.currentTarget.blur();
        if (event.key === 'Escape') {
          event.currentTarget.value = name;
          done();
        }
      }}
    />
  );
}

function itemsFor({ node }: Row, rename: () => void): MenuItems {
  const choose = () => {
    chosen.value = node.path;
  };
  const above = scene.value?.nodes[node.parent];
  const deform = (adapter: AdapterName) => () => void startAdapter(node.path, adapter);
  return [
    { label: 'Rename', icon: 'rename', keys: 'F2', onPick: rename },
    { label: 'Duplicate', icon: 'copy', keys: 'D', onPick: () => void apply({ do: 'duplicate', path: node.path }) },
    {
      label: node.hidden ? 'Show' : 'Hide',
      icon: node.hidden ? 'look' : 'hidden',
      keys: 'H',
      disabled: !above,
      onPick: () => void hideNode(node),
    },
    null,
    { label: 'Add a shape here…', icon: 'plus', keys: 'A', onPick: () => (choose(), (dialog.value = 'add')) },
    { label: 'Put into an operator…', icon: 'wrap', keys: 'W', onPick: () => (choose(), (dialog.value = 'wrap')) },
    { label: 'Move with a handle', icon: 'move', onPick: deform('mover') },
    null,
    { label: 'Earlier', icon: 'up', keys: 'Alt ↑', disabled: !above || node.place === 0, onPick: () => void shiftNode(node, -1) },
    {
      label: 'Later',
      icon: 'down',
      keys: 'Alt ↓',
      disabled: !above || node.place >= above.operands - 1,
      onPick: () => void shiftNode(node, 1),
    },
    { label: 'Take the operator off', disabled: node.operands !== 1, onPick: () => void apply({ do: 'unwrap', path: node.path }) },
    { label: 'Flatten into the parameters', disabled: node.operands !== 1, onPick: () => void apply({ do: 'flatten', path: node.path }) },
    null,
    { label: 'Delete', icon: 'trash', keys: 'Del', danger: true, disabled: !above, onPick: () => void removeNode(node) },
  ];
}
