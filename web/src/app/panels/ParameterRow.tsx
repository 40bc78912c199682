import { useRef } from 'preact/hooks';
import type { ParameterState } from '../../client/protocol.ts';
import { setParameters } from '../state/actions.ts';
import { endGesture } from '../state/gesture.ts';
import { apply } from '../state/session.ts';
import { shownUnit } from '../state/units.ts';
import { IconButton, Slider } from '../ui/controls.tsx';
import { NumberField } from '../ui/NumberField.tsx';

interface ParameterRowProps {
  parameter: ParameterState;
  /** The value as it is now: it moves with the surface. */
  value: number;
}

/** A parameter: name, slider, number, lock. */
export function ParameterRow({ parameter: p, value }: ParameterRowProps) {
  // While the hand is on the slider its ends stay where they are.
  const range = useRef<[number, number] | null>(null);
  const [lo, hi] = range.current ?? p.slider;
  const { unit, factor } = shownUnit(p.unit);
  const slide = (v: number) => {
    range.current ??= p.slider;
    setParameters({ [p.path]: v });
  };
  const done = () => {
    range.current = null;
    endGesture();
  };
  const shown = (bound: number | null) => (bound === null ? null : bound * factor);
  return (
    <div class={p.frozen ? 'parameter frozen' : 'parameter'} role="group" aria-label={p.name} data-parameter={p.path}>
      <span class="parameter-name" title={[p.doc, p.unit && `Unit: ${p.unit}.`].filter(Boolean).join(' ')}>
        {p.name}
      </span>
      <Slider label={`${p.name}, slider`} value={value} range={[lo, hi]} whole={p.discrete} onInput={slide} onDone={done} />
      <NumberField
        label={p.name}
        value={value * factor}
        bounds={[shown(p.bounds[0]), shown(p.bounds[1])]}
        unit={unit}
        whole={p.discrete}
        step={Number(((Math.abs(hi - lo) * factor) / 100).toPrecision(1)) || 0.01}
        onCommit={v => {
          setParameters({ [p.path]: v / factor });
          endGesture();
        }}
      />
      {p.discrete ? (
        <span class="lock-space" />
      ) : (
        <IconButton
          small
          icon={p.frozen ? 'lock' : 'unlock'}
          label={p.frozen ? `Let ${p.name} follow the pins again` : `Lock ${p.name}: pins do not move it`}
          pressed={p.frozen}
          onClick={() => void apply({ do: 'freeze', pattern: p.path, frozen: !p.frozen })}
        />
      )}
    </div>
  );
}
