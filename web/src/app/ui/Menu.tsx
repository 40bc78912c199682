import type { ComponentChildren } from 'preact';
import { useEffect, useRef, useState } from 'preact/hooks';
import { Icon, type IconName } from './Icon.tsx';

export interface MenuItem {
  label: string;
  icon?: IconName;
  keys?: string;
  hint?: string;
  checked?: boolean;
  disabled?: boolean;
  danger?: boolean;
  onPick: () => void;
}

/** Items; null draws a line between groups. */
export type MenuItems = (MenuItem | null)[];

interface MenuProps {
  label: string;
  items: MenuItems;
  /** The button's class and content. */
  class: string;
  children: ComponentChildren;
  title?: string;
  side?: 'left' | 'right';
}

/** A button with a menu: arrow keys, Home, End, first letters, Escape. */
export function Menu(props: MenuProps) {
  const [open, setOpen] = useState(false);
  const button = useRef<HTMLButtonElement>(null);
  const list = useRef<HTMLDivElement>(null);

  useEffect(() => {
    if (!open) return;
    list.current!.showPopover();
    place(button.current!, list.current!, props.side ?? 'left');
    list.current!.querySelector<HTMLElement>('[role^=menuitem]:not(:disabled)')?.focus();
    const away = (event: Event) => {
      const target = event.target as Node;
      if (!list.current?.contains(target) && !button.current?.contains(target)) setOpen(false);
    };
    addEventListener('pointerdown', away, true);
    addEventListener('resize', away);
    return () => {
      removeEventListener('pointerdown', away, true);
      removeEventListener('resize', away);
    };
  }, [open]);

  const close = () => {
    setOpen(false);
    button.current?.focus();
  };
  const key = (event: KeyboardEvent) => {
    event.stopPropagation();
    const items = [...list.current!.querySelectorAll<HTMLElement>('[role^=menuitem]:not(:disabled)')];
    const at = items.indexOf(document.activeElement as HTMLElement);
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: -1 }[event.key];
    if (to !== undefined) {
      event.preventDefault();
      items.at(to % items.length)?.focus();
    } else if (event.key === 'Escape' || event.key === 'Tab') {
      event.preventDefault();
      close();
    } else if (event.key.length === 1) {
      items.find(i => i.textContent!.toLowerCase().startsWith(event.key.toLowerCase()))?.focus();
    }
  };

  return (
    <>
      <button
        ref={button}
        type="button"
        class={props.class}
        aria-label={props.label}
        aria-haspopup="menu"
        aria-expanded={open}
        title={props.title ?? props.label}
        onClick={event => {
          event.stopPropagation();
          setOpen(!open);
        }}
      >
        {props.children}
      </button>
      {open && (
        <div ref={list} popover="manual" class="menu" role="menu" aria-label={props.label} onKeyDown={key} onClick={e => e.stopPropagation()}>
          {props.items.map((item, i) => (item === null ? <hr key={i} /> : <Row key={i} item={item} close={close} />))}
        </div>
      )}
    </>
  );
}

function Row({ item, close }: { item: MenuItem; close: () => void }) {
  const radio = item.checked !== undefined;
  return (
    <button
      type="button"
      role={radio ? 'menuitemradio' : 'menuitem'}
      aria-checked={radio ? item.checked : undefined}
      class={item.danger ? 'danger' : undefined}
      disabled={item.disabled}
      tabIndex={-1}
      onClick={() => {
        close();
        item.onPick();
      }}
    >
      <span class="menu-icon">
        {radio ? item.checked && <Icon name="check" size={15} /> : item.icon && <Icon name={item.icon} size={16} />}
      </span>
      <span class="menu-label">
        {item.label}
        {item.hint && <small>{item.hint}</small>}
      </span>
      {item.keys && <span class="menu-keys">{item.keys}</span>}
    </button>
  );
}

/** Below the button, within the window. */
function place(button: HTMLElement, list: HTMLElement, side: 'left' | 'right'): void {
  const b = button.getBoundingClientRect();
  const l = list.getBoundingClientRect();
  const left = side === 'left' ? b.left : b.right - l.width;
  const below = b.bottom + 4 + l.height <= innerHeight - 8;
  const top = below ? b.bottom + 4 : Math.max(8, b.top - 4 - l.height);
  list.style.left = `${Math.min(Math.max(8, left), innerWidth - l.width - 8)}px`;
  list.style.top = `${top}px`;
}
