/** A searchable menu made from the table of kinds. */
import { useRef, useState } from 'preact/hooks';
import type { Kind } from '../../client/protocol.ts';
import { addShape, labelOf, templateOf, wrapNode } from '../state/actions.ts';
import { kinds, scene } from '../state/session.ts';
import { chosen, dialog } from '../state/ui.ts';
import { Dialog } from '../ui/Dialog.tsx';
import { Icon, kindIcon } from '../ui/Icon.tsx';

/** Without kinds that only a program can make, and the one that the tree's eye makes. */
const isMade = (k: Kind) => k.name !== 'hidden' && (k.payload === 'none' || k.layout === 'groups' || k.layout === 'monomials');

function choices(what: 'add' | 'wrap'): Kind[] {
  return kinds.value.filter(k => {
    if (!isMade(k)) return false;
    if (what === 'add') return k.category === 'shape';
    if (k.category !== 'operator' && k.category !== 'deformation') return false;
    return !('exactly' in k.operands) || k.operands.exactly <= 2;
  });
}

function fits(kind: Kind, search: string): boolean {
  const words = `${kind.name} ${kind.aliases.join(' ')} ${kind.doc}`.toLowerCase().replaceAll('_', ' ');
  return search
    .toLowerCase()
    .split(/[\s_]+/)
    .every(w => words.includes(w));
}

/** How well it fits: what is called so comes before what is only told of so. */
function rank(kind: Kind, search: string): number {
  const name = kind.name.replaceAll('_', ' ');
  const word = search.trim().toLowerCase().replaceAll('_', ' ');
  return name === word ? 0 : name.startsWith(word) ? 1 : name.includes(word) ? 2 : 3;
}

const HEADINGS: Record<string, string> = { shape: 'Shapes', operator: 'Operators', deformation: 'Deformations' };

export function KindPicker({ what }: { what: 'add' | 'wrap' }) {
  const [search, setSearch] = useState('');
  const list = useRef<HTMLDivElement>(null);
  const node = scene.value?.nodes.find(n => n.path === chosen.value) ?? scene.value?.nodes[0];
  if (!node) return null;
  const close = () => {
    dialog.value = null;
  };
  const pick = (kind: Kind) => {
    close();
    if (what === 'add') void addShape(node.path, templateOf(kind, scene.value!.size));
    else void wrapNode(node, kind);
  };
  const found = choices(what)
    .filter(k => fits(k, search))
    .sort((a, b) => rank(a, search) - rank(b, search));
  const groups = [...new Set(found.map(k => k.category))];
  const key = (event: KeyboardEvent) => {
    const items = [...list.current!.querySelectorAll<HTMLElement>('button.kind')];
    const at = items.indexOf(document.activeElement as HTMLElement);
    if (event.key === 'ArrowDown') {
      event.preventDefault();
      items[Math.min(at + 1, items.length - 1)]?.focus();
    } else if (event.key === 'ArrowUp') {
      event.preventDefault();
      if (at <= 0) (event.currentTarget as HTMLElement).querySelector('input')?.focus();
      else items[at - 1]?.focus();
    } else if (event.key === 'Enter' && at < 0 && found[0]) {
      event.preventDefault();
      pick(found[0]);
    }
  };
  const title = what === 'add' ? 'Add a shape' : 'Put into an operator';
  const hint = what === 'add' ? `It becomes part of ${labelOf(node)}.` : `${labelOf(node)} becomes its operand.`;
  return (
    <Dialog title={title} hint={hint} onClose={close}>
      <div class="picker" onKeyDown={key}>
        <label class="search">
          <Icon name="search" size={16} />
          <input autofocus class="field" aria-label="Search" placeholder="Search" value={search} onInput={e => setSearch(e.currentTarget.value)} />
        </label>
        <div ref={list} class="kinds scroll">
          {groups.map(g => (
            <section key={g} aria-label={HEADINGS[g] ?? g}>
              <h3>{HEADINGS[g] ?? g}</h3>
              {found
                .filter(k => k.category === g)
                .map(k => (
                  <button type="button" class="kind" key={k.name} onClick={() => pick(k)}>
                    <Icon name={kindIcon(k.name, k.category)} size={20} />
                    <span>
                      <strong>{k.name.replaceAll('_', ' ')}</strong>
                      <small>{k.doc}</small>
                    </span>
                  </button>
                ))}
            </section>
          ))}
          {found.length === 0 && <p class="quiet">Nothing is called “{search}”. A formula can make it: type one below the tree.</p>}
        </div>
      </div>
    </Dialog>
  );
}
