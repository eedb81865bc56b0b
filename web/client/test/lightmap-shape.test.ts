/** Lightmaps in a catalog, and how their pages are cut into regions. */
import { describe, expect, it } from 'vitest';

import { isLightmap, offersSame, parseCatalog } from '../src/codec/catalog.js';
import { type LightmapShape, lumelCount, tileCount, tileOf } from '../src/codec/lightmap-shape.js';
import { layersOf, regionsOf } from '../src/session/regions.js';
import { FakeServer, json } from './support/fake-server.js';

type Loose = Record<string, any>;

const LAYOUT = 'ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad';

/** A catalog of a volume, and a lightmap of number 4. */
function catalog(change: (shape: Loose, catalog: Loose) => void = () => {}): Uint8Array {
  const value = JSON.parse(new TextDecoder().decode(new FakeServer().catalog)) as Loose;
  const shape: Loose = { coding: 'halves', page_size: 600, pages: 2, layout: LAYOUT };
  value.fields = [value.fields[0], { id: 4, use: 'static', kind: 'lightmap', shape }];
  change(shape, value);
  return json(value);
}

function shapeOf(changes: Partial<LightmapShape>): LightmapShape {
  return { coding: 'halves', pageSize: 1, pages: 1, layout: LAYOUT, ...changes };
}

describe('the shape of a lightmap', () => {
  it.each(['halves', 'h264', 'h264_stacked'])('is read with coding %s', (coding) => {
    const { fields, unknown } = parseCatalog(
      catalog((shape) => Object.assign(shape, { coding, layout: LAYOUT.toUpperCase() })),
    );
    const [lightmap] = fields.filter(isLightmap);
    expect([lightmap.id, lightmap.use, unknown]).toEqual([4, 'static', []]);
    expect(lightmap.shape).toEqual({ coding, pageSize: 600, pages: 2, layout: LAYOUT });
  });

  it.each(['av1', null, 7, undefined])('in coding %s is of a kind that is not known', (coding) => {
    const { fields, unknown } = parseCatalog(catalog((shape) => (shape.coding = coding)));
    expect(fields.map(({ kind }) => kind)).toEqual(['volume']);
    expect(unknown).toEqual([{ id: 4, kind: 'lightmap' }]);
  });

  it('may have slopes, whose regions come after those of irradiance', () => {
    const [, lightmap] = parseCatalog(catalog((shape) => (shape.slopes = true))).fields;
    expect(lightmap.shape).toEqual({
      coding: 'halves',
      pageSize: 600,
      pages: 2,
      slopes: true,
      layout: LAYOUT,
    });
    const shape = shapeOf({ pageSize: 300, pages: 2, slopes: true });
    expect([tileCount(shape), lumelCount(shape)]).toEqual([16, 4 * 300 ** 2]);
    const [size, min] = [
      [44, 44],
      [256, 256],
    ];
    expect([7, 15, 16].map((region) => tileOf(shape, region))).toEqual([
      { page: 1, min, size },
      { page: 1, slopes: true, min, size },
      undefined,
    ]);
  });

  const wrong: [string, unknown][] = [
    ['slopes', 1],
    ['slopes', null],
    ['page_size', 0],
    ['page_size', 4097],
    ['page_size', 1.5],
    ['pages', 0],
    ['pages', 24],
    ['layout', '12'],
    ['layout', null],
    ['layout', LAYOUT.replace('b', 'g')],
  ];
  it.each(wrong)('is left out where %s is %s', (member, value) => {
    const { fields, unknown } = parseCatalog(catalog((shape) => (shape[member] = value)));
    expect([fields.length, unknown]).toEqual([1, []]);
  });

  it('has a bounded number of regions, and of lumels with all others', () => {
    const kept = (change: (shape: Loose, catalog: Loose) => void) =>
      parseCatalog(catalog(change)).fields.length - 1;
    expect(kept((shape) => Object.assign(shape, { page_size: 1, pages: 4096 }))).toBe(1);
    expect(kept((shape) => Object.assign(shape, { page_size: 1, pages: 4097 }))).toBe(0);
    const full = (shape: Loose) => Object.assign(shape, { page_size: 1024, pages: 8 });
    expect(kept(full)).toBe(1);
    const another = (shape: Loose, { fields }: Loose) => {
      full(shape);
      fields.push({ ...fields[1], id: 5, shape: { ...shape, page_size: 1, pages: 1 } });
    };
    expect(() => kept(another)).toThrow(expect.objectContaining({ kind: 'limit' }));
  });

  it('may name another layout, and what is read stays the same', () => {
    const one = parseCatalog(catalog());
    const same = (change: (shape: Loose) => void) => offersSame(one, parseCatalog(catalog(change)));
    expect(same((shape) => (shape.layout = LAYOUT.replace('b', 'c')))).toBe(true);
    expect(same((shape) => (shape.coding = 'h264'))).toBe(false);
    expect(same((shape) => (shape.pages = 3))).toBe(false);
  });
});

describe('regions of a lightmap', () => {
  it.each([
    [1, 1, 'halves', 1],
    [256, 2, 'halves', 2],
    [300, 3, 'halves', 12],
    [1024, 1, 'halves', 16],
    [1024, 3, 'h264', 3],
    [300, 2, 'h264_stacked', 2],
  ] as const)('cover every lumel once: size %i, pages %i, %s', (pageSize, pages, coding, count) => {
    const shape = shapeOf({ pageSize, pages, coding });
    const seen = new Uint8Array(lumelCount(shape));
    for (let region = 0; region < tileCount(shape); region++) {
      const { page, min, size } = tileOf(shape, region)!;
      for (let y = min[1]; y < min[1] + size[1]; y++) {
        for (let x = min[0]; x < min[0] + size[0]; x++) seen[(page * pageSize + y) * pageSize + x]++;
      }
    }
    expect(tileCount(shape)).toBe(count);
    expect(seen.every((times) => times === 1)).toBe(true);
    for (const none of [count, -1, 0.5]) expect(tileOf(shape, none)).toBeUndefined();
  });

  it('are numbered page after page, row after row', () => {
    const tile = tileOf(shapeOf({ pageSize: 300, pages: 2 }), 5);
    expect(tile).toEqual({ page: 1, min: [256, 0], size: [44, 256] });
  });

  it('count as near everywhere, and have one layer', () => {
    const [field] = parseCatalog(catalog()).fields.filter(isLightmap);
    expect(layersOf(field)).toBe(1);
    const regions = regionsOf(field, [1e6, 0, 0]);
    expect(regions.map(({ region }) => region)).toEqual(Array.from({ length: 18 }, (_, i) => i));
    expect(regions.every(({ distance, layers }) => distance === 0 && layers === 1)).toBe(true);
  });
});
