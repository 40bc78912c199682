import { dialog } from '../state/ui.ts';
import { Dialog } from '../ui/Dialog.tsx';
import { SHORTCUTS } from '../state/shortcuts.ts';

const HANDS: readonly [string, string][] = [
  ['Drag', 'orbit'],
  ['Right or Shift drag', 'pan'],
  ['Wheel, pinch', 'zoom'],
  ['Click the surface', 'set a pin'],
  ['Drag a pin', 'pull the surface'],
  ['Shift while dragging', 'keep to an axis'],
  ['Shift click pins', 'choose several, to drag together'],
];

export function Help() {
  return (
    <Dialog title="Help" hint="Set pins on the surface and pull: the parameters of the model follow." wide onClose={() => (dialog.value = null)}>
      <div class="help scroll">
        <section>
          <h3>With the hand</h3>
          <dl>
            {HANDS.map(([how, what]) => (
              <div key={how}>
                <dt>{how}</dt>
                <dd>{what}</dd>
              </div>
            ))}
          </dl>
        </section>
        {[...new Set(SHORTCUTS.map(s => s.group))].map(group => (
          <section key={group}>
            <h3>{group}</h3>
            <dl>
              {SHORTCUTS.filter(s => s.group === group).map(s => (
                <div key={s.keys}>
                  <dt>
                    {s.keys.split(' ').map(k => (
                      <kbd key={k}>{k}</kbd>
                    ))}
                  </dt>
                  <dd>{s.label}</dd>
                </div>
              ))}
            </dl>
          </section>
        ))}
        <section>
          <h3>In the tree</h3>
          <dl>
            {[
              ['↑ ↓ ← →', 'go through the tree'],
              ['F2', 'rename'],
              ['D', 'duplicate'],
              ['H', 'hide or show'],
              ['Alt ↑ ↓', 'earlier or later'],
              ['Del', 'delete'],
            ].map(([k, what]) => (
              <div key={k}>
                <dt>
                  <kbd>{k}</kbd>
                </dt>
                <dd>{what}</dd>
              </div>
            ))}
          </dl>
        </section>
      </div>
    </Dialog>
  );
}
