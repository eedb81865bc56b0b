import type { Grid, Region } from '../codec/volume-shape.js';
import type { Vec3, Vec4 } from '../edit.js';

/** Metres from a point in the world to the box of a volume's region; 0 inside. */
export function boxDistance(grid: Grid, region: Region, point: Vec3): number {
  const local = rotateBack(grid.rotation, [0, 1, 2].map((i) => point[i] - grid.center[i]) as Vec3);
  let squared = 0;
  for (let axis = 0; axis < 3; axis++) {
    const cell = grid.size[axis] / grid.resolution[axis];
    const min = region.min[axis] * cell - grid.size[axis] / 2;
    const max = min + region.size[axis] * cell;
    squared += Math.max(min - local[axis], 0, local[axis] - max) ** 2;
  }
  return Math.sqrt(squared);
}

/** A vector turned by the inverse of a unit quaternion: v + 2w(u×v) + 2u×(u×v) with u = −xyz. */
function rotateBack([x, y, z, w]: Vec4, v: Vec3): Vec3 {
  const u: Vec3 = [-x, -y, -z];
  const t = cross(u, v).map((c) => 2 * c) as Vec3;
  const s = cross(u, t);
  return [v[0] + w * t[0] + s[0], v[1] + w * t[1] + s[1], v[2] + w * t[2] + s[2]];
}

function cross(a: Vec3, b: Vec3): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
