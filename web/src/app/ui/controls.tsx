import type { ComponentChildren } from 'preact';
import { useId } from 'preact/hooks';
import { Icon, type IconName } from './Icon.tsx';

interface ButtonProps {
  children: ComponentChildren;
  icon?: IconName;
  look?: 'plain' | 'primary' | 'outline' | 'danger';
  onClick: (event: MouseEvent) => void;
  disabled?: boolean;
  title?: string;
}

export function Button({ children, icon, look = 'plain', onClick, disabled, title }: ButtonProps) {
  return (
    <button type="button" class={`button ${look}`} onClick={onClick} disabled={disabled} title={title}>
      {icon && <Icon name={icon} size={16} />}
      {children}
    </button>
  );
}

interface IconButtonProps {
  icon: IconName;
  /** What it does: the accessible name, and the tip. */
  label: string;
  keys?: string;
  onClick: (event: MouseEvent) => void;
  disabled?: boolean;
  pressed?: boolean;
  small?: boolean;
}

export function IconButton({ icon, label, keys, onClick, disabled, pressed, small }: IconButtonProps) {
  return (
    <button
      type="button"
      class={small ? 'icon-button small' : 'icon-button'}
      aria-label={label}
      aria-pressed={pressed}
      title={keys ? `${label} (${keys})` : label}
      onClick={onClick}
      disabled={disabled}
    >
      <Icon name={icon} size={small ? 15 : 18} />
    </button>
  );
}

interface Choice<T extends string> {
  value: T;
  label: string;
  icon?: IconName;
}

/** One of a few: a radio group. */
export function Segmented<T extends string>(props: {
  label: string;
  choices: readonly Choice<T>[];
  value: T;
  onChange: (value: T) => void;
}) {
  const move = (event: KeyboardEvent) => {
    const by = event.key === 'ArrowRight' || event.key === 'ArrowDown' ? 1 : event.key === 'ArrowLeft' || event.key === 'ArrowUp' ? -1 : 0;
    if (by === 0) return;
    event.preventDefault();
    const at = props.choices.findIndex(c => c.value === props.value);
    const next = (at + by + props.choices.length) % props.choices.length;
    props.onChange(props.choices[next]!.value);
    const buttons = (event.currentTarget as HTMLElement).querySelectorAll('button');
    buttons[next]?.focus();
  };
  return (
    <div class="segmented" role="radiogroup" aria-label={props.label} onKeyDown={move}>
      {props.choices.map(c => (
        <button
          type="button"
          role="radio"
          key={c.value}
          aria-checked={c.value === props.value}
          aria-label={c.label}
          title={c.label}
          tabIndex={c.value === props.value ? 0 : -1}
          onClick={() => props.onChange(c.value)}
        >
          {c.icon && <Icon name={c.icon} size={16} />}
          <span class={c.icon ? 'word' : undefined}>{c.label}</span>
        </button>
      ))}
    </div>
  );
}

interface SliderProps {
  label: string;
  value: number;
  range: readonly [number, number];
  onInput: (value: number) => void;
  /** The hand has let go. */
  onDone?: () => void;
  /** Logarithmic: for what is above 0 and spans decades. */
  log?: boolean;
  whole?: boolean;
}

export function Slider({ label, value, range: [lo, hi], onInput, onDone, log, whole }: SliderProps) {
  const to = (v: number) => (log ? Math.log(v / lo) / Math.log(hi / lo) : (v - lo) / (hi - lo));
  const from = (t: number) => (log ? lo * (hi / lo) ** t : lo + t * (hi - lo));
  const at = Math.min(1, Math.max(0, to(value)));
  const input = (event: { currentTarget: HTMLInputElement }) => {
    const v = from(event.currentTarget.valueAsNumber / 1000);
    onInput(whole ? Math.round(v) : v);
  };
  return (
    <input
      type="range"
      class="slider"
      aria-label={label}
      aria-valuetext={String(Number(value.toPrecision(4)))}
      min={0}
      max={1000}
      step={whole ? 1000 / Math.max(1, hi - lo) : 1}
      value={Math.round(at * 1000)}
      style={{ '--at': `${at * 100}%` }}
      onInput={input}
      onChange={() => onDone?.()}
    />
  );
}

export function Switch(props: { label: string; checked: boolean; onChange: (on: boolean) => void }) {
  const id = useId();
  return (
    <label class="switch" for={id}>
      <input id={id} type="checkbox" role="switch" checked={props.checked} onChange={e => props.onChange(e.currentTarget.checked)} />
      {props.label}
    </label>
  );
}
