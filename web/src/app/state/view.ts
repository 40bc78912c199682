/** How the surface is looked at: kept in the browser, no part of the scene. */
import { effect, signal } from '@preact/signals';

export type Mode = 'discs' | 'points' | 'mesh';
export type Shading = 'smooth' | 'flat' | 'wire';
export type Colouring = 'plain' | 'normal' | 'curvature' | 'radius' | 'error';
export type Theme = 'auto' | 'light' | 'dark';

export interface View {
  mode: Mode;
  shading: Shading;
  colouring: Colouring;
  orthographic: boolean;
  /** Radius of a disc as a part of the floater's own. */
  discSize: number;
  theme: Theme;
  tree: boolean;
  inspector: boolean;
  figures: boolean;
  /** Whether a pin has ever been set: then nobody needs to be told how. */
  knowsPins: boolean;
}

const KEY = 'isoswarm.view';

const defaults: View = {
  mode: 'discs',
  shading: 'smooth',
  colouring: 'plain',
  orthographic: false,
  discSize: 1.2,
  theme: 'auto',
  tree: true,
  inspector: true,
  figures: true,
  knowsPins: false,
};

function stored(): Partial<View> {
  try {
    return JSON.parse(localStorage.getItem(KEY) ?? '{}') as Partial<View>;
  } catch {
    return {};
  }
}

export const view = signal<View>({ ...defaults, ...stored() });

export function setView(change: Partial<View>): void {
  view.value = { ...view.value, ...change };
}

/** A plane that cuts what is in front of it away. */
export interface Section {
  on: boolean;
  axis: 0 | 1 | 2;
  /** From the near to the far side of the surface, 0 to 1. */
  at: number;
  flipped: boolean;
}

export const section = signal<Section>({ on: false, axis: 1, at: 0.5, flipped: false });

const systemDark = matchMedia('(prefers-color-scheme: dark)');
export const dark = signal(false);

function applyTheme(): void {
  const { theme } = view.value;
  dark.value = theme === 'dark' || (theme === 'auto' && systemDark.matches);
  document.documentElement.dataset.theme = dark.value ? 'dark' : 'light';
}

systemDark.addEventListener('change', applyTheme);
effect(applyTheme);
effect(() => {
  try {
    localStorage.setItem(KEY, JSON.stringify(view.value));
  } catch {
    // A browser without storage forgets how the surface is looked at, and nothing else.
  }
});

/** Small screens have sheets instead of panels beside the surface. */
const narrow = matchMedia('(max-width: 760px)');
export const small = signal(narrow.matches);
narrow.addEventListener('change', () => {
  small.value = narrow.matches;
});
