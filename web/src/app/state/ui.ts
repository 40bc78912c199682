/** What is open, chosen and said: no part of the scene. */
import { signal } from '@preact/signals';

export type DialogName = 'gallery' | 'help' | 'add' | 'wrap' | 'formula' | null;
export const dialog = signal<DialogName>(null);

/** The path of the chosen node; null: none. */
export const chosen = signal<string | null>(null);
/** Chosen pins, by number. */
export const chosenPins = signal<ReadonlySet<number>>(new Set());
/** Pins that the hand must not move: a matter of this page. */
export const lockedPins = signal<ReadonlySet<number>>(new Set());

export type Tool = 'pin' | 'look';
export const tool = signal<Tool>('pin');

export type SheetName = 'tree' | 'inspector' | 'figures' | null;
/** The sheet that is up, on a small screen. */
export const sheet = signal<SheetName>(null);

export interface Toast {
  id: number;
  text: string;
  tone: 'plain' | 'good' | 'warn';
  action?: { label: string; run: () => void };
}

export const toasts = signal<readonly Toast[]>([]);
let nextToast = 1;

/** Says something in the page. Warnings stay until they are closed or the next one comes. */
export function say(text: string, options: Partial<Omit<Toast, 'id' | 'text'>> = {}): number {
  const toast: Toast = { id: nextToast++, text, tone: options.tone ?? 'plain', ...(options.action ? { action: options.action } : {}) };
  const others = toasts.value.filter(t => t.text !== text).slice(-2);
  toasts.value = [...others, toast];
  if (toast.tone !== 'warn') setTimeout(() => hush(toast.id), toast.action ? 9000 : 4500);
  return toast.id;
}

export function hush(id: number): void {
  if (toasts.value.some(t => t.id === id)) toasts.value = toasts.value.filter(t => t.id !== id);
}

/** A job that takes long: a bar with a way to cancel it. */
export interface Job {
  title: string;
  /** 0 to 1; null: unknown. */
  done: number | null;
  cancel: () => void;
}

export const job = signal<Job | null>(null);

export function toggle(set: ReadonlySet<number>, item: number): ReadonlySet<number> {
  const next = new Set(set);
  if (!next.delete(item)) next.add(item);
  return next;
}
