/** The shape of a probe volume: the catalog's `shape` where `kind` is `volume`. */
import type { Vec3, Vec4 } from '../edit.js';
import { WireError } from '../wire-error.js';
import { type Json, list, object, single, vec3, vec4, whole } from './json.js';
import { LIMITS } from './limits.js';

/** A probe volume: one probe at the centre of each cell of an oriented box. */
export interface VolumeShape {
  readonly basis: 'sh';
  /** Order of the spherical harmonics, 1 to 4. */
  readonly order: number;
  readonly grid: Grid;
  /**
   * How far along its normal a point of a surface is moved before light is read there, in cells along
   * each of the box's axes or in metres. Half a cell is three.js's rule; light that was fitted to be read
   * elsewhere is wrong there.
   */
  readonly offset: Offset;
  /** Absolute integer coordinates of the grid's first cell; 0 unless the volume scrolls. */
  readonly cellsMin: Vec3;
  readonly regions: readonly Region[];
  /** Temporal layers, 1 to 3. */
  readonly layers: number;
}

/** Where in front of a surface light is read. */
export type Offset = { readonly cells: number } | { readonly metres: number };

/** An oriented box divided into cells. */
export interface Grid {
  /** Centre of the box, metres. */
  readonly center: Vec3;
  /** Axes of the box in the world, a unit quaternion x, y, z, w. */
  readonly rotation: Vec4;
  /** Full extent along the box's axes, metres. */
  readonly size: Vec3;
  /** Cells along each axis. */
  readonly resolution: Vec3;
}

/** A box of a volume's cells, which is coded and sent as one frame. */
export interface Region {
  readonly id: number;
  /** First cell, counted from the grid's first. */
  readonly min: Vec3;
  /** Cells along each axis, 1 to 16. */
  readonly size: Vec3;
}

/** Number of values (coefficients times three channels) of a probe. */
export function valuesPerProbe(order: number): number {
  return 3 * (order + 1) * (order + 1);
}

/** Number of probes of a grid or a region. */
export function cellCount(size: Vec3): number {
  return size[0] * size[1] * size[2];
}

/**
 * Reads a volume's shape; `undefined` where its basis is another than this client knows.
 * @throws WireError where the shape contradicts itself or exceeds a limit.
 */
export function parseVolumeShape(json: Json): VolumeShape | undefined {
  if (json.basis !== 'sh') return undefined;
  const grid = parseGrid(object(json.grid, 'grid'));
  return {
    basis: 'sh',
    order: whole(json.order, 'order', 4, 1),
    grid,
    offset: json.offset === undefined ? { cells: 0.5 } : parseOffset(object(json.offset, 'offset')),
    cellsMin: json.cells_min === undefined ? [0, 0, 0] : vec3(json.cells_min, 'cells_min', anyWhole),
    regions: parseRegions(json.regions, grid.resolution),
    layers: whole(json.layers, 'layers', LIMITS.layers, 1),
  };
}

function parseOffset(json: Json): Offset {
  return json.cells === undefined
    ? { metres: single(json.metres, 'offset.metres') }
    : { cells: single(json.cells, 'offset.cells') };
}

function parseGrid(json: Json): Grid {
  const rotation = json.rotation === undefined ? ([0, 0, 0, 1] as Vec4) : vec4(json.rotation, 'rotation');
  const length = Math.hypot(...rotation);
  if (!(Math.abs(length - 1) < 1e-3)) throw new WireError('malformed', `a rotation of length ${length}`);
  const resolution = vec3(json.resolution, 'resolution', (value, what) =>
    whole(value, what, LIMITS.probesPerField, 1),
  );
  if (cellCount(resolution) > LIMITS.probesPerField) {
    throw new WireError('limit', `a field of ${cellCount(resolution)} probes`);
  }
  return {
    center: vec3(json.center, 'center', single),
    rotation: rotation.map((c) => c / length) as Vec4,
    size: vec3(json.size, 'size', (value, what) => single(value, what, Number.MIN_VALUE)),
    resolution,
  };
}

/** Regions must cover the grid without overlap. */
function parseRegions(json: unknown, resolution: Vec3): Region[] {
  const regions = list(json, 'regions', LIMITS.regionsPerField).map((entry) => {
    const region = object(entry, 'a region');
    const cells = (value: unknown, what: string) => whole(value, what, LIMITS.regionCells, 1);
    return {
      id: whole(region.id, 'region.id', 0xffff_ffff),
      min: vec3(region.min, 'region.min', whole),
      size: vec3(region.size, 'region.size', cells),
    };
  });
  if (new Set(regions.map((region) => region.id)).size !== regions.length) {
    throw new WireError('malformed', 'two regions have the same id');
  }
  const [nx, ny, nz] = resolution;
  const covered = new Uint8Array(cellCount(resolution));
  for (const { id, min, size } of regions) {
    if (min.some((m, axis) => m + size[axis] > resolution[axis])) {
      throw new WireError('malformed', `region ${id} lies outside the grid`);
    }
    for (let z = min[2]; z < min[2] + size[2]; z++) {
      for (let y = min[1]; y < min[1] + size[1]; y++) {
        for (let i = (z * ny + y) * nx + min[0], end = i + size[0]; i < end; i++) {
          if (covered[i]++) throw new WireError('malformed', `region ${id} overlaps another`);
        }
      }
    }
  }
  if (regions.reduce((sum, region) => sum + cellCount(region.size), 0) !== nx * ny * nz) {
    throw new WireError('malformed', 'the regions do not cover the grid');
  }
  return regions;
}

function anyWhole(value: unknown, what: string): number {
  return whole(value, what, 0x7fff_ffff, -0x8000_0000);
}
