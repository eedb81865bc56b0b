import type { Edit } from '../edit.js';
import { WireError } from '../wire-error.js';
import { type Catalog, parseCatalog } from './catalog.js';
import { parseEdit } from './edits.js';
import { splitFrame } from './frame-head.js';
import { list, parseObject } from './json.js';
import { LIMITS } from './limits.js';
import { Reader } from './reader.js';

/** What a `.light` file holds: a catalog and keyframes, the same bytes as on the wire. */
export interface LightFile {
  readonly catalog: Catalog;
  /** Edits that turn the scene as it stands in its file into the scene that this light is of. */
  readonly edits: readonly Edit[];
  /** Files of the scene's folder that the edits name, by their names. */
  readonly files: ReadonlyMap<string, Uint8Array>;
  /** Layouts of lightmaps, and their charts. */
  readonly resources: readonly Uint8Array[];
  readonly frames: readonly { readonly field: number; readonly region: number; readonly frame: Uint8Array }[];
}

const MAGIC = new TextEncoder().encode('LUMENCST');
const VERSION = 2;

/** What a record holds; those of other kinds are passed over. */
const KIND = { catalog: 0, keyframe: 1, edits: 2, file: 3, resource: 4 } as const;
const utf8 = new TextDecoder('utf-8', { fatal: true });

/** Reads a `.light` file. Frames and resources are views of `bytes`; what is in them is not decoded yet. */
export function readLightFile(bytes: Uint8Array): LightFile {
  if (bytes.length > LIMITS.fileBytes) throw new WireError('limit', `a file of ${bytes.length} bytes`);
  const reader = new Reader(bytes);
  const magic = reader.take(MAGIC.length);
  if (magic.some((byte, i) => byte !== MAGIC[i])) throw new WireError('malformed', 'not a light file');
  const version = reader.u8();
  if (version !== VERSION) throw new WireError('version', `a light file of version ${version}`);
  const first = record(reader);
  if (first.kind !== KIND.catalog) throw new WireError('malformed', 'a light file without a catalog');
  const catalog = parseCatalog(first.body.rest());
  const known = new Set(catalog.fields.map((field) => field.id));
  let edits: readonly Edit[] = [];
  const files = new Map<string, Uint8Array>();
  const resources = [];
  const frames = [];
  while (reader.left > 0) {
    const { kind, body } = record(reader);
    if (kind === KIND.keyframe) {
      // A frame of a kind that is not known is built in a way that is not known.
      const [field, region] = [body.varint(), body.varint()];
      if (known.has(field)) frames.push({ field, region, frame: keyframe(body.rest()) });
    } else if (kind === KIND.edits) edits = readEdits(body.rest());
    else if (kind === KIND.file) files.set(name(body.take(body.varint())), body.rest());
    else if (kind === KIND.resource) resources.push(resource(body.rest()));
  }
  return { catalog, edits, files, resources, frames };
}

function record(reader: Reader): { kind: number; body: Reader } {
  const body = new Reader(reader.take(reader.varint()));
  return { kind: body.varint(), body };
}

function keyframe(frame: Uint8Array): Uint8Array {
  if (splitFrame(frame).head.base !== undefined) {
    throw new WireError('malformed', 'a delta in a light file');
  }
  return frame;
}

function resource(bytes: Uint8Array): Uint8Array {
  if (bytes.length > LIMITS.resourceBytes) {
    throw new WireError('limit', `a resource of ${bytes.length} bytes`);
  }
  return bytes;
}

function readEdits(bytes: Uint8Array): readonly Edit[] {
  const { edits } = parseObject(bytes, 'the edits of a light file');
  return list(edits, 'edits', LIMITS.snapshotEdits)
    .map(parseEdit)
    .filter((edit) => edit !== undefined);
}

function name(bytes: Uint8Array): string {
  try {
    return utf8.decode(bytes);
  } catch {
    throw new WireError('malformed', 'the name of a file');
  }
}
