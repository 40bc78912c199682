/** The tools, at the viewport's left edge. */
import { startAdapter } from '../state/actions.ts';
import { scene } from '../state/session.ts';
import { chosen, tool } from '../state/ui.ts';
import { IconButton } from '../ui/controls.tsx';
import { ADAPTERS } from './Inspector.tsx';

const KEYS = ['M', 'R', 'S', 'T', 'B', 'Y'];

export function Toolbar() {
  const on = scene.value?.adapter;
  return (
    <div class="toolbar" role="toolbar" aria-label="Tools" aria-orientation="vertical">
      <IconButton icon="pin" label="Set and drag pins" keys="P" pressed={tool.value === 'pin'} onClick={() => (tool.value = 'pin')} />
      <IconButton icon="look" label="Look only: clicks set no pins" keys="L" pressed={tool.value === 'look'} onClick={() => (tool.value = 'look')} />
      <span class="rule" />
      {ADAPTERS.map((a, i) => (
        <IconButton
          key={a.name}
          icon={a.icon}
          label={`${a.label} the chosen part`}
          keys={KEYS[i]!}
          disabled={!scene.value || Boolean(on)}
          onClick={() => void startAdapter(chosen.value ?? '', a.name)}
        />
      ))}
    </div>
  );
}
