import { useEffect, useState } from 'preact/hooks';

/** A number as people write it: a few significant digits, no exponent where it can be helped. */
export function format(value: number, digits = 4): string {
  if (!Number.isFinite(value)) return '–';
  const rounded = Number(value.toPrecision(digits));
  const small = rounded !== 0 && Math.abs(rounded) < 1e-4;
  return small || Math.abs(rounded) >= 1e7 ? Number(value.toPrecision(2)).toExponential() : String(rounded);
}

interface NumberFieldProps {
  label: string;
  value: number;
  bounds?: readonly [number | null, number | null];
  unit?: string;
  /** What an arrow key adds. */
  step?: number;
  whole?: boolean;
  onCommit: (value: number) => void;
}

/** Takes a number, with Enter or on leaving; Escape brings the old one back, arrow keys step. */
export function NumberField({ label, value, bounds = [null, null], unit, step = 0.1, whole, onCommit }: NumberFieldProps) {
  const [text, setText] = useState<string | null>(null);
  const [wrong, setWrong] = useState('');
  useEffect(() => {
    setText(null);
    setWrong('');
  }, [value]);

  const commit = (next: number) => {
    const [lo, hi] = bounds;
    if (!Number.isFinite(next)) return setWrong('Please give a number.');
    // The core says "above 0" by the smallest number there is.
    if (lo !== null && next < lo) return setWrong(lo > 0 && lo < 1e-300 ? 'More than 0, please.' : `At least ${format(lo)}, please.`);
    if (hi !== null && next > hi) return setWrong(`At most ${format(hi)}, please.`);
    setWrong('');
    setText(null);
    if (next !== value) onCommit(whole ? Math.round(next) : next);
  };
  const leave = (event: { currentTarget: HTMLInputElement }) => {
    if (text === null) {
      event.currentTarget.value = format(value);
      return;
    }
    const given = text.trim().replace(',', '.');
    commit(given === '' ? NaN : Number(given));
  };
  const key = (event: KeyboardEvent & { currentTarget: HTMLInputElement }) => {
    if (event.key === 'Enter') leave(event);
    if (event.key === 'Escape' && text !== null) {
      event.stopPropagation();
      setText(null);
      setWrong('');
    }
    if (event.key === 'ArrowUp' || event.key === 'ArrowDown') {
      event.preventDefault();
      const by = (event.key === 'ArrowUp' ? 1 : -1) * (whole ? 1 : step) * (event.shiftKey ? 10 : 1);
      commit(Number((value + by).toPrecision(12)));
    }
  };
  return (
    <span class={unit ? 'number with-unit' : 'number'}>
      <input
        class="field"
        inputMode="decimal"
        aria-label={label}
        aria-invalid={wrong !== ''}
        title={wrong || undefined}
        value={text ?? format(value)}
        onInput={e => setText(e.currentTarget.value)}
        onFocus={e => {
          // All digits while it is edited.
          e.currentTarget.value = String(Number(value.toPrecision(15)));
          e.currentTarget.select();
        }}
        onBlur={leave}
        onKeyDown={key}
      />
      {unit && <span class="unit">{unit}</span>}
      {wrong && (
        <span class="wrong" role="alert">
          {wrong}
        </span>
      )}
    </span>
  );
}
