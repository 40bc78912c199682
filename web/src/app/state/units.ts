/** Angles are radians in the core and degrees in the page. */
export interface Shown {
  unit: string;
  /** What a value of the core is multiplied by. */
  factor: number;
}

export function shownUnit(unit: string): Shown {
  if (unit === 'angle') return { unit: '°', factor: 180 / Math.PI };
  return { unit: '', factor: 1 };
}
