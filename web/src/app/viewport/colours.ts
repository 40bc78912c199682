/** Colours of the surface: one palette for the shader, the legend and the thumbnails. */
import type { Colouring } from '../state/view.ts';

export type Rgb = readonly [number, number, number];

/** From the lowest to the highest value, in sRGB 0 to 1. */
const sequential: readonly Rgb[] = [
  [0.16, 0.22, 0.38],
  [0.17, 0.42, 0.55],
  [0.32, 0.61, 0.57],
  [0.64, 0.76, 0.55],
  [0.95, 0.84, 0.56],
  [0.96, 0.95, 0.86],
];

/** From hollow to bulging, with paper in the middle. */
const diverging: readonly Rgb[] = [
  [0.13, 0.34, 0.56],
  [0.42, 0.62, 0.78],
  [0.93, 0.91, 0.87],
  [0.86, 0.58, 0.42],
  [0.65, 0.28, 0.15],
];

const clay: readonly [light: Rgb, dark: Rgb] = [
  [0.83, 0.54, 0.4],
  [0.86, 0.6, 0.47],
];

export function plain(dark: boolean): Rgb {
  return clay[dark ? 1 : 0];
}

export function palette(colouring: Colouring): readonly Rgb[] {
  return colouring === 'curvature' ? diverging : sequential;
}

/** The palette as a texture of 256 texels, RGBA. */
export function paletteTexels(colouring: Colouring): Uint8Array<ArrayBuffer> {
  const stops = palette(colouring);
  const out = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; i++) {
    const at = (i / 255) * (stops.length - 1);
    const k = Math.min(Math.floor(at), stops.length - 2);
    for (let c = 0; c < 3; c++) out[4 * i + c] = Math.round(255 * (stops[k]![c]! * (1 - at + k) + stops[k + 1]![c]! * (at - k)));
    out[4 * i + 3] = 255;
  }
  return out;
}

export function paletteGradient(colouring: Colouring): string {
  const stops = palette(colouring).map(c => `rgb(${c.map(v => Math.round(255 * v)).join(' ')})`);
  return `linear-gradient(to right, ${stops.join(', ')})`;
}

export interface Range {
  lo: number;
  hi: number;
}

/** What the palette spans: nearly all values, symmetrical about 0 for curvature. */
export function rangeOf(values: Float32Array, colouring: Colouring): Range {
  const stride = Math.max(1, Math.floor(values.length / 4000));
  const sample: number[] = [];
  for (let i = 0; i < values.length; i += stride) if (Number.isFinite(values[i])) sample.push(values[i]!);
  if (sample.length === 0) return { lo: 0, hi: 1 };
  sample.sort((a, b) => a - b);
  const at = (q: number) => sample[Math.round(q * (sample.length - 1))]!;
  if (colouring === 'curvature') {
    const most = Math.max(Math.abs(at(0.03)), Math.abs(at(0.97)), 1e-9);
    return { lo: -most, hi: most };
  }
  const lo = colouring === 'error' ? 0 : at(0.01);
  return { lo, hi: Math.max(at(0.99), lo + 1e-12 + Math.abs(lo) * 1e-6) };
}
