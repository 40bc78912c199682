const WIDTH = 64;
const HEIGHT = 20;
const EDGE = 1.8;
/** Values for which there is room from the beginning; more share it. */
const FEW = 24;

/** A line of the last values, from the left; the newest has a dot. */
export function Sparkline({ values, zero }: { values: number[]; zero: boolean }) {
  const lo = zero ? 0 : Math.min(...values);
  const hi = Math.max(...values, lo + 1e-12);
  const flat = hi - lo <= 1e-9 * Math.max(1, Math.abs(hi));
  const points = values.map((v, i) => {
    const x = EDGE + (i / (Math.max(values.length, FEW) - 1)) * (WIDTH - 2 * EDGE);
    const y = flat ? HEIGHT - 2 : HEIGHT - 2 - ((v - lo) / (hi - lo)) * (HEIGHT - 4);
    return `${x.toFixed(1)},${y.toFixed(1)}`;
  });
  const last = points.at(-1)?.split(',');
  return (
    <svg class="sparkline" viewBox={`0 0 ${WIDTH} ${HEIGHT}`} width={WIDTH} height={HEIGHT} aria-hidden="true">
      <line class="base" x1="0" x2={WIDTH} y1={HEIGHT - 0.5} y2={HEIGHT - 0.5} />
      {points.length > 1 && <polyline points={points.join(' ')} />}
      {last && <circle cx={last[0]} cy={last[1]} r={EDGE} />}
    </svg>
  );
}
