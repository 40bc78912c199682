import type { Vec3 } from '../../client/protocol.ts';
import { drawn, stage } from './Viewport.tsx';

const DIRECTIONS: readonly { name: string; of: Vec3; axis: string }[] = [
  { name: 'X', of: [1, 0, 0], axis: 'x' },
  { name: 'Y', of: [0, 1, 0], axis: 'y' },
  { name: 'Z', of: [0, 0, 1], axis: 'z' },
  { name: '−X', of: [-1, 0, 0], axis: 'x' },
  { name: '−Y', of: [0, -1, 0], axis: 'y' },
  { name: '−Z', of: [0, 0, -1], axis: 'z' },
];

/** The axes as the camera sees them; a click looks along one. */
export function AxisGizmo() {
  drawn.value;
  const on = stage.value;
  if (!on) return null;
  const m = on.eye.camera.matrixWorldInverse.elements;
  const seen = DIRECTIONS.map(d => {
    const [x, y, z] = d.of;
    return { ...d, x: m[0]! * x + m[4]! * y + m[8]! * z, y: -(m[1]! * x + m[5]! * y + m[9]! * z), z: m[2]! * x + m[6]! * y + m[10]! * z };
  }).sort((a, b) => a.z - b.z);
  return (
    <svg class="gizmo" viewBox="-40 -40 80 80" role="group" aria-label="Look along an axis">
      {seen.map(d => {
        const negative = d.name.startsWith('−');
        const [x, y] = [26 * d.x, 26 * d.y];
        const look = () => on.fit(d.axis === 'z' ? [0, -1e-3, d.of[2]] : d.of);
        return (
          <g
            key={d.name}
            class={`gizmo-axis axis-${d.axis}${negative ? ' negative' : ''}`}
            role="button"
            tabIndex={0}
            aria-label={`Look from ${d.name}`}
            style={{ opacity: 0.55 + 0.45 * Math.max(0, Math.min(1, 0.5 + d.z)) }}
            onClick={look}
            onKeyDown={e => (e.key === 'Enter' || e.key === ' ') && look()}
          >
            {!negative && <line x1={0} y1={0} x2={x} y2={y} />}
            <circle cx={x} cy={y} r={negative ? 4 : 7.5} />
            {!negative && (
              <text x={x} y={y} dy="3.2" text-anchor="middle">
                {d.name}
              </text>
            )}
          </g>
        );
      })}
    </svg>
  );
}
