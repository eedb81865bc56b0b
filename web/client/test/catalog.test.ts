import { describe, expect, it } from 'vitest';

import { epochOf, hasSameShape, offersSame, parseCatalog } from '../src/codec/catalog.js';
import { parseState } from '../src/codec/state.js';
import { FakeServer, json } from './support/fake-server.js';
import { random } from './support/random.js';
import { volumeIn } from './support/volumes.js';

type Loose = Record<string, any>;

function catalog(change: (catalog: Loose, field: Loose) => void = () => {}): Uint8Array {
  const value = JSON.parse(new TextDecoder().decode(new FakeServer({ regions: 2 }).catalog)) as Loose;
  change(value, value.fields[0]);
  return json(value);
}

describe('a catalog', () => {
  it('is read, with the fields of unknown kinds apart', () => {
    const read = parseCatalog(catalog());
    const { epoch, tickSeconds, fields, unknown } = read;
    expect(unknown).toEqual([{ id: 9, kind: 'something later' }]);
    expect([epoch, tickSeconds, fields.length]).toEqual(['00000000000000aa', 0.04, 1]);
    expect(volumeIn(read).shape.regions[1]).toEqual({ id: 1, min: [2, 0, 0], size: [2, 2, 2] });
  });

  const unknown: [string, (catalog: Loose, field: Loose) => void, object][] = [
    ['another kind', (_, f) => (f.kind = 'hologram'), { id: 0, kind: 'hologram' }],
    ['what all objects have as kind', (_, f) => (f.kind = 'constructor'), { id: 0, kind: 'constructor' }],
    ['no kind and no number', (_, f) => ((f.kind = 1), (f.id = -1)), { id: undefined, kind: undefined }],
    ['an escape sequence as kind', (_, f) => (f.kind = '\u001b[2J'), { id: 0, kind: undefined }],
    ['another basis', (_, f) => (f.shape.basis = 'ambient cube'), { id: 0, kind: 'volume' }],
  ];
  for (const [name, change, wanted] of unknown) {
    it(`tells apart a field of ${name}`, () => {
      const read = parseCatalog(catalog(change));
      expect(read.fields).toEqual([]);
      expect(read.unknown).toEqual([wanted, { id: 9, kind: 'something later' }]);
    });
  }

  it('tells what computes a field, and its epoch where it is another', () => {
    const old = parseCatalog(catalog());
    expect('source' in old.fields[0] || 'epoch' in old.fields[0]).toBe(false);
    expect(epochOf(old, old.fields[0])).toBe('00000000000000aa');
    const fieldEpoch = '00000000000000cc';
    const read = parseCatalog(catalog((_, f) => Object.assign(f, { source: 'é', epoch: fieldEpoch })));
    expect(read.fields[0].source).toBe('é');
    expect(epochOf(read, read.fields[0])).toBe(fieldEpoch);
  });

  it('tells where in front of surfaces a field is read: half a cell unless it says so', () => {
    expect(volumeIn(parseCatalog(catalog())).shape.offset).toEqual({ cells: 0.5 });
    for (const offset of [{ cells: 0.125 }, { metres: 0.1 }]) {
      expect(volumeIn(parseCatalog(catalog((_, f) => (f.shape.offset = offset)))).shape.offset).toEqual(
        offset,
      );
    }
  });

  it('tells a field’s scale where there is light', () => {
    expect('scale' in parseCatalog(catalog()).fields[0]).toBe(false);
    expect(parseCatalog(catalog((_, f) => (f.scale_log2 = -9))).fields[0].scale).toBe(2 ** -9);
  });

  it('offers the same as another at any scale, and at nothing else', () => {
    const one = parseCatalog(catalog());
    const same = (change: (c: Loose, f: Loose) => void) => offersSame(one, parseCatalog(catalog(change)));
    expect(same((_, f) => (f.scale_log2 = 5))).toBe(true);
    expect(same((c) => (c.epoch = '00000000000000ab'))).toBe(false);
    expect(same((_, f) => (f.epoch = '00000000000000ab'))).toBe(false);
    expect(same((_, f) => (f.source = 'another'))).toBe(false);
    expect(same((_, f) => (f.shape.layers = 2))).toBe(false);
    expect(same((_, f) => (f.shape.offset = { cells: 0 }))).toBe(false);
    expect(same((_, f) => (f.shape.grid.size = [4, 2, 3]))).toBe(false);
    expect(same((c) => (c.fields = []))).toBe(false);
  });

  it('has fields of the same shape where kind and shape are equal', () => {
    const [field] = parseCatalog(catalog()).fields;
    const same = (change: (f: Loose) => void) =>
      hasSameShape(field, parseCatalog(catalog((_, f) => change(f))).fields[0]);
    const head = { id: 7, use: 'static', scale_log2: 5, source: 'another', epoch: '00000000000000ab' };
    expect(same((f) => Object.assign(f, head))).toBe(true);
    expect(same((f) => (f.shape.offset = { cells: 0.5 }))).toBe(true);
    expect(same((f) => (f.shape.offset = { metres: 0.5 }))).toBe(false);
    expect(same((f) => (f.shape.layers = 2))).toBe(false);
    expect(same((f) => (f.shape.cells_min = [0, 0, 1]))).toBe(false);
    expect(same((f) => (f.shape.regions[0].id = 5))).toBe(false);
  });

  it('has its rotation made a unit quaternion', () => {
    const turned = parseCatalog(catalog((_, field) => (field.shape.grid.rotation = [0, 0.6001, 0, 0.8])));
    expect(Math.hypot(...volumeIn(turned).shape.grid.rotation)).toBeCloseTo(1, 12);
  });

  const refused: [string, string, (catalog: Loose, field: Loose) => void][] = [
    ['another version', 'version', (c) => (c.lumencast = 2)],
    ['a short epoch', 'malformed', (c) => (c.epoch = 'abc')],
    ['no scene', 'malformed', (c) => delete c.scene],
    ['a tick of no length', 'malformed', (c) => (c.tick_seconds = 0)],
    ['257 fields', 'limit', (c) => (c.fields = Array(257).fill({}))],
    ['a field twice', 'malformed', (c, f) => c.fields.push(f)],
  ];
  for (const [name, kind, change] of refused) {
    it(`with ${name} is refused`, () => {
      expect(() => parseCatalog(catalog(change))).toThrow(expect.objectContaining({ kind }));
    });
  }

  const unusable: [string, (catalog: Loose, field: Loose) => void][] = [
    ['order 5', (_, f) => (f.shape.order = 5)],
    ['no shape', (_, f) => delete f.shape],
    ['an unknown use', (_, f) => (f.use = 'some')],
    ['an offset without a unit', (_, f) => (f.shape.offset = 0.5)],
    ['an offset in feet', (_, f) => (f.shape.offset = { feet: 1 })],
    ['no layers', (_, f) => (f.shape.layers = 0)],
    ['a short epoch of a field', (_, f) => (f.epoch = 'abc')],
    ['a flat box', (_, f) => (f.shape.grid.size = [1, 0, 1])],
    ['a rotation of length 2', (_, f) => (f.shape.grid.rotation = [0, 0, 0, 2])],
    ['too many probes', (_, f) => (f.shape.grid.resolution = [65, 64, 64])],
    ['half a cell', (_, f) => (f.shape.grid.resolution = [4, 2, 1.5])],
    ['a cell without region', (_, f) => f.shape.regions.pop()],
    ['overlapping regions', (_, f) => (f.shape.regions[1].min = [1, 0, 0])],
    ['a region outside', (_, f) => (f.shape.regions[1].min = [3, 0, 0])],
    ['a region of 17 cells', (_, f) => (f.shape.regions[0].size = [17, 2, 2])],
    ['a region twice', (_, f) => (f.shape.regions[1].id = 0)],
  ];
  for (const [name, change] of unusable) {
    it(`leaves out a field with ${name}`, () =>
      expect(parseCatalog(catalog(change))).toMatchObject({ fields: [], unknown: [{ id: 9 }] }));
  }

  const none: [string, (catalog: Loose, field: Loose) => void][] = [
    ['a scale of 2^128', (_, f) => (f.scale_log2 = 128)],
    ['half a power as scale', (_, f) => (f.scale_log2 = 0.5)],
    ['a source of 130 bytes', (_, f) => (f.source = 'é'.repeat(65))],
    ['an escape sequence as source', (_, f) => (f.source = '\u001b[2J')],
    ['a number as source', (_, f) => (f.source = 1)],
  ];
  for (const [name, change] of none) {
    it(`has none for ${name}`, () =>
      expect(parseCatalog(catalog(change)).fields).toEqual(parseCatalog(catalog()).fields));
  }

  it('is read where a member is nested deeper than a stack', () => {
    const text = new TextDecoder().decode(catalog());
    const deep = '['.repeat(1e5) + ']'.repeat(1e5);
    const read = (from: string, to: string) => parseCatalog(new TextEncoder().encode(text.replace(from, to)));
    const version = expect.objectContaining({ kind: 'version' });
    expect(() => read('"lumencast":1', `"lumencast":${deep}`)).toThrow(version);
    expect(read('"use":"all"', `"use":${deep}`).fields).toEqual([]);
  });

  it('of too many probes over all fields is refused', () => {
    const regions: unknown[] = [];
    for (let x = 0; x < 4; x++) {
      for (let y = 0; y < 4; y++) {
        for (let z = 0; z < 4; z++) {
          regions.push({ id: regions.length, min: [16 * x, 16 * y, 16 * z], size: [16, 16, 16] });
        }
      }
    }
    const many = (count: number) =>
      catalog((c, f) => {
        const grid = { ...f.shape.grid, resolution: [64, 64, 64] };
        c.fields = Array.from({ length: count }, (_, id) => ({
          ...f,
          id,
          shape: { ...f.shape, grid, regions },
        }));
      });
    expect(parseCatalog(many(2)).fields.length).toBe(2);
    expect(() => parseCatalog(many(3))).toThrow(expect.objectContaining({ kind: 'limit' }));
  });

  it('damaged at random gives a catalog or a WireError', () => {
    const good = catalog();
    const next = random(8);
    let refusals = 0;
    for (let round = 0; round < 3000; round++) {
      const bytes = good.slice();
      bytes[Math.floor(next() * bytes.length)] = 32 + Math.floor(next() * 95);
      try {
        parseCatalog(bytes);
      } catch (error) {
        expect(error).toMatchObject({ name: 'WireError' });
        refusals++;
      }
    }
    expect(refusals).toBeGreaterThan(1000);
    expect(refusals).toBeLessThan(3000);
  });
});

describe('a state frame', () => {
  const tick = { tick: 1, time: 0.04, clock: 9, version: 2, tick_ms: 30, samples: 8 };

  it('may leave out what is empty', () => {
    expect(parseState(json(tick))).toMatchObject({ kind: 'delta', accepted: [], refused: [], tickMs: 30 });
    const snapshot = { snapshot: [], acks: { me: 4 }, ...tick };
    expect(parseState(json(snapshot))).toMatchObject({
      kind: 'snapshot',
      edits: [],
      acks: new Map([['me', 4]]),
    });
  });

  it('keeps strange client names apart from what objects have by nature', () => {
    const acks = JSON.parse('{ "__proto__": 7, "constructor": 8 }');
    const state = parseState(json({ snapshot: [], acks, ...tick }));
    expect(state.kind === 'snapshot' && [...state.acks]).toEqual([
      ['__proto__', 7],
      ['constructor', 8],
    ]);
  });

  for (const [name, change] of [
    ['no tick', { tick: undefined }],
    ['a negative tick', { tick: -1 }],
    ['a clock of text', { clock: '9' }],
    ['edits that are no list', { edits: {} }],
  ] as const) {
    it(`with ${name} is refused`, () => {
      expect(() => parseState(json({ ...tick, ...change }))).toThrow(
        expect.objectContaining({ kind: 'malformed' }),
      );
    });
  }

  it('with more edits than allowed is refused', () => {
    const edits = Array(4097).fill({ edit: { edit: 'remove_node', node: 1 } });
    expect(() => parseState(json({ ...tick, edits }))).toThrow(expect.objectContaining({ kind: 'limit' }));
  });
});
