import { changeSettings } from '../state/actions.ts';
import { endGesture } from '../state/gesture.ts';
import { scene } from '../state/session.ts';
import { setView, view } from '../state/view.ts';
import { Slider, Switch } from '../ui/controls.tsx';
import { NumberField, format } from '../ui/NumberField.tsx';
import { Fold } from './Inspector.tsx';

/** How dense the floaters are. */
export function Sampling() {
  const { settings, size, spacing: found } = scene.value!;
  const [send, done] = [changeSettings, endGesture];
  const amount = settings.amount ?? { count: 1000 };
  const spacing = 'spacing' in amount ? amount.spacing : found;
  const focus = settings.focus;
  const setSpacing = (v: number) => send({ amount: { spacing: Number(v.toPrecision(4)) } });
  return (
    <Fold title="Sampling">
      <div class="setting">
        <span>Spacing</span>
        <Slider label="Spacing, slider" value={spacing} range={[size / 200, size / 8]} log onInput={setSpacing} onDone={done} />
        <NumberField
          label="Spacing"
          value={spacing}
          bounds={[size / 1500, size]}
          step={Number((spacing / 20).toPrecision(1))}
          onCommit={v => {
            setSpacing(v);
            done();
          }}
        />
      </div>
      <div class="setting">
        <span title="Denser where the surface is curved">Curvature</span>
        <Slider label="Denser where the surface is curved" value={settings.curvature ?? 0} range={[0, 1]} onInput={v => send({ curvature: Number(v.toFixed(2)) })} onDone={done} />
        <output>{format(settings.curvature ?? 0, 2)}</output>
      </div>
      <Switch
        label="Denser around the pins"
        checked={focus !== undefined && focus !== null}
        onChange={on => send({ focus: on ? { radius: Number((size / 6).toPrecision(2)), factor: 0.4 } : undefined })}
      />
      {focus && (
        <>
          <div class="setting">
            <span>Radius</span>
            <Slider label="Radius of the focus" value={focus.radius} range={[size / 50, size]} log onInput={v => send({ focus: { ...focus, radius: Number(v.toPrecision(3)) } })} onDone={done} />
            <output>{format(focus.radius, 2)}</output>
          </div>
          <div class="setting">
            <span>Factor</span>
            <Slider label="Spacing in the focus, as a part of the spacing elsewhere" value={focus.factor} range={[0.1, 1]} onInput={v => send({ focus: { ...focus, factor: Number(v.toFixed(2)) } })} onDone={done} />
            <output>{format(focus.factor, 2)}</output>
          </div>
        </>
      )}
      <div class="setting">
        <span title="Radius of the discs as a part of the floaters' own">Disc size</span>
        <Slider label="Disc size" value={view.value.discSize} range={[0.3, 1.6]} onInput={v => setView({ discSize: Number(v.toFixed(2)) })} />
        <output>{format(view.value.discSize, 2)}</output>
      </div>
    </Fold>
  );
}
