import type { FieldInfo, Grid, Vec3, Vec4 } from '@lumencast/client';

/** A field that is a volume. */
export type Volume = FieldInfo<'volume'>;

/**
 * Which probe grids of three.js show a server's volumes. three.js' grids are axis-aligned, L2, and
 * each takes a texture unit, so a plan says for every grid which fields it is filled from, and
 * whether probe by probe or by resampling.
 */
export interface VolumePlan {
  /** Coarse before fine: where grids overlap, three.js takes the one of the highest priority. */
  readonly grids: readonly GridPlan[];
  /** What is shown otherwise than the server means it, in words. */
  readonly warnings: readonly string[];
}

/** One axis-aligned grid. */
export interface GridPlan {
  readonly center: Vec3;
  readonly size: Vec3;
  readonly resolution: Vec3;
  /** Where the light comes from, fine before coarse. */
  readonly fields: readonly Volume[];
  /** One field whose probes are the grid's own: nothing to resample. */
  readonly exact: boolean;
}

export interface VolumeLimits {
  /** Grids that the renderer has texture units for. */
  readonly grids: number;
  /** Largest size of a 3D texture along an axis: 256 or more. */
  readonly textureSize: number;
}

/** Most probes of a grid that is resampled at every update: about 10 ms of a page's time. */
export const MAX_RESAMPLED = 16_384;
/** Sub-volumes of an L2 atlas. */
const SUB_VOLUMES = 7;

export function planVolumes(fields: readonly Volume[], limits: VolumeLimits): VolumePlan {
  const warnings: string[] = [];
  const maxCells = mostCells(limits.textureSize);
  let grids = forAllInstances(fields, warnings).map((field) => gridOf(field, maxCells, warnings));
  if (limits.grids < 1 && grids.length > 0) {
    warnings.push('no texture unit is free: indirect light is not shown');
    grids = [];
  }
  while (grids.length > limits.grids) grids = mergeClosest(grids, maxCells, warnings);
  return { grids: grids.sort((a, b) => cellVolume(b) - cellVolume(a)), warnings };
}

/** Cells along each axis that a 3D texture of a size along an axis has room for. */
export function mostCells(textureSize: number): Vec3 {
  return [textureSize, textureSize, Math.floor(textureSize / SUB_VOLUMES) - 2];
}

/** three.js lights every instance with the same grids. */
function forAllInstances(fields: readonly Volume[], warnings: string[]): readonly Volume[] {
  const kept = fields.filter((field) => field.use !== 'moving');
  if (kept.length === 0 || kept.length === fields.length) return fields;
  warnings.push('volumes for moving instances only are left out: three.js lights all instances alike');
  return kept;
}

function gridOf(field: Volume, maxCells: Vec3, warnings: string[]): GridPlan {
  const { grid, offset } = field.shape;
  const { center, size, resolution, rotation } = grid;
  if (!('cells' in offset && offset.cells === 0.5)) {
    const off = 'cells' in offset ? `${offset.cells} cells` : `${offset.metres} m`;
    warnings.push(
      `volume ${field.id} is meant to be read ${off} off surfaces: three.js reads it half a cell off`,
    );
  }
  const turned = Math.hypot(rotation[0], rotation[1], rotation[2]) > 1e-4;
  if (!turned && resolution.every((n, axis) => n <= maxCells[axis])) {
    return { center, size, resolution, fields: [field], exact: true };
  }
  warnings.push(
    turned
      ? `volume ${field.id} is turned: it is resampled into an axis-aligned grid`
      : `volume ${field.id} has too many cells for this device's 3D textures: it is resampled`,
  );
  const half = halfExtent(grid);
  return resampled(
    center.map((c, axis) => c - half[axis]) as Vec3,
    center.map((c, axis) => c + half[axis]) as Vec3,
    [field],
    maxCells,
  );
}

/** Merges the two grids whose common box wastes least space. */
function mergeClosest(grids: readonly GridPlan[], maxCells: Vec3, warnings: string[]): GridPlan[] {
  let best: { a: GridPlan; b: GridPlan; waste: number } | undefined;
  for (const [i, a] of grids.entries()) {
    for (const b of grids.slice(i + 1)) {
      const { min, max } = unionBox(a, b);
      const waste = volume(min.map((m, axis) => max[axis] - m) as Vec3) - volume(a.size) - volume(b.size);
      if (best === undefined || waste < best.waste) best = { a, b, waste };
    }
  }
  const { a, b } = best!;
  const sources = [...a.fields, ...b.fields].sort((x, y) => fieldCell(x) - fieldCell(y));
  warnings.push(
    `volumes ${sources.map((field) => field.id).join(' and ')} share a grid: texture units are short`,
  );
  const { min, max } = unionBox(a, b);
  return [...grids.filter((grid) => grid !== a && grid !== b), resampled(min, max, sources, maxCells)];
}

/** A grid over a box, as fine as the finest source as far as the limits allow. */
function resampled(min: Vec3, max: Vec3, fields: readonly Volume[], maxCells: Vec3): GridPlan {
  const size = max.map((m, axis) => m - min[axis]) as Vec3;
  const spacing = [0, 1, 2].map((axis) =>
    Math.min(...fields.map((field) => axisSpacing(field.shape.grid, axis))),
  );
  const cells = (coarser: number) =>
    size.map((s, axis) =>
      Math.min(maxCells[axis], Math.max(1, Math.round(s / (spacing[axis] * coarser)))),
    ) as Vec3;
  let coarser = 1;
  while (volume(cells(coarser)) > MAX_RESAMPLED) coarser *= 1.05;
  return {
    center: min.map((m, axis) => (m + max[axis]) / 2) as Vec3,
    size,
    resolution: cells(coarser),
    fields,
    exact: false,
  };
}

/** Distance of the probes along a world axis: the least of the grid's own axes that lean that way. */
function axisSpacing(grid: Grid, axis: number): number {
  const world = [0, 0, 0] as Vec3;
  world[axis] = 1;
  const local = rotate(conjugate(grid.rotation), world);
  return 1 / Math.max(...local.map((part, own) => (Math.abs(part) * grid.resolution[own]) / grid.size[own]));
}

/** Half the extent of a turned box's axis-aligned bounds. */
function halfExtent(grid: Grid): Vec3 {
  const columns = grid.size.map((s, axis) => {
    const edge = [0, 0, 0] as Vec3;
    edge[axis] = s / 2;
    return rotate(grid.rotation, edge);
  });
  return [0, 1, 2].map((axis) => columns.reduce((sum, column) => sum + Math.abs(column[axis]), 0)) as Vec3;
}

function unionBox(a: GridPlan, b: GridPlan): { min: Vec3; max: Vec3 } {
  const bound = (pick: (...values: number[]) => number, sign: number) =>
    a.center.map((c, axis) =>
      pick(c + (sign * a.size[axis]) / 2, b.center[axis] + (sign * b.size[axis]) / 2),
    ) as Vec3;
  return { min: bound(Math.min, -1), max: bound(Math.max, 1) };
}

function cellVolume(grid: Pick<GridPlan, 'size' | 'resolution'>): number {
  return volume(grid.size) / volume(grid.resolution);
}

function fieldCell(field: Volume): number {
  return cellVolume(field.shape.grid);
}

export function volume(size: Vec3): number {
  return size[0] * size[1] * size[2];
}

/** Turns a vector by a unit quaternion. */
export function rotate([x, y, z, w]: Vec4, [a, b, c]: Vec3): Vec3 {
  const tx = 2 * (y * c - z * b);
  const ty = 2 * (z * a - x * c);
  const tz = 2 * (x * b - y * a);
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}

/** The inverse of a unit quaternion. */
export function conjugate([x, y, z, w]: Vec4): Vec4 {
  return [-x, -y, -z, w];
}
