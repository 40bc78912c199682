/** On a small screen: sheets from below, and time within reach of the thumb. */
import { playing, setPlaying } from '../state/session.ts';
import { type SheetName, sheet } from '../state/ui.ts';
import { Icon, type IconName } from '../ui/Icon.tsx';

const SHEETS: readonly { name: SheetName; label: string; icon: IconName }[] = [
  { name: 'tree', label: 'Model', icon: 'tree' },
  { name: 'inspector', label: 'Parameters', icon: 'sliders' },
  { name: 'figures', label: 'Figures', icon: 'chart' },
];

export function SheetBar() {
  return (
    <nav class="sheet-bar" aria-label="Panels">
      {SHEETS.map(s => (
        <button type="button" key={s.name} aria-pressed={sheet.value === s.name} onClick={() => (sheet.value = sheet.value === s.name ? null : s.name)}>
          <Icon name={s.icon} size={20} />
          {s.label}
        </button>
      ))}
      <button type="button" onClick={() => setPlaying(!playing.value)}>
        <Icon name={playing.value ? 'pause' : 'play'} size={20} />
        {playing.value ? 'Pause' : 'Play'}
      </button>
    </nav>
  );
}
