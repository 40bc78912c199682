import { sheet } from '../state/ui.ts';
import { small, view } from '../state/view.ts';
import type { Insets } from './eye.ts';

/** On a small screen: height of a bar in pixels, and of a sheet as a part of the window's. */
const BAR = 56;
const SHEET = 0.5;

/** What panels cover of the window, from the lengths in tokens.css. */
export function insets(): Insets {
  const style = getComputedStyle(document.documentElement);
  const length = (name: string) => Number.parseFloat(style.getPropertyValue(name)) || 0;
  const { tree, inspector, figures } = view.value;
  if (small.value) return { left: 0, right: 0, top: length('--top') + BAR, bottom: BAR + (sheet.value ? SHEET * innerHeight : 0) };
  return {
    left: tree ? length('--left') : 0,
    right: inspector ? length('--right') : 0,
    top: length('--top'),
    bottom: figures ? length('--strip') : 0,
  };
}
