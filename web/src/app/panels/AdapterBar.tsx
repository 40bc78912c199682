/** The adapter that is on: its values, how well the part follows, and what becomes of it. */
import { setParameters, startAdapter } from '../state/actions.ts';
import { endGesture } from '../state/gesture.ts';
import { apply, frame, scene, values } from '../state/session.ts';
import { shownUnit } from '../state/units.ts';
import { adapterOf } from '../viewport/AdapterHandles.tsx';
import { Button, Segmented } from '../ui/controls.tsx';
import { NumberField, format } from '../ui/NumberField.tsx';
import type { AdapterName } from '../../client/protocol.ts';

const TITLES: Record<string, string> = {
  translate: 'Move',
  rotate_about: 'Turn',
  scale_about: 'Scale',
  twist_about: 'Twist',
  bend_about: 'Bend',
  taper_about: 'Taper',
};

/** A part that is off by less than this of the size follows as far as the eye can see. */
const CLOSE = 1e-3;

export function AdapterBar() {
  const state = scene.value;
  const adapter = state && adapterOf(state, values.value);
  if (!adapter || !state.adapter) return null;
  const report = frame.value?.transfer ?? state.adapter.transfer;
  const follows = report.relative <= CLOSE;
  const alongAxis = adapter.own.length === 1;
  return (
    <section class="adapter-bar" aria-label={`${TITLES[adapter.kind] ?? 'Deform'} the part`}>
      <h2>{TITLES[adapter.kind] ?? 'Deform'}</h2>
      <div class="adapter-fields">
        {alongAxis && (
          <Segmented
            label="About the axis"
            choices={[
              { value: '0', label: 'X' },
              { value: '1', label: 'Y' },
              { value: '2', label: 'Z' },
            ]}
            value={String(adapter.axis)}
            onChange={a => void changeAxis(adapter.kind, adapter.path, Number(a) as 0 | 1 | 2)}
          />
        )}
        {adapter.own.slice(0, 3).map(p => {
          const { unit, factor } = shownUnit(p.unit);
          return (
            <label key={p.path}>
              <span>{p.name}</span>
              <NumberField
                label={`${TITLES[adapter.kind] ?? 'Deform'} ${p.name}`}
                value={p.at * factor}
                unit={unit}
                step={unit === '°' ? 5 : 0.05}
                onCommit={v => {
                  setParameters({ [p.path]: v / factor });
                  endGesture();
                }}
              />
            </label>
          );
        })}
      </div>
      <p class={follows ? 'residual good' : 'residual warn'} role="status">
        {follows ? 'The part follows exactly' : `The part is off by ${format(100 * report.relative, 2)} % of its size`}
        <small>
          residual {format(report.largest, 2)} · rank {report.rank} of {report.freedom}
        </small>
      </p>
      <div class="adapter-actions">
        <Button onClick={() => void apply({ do: 'cancel' })} title="The part is as it was (Escape)">
          Cancel
        </Button>
        <Button look="outline" onClick={() => void apply({ do: 'keep' })} title="Leaves the deformation in the model, as an operator">
          Keep as operator
        </Button>
        <Button look="primary" onClick={() => void apply({ do: 'accept' })} title="The part's own parameters take it on (Enter)">
          Accept
        </Button>
      </div>
    </section>
  );
}

/** About another axis: the adapter begins anew. */
async function changeAxis(kind: string, path: string, axis: 0 | 1 | 2): Promise<void> {
  const place = scene.value?.nodes.findIndex(n => n.path === path) ?? 0;
  await apply({ do: 'cancel' });
  await startAdapter(scene.value?.nodes[place]?.path ?? '', kind.replace('_about', '') as AdapterName, axis);
}
