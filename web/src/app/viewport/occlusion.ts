/** Whether floaters hide a point: discs tested against the line of sight. */
import type { Frame, Vec3 } from '../../client/protocol.ts';

/** Discs this much larger close the gaps between them. */
const CLOSED = 1.25;
/** What lies within so many spacings of the point does not hide it. */
const NEAR = 1.5;

export function isHidden(frame: Frame, point: Vec3, eye: Vec3): boolean {
  const to = [point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]] as const;
  const length = Math.hypot(...to);
  const [dx, dy, dz] = [to[0] / length, to[1] / length, to[2] / length];
  const end = length - NEAR * frame.spacing;
  const { positions: p, normals: n, radii } = frame;
  for (let i = 0, k = 0; i < frame.count; i++, k += 3) {
    const cx = p[k]! - eye[0];
    const cy = p[k + 1]! - eye[1];
    const cz = p[k + 2]! - eye[2];
    const along = cx * dx + cy * dy + cz * dz;
    if (along > end || along <= 0) continue;
    const reach = CLOSED * radii[i]!;
    const apart = cx * cx + cy * cy + cz * cz - along * along;
    if (apart > reach * reach) continue;
    const facing = n[k]! * dx + n[k + 1]! * dy + n[k + 2]! * dz;
    if (Math.abs(facing) < 1e-6) continue;
    const t = (n[k]! * cx + n[k + 1]! * cy + n[k + 2]! * cz) / facing;
    const ex = dx * t - cx;
    const ey = dy * t - cy;
    const ez = dz * t - cz;
    if (t > 0 && t < end && ex * ex + ey * ey + ez * ez < reach * reach) return true;
  }
  return false;
}
