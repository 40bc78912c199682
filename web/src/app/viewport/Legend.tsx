import { frame } from '../state/session.ts';
import { view } from '../state/view.ts';
import { format } from '../ui/NumberField.tsx';
import { paletteGradient, rangeOf } from './colours.ts';
import { valuesOf } from './discs.ts';

const TITLES = {
  curvature: 'Mean curvature (1/length)',
  radius: 'Radius of the discs (length)',
  error: 'Distance off the surface (length)',
};

/** What the colours mean. */
export function Legend() {
  const { colouring } = view.value;
  if (colouring === 'plain') return null;
  if (colouring === 'normal') {
    return (
      <figure class="legend" aria-label="Colours: the normal">
        <figcaption>Normal</figcaption>
        <p class="legend-axes">
          <span class="axis-x">x red</span> <span class="axis-y">y green</span> <span class="axis-z">z blue</span>
        </p>
      </figure>
    );
  }
  const values = frame.value && valuesOf(frame.value, colouring);
  const range = values ? rangeOf(values, colouring) : null;
  return (
    <figure class="legend" aria-label={`Colours: ${TITLES[colouring]}`}>
      <figcaption>{TITLES[colouring]}</figcaption>
      <div class="legend-bar" style={{ background: paletteGradient(colouring) }} />
      <p class="legend-ends">
        <span>{range ? format(range.lo, 3) : '–'}</span>
        {colouring === 'curvature' && <span>0</span>}
        <span>{range ? format(range.hi, 3) : '–'}</span>
      </p>
    </figure>
  );
}
