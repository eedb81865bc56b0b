import type { FakeServer } from './fake-server.js';
import { FIELD, type LightmapServer } from './lightmap-server.js';
import { join, varint } from './probe-encoder.js';
import type { Resource } from './resource-writer.js';

/** What a `.light` file keeps of its scene. */
export interface Kept {
  readonly edits?: readonly unknown[];
  readonly files?: Readonly<Record<string, Uint8Array>>;
}

/** A `.light` file of a server's next tick: the catalog, what is kept, and a keyframe of each region. */
export function lightFile(server: FakeServer, { edits, files = {} }: Kept = {}): Uint8Array {
  const utf8 = new TextEncoder();
  const kept = Object.entries(files).map(([name, bytes]) => {
    const encoded = utf8.encode(name);
    return record(3, varint(encoded.length), encoded, bytes);
  });
  const keyframes = server
    .step()
    .probes.map(({ bytes }, region) => record(1, varint(0), varint(region), bytes));
  const edited = edits ? [record(2, utf8.encode(JSON.stringify({ edits })))] : [];
  const records = [record(0, server.catalog), ...edited, ...kept, ...keyframes];
  return join(utf8.encode('LUMENCST'), [2], ...records);
}

/** A record of a `.light` file. */
export function record(kind: number, ...parts: (Uint8Array | number[])[]): Uint8Array {
  const body = join([kind], ...parts);
  return join(varint(body.length), body);
}

/** A `.light` file of a lightmap of such light; resources may be left out. */
export function lightmapFile(
  server: LightmapServer,
  value: number,
  resources: readonly Resource[] = server.resources,
): Uint8Array {
  const keyframes = server
    .step(value)
    .map(({ bytes }, region) => record(1, varint(FIELD), varint(region), bytes));
  const kept = resources.map(({ bytes }) => record(4, bytes));
  return join(new TextEncoder().encode('LUMENCST'), [2], record(0, server.catalog), ...kept, ...keyframes);
}
