const WIDTH = 64;
const HEIGHT = 20;
const MOST = 90;

/** A line of the last values, the newest on the right. */
export function Sparkline({ values, zero }: { values: number[]; zero: boolean }) {
  const lo = zero ? 0 : Math.min(...values);
  const hi = Math.max(...values, lo + 1e-12);
  const flat = hi - lo <= 1e-9 * Math.max(1, Math.abs(hi));
  const points = values.map((v, i) => {
    const x = WIDTH - ((values.length - 1 - i) / (MOST - 1)) * WIDTH;
    const y = flat ? HEIGHT - 2 : HEIGHT - 2 - ((v - lo) / (hi - lo)) * (HEIGHT - 4);
    return `${x.toFixed(1)},${y.toFixed(1)}`;
  });
  const last = points.at(-1)?.split(',');
  return (
    <svg class="sparkline" viewBox={`0 0 ${WIDTH} ${HEIGHT}`} width={WIDTH} height={HEIGHT} aria-hidden="true">
      {points.length > 1 && <polyline points={points.join(' ')} />}
      {last && <circle cx={Math.min(Number(last[0]), WIDTH - 1.5)} cy={last[1]} r="1.8" />}
    </svg>
  );
}
