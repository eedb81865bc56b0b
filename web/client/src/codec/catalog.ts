/** The catalog: what a server offers. The head that all fields share, and a table of their kinds. */
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
  text,
  usable,
  whole,
} from './json.js';
import { type LightmapShape, lumelCount, parseLightmapShape } from './lightmap-shape.js';
import { LIMITS } from './limits.js';
import { cellCount, parseVolumeShape, type VolumeShape } from './volume-shape.js';

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
  /** Those that this client knows. */
  readonly fields: readonly FieldInfo[];
  /** The others: light that there is and this client cannot show. */
  readonly unknown: readonly UnknownField[];
}

/** What the catalog says of a field of any kind. */
export interface FieldHead {
  readonly id: number;
  /** Which instances the field is for. */
  readonly use: 'static' | 'moving' | 'all';
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

/** The kinds of fields that this client knows, each with its shape: what the catalog says of it besides. */
export interface Shapes {
  readonly volume: VolumeShape;
  readonly lightmap: LightmapShape;
}

export type FieldKind = keyof Shapes;

/** A field: one part of the light, of one kind. `FieldInfo<'volume'>` is one that is a volume. */
export type FieldInfo<K extends FieldKind = FieldKind> = {
  [Kind in K]: FieldHead & { readonly kind: Kind; readonly shape: Shapes[Kind] };
}[K];

/** A field of which this client does not know the kind, or what the kind is made of. */
export interface UnknownField {
  readonly id: number | undefined;
  readonly kind: string | undefined;
}

/** Whether a field, or its light, is that of a volume. */
export function isVolume<T extends { readonly kind: FieldKind }>(
  of: T,
): of is Extract<T, { readonly kind: 'volume' }> {
  return of.kind === 'volume';
}

/** Whether a field, or its light, is that of a lightmap. */
export function isLightmap<T extends { readonly kind: FieldKind }>(
  of: T,
): of is Extract<T, { readonly kind: 'lightmap' }> {
  return of.kind === 'lightmap';
}

/** The run that numbers a field's updates and ticks: its own, or else the catalog's. */
export function epochOf(catalog: Catalog, field: FieldInfo): string {
  return field.epoch ?? catalog.epoch;
}

/**
 * Whether light of the one field is light of the other too: they are of one kind and equal in all that is
 * the kind's own. Number, use, scale, source and epoch do not count.
 */
export function hasSameShape(a: FieldInfo, b: FieldInfo): boolean {
  return a.kind === b.kind && JSON.stringify(a.shape) === JSON.stringify(b.shape);
}

/**
 * Whether frames of the one field are frames of the other too, if one server numbers them: their shapes are
 * equal but for the layout of a lightmap, which says where surfaces are and nothing of how pages are coded.
 */
export function isCodedAlike(a: FieldInfo, b: FieldInfo): boolean {
  if (!isLightmap(a) || !isLightmap(b)) return hasSameShape(a, b);
  return hasSameShape(a, { ...b, shape: { ...b.shape, layout: a.shape.layout } });
}

/**
 * Whether a lightmap has more pages than before, and is coded alike otherwise: regions keep their numbers.
 * Slopes lie behind all pages, and would get others.
 */
export function hasMorePages(now: FieldInfo, before: FieldInfo): boolean {
  if (!isLightmap(now) || !isLightmap(before) || now.shape.slopes) return false;
  const { pages } = now.shape;
  return pages > before.shape.pages && isCodedAlike(now, { ...before, shape: { ...before.shape, pages } });
}

/** Whether two catalogs offer the same fields of the same scene and run, at whatever scales and layouts. */
export function offersSame(a: Catalog, b: Catalog): boolean {
  const heads = ({ fields, ...rest }: Catalog) =>
    JSON.stringify({ ...rest, heads: fields.map(({ scale: _, shape: __, ...head }) => head) });
  return heads(a) === heads(b) && a.fields.every((field, i) => isCodedAlike(field, b.fields[i]));
}

/**
 * How the shape of each kind is read: `undefined` where it is made of what this client does not know.
 * Each throws a {@link WireError} where the shape is wrong.
 */
const SHAPES: { readonly [K in FieldKind]: (json: Json) => Shapes[K] | undefined } = {
  volume: parseVolumeShape,
  lightmap: parseLightmapShape,
};

/**
 * Reads a catalog. Fields of kinds that this client does not know are told apart. Those that contradict
 * themselves or exceed a limit are left out; so are members of fields that may be absent and are none.
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
  const fields: FieldInfo[] = [];
  const unknown: UnknownField[] = [];
  for (const entry of list(json.fields, 'fields', LIMITS.fields).filter(isObject)) {
    const field = usable(() => parseField(entry));
    if (field === 'unknown') unknown.push(parseUnknown(entry));
    else if (field) fields.push(field);
  }
  if (new Set(fields.map((field) => field.id)).size !== fields.length) {
    throw new WireError('malformed', 'two fields have the same id');
  }
  const volumes = fields.filter(isVolume);
  const probes = volumes.reduce((sum, { shape }) => sum + cellCount(shape.grid.resolution), 0);
  if (probes > LIMITS.probesPerCatalog) throw new WireError('limit', `a catalog of ${probes} probes`);
  const lumels = fields.filter(isLightmap).reduce((sum, { shape }) => sum + lumelCount(shape), 0);
  if (lumels > LIMITS.lumelsPerCatalog) throw new WireError('limit', `a catalog of ${lumels} lumels`);
  return {
    epoch,
    scene: { name: text(scene.name, 'scene.name'), root: text(scene.root, 'scene.root') },
    tickSeconds: number(json.tick_seconds, 'tick_seconds', 1e-4, 3600),
    fields,
    unknown,
  };
}

function parseField(json: Json): FieldInfo | 'unknown' {
  const { kind } = json;
  if (!isKnown(kind)) return 'unknown';
  const shape = SHAPES[kind](object(json.shape, 'shape'));
  // The table gives each kind its own shape.
  return shape ? ({ ...parseHead(json), kind, shape } as FieldInfo) : 'unknown';
}

function isKnown(kind: unknown): kind is FieldKind {
  return typeof kind === 'string' && Object.hasOwn(SHAPES, kind);
}

const USES = ['static', 'moving', 'all'] as const;

function parseHead(json: Json): FieldHead {
  const id = parseId(json);
  const use = USES.find((use) => use === json.use);
  if (!use) throw new WireError('malformed', `use of field ${id} is ${shown(json.use)}`);
  const scale = usable(() => 2 ** whole(json.scale_log2, 'scale_log2', 127, -128));
  const source = usable(() => label(json.source, 'source', LIMITS.sourceBytes));
  return {
    id,
    use,
    ...(scale === undefined ? {} : { scale }),
    ...(source === undefined ? {} : { source }),
    ...(json.epoch === undefined ? {} : { epoch: parseEpoch(json.epoch) }),
  };
}

function parseUnknown(json: Json): UnknownField {
  return {
    id: usable(() => parseId(json)),
    kind: usable(() => label(json.kind, 'kind', LIMITS.sourceBytes)),
  };
}

function parseId(json: Json): number {
  return whole(json.id, 'field.id', 0xffff_ffff);
}

function parseEpoch(json: unknown): string {
  const epoch = text(json, 'epoch');
  if (!/^[0-9a-f]{16}$/i.test(epoch)) throw new WireError('malformed', 'epoch is not 16 hexadecimal digits');
  return epoch;
}
