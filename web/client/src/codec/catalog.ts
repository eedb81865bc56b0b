import type { Vec3, Vec4 } from '../edit.js';
import { WireError } from '../wire-error.js';
import {
  isObject,
  type Json,
  label,
  list,
  number,
  object,
  parseObject,
  shown,
  single,
  text,
  usable,
  vec3,
  vec4,
  whole,
} from './json.js';
import { LIMITS } from './limits.js';

/** Version of the wire format that this client speaks; see docs/wire.md. */
export const WIRE_VERSION = 1;

/** What a server offers: its scene and its fields of light. */
export interface Catalog {
  /** 16 hexadecimal digits, new at every start of the server. */
  readonly epoch: string;
  readonly scene: {
    readonly name: string;
    /** The scene's glTF file under `/scene/` of the server's HTTP address. */
    readonly root: string;
  };
  /** Length of a tick. */
  readonly tickSeconds: number;
  /** Those of the kinds that this client knows. */
  readonly fields: readonly Field[];
}

/** A probe volume: one probe at the centre of each cell of an oriented box. */
export interface Field {
  readonly id: number;
  readonly kind: 'volume';
  readonly basis: 'sh';
  /** Order of the spherical harmonics, 1 to 4. */
  readonly order: number;
  /** Which instances the field is for. */
  readonly use: 'static' | 'moving' | 'all';
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
  /**
   * A power of two near the field's largest coefficient; absent before there was any light. It follows
   * the light: the server sends the catalog again when it has changed.
   */
  readonly scale?: number;
  /** What computes it, in words: `cpu path tracing`. */
  readonly source?: string;
  /** The run of the server that computes it, where that is not the catalog's; see {@link epochOf}. */
  readonly epoch?: string;
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

/** A box of a field's cells that travels on its own tracks. */
export interface Region {
  readonly id: number;
  /** First cell, counted from the grid's first. */
  readonly min: Vec3;
  /** Cells along each axis, 1 to 16. */
  readonly size: Vec3;
}

/** The run that numbers a field's updates and ticks: its own, or else the catalog's. */
export function epochOf(catalog: Catalog, field: Field): string {
  return field.epoch ?? catalog.epoch;
}

/** Whether two catalogs offer the same fields of the same scene and run, at whatever scales. */
export function offersSame(a: Catalog, b: Catalog): boolean {
  const offer = ({ fields, ...rest }: Catalog) =>
    JSON.stringify({ ...rest, fields: fields.map((field) => ({ ...field, scale: undefined })) });
  return offer(a) === offer(b);
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
 * Reads a catalog. Fields of kinds that this client does not know, and those that contradict themselves
 * or exceed a limit, are left out; so are members of fields that may be absent and are none.
 * @throws WireError of kind `version` when the server speaks another version.
 */
export function parseCatalog(bytes: Uint8Array): Catalog {
  const json = parseObject(bytes, 'the catalog');
  if (json.lumencast !== WIRE_VERSION) {
    throw new WireError(
      'version',
      `the server speaks version ${shown(json.lumencast)} of the wire format, this client version ${WIRE_VERSION}`,
    );
  }
  const epoch = parseEpoch(json.epoch);
  const scene = object(json.scene, 'scene');
  const fields = list(json.fields, 'fields', LIMITS.fields)
    .filter(isObject)
    .filter((field) => field.kind === 'volume' && field.basis === 'sh')
    .map((field) => usable(() => parseField(field)))
    .filter((field) => field !== undefined);
  if (new Set(fields.map((field) => field.id)).size !== fields.length) {
    throw new WireError('malformed', 'two fields have the same id');
  }
  const probes = fields.reduce((sum, field) => sum + cellCount(field.grid.resolution), 0);
  if (probes > LIMITS.probesPerCatalog) throw new WireError('limit', `a catalog of ${probes} probes`);
  return {
    epoch,
    scene: { name: text(scene.name, 'scene.name'), root: text(scene.root, 'scene.root') },
    tickSeconds: number(json.tick_seconds, 'tick_seconds', 1e-4, 3600),
    fields,
  };
}

const USES = ['static', 'moving', 'all'] as const;

function parseField(json: Json): Field {
  const id = whole(json.id, 'field.id', 0xffff_ffff);
  const grid = parseGrid(object(json.grid, 'grid'));
  const use = USES.find((use) => use === json.use);
  if (!use) throw new WireError('malformed', `use of field ${id} is ${shown(json.use)}`);
  const scale = usable(() => 2 ** whole(json.scale_log2, 'scale_log2', 127, -128));
  const source = usable(() => label(json.source, 'source', LIMITS.sourceBytes));
  return {
    id,
    kind: 'volume',
    basis: 'sh',
    order: whole(json.order, 'order', 4, 1),
    use,
    grid,
    offset: json.offset === undefined ? { cells: 0.5 } : parseOffset(object(json.offset, 'offset')),
    cellsMin: json.cells_min === undefined ? [0, 0, 0] : vec3(json.cells_min, 'cells_min', anyWhole),
    regions: parseRegions(json.regions, grid.resolution),
    layers: whole(json.layers, 'layers', LIMITS.layers, 1),
    ...(scale === undefined ? {} : { scale }),
    ...(source === undefined ? {} : { source }),
    ...(json.epoch === undefined ? {} : { epoch: parseEpoch(json.epoch) }),
  };
}

function parseOffset(json: Json): Offset {
  return json.cells === undefined
    ? { metres: single(json.metres, 'offset.metres') }
    : { cells: single(json.cells, 'offset.cells') };
}

function parseEpoch(json: unknown): string {
  const epoch = text(json, 'epoch');
  if (!/^[0-9a-f]{16}$/i.test(epoch)) throw new WireError('malformed', 'epoch is not 16 hexadecimal digits');
  return epoch;
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
