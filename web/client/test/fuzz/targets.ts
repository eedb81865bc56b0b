/**
 * What strangers' bytes must not do: throw anything but a {@link WireError}, loop, or take memory without
 * end. The twin of `fuzz/src/lib.rs`. Each function tells whether anything of the bytes was taken.
 */
import { expect } from 'vitest';
import { Cache } from '../../src/cache.js';
import { type Catalog, isLightmap, isVolume, parseCatalog } from '../../src/codec/catalog.js';
import { readCharts } from '../../src/codec/charts.js';
import { parseEdit } from '../../src/codec/edits.js';
import { readLightFile } from '../../src/codec/file.js';
import { layOut, readLayout } from '../../src/codec/layout.js';
import { lumelCount } from '../../src/codec/lightmap-shape.js';
import { LIMITS } from '../../src/codec/limits.js';
import { splitLumelFrame } from '../../src/codec/lumel-header.js';
import { LumelDecoder } from '../../src/codec/lumels.js';
import { splitProbeFrame } from '../../src/codec/probe-header.js';
import { ProbeDecoder } from '../../src/codec/probes.js';
import { checkEdit, encodeClientEdit, parseState } from '../../src/codec/state.js';
import type { Region } from '../../src/codec/volume-shape.js';
import { splitVideoFrame } from '../../src/codec/video-frame.js';
import { codecOf } from '../../src/video/access-unit.js';
import { WireError } from '../../src/wire-error.js';

const utf8 = new TextDecoder();

/** What `read` makes of bytes; `undefined` where they are refused. */
function unlessRefused<T>(read: () => T): T | undefined {
  try {
    return read();
  } catch (error) {
    if (error instanceof WireError) return undefined;
    throw error;
  }
}

function isNever(coefficients: Float32Array): boolean {
  for (let i = 0; i < coefficients.length; i++) if (Number.isNaN(coefficients[i])) return true;
  return false;
}

/** Probe frames, alone and one after another. */
export function probeFrame(data: Uint8Array): boolean {
  // A frame that says its own size and order fits its region, so that payloads are reached.
  const header = unlessRefused(() => splitProbeFrame(data).header);
  if (header) {
    expect(header.time).toSatisfy(Number.isFinite);
    expect(Math.max(...header.size)).toBeLessThanOrEqual(LIMITS.regionCells);
  }
  const decoder = new ProbeDecoder(header?.size ?? [4, 4, 4], header?.order ?? 2);
  const half = data.length >> 1;
  // As one frame, and cut in two: the second may be a delta against the first.
  const frames = [data, data.subarray(0, half), data.subarray(half)];
  const lights = frames.map((frame) => unlessRefused(() => decoder.decode(frame)));
  for (const light of lights) expect(light && isNever(light.coefficients)).not.toBe(true);
  return lights[0] !== undefined;
}

/** Lumel frames, alone and one after another. */
export function lumelFrame(data: Uint8Array): boolean {
  const header = unlessRefused(() => splitLumelFrame(data).header);
  if (header) expect(Math.max(...header.size)).toBeLessThanOrEqual(LIMITS.tileLumels);
  const decoder = new LumelDecoder(header?.size ?? [8, 8]);
  const half = data.length >> 1;
  const frames = [data, data.subarray(0, half), data.subarray(half)];
  const lights = frames.map((frame) => unlessRefused(() => decoder.decode(frame)));
  for (const light of lights) if (light) expectHalves(light.texels);
  return lights[0] !== undefined;
}

/** Every half is finite and not negative. */
function expectHalves(texels: Uint16Array): void {
  expect(texels.findIndex((half) => half > 0x7bff)).toBe(-1);
}

export function videoFrame(data: Uint8Array): boolean {
  const frame = unlessRefused(() => splitVideoFrame(data));
  if (!frame) return false;
  expect(frame.header.octaves).toBeGreaterThan(0);
  // Whatever it is, a name or none is made of it.
  expect(codecOf(frame.unit) ?? 'avc1.000000').toMatch(/^avc1\.[0-9a-f]{6}$/);
  return true;
}

export function charts(data: Uint8Array): boolean {
  const read = unlessRefused(() => readCharts(data));
  if (!read) return false;
  const { sizes, sources, rectangle, at, triangles } = read;
  expect([rectangle.length, at.length]).toEqual([sources.length, 2 * sources.length]);
  expect(rectangle.every((own) => own < sizes.length)).toBe(true);
  expect(triangles.every((corner) => corner >= -1 && corner < sources.length)).toBe(true);
  expect(at.every((place, i) => place >= 0 && place <= sizes[rectangle[i >> 1]][i % 2])).toBe(true);
  return true;
}

export function layout(data: Uint8Array): boolean {
  const read = unlessRefused(() => readLayout(data));
  if (!read) return false;
  const one = { sizes: [[1, 1]] as const, sources: new Uint32Array(), rectangle: new Uint32Array() };
  const known = { ...one, at: new Float32Array(), triangles: new Int32Array() };
  const { pageSize, pages, surfaces } = layOut(read, () => known);
  for (const { rectangles } of surfaces) {
    for (const { page, x, y } of rectangles) {
      expect(page < pages && x < pageSize && y < pageSize).toBe(true);
    }
  }
  return true;
}

export function catalog(data: Uint8Array): boolean {
  const read = unlessRefused(() => parseCatalog(data));
  if (!read) return false;
  expectWithinLimits(read);
  // What decodes is taken in.
  expect(new Cache('me').addCatalog(data, 0)).toBe(true);
  return true;
}

function expectWithinLimits({ fields }: Catalog): void {
  const shapes = fields.filter(isVolume).map(({ shape }) => shape);
  const probes = shapes.map(({ grid: { resolution } }) => resolution[0] * resolution[1] * resolution[2]);
  expect(Math.max(0, ...probes)).toBeLessThanOrEqual(LIMITS.probesPerField);
  expect(probes.reduce((sum, more) => sum + more, 0)).toBeLessThanOrEqual(LIMITS.probesPerCatalog);
  const lumels = fields.filter(isLightmap).reduce((sum, { shape }) => sum + lumelCount(shape), 0);
  expect(lumels).toBeLessThanOrEqual(LIMITS.lumelsPerCatalog);
  for (const { grid, regions } of shapes) {
    const isInside = ({ min, size }: Region) =>
      min.every((m, axis) => m + size[axis] <= grid.resolution[axis]);
    expect(regions.every(isInside)).toBe(true);
  }
}

export function state(data: Uint8Array): boolean {
  const frame = unlessRefused(() => parseState(data));
  if (!frame) return false;
  const edits = frame.kind === 'snapshot' ? frame.edits : [];
  for (const edit of [...edits, ...frame.accepted.map((accepted) => accepted.edit)]) {
    if (edit) expectSame(edit);
  }
  return true;
}

/** An edit in a client's frame: what is read can be sent, and is the same then. */
export function clientEdit(data: Uint8Array): boolean {
  const frame = parsed(data);
  const edit = parseEdit(frame?.edit);
  if (edit) expectSame(edit);
  return edit !== undefined;
}

function expectSame(edit: NonNullable<ReturnType<typeof parseEdit>>): void {
  checkEdit(edit);
  const sent = unlessRefused(() => encodeClientEdit(1, edit));
  if (sent) expect(JSON.stringify(parseEdit(parsed(sent)!.edit))).toBe(JSON.stringify(edit));
}

function parsed(data: Uint8Array): { readonly edit?: unknown } | undefined {
  try {
    return JSON.parse(utf8.decode(data)) as { readonly edit?: unknown };
  } catch {
    return undefined;
  }
}

/** Files of saved light. */
export function lightFile(data: Uint8Array): boolean {
  const file = unlessRefused(() => readLightFile(data));
  if (!file) return false;
  const cache = new Cache('me');
  unlessRefused(() => cache.load(data, 0));
  expectSound(cache, 0);
  return true;
}

/** What a client does with all that a server sends, as packed frames of its tracks in any order. */
export function stream(data: Uint8Array): boolean {
  const cache = new Cache('me');
  let taken = 0;
  let now = 0;
  for (let at = 0; at + 3 <= data.length;) {
    const [track, low, high] = data.subarray(at, at + 3);
    const frame = data.subarray(at + 3, at + 3 + low + 256 * high);
    at += 3 + frame.length;
    now += 0.04;
    if (unlessRefused(() => read(cache, track, frame, now)) !== undefined) taken++;
    expectSound(cache, now);
    cache.events();
  }
  return taken > 1;
}

/** Hands a frame to the cache; `undefined` where it has no use for it. */
function read(cache: Cache, track: number, frame: Uint8Array, now: number): unknown {
  if (track === 'c'.charCodeAt(0)) return cache.addCatalog(frame, now);
  if (track === 's'.charCodeAt(0)) return cache.addState(frame, now) ?? true;
  if (track === 'r'.charCodeAt(0)) return cache.addResource(frame) || undefined;
  const [field] = cache.catalog?.fields ?? [];
  return field && cache.addLight(field.id, 0, track, frame, now);
}

/** All that a page asks of a cache each frame has an answer. */
function expectSound(cache: Cache, now: number): void {
  const { fields, age } = cache.light(now);
  for (const { coefficients } of fields.filter(isVolume)) expect(isNever(coefficients)).toBe(false);
  for (const { regions, field } of fields.filter(isLightmap)) {
    for (const { picture, min, size, page } of regions) {
      if (picture.kind === 'halves') expectHalves(picture.texels);
      const { pageSize, pages } = field.shape;
      expect(page < pages && min.every((first, axis) => first + size[axis] <= pageSize)).toBe(true);
    }
  }
  for (const time of [age, cache.sceneTime(now), cache.serverTime(now)])
    expect(time ?? 0).toSatisfy(Number.isFinite);
}
