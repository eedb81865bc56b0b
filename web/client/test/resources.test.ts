/** What is wanted, kept and forgotten of resources. */
import { describe, expect, it } from 'vitest';

import { Resources } from '../src/cache/resources.js';
import { type Catalog, isLightmap, parseCatalog } from '../src/codec/catalog.js';
import { LightmapServer } from './support/lightmap-server.js';
import { layoutOf, resource, triangle } from './support/resource-writer.js';

const shapeOf = (catalog: Catalog) => catalog.fields.filter(isLightmap)[0].shape;

function follow(resources: Resources, server: LightmapServer): Catalog {
  const catalog = parseCatalog(server.catalog);
  resources.follow(catalog);
  return catalog;
}

describe('resources', () => {
  it('that nothing names any more are forgotten, and wanted anew when something does again', () => {
    const resources = new Resources();
    const server = new LightmapServer();
    const shape = shapeOf(follow(resources, server));
    for (const { bytes } of server.resources) expect(resources.add(bytes)).toBe(true);
    expect(resources.hasAllOf(shape)).toBe(true);
    resources.follow({ ...parseCatalog(server.catalog), fields: [] });
    expect([resources.hasAllOf(shape), resources.wanted(), resources.layoutOf(shape)]).toEqual([
      false,
      [],
      undefined,
    ]);
    follow(resources, server);
    expect(resources.wanted()).toEqual([server.layout.hash]);
  });

  it('of which charts are missing or make no sense are not all there', () => {
    const rubbish = resource(new Uint8Array([1, 1]));
    const server = new LightmapServer({
      surfaces: [
        { node: 1, charts: triangle(4) },
        { node: 2, charts: rubbish },
      ],
    });
    const resources = new Resources();
    const shape = shapeOf(follow(resources, server));
    resources.add(server.layout.bytes);
    resources.add(triangle(4).bytes);
    expect([resources.hasAllOf(shape), resources.wanted()]).toEqual([false, [rubbish.hash]]);
    expect(() => resources.add(rubbish.bytes)).toThrow(expect.objectContaining({ kind: 'truncated' }));
    expect([resources.hasAllOf(shape), resources.wanted()]).toEqual([false, []]);
    expect(resources.layoutOf(shape)?.surfaces.map(({ node }) => node)).toEqual([1]);
  });

  it('share charts between layouts, and of two layouts only the one that gains is laid out again', () => {
    const catalog = parseCatalog(new LightmapServer().catalog);
    const [field] = catalog.fields.filter(isLightmap);
    const layouts = [
      layoutOf(16, 2, [{ node: 1, charts: triangle(4) }]),
      layoutOf(16, 2, [{ node: 2, charts: triangle(5) }]),
    ];
    const fields = layouts.map(({ hash }, id) => ({ ...field, id, shape: { ...field.shape, layout: hash } }));
    const resources = new Resources();
    resources.follow({ ...catalog, fields });
    for (const { bytes } of layouts) resources.add(bytes);
    const [first, second] = fields.map(({ shape }) => resources.layoutOf(shape));
    resources.add(triangle(4).bytes);
    expect(resources.layoutOf(fields[0].shape)).not.toBe(first);
    expect(resources.layoutOf(fields[1].shape)).toBe(second);
  });

  it('stay while a layout is on its way that may name them', () => {
    const resources = new Resources();
    const before = new LightmapServer();
    follow(resources, before);
    for (const { bytes } of before.resources) resources.add(bytes);
    const after = new LightmapServer({ surfaces: [{ node: 3, charts: triangle(4) }] });
    const shape = shapeOf(follow(resources, after));
    expect(resources.wanted()).toEqual([after.layout.hash]);
    resources.add(after.layout.bytes);
    expect(resources.wanted()).toEqual([]);
    expect(resources.layoutOf(shape)?.surfaces.map(({ node }) => node)).toEqual([3]);
    // Those that it does not name have gone.
    follow(resources, before);
    resources.add(before.layout.bytes);
    expect(resources.wanted()).toEqual([triangle(8).hash]);
  });

  it('are bounded in all', () => {
    const server = new LightmapServer();
    const sum = server.resources.reduce((bytes, one) => bytes + one.bytes.length, 0);
    for (const [most, fits] of [
      [sum, true],
      [sum - 1, false],
    ] as const) {
      const resources = new Resources(most);
      follow(resources, server);
      const [layout, first, last] = server.resources;
      for (const { bytes } of [layout, first]) expect(resources.add(bytes)).toBe(true);
      if (fits) expect(resources.add(last.bytes)).toBe(true);
      else expect(() => resources.add(last.bytes)).toThrow(expect.objectContaining({ kind: 'limit' }));
      expect(resources.wanted()).toEqual([]);
    }
  });
});
