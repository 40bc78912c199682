/** The model as a tree. */
import { useRef, useState } from 'preact/hooks';
import type { NodeState, SceneState } from '../../client/protocol.ts';
import { hideNode, moveNode, placeNode, removeNode, shiftNode } from '../state/actions.ts';
import { apply, scene } from '../state/session.ts';
import { chosen, dialog } from '../state/ui.ts';
import { Button, IconButton } from '../ui/controls.tsx';
import { FormulaField } from './FormulaField.tsx';
import { TreeRow } from './TreeRow.tsx';

export interface Row {
  node: NodeState;
  /** Left out, itself or with what is above it. */
  hidden: boolean;
  children: boolean;
}

/** What the tree shows. */
function rowsOf(state: SceneState, folded: ReadonlySet<string>): Row[] {
  const shut: boolean[] = [];
  const hidden: boolean[] = [];
  const rows: Row[] = [];
  state.nodes.forEach((node, i) => {
    const inside = shut[node.parent] ?? false;
    shut[i] = inside || folded.has(node.path);
    hidden[i] = node.hidden || (hidden[node.parent] ?? false);
    if (!inside) rows.push({ node, hidden: hidden[i], children: state.nodes.some(n => n.parent === i) });
  });
  return rows;
}

export function Tree() {
  const [folded, setFolded] = useState<ReadonlySet<string>>(new Set());
  const [renaming, setRenaming] = useState<string | null>(null);
  const list = useRef<HTMLUListElement>(null);
  const state = scene.value;
  if (!state) return <TreeSkeleton />;
  const rows = rowsOf(state, folded);
  const at = Math.max(0, rows.findIndex(r => r.node.path === chosen.value));

  const focusRow = (i: number) => {
    const row = rows[Math.min(Math.max(i, 0), rows.length - 1)]!;
    chosen.value = row.node.path;
    requestAnimationFrame(() => list.current?.querySelector<HTMLElement>('[tabindex="0"]')?.focus());
  };
  const fold = (path: string, shut: boolean) => {
    const next = new Set(folded);
    if (shut) next.add(path);
    else next.delete(path);
    setFolded(next);
  };
  const key = (event: KeyboardEvent) => {
    const row = rows[at];
    if (!row || (event.target as HTMLElement).tagName === 'INPUT') return;
    const { node, children } = row;
    const isFolded = folded.has(node.path);
    const moves: Record<string, () => void> = {
      ArrowDown: () => (event.altKey ? void shiftNode(node, 1) : focusRow(at + 1)),
      ArrowUp: () => (event.altKey ? void shiftNode(node, -1) : focusRow(at - 1)),
      Home: () => focusRow(0),
      End: () => focusRow(rows.length - 1),
      ArrowRight: () => (children && isFolded ? fold(node.path, false) : focusRow(at + 1)),
      ArrowLeft: () =>
        children && !isFolded ? fold(node.path, true) : focusRow(rows.findIndex(r => r.node === state.nodes[node.parent])),
      F2: () => setRenaming(node.path),
      Enter: () => setRenaming(node.path),
      Delete: () => void removeNode(node),
      Backspace: () => void removeNode(node),
      h: () => void hideNode(node),
      d: () => void apply({ do: 'duplicate', path: node.path }),
    };
    const move = moves[event.key];
    if (!move || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    move();
  };

  return (
    <>
      <header class="panel-head">
        <h2>Model</h2>
        <span class="spacer" />
        <IconButton small icon="wrap" label="Put the chosen part into an operator" keys="W" onClick={() => (dialog.value = 'wrap')} />
        <IconButton small icon="plus" label="Add a shape" keys="A" onClick={() => (dialog.value = 'add')} />
      </header>
      <ul ref={list} class="tree scroll" role="tree" aria-label="The model's parts" onKeyDown={key}>
        {rows.map((row, i) => (
          <TreeRow
            key={row.node.path}
            row={row}
            folded={folded.has(row.node.path)}
            focusable={i === at}
            renaming={renaming === row.node.path}
            onFold={shut => fold(row.node.path, shut)}
            onRename={on => setRenaming(on ? row.node.path : null)}
            onDrop={path => dropOn(state, path, row.node)}
          />
        ))}
      </ul>
      <FormulaField />
      <footer class="panel-foot">
        <Button icon="plus" onClick={() => (dialog.value = 'add')}>
          Add a shape
        </Button>
        <Button icon="gallery" onClick={() => (dialog.value = 'gallery')}>
          Gallery
        </Button>
      </footer>
    </>
  );
}

/** A row dropped on another: among brothers it takes that place, elsewhere it becomes part of it. */
function dropOn(state: SceneState, path: string, target: NodeState): void {
  const node = state.nodes.find(n => n.path === path);
  if (!node || node === target) return;
  if (node.parent === target.parent && node.parent >= 0) void placeNode(node, target.place);
  else void moveNode(path, target.path);
}

function TreeSkeleton() {
  return (
    <div class="tree-skeleton" role="status" aria-label="Opening the scene">
      {[70, 52, 60, 44].map(w => (
        <i key={w} style={{ width: `${w}%` }} />
      ))}
    </div>
  );
}
