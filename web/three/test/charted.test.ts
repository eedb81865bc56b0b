/** Geometries parted by charts. */
import type { Charts } from '@lumencast/client';
import {
  BufferAttribute,
  BufferGeometry,
  InterleavedBuffer,
  InterleavedBufferAttribute,
  Mesh,
  PlaneGeometry,
  Raycaster,
  SkinnedMesh,
  Vector3,
} from 'three';
import { describe, expect, it, vi } from 'vitest';
import {
  canHaveLumels,
  chartedGeometry,
  disposeCharted,
  FIRST,
  isCharted,
  LUMEL_SHARE,
  LUMELS,
  lumelsAttribute,
  NO_LUMELS,
  part,
  type Sides,
  withoutCharts,
} from '../src/charted.js';

/** A square of two triangles, 0 2 1 and 2 3 1, each on a rectangle of its own. */
const APART: Charts = {
  sizes: [
    [4, 4],
    [4, 4],
  ],
  sources: new Uint32Array([0, 2, 1, 2, 3, 1]),
  rectangle: new Uint32Array([0, 0, 0, 1, 1, 1]),
  at: new Float32Array([0.5, 0.5, 0.5, 3.5, 3.5, 0.5, 0.5, 3.5, 3.5, 3.5, 3.5, 0.5]),
  triangles: new Int32Array([0, 1, 2, 3, 4, 5]),
};
/** Of the same square only the second triangle has lumels. */
const HALF: Charts = { ...APART, triangles: new Int32Array([-1, -1, -1, 3, 4, 5]) };
const AT: readonly (readonly [number, number])[] = [
  [10, 20],
  [30, 40],
];

function charted(geometry: BufferGeometry, sides: Sides): BufferGeometry {
  const parted = part(geometry, sides)!;
  return chartedGeometry(
    geometry,
    parted,
    lumelsAttribute(parted, sides, [AT, AT.map(([x, y]) => [x + 100, y])]),
  );
}

/** Of each corner of each triangle what an attribute says. */
const corners = (geometry: BufferGeometry, name: string) => {
  const attribute = geometry.getAttribute(name);
  return Array.from(geometry.index!.array, (vertex) =>
    Array.from({ length: attribute.itemSize }, (_, k) => attribute.getComponent(vertex, k)),
  );
};
const put = (x: number, y: number) => [FIRST + x, FIRST + y];

describe('a geometry parted by charts', () => {
  it('has the triangles that it had, each with its lumels', () => {
    const plane = new PlaneGeometry(2, 2);
    const made = charted(plane, [APART, undefined]);
    for (const name of ['position', 'normal', 'uv']) {
      expect(corners(made, name)).toEqual(corners(plane, name));
    }
    expect(corners(made, LUMELS)).toEqual([
      put(10.5, 20.5),
      put(10.5, 23.5),
      put(13.5, 20.5),
      put(30.5, 43.5),
      put(33.5, 43.5),
      put(33.5, 40.5),
    ]);
    expect(made.getAttribute('position').count).toBe(6);
    expect(plane.getAttribute('position').count).toBe(4);
    expect(plane.hasAttribute(LUMELS)).toBe(false);
  });

  it('keeps vertices of triangles without lumels together, and says that they have none', () => {
    const plane = new PlaneGeometry(2, 2, 2, 1);
    const [none, first] = [
      [-1, -1, -1],
      [0, 1, 2],
    ];
    const own = Array.from(plane.index!.array);
    const charts: Charts = {
      ...APART,
      sources: Uint32Array.from(own.slice(0, 3)),
      triangles: Int32Array.from([...first, ...none, ...none, ...none]),
    };
    const made = charted(plane, [charts, undefined]);
    expect(corners(made, 'position')).toEqual(corners(plane, 'position'));
    expect(corners(made, LUMELS).slice(3)).toEqual(own.slice(3).map(() => [NO_LUMELS, NO_LUMELS]));
    expect(made.getAttribute('position').count).toBe(3 + new Set(own.slice(3)).size);
  });

  it('knows the lumels of both sides, and which side has none', () => {
    const made = charted(new PlaneGeometry(2, 2), [HALF, APART]);
    const none = [NO_LUMELS, NO_LUMELS];
    expect(corners(made, LUMELS)).toEqual([
      [...none, ...put(110.5, 20.5)],
      [...none, ...put(110.5, 23.5)],
      [...none, ...put(113.5, 20.5)],
      [...put(30.5, 43.5), ...put(130.5, 43.5)],
      [...put(33.5, 43.5), ...put(133.5, 43.5)],
      [...put(33.5, 40.5), ...put(133.5, 40.5)],
    ]);
    const back = charted(new PlaneGeometry(2, 2), [undefined, HALF]);
    expect(corners(back, LUMELS)[3]).toEqual([...none, ...put(130.5, 43.5)]);
    expect(corners(back, LUMELS)[0]).toEqual([...none, ...none]);
  });

  it('keeps types of attributes, those in one buffer too', () => {
    const data = new InterleavedBuffer(
      new Float32Array(4 * 5).map((_, i) => i),
      5,
    );
    const geometry = new PlaneGeometry(2, 2);
    geometry.setAttribute('position', new InterleavedBufferAttribute(data, 3, 0));
    geometry.setAttribute('uv', new InterleavedBufferAttribute(data, 2, 3));
    const colors = new BufferAttribute(new Uint8Array([0, 64, 128, 255]), 1, true);
    geometry.setAttribute('shade', colors);
    const made = charted(geometry, [APART, undefined]);
    for (const name of ['position', 'uv', 'shade']) {
      expect(corners(made, name)).toEqual(corners(geometry, name));
    }
    const shade = made.getAttribute('shade') as BufferAttribute;
    expect([shade.array.constructor, shade.normalized]).toEqual([Uint8Array, true]);
  });

  it('may have no index of its own', () => {
    const geometry = new PlaneGeometry(2, 2).toNonIndexed();
    const charts = { ...APART, sources: new Uint32Array([0, 1, 2, 3, 4, 5]) };
    const made = charted(geometry, [charts, undefined]);
    const position = geometry.getAttribute('position');
    const own = Array.from({ length: 6 }, (_, i) => [0, 1, 2].map((k) => position.getComponent(i, k)));
    expect(corners(made, 'position')).toEqual(own);
  });

  it.each([
    ['more triangles', { triangles: new Int32Array(9).fill(-1) }],
    ['other vertices', { sources: new Uint32Array([0, 2, 1, 2, 1, 3]) }],
  ])('is not made by charts of %s', (_, other) => {
    expect(part(new PlaneGeometry(2, 2), [{ ...APART, ...other }, undefined])).toBeUndefined();
    expect(part(new PlaneGeometry(2, 2), [APART, { ...APART, ...other }])).toBeUndefined();
  });

  it('stands in for its own in groups, ranges, bounds and rays', () => {
    const plane = new PlaneGeometry(2, 2);
    plane.addGroup(0, 3, 1);
    plane.setDrawRange(0, 3);
    const made = charted(plane, [APART, undefined]);
    expect(made.groups).toEqual(plane.groups);
    expect(made.drawRange).toEqual(plane.drawRange);
    expect(made.boundingSphere).toEqual(plane.boundingSphere);
    plane.setDrawRange(0, Infinity);
    made.setDrawRange(0, Infinity);
    plane.clearGroups();
    made.clearGroups();
    const hit = (geometry: BufferGeometry) => {
      const ray = new Raycaster(new Vector3(0.3, -0.6, 1), new Vector3(0, 0, -1));
      const [{ faceIndex, uv }] = ray.intersectObject(new Mesh(geometry));
      return [faceIndex, uv!.toArray()];
    };
    expect(hit(made)).toEqual(hit(plane));
  });

  it('is known from its own, which it gives back', () => {
    const plane = new PlaneGeometry(2, 2);
    const made = charted(plane, [APART, undefined]);
    expect([isCharted(made), isCharted(plane)]).toEqual([true, false]);
    expect([withoutCharts(made), withoutCharts(plane)]).toEqual([plane, plane]);
  });

  it('keeps what it shares when another one that shares it goes', () => {
    const plane = new PlaneGeometry(2, 2);
    const parted = part(plane, [APART, undefined])!;
    const lumels = () => lumelsAttribute(parted, [APART, undefined], [AT, []]);
    const [one, other] = [chartedGeometry(plane, parted, lumels()), chartedGeometry(plane, parted, lumels())];
    expect(one.getAttribute('position')).toBe(other.getAttribute('position'));
    const freed = vi.fn();
    one.addEventListener('dispose', () => freed(Object.keys(one.attributes), one.index));
    disposeCharted(one, false);
    // three.js frees the buffers of all attributes that a disposed geometry has.
    expect(freed).toHaveBeenCalledWith([LUMELS, LUMEL_SHARE], null);
  });
});

it('lumels are for plain meshes that do not deform', () => {
  expect(canHaveLumels(new Mesh(new PlaneGeometry()))).toBe(true);
  expect(canHaveLumels(new SkinnedMesh(new PlaneGeometry()))).toBe(false);
  const morphed = new PlaneGeometry();
  morphed.morphAttributes.position = [morphed.getAttribute('position') as BufferAttribute];
  expect(canHaveLumels(new Mesh(morphed))).toBe(false);
});
