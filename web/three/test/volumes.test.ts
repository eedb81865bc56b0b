import type { Grid, Vec3, Vec4, VolumeShape } from '@lumencast/client';
import { describe, expect, it } from 'vitest';
import { withMargin } from '../src/margin.js';
import { L2_VALUES, Resampler, toL2 } from '../src/resample.js';
import { mostCells, planVolumes, type Volume } from '../src/volumes.js';

const WIDE = { grids: 8, textureSize: 2048 };
const QUARTER_ABOUT_Y: Vec4 = [0, Math.SQRT1_2, 0, Math.SQRT1_2];

function field(id: number, grid: Partial<Grid>, rest: Partial<VolumeShape> = {}): Volume {
  return {
    id,
    use: 'all',
    kind: 'volume',
    shape: {
      basis: 'sh',
      order: 2,
      grid: { center: [0, 0, 0], rotation: [0, 0, 0, 1], size: [4, 4, 4], resolution: [4, 4, 4], ...grid },
      offset: { cells: 0.5 },
      cellsMin: [0, 0, 0],
      regions: [],
      layers: 3,
      ...rest,
    },
  };
}

/** The same field with another box. */
function inGrid(field: Volume, grid: Partial<Grid>): Volume {
  return { ...field, shape: { ...field.shape, grid: { ...field.shape.grid, ...grid } } };
}

/** Coefficients whose c0 is a function of the probe's world position, for grids that are not turned. */
function fill({ shape: { grid, order } }: Volume, value: (position: Vec3) => number): Float32Array {
  const [nx, ny, nz] = grid.resolution;
  const stride = 3 * (order + 1) ** 2;
  const out = new Float32Array(nx * ny * nz * stride);
  for (let i = 0; i < nx * ny * nz; i++) {
    const cell = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))];
    out[i * stride] = value(
      cell.map(
        (c, axis) => grid.center[axis] + ((c + 0.5) / grid.resolution[axis] - 0.5) * grid.size[axis],
      ) as Vec3,
    );
  }
  return out;
}

describe('planVolumes', () => {
  it('shows an axis-aligned volume probe by probe', () => {
    const { grids, warnings } = planVolumes([field(0, { resolution: [10, 6, 7], size: [8, 6, 4] })], WIDE);
    expect(warnings).toEqual([]);
    expect(grids).toMatchObject([{ exact: true, resolution: [10, 6, 7], size: [8, 6, 4] }]);
  });

  it('says where light is meant to be read elsewhere than three.js does', () => {
    const { grids, warnings } = planVolumes([field(0, {}, { offset: { cells: 0.125 } })], WIDE);
    expect(warnings).toEqual([expect.stringContaining('0.125 cells off surfaces')]);
    expect(grids).toMatchObject([{ exact: true }]);
    expect(planVolumes([field(0, {}, { offset: { metres: 1 } })], WIDE).warnings).toHaveLength(1);
  });

  it('gives the finer of two overlapping volumes the higher priority', () => {
    const fine = field(7, { size: [1, 1, 1] });
    const { grids } = planVolumes([fine, field(3, {})], WIDE);
    expect(grids.map((grid) => grid.fields[0].id)).toEqual([3, 7]);
  });

  it('resamples a turned volume into its bounds, at its own spacing', () => {
    const turned = field(1, { rotation: QUARTER_ABOUT_Y, size: [2, 4, 8], resolution: [4, 4, 4] });
    const { grids, warnings } = planVolumes([turned], WIDE);
    expect(warnings).toHaveLength(1);
    expect(grids[0].exact).toBe(false);
    grids[0].size.forEach((s, axis) => expect(s).toBeCloseTo([8, 4, 2][axis]));
    expect(grids[0].resolution).toEqual([4, 4, 4]);
  });

  it('merges volumes past the free texture units, those that waste least space first', () => {
    const beside = [field(0, { center: [-2, 0, 0] }), field(1, { center: [2, 0, 0] })];
    const far = field(2, { center: [100, 0, 0] });
    const { grids, warnings } = planVolumes([...beside, far], { ...WIDE, grids: 2 });
    expect(warnings).toHaveLength(1);
    const merged = grids.find((grid) => !grid.exact)!;
    expect(merged).toMatchObject({ center: [0, 0, 0], size: [8, 4, 4], resolution: [8, 4, 4] });
    expect(grids.find((grid) => grid.exact)!.fields).toEqual([far]);
  });

  it('keeps a merged grid small however far its parts lie apart', () => {
    const apart = [field(0, { center: [-1000, 0, 0] }), field(1, { center: [1000, 0, 0] })];
    const { grids } = planVolumes(apart, { ...WIDE, grids: 1 });
    expect(grids[0].resolution.reduce((a, b) => a * b)).toBeLessThanOrEqual(16_384);
  });

  it('takes fewer slices where a device has small 3D textures', () => {
    const deep = field(0, { resolution: [2, 2, 40] });
    const { grids, warnings } = planVolumes([deep], { ...WIDE, textureSize: 256 });
    expect(grids[0].resolution).toEqual([2, 2, 34]);
    expect(warnings).toHaveLength(1);
    expect(planVolumes([deep], WIDE).grids[0].exact).toBe(true);
  });

  it('shows nothing, and says so, when no texture unit is free', () => {
    const { grids, warnings } = planVolumes([field(0, {})], { ...WIDE, grids: 0 });
    expect(grids).toEqual([]);
    expect(warnings[0]).toMatch(/texture unit/);
  });

  it('leaves volumes for moving instances out where there are others', () => {
    const moving: Volume = { ...field(1, {}), use: 'moving' };
    expect(planVolumes([field(0, {}), moving], WIDE).grids).toHaveLength(1);
    expect(planVolumes([moving], WIDE).grids).toHaveLength(1);
  });
});

describe('withMargin', () => {
  const margins = (fields: Volume[], textureSize = 2048) => {
    const { grids } = planVolumes(fields, { ...WIDE, textureSize });
    return grids.map((grid) => withMargin(grid, grids, mostCells(textureSize)));
  };

  it('goes on a cell beyond a lonely volume, with its outermost probes', () => {
    const lonely = field(0, { size: [8, 6, 4], resolution: [4, 3, 2] });
    const [grid] = margins([lonely]);
    expect(grid).toMatchObject({ center: [0, 0, 0], size: [12, 10, 8], resolution: [6, 5, 4] });
    const value = ([x, y, z]: Vec3) => x + 10 * y + 100 * z;
    const clamped = ([x, y, z]: Vec3): Vec3 => [
      Math.min(Math.max(x, -3), 3),
      Math.min(Math.max(y, -2), 2),
      Math.min(Math.max(z, -1), 1),
    ];
    const out = new Float32Array(6 * 5 * 4 * L2_VALUES);
    new Resampler(grid).fill([fill(lonely, value)], out);
    const { center, size, resolution } = grid;
    const beyond = fill(inGrid(lonely, { center, size, resolution }), (position) => value(clamped(position)));
    expect(out).toEqual(beyond);
  });

  it('does not reach into the next volume', () => {
    const [left, right] = margins([field(0, { center: [-2, 0, 0] }), field(1, { center: [2, 0, 0] })]);
    expect(left).toMatchObject({ center: [-2.5, 0, 0], size: [5, 6, 6], resolution: [5, 6, 6] });
    expect(right).toMatchObject({ center: [2.5, 0, 0], size: [5, 6, 6] });
  });

  it('leaves a volume within another alone', () => {
    const [coarse, fine] = margins([field(0, {}), field(1, { size: [1, 1, 1] })]);
    expect(coarse.resolution).toEqual([6, 6, 6]);
    expect(fine).toMatchObject({ exact: true, resolution: [4, 4, 4] });
  });

  it('stays within what textures hold', () => {
    expect(margins([field(0, { resolution: [2, 2, 33] })], 256)[0].resolution).toEqual([4, 4, 34]);
  });
});

describe('Resampler', () => {
  it('reproduces a linear function inside, and clamps outside', () => {
    const source = field(0, { resolution: [4, 4, 4] });
    const plan = { center: [0.1, 0, 0] as Vec3, size: [6, 2, 2] as Vec3, resolution: [12, 4, 4] as Vec3 };
    const out = new Float32Array(12 * 4 * 4 * L2_VALUES);
    const linear = ([x, y, z]: Vec3) => 3 + 2 * x - y + 0.5 * z;
    new Resampler({ ...plan, fields: [source], exact: false }).fill([fill(source, linear)], out);
    for (let x = 0; x < 12; x++) {
      const position: Vec3 = [0.1 + ((x + 0.5) / 12 - 0.5) * 6, -0.75, -0.75];
      position[0] = Math.min(Math.max(position[0], -1.5), 1.5);
      expect(out[x * L2_VALUES]).toBeCloseTo(linear(position), 5);
    }
  });

  it('reads a turned volume at the world position', () => {
    // Light that grows along the box's own x, which after a quarter turn about y points to −z.
    const source = field(0, { rotation: QUARTER_ABOUT_Y, resolution: [4, 1, 1] });
    const along = inGrid(source, { rotation: [0, 0, 0, 1] });
    const out = new Float32Array(4 * L2_VALUES);
    const plan = planVolumes([source], WIDE).grids[0];
    expect(plan.resolution).toEqual([1, 1, 4]);
    new Resampler(plan).fill([fill(along, ([x]) => x)], out);
    for (const [i, expected] of [1.5, 0.5, -0.5, -1.5].entries()) {
      expect(out[i * L2_VALUES]).toBeCloseTo(expected, 5);
    }
  });

  it('takes each probe from the finer field that holds it, and is dark where none has come', () => {
    const coarse = field(0, { size: [4, 4, 4], resolution: [1, 1, 1] });
    const fine = field(1, { center: [1, 0, 0], size: [2, 4, 4], resolution: [1, 1, 1] });
    const plan = {
      center: [0, 0, 0] as Vec3,
      size: [4, 4, 4] as Vec3,
      resolution: [2, 1, 1] as Vec3,
      exact: false,
    };
    const resampler = new Resampler({ ...plan, fields: [fine, coarse] });
    const out = new Float32Array(2 * L2_VALUES);
    const [one, two] = [fill(fine, () => 1), fill(coarse, () => 2)];
    resampler.fill([one, two], out);
    expect([out[0], out[L2_VALUES]]).toEqual([2, 1]);
    resampler.fill([undefined, two], out);
    expect([out[0], out[L2_VALUES]]).toEqual([2, 0]);
  });
});

describe('toL2', () => {
  it.each([1, 3, 4])('keeps the shared bands of order %d', (order) => {
    const stride = 3 * (order + 1) ** 2;
    const coefficients = Float32Array.from({ length: stride * 2 }, (_, i) => i + 1);
    const out = toL2(coefficients, order, new Float32Array(2 * L2_VALUES));
    const shared = Math.min(stride, L2_VALUES);
    for (const probe of [0, 1]) {
      const own = [...out.subarray(probe * L2_VALUES, (probe + 1) * L2_VALUES)];
      expect(own.slice(0, shared)).toEqual([
        ...coefficients.subarray(probe * stride, probe * stride + shared),
      ]);
      expect(own.slice(shared).every((value) => value === 0)).toBe(true);
    }
  });
});
