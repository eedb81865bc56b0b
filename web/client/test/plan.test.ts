import { describe, expect, it } from 'vitest';

import type { Catalog, FieldInfo } from '../src/codec/catalog.js';
import type { Region } from '../src/codec/volume-shape.js';
import type { Vec3, Vec4 } from '../src/edit.js';
import { boxDistance } from '../src/session/box.js';
import { planTracks } from '../src/session/plan.js';

const HALF = Math.SQRT1_2;

function field(
  regions: Region[],
  resolution: Vec3,
  rotation: Vec4 = [0, 0, 0, 1],
  layers = 3,
): FieldInfo<'volume'> {
  return {
    id: 3,
    use: 'all',
    kind: 'volume',
    shape: {
      basis: 'sh',
      order: 2,
      grid: { center: [10, 0, 0], rotation, size: [8, 4, 4], resolution },
      offset: { cells: 0.5 },
      cellsMin: [0, 0, 0],
      regions,
      layers,
    },
  };
}

function catalog(fields: FieldInfo[]): Catalog {
  const scene = { name: 'x', root: 'x.glb' };
  return { epoch: '0123456789abcdef', scene, tickSeconds: 0.04, fields, unknown: [] };
}

describe('the distance to a region', () => {
  const left: Region = { id: 0, min: [0, 0, 0], size: [4, 4, 4] };
  const right: Region = { id: 1, min: [4, 0, 0], size: [4, 4, 4] };

  it('is that to its box, 0 inside', () => {
    const { grid } = field([left, right], [8, 4, 4]).shape;
    // The left half reaches from x = 6 to 10, y and z from −2 to 2.
    expect(boxDistance(grid, left, [8, 1, -1])).toBe(0);
    expect(boxDistance(grid, left, [13, 0, 0])).toBe(3);
    expect(boxDistance(grid, left, [3, 6, 0])).toBe(5);
    expect(boxDistance(grid, right, [3, 0, 0])).toBe(7);
  });

  it('follows the box when it is turned', () => {
    // A quarter turn about +Y takes the grid's +x to the world's −z: the right half lies at z < 0.
    const { grid } = field([left, right], [8, 4, 4], [0, HALF, 0, HALF]).shape;
    expect(boxDistance(grid, right, [10, 0, -3])).toBeCloseTo(0);
    expect(boxDistance(grid, left, [10, 0, -3])).toBeCloseTo(3);
    expect(boxDistance(grid, left, [10, 0, 3])).toBeCloseTo(0);
  });
});

describe('the tracks to read', () => {
  const row = (count: number) =>
    Array.from({ length: count }, (_, id): Region => ({ id, min: [id, 0, 0], size: [1, 1, 1] }));

  it('are as many as a connection carries: low layers and near regions first', () => {
    const plan = planTracks(catalog([field(row(60), [60, 1, 1])]), 3, [6, 0, 0]);
    expect(plan.length).toBe(80);
    expect(plan.filter(({ layer }) => layer === 0).length).toBe(60);
    expect(plan.filter(({ layer }) => layer === 1).map(({ region }) => region)).toEqual(
      Array.from({ length: 20 }, (_, i) => i),
    );
  });

  it('have priorities between 0 and that of the state, in order', () => {
    for (const count of [1, 20, 200]) {
      const plan = planTracks(catalog([field(row(count), [count, 1, 1])]), 3, [6, 0, 0]);
      const priorities = plan.map(({ priority }) => priority);
      expect(priorities).toEqual(priorities.toSorted((a, b) => b - a));
      expect(Math.max(...priorities)).toBeLessThan(254);
      expect(Math.min(...priorities)).toBeGreaterThanOrEqual(0);
    }
  });

  it('leave out layers that a field lacks', () => {
    const one = field(row(1), [1, 1, 1], undefined, 1);
    expect(planTracks(catalog([one]), 3, undefined).map(({ name }) => name)).toEqual(['f3/r0/l0']);
  });
});
