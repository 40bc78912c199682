import { small, view } from '../state/view.ts';
import type { Insets } from './stage.ts';

/** What panels cover of the window, from the lengths in tokens.css. */
export function insets(): Insets {
  const style = getComputedStyle(document.documentElement);
  const length = (name: string) => Number.parseFloat(style.getPropertyValue(name)) || 0;
  const { tree, inspector, figures } = view.value;
  if (small.value) return { left: 0, right: 0, top: length('--top'), bottom: 120 };
  return {
    left: tree ? length('--left') : 0,
    right: inspector ? length('--right') : 0,
    top: length('--top'),
    bottom: figures ? length('--strip') : 0,
  };
}
