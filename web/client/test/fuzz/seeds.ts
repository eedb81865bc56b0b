/** Sound bytes from which mutations start: the repository's vectors. The twin of `fuzz/src/seeds.rs`. */
import { layerOf, splitProbeFrame } from '../../src/codec/probe-header.js';
import type { Vec3 } from '../../src/edit.js';
import { json } from '../support/fake-server.js';
import { record } from '../support/light-file.js';
import { join, varint } from '../support/probe-encoder.js';
import { accessUnit } from '../support/fake-video.js';
import { lightmapFile } from '../support/light-file.js';
import { LightmapServer } from '../support/lightmap-server.js';
import { triangle } from '../support/resource-writer.js';
import { frameHead } from '../support/probe-encoder.js';
import { bytesOf, readVectors } from '../support/vectors.js';

/** Probe frames of one region, one after the other. */
interface Sequence {
  readonly size: Vec3;
  readonly order: number;
  readonly frames: readonly Uint8Array[];
}

interface CodecVectors {
  sequences: { size: Vec3; order: number; frames: { bytes: string }[] }[];
}

const sequences: readonly Sequence[] = readVectors<CodecVectors>('codec').sequences.map(
  ({ size, order, frames }) => ({ size, order, frames: frames.map(({ bytes }) => bytesOf(bytes)) }),
);
const { frames: cases } = readVectors<{ frames: { track: 'catalog' | 'state'; frame: unknown }[] }>('frames');
const { edits } = readVectors<{ edits: { json: unknown }[] }>('edits');

export const probeFrames: readonly Uint8Array[] = sequences.flatMap(({ frames }) => frames);

const { sequences: tiles } = readVectors<{ sequences: { frames: { bytes: string }[] }[] }>('lumels');

/** Frames of tiles, of several sequences. */
export const lumelFrames: readonly Uint8Array[] = tiles.flatMap(({ frames }) =>
  frames.slice(0, 3).map(({ bytes }) => bytesOf(bytes)),
);

/** Frames of video, of which what is in the access unit is the decoder's affair. */
export const videoFrames: readonly Uint8Array[] = [true, false].map((key) =>
  join(frameHead({ update: 5, ...(key ? {} : { base: 4 }) }), [7, 96], accessUnit(key, 1)),
);

const resources = readVectors<Record<'charts' | 'layouts', { bytes: string }[]>>('resources');
export const charts: readonly Uint8Array[] = resources.charts.map(({ bytes }) => bytesOf(bytes));
export const layouts: readonly Uint8Array[] = resources.layouts.map(({ bytes }) => bytesOf(bytes));

export const catalogs = [...framesOf('catalog'), new LightmapServer().catalog];
export const states = framesOf('state');

/** Edits as clients send them. */
export const clientEdits: readonly Uint8Array[] = edits.map((edit, number) =>
  json({ seq: number + 1, edit: edit.json }),
);

/** All that a client reads of a server: catalog, state and light. */
export const streams: readonly Uint8Array[] = sequences.map((sequence, number) => {
  const frames = sequence.frames.flatMap((frame, i) => [
    packed('s', states[(13 * number + i) % states.length]),
    packed(layerOf(splitProbeFrame(frame).header.update), frame),
  ]);
  return join(packed('c', catalogOf(sequence)), ...frames);
});

/** The same of a lightmap. */
export const lightmapStreams: readonly Uint8Array[] = [8, 24].map((pageSize) => {
  const server = new LightmapServer({ pageSize, pages: 1, surfaces: [{ node: 1, charts: triangle(4) }] });
  const frames = [1, 1, 2, 3].flatMap((value) => server.step(value).map(({ bytes }) => packed(0, bytes)));
  const all = server.resources.map(({ bytes }) => packed('r', bytes));
  return join(packed('c', server.catalog), ...all, ...frames);
});

/** Files of saved light. */
export const lightmapFiles: readonly Uint8Array[] = [lightmapFile(new LightmapServer(), 4)];
export const lightFiles: readonly Uint8Array[] = sequences.map((sequence) => {
  const kept = json({ edits: edits.map((edit) => edit.json) });
  return join(
    Buffer.from('LUMENCST'),
    [2],
    record(0, catalogOf(sequence)),
    record(2, kept),
    record(3, varint(5), Buffer.from('a.hdr'), kept.subarray(0, 40)),
    record(1, varint(0), varint(0), sequence.frames[0]),
  );
});

/**
 * A frame of a stream: its track (`c`atalog, `s`tate, or the number of a layer; `r` a resource), its length in
 * two bytes, and what it holds.
 */
function packed(track: 'c' | 's' | 'r' | number, frame: Uint8Array): Uint8Array {
  const first = typeof track === 'number' ? track : track.charCodeAt(0);
  return join([first, frame.length & 0xff, frame.length >> 8], frame);
}

function framesOf(track: 'catalog' | 'state'): readonly Uint8Array[] {
  return cases.filter((entry) => entry.track === track).map(({ frame }) => json(frame));
}

/** What a server says that has one region of light. */
function catalogOf({ size, order }: Sequence): Uint8Array {
  const grid = { center: [0, 0, 0], rotation: [0, 0, 0, 1], size, resolution: size };
  const regions = [{ id: 0, min: [0, 0, 0], size }];
  const shape = { basis: 'sh', order, grid, regions, layers: 3 };
  const field = { id: 0, use: 'all', kind: 'volume', shape };
  const scene = { name: 'fuzz', root: 'fuzz.glb' };
  return json({ lumencast: 1, epoch: '0000000000000001', scene, tick_seconds: 0.04, fields: [field] });
}
