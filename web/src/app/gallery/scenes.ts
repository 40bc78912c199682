/** What there is to begin with. Thumbnails are made by `npm run thumbnails`. */
import type { Source, Vec3 } from '../../client/protocol.ts';

export interface GalleryScene {
  /** The name of its thumbnail. */
  id: string;
  title: string;
  /** Where it is from, or what it shows. */
  note: string;
  group: 'Papers' | 'Shapes' | 'Formulas';
  source: () => Promise<Source>;
}

const models = import.meta.glob<string>('../../../../models/*.iso.json', { query: '?raw', import: 'default' });
/** What scripts have made of models: `isoswarm run models/X.iso.json --script models/X.script.json -o …`. */
const pulled = import.meta.glob<string>('./*.iso.json', { query: '?raw', import: 'default' });
const pictures = import.meta.glob<string>('./*.webp', { query: '?url', import: 'default', eager: true });

export function thumbnail(id: string): string | undefined {
  return pictures[`./${id}.webp`];
}

const box = (r: number): [Vec3, Vec3] => [
  [-r, -r, -r],
  [r, r, r],
];

const formula = (text: string, bounds?: [Vec3, Vec3], count = 2500) => async (): Promise<Source> => ({
  text,
  settings: { amount: { count }, ...(bounds ? { bounds } : {}) },
});

const stored = (name: string) => async (): Promise<Source> => ({ text: await models[`../../../../models/${name}.iso.json`]!() });

const after = (name: string) => async (): Promise<Source> => ({ text: await pulled[`./${name}.iso.json`]!() });

/** Sixteen blobs along a knot. */
function blobs(): string {
  const numbers: string[] = [];
  for (let i = 0; i < 16; i++) {
    const t = (i / 16) * 2 * Math.PI;
    const p = [Math.sin(t) + 2 * Math.sin(2 * t), Math.cos(t) - 2 * Math.cos(2 * t), -Math.sin(3 * t)];
    numbers.push(...p.map(v => (0.45 * v).toFixed(3)), '0.5');
  }
  return `blobs(0.5, ${numbers.join(', ')})`;
}

export const scenes: readonly GalleryScene[] = [
  {
    id: 'stretch',
    title: 'A cylinder to stretch',
    note: 'Witkin & Heckbert 1994, figure 1',
    group: 'Papers',
    source: async () => ({
      text: 'blobby_cylinders(0.5, -0.5, 0, 0, 0.5, 0, 0, 0.6)',
      settings: { amount: { spacing: 0.09 } },
      script: script([
        { do: 'pin', at: [-1, 0, 0], name: 'left' },
        { do: 'pin', at: [1, 0, 0], name: 'right' },
      ]),
    }),
  },
  { id: 'three_cylinders', title: 'Three cylinders', note: 'Witkin & Heckbert 1994, figure 2: the start', group: 'Papers', source: stored('three_cylinders') },
  { id: 'creature', title: 'Creature', note: 'Witkin & Heckbert 1994, figure 2: after four drags', group: 'Papers', source: after('creature') },
  { id: 'quartic', title: 'Quartic', note: 'Hart et al. 2002, figure 1: 35 coefficients', group: 'Papers', source: stored('quartic') },
  { id: 'quartic_pulled', title: 'Quartic, pulled', note: 'Hart et al. 2002, figure 1: after two drags', group: 'Papers', source: after('quartic_pulled') },
  { id: 'dumbbell', title: 'Dumbbell', note: 'Hart et al. 2002, figure 2: R-functions', group: 'Papers', source: stored('dumbbell') },
  { id: 'dumbbell_pulled', title: 'Dumbbell, pulled', note: 'Hart et al. 2002, figure 2: after its drags', group: 'Papers', source: after('dumbbell_pulled') },
  { id: 'ellipsoid', title: 'Ellipsoid to move', note: 'Hart et al. 2002, figure 3: an adapter', group: 'Papers', source: stored('ellipsoid') },

  { id: 'body', title: 'Head and body', note: 'A blend to begin with', group: 'Shapes', source: formula('smooth_union(ellipsoid(1, 0.7, 0.7), translate(sphere(0.5), x=1.1, z=0.35), k=0.15)') },
  { id: 'blobs', title: 'Sixteen blobs', note: 'Along a trefoil knot', group: 'Shapes', source: formula(blobs(), undefined, 4000) },
  { id: 'part', title: 'Machine part', note: 'Union, difference, rounded edges', group: 'Shapes', source: formula('smooth_difference(smooth_union(rounded_box(2.4, 1.4, 0.5, 0.12), translate(cylinder(0.6, 1), z=0.3), k=0.08), translate(cylinder(0.36, 3), z=0.3), translate(cylinder(0.18, 2), x=0.9, y=0.42), translate(cylinder(0.18, 2), x=-0.9, y=-0.42), k=0.03)', box(1.6), 5000) },
  { id: 'twisted', title: 'Twisted tower', note: 'A deformation on a box', group: 'Shapes', source: formula('taper(twist(rounded_box(1.1, 1.1, 3, 0.15), rate=0.6), rate=0.12)', box(2), 4000) },
  { id: 'gyroid', title: 'Gyroid ball', note: 'A minimal surface in a sphere', group: 'Shapes', source: formula('shell(gyroid(period=1.1), thickness=0.32) & sphere(1)', undefined, 9000) },
  { id: 'rings', title: 'Two rings', note: 'Linked, with a soft seam', group: 'Shapes', source: formula('smooth_union(translate(torus(0.8, 0.22), x=-0.4), translate(rotate(torus(0.8, 0.22), angle=1.5708, ax=1, ay=0, az=0), x=0.4), k=0.04)', undefined, 4000) },

  { id: 'tanglecube', title: 'Tanglecube', note: 'x⁴ + y⁴ + z⁴ − 5 (x² + y² + z²) + 11.8', group: 'Formulas', source: formula('x^4 + y^4 + z^4 - 5*(x^2 + y^2 + z^2) + 11.8', box(3), 4000) },
  { id: 'heart', title: 'Heart', note: "Taubin's sextic", group: 'Formulas', source: formula('(x^2 + 2.25*y^2 + z^2 - 1)^3 - x^2*z^3 - 0.1125*y^2*z^3', box(1.6), 3000) },
  { id: 'genus', title: 'Genus two', note: 'A double torus', group: 'Formulas', source: formula('((x^2 + y^2)^2 - 2*(x^2 - y^2))^2 + 3*z^2 - 0.35', box(2.2), 4000) },
  { id: 'chmutov', title: 'Chmutov quartic', note: 'Chebyshev polynomials', group: 'Formulas', source: formula('(8*x^4 - 8*x^2) + (8*y^4 - 8*y^2) + (8*z^4 - 8*z^2) + 3.3', box(1.3), 5000) },
  { id: 'cassini', title: 'Cassini oval', note: 'A curve in the plane', group: 'Formulas', source: formula('planar((x^2 + y^2)^2 - 2*(x^2 - y^2) - 0.15)', [[-2, -2, 0], [2, 2, 0]], 300) },
];

function script(commands: object[]): string {
  return JSON.stringify({ format: 'isoswarm script', version: 1, commands });
}

/** What a new visitor sees. */
export const first = scenes.find(s => s.id === 'body')!;
