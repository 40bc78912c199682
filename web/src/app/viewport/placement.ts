/** Where a part is in the world: the moves, turns and scalings above it. */
import type { NodeState, SceneState, Vec3 } from '../../client/protocol.ts';

/** From the coordinates of a part to the world's. Other deformations above it are left out. */
export function placement(state: SceneState, values: Float64Array, node: NodeState): (p: Vec3) => Vec3 {
  const steps: ((p: Vec3) => Vec3)[] = [];
  for (let at = state.nodes[node.parent]; at; at = state.nodes[at.parent]) {
    const q = Object.fromEntries(at.parameters.map(i => [state.parameters[i]!.name, values[i] ?? state.parameters[i]!.value]));
    const step = mapOf(at.kind, q);
    if (step) steps.push(step);
  }
  return p => steps.reduce((at, step) => step(at), p);
}

function mapOf(kind: string, q: Record<string, number>): ((p: Vec3) => Vec3) | null {
  switch (kind) {
    case 'translate':
      return ([x, y, z]) => [x + q.x!, y + q.y!, z + q.z!];
    case 'scale':
      return ([x, y, z]) => [x * q.s!, y * q.s!, z * q.s!];
    case 'scale_axes':
      return ([x, y, z]) => [x * q.sx!, y * q.sy!, z * q.sz!];
    case 'rotate':
      return p => turned(p, [q.ax!, q.ay!, q.az!], q.angle!);
    default:
      return null;
  }
}

/** Rodrigues' formula. */
function turned(p: Vec3, axis: Vec3, angle: number): Vec3 {
  const length = Math.hypot(...axis) || 1;
  const [x, y, z] = axis.map(v => v / length) as Vec3;
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const along = (x * p[0] + y * p[1] + z * p[2]) * (1 - c);
  return [
    p[0] * c + (y * p[2] - z * p[1]) * s + x * along,
    p[1] * c + (z * p[0] - x * p[2]) * s + y * along,
    p[2] * c + (x * p[1] - y * p[0]) * s + z * along,
  ];
}
