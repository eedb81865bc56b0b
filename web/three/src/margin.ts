import type { Vec3 } from '@lumencast/client';
import { type GridPlan, MAX_RESAMPLED, volume } from './volumes.js';

/**
 * The grid with a layer of cells more on each side where no other grid is within a cell's reach. A
 * surface is lit from half a cell in front of it, and three.js leaves dark what is lit from outside
 * every box: floors' undersides, whatever stands on a floor, walls seen from outside.
 */
export function withMargin(grid: GridPlan, all: readonly GridPlan[], maxCells: Vec3): GridPlan {
  const cell = grid.size.map((s, axis) => s / grid.resolution[axis]);
  const min = grid.center.map((c, axis) => c - grid.size[axis] / 2) as Vec3;
  const max = grid.center.map((c, axis) => c + grid.size[axis] / 2) as Vec3;
  const resolution: Vec3 = [...grid.resolution];
  const others = all.filter((other) => other !== grid);
  for (const axis of [0, 1, 2]) {
    for (const [side, step] of [[min, -cell[axis]] as const, [max, cell[axis]] as const]) {
      const layer = { min: [...min] as Vec3, max: [...max] as Vec3 };
      (step < 0 ? layer.max : layer.min)[axis] = side[axis];
      (step < 0 ? layer.min : layer.max)[axis] = side[axis] + step;
      const fits = resolution[axis] < maxCells[axis] && !others.some((other) => overlaps(other, layer));
      if (!fits) continue;
      side[axis] += step;
      resolution[axis]++;
    }
  }
  if (volume(resolution) > MAX_RESAMPLED || volume(resolution) === volume(grid.resolution)) return grid;
  return {
    center: min.map((m, axis) => (m + max[axis]) / 2) as Vec3,
    size: min.map((m, axis) => max[axis] - m) as Vec3,
    resolution,
    fields: grid.fields,
    exact: false,
  };
}

/** Whether a grid's box and another one share more than a face. */
function overlaps(grid: GridPlan, { min, max }: { min: Vec3; max: Vec3 }): boolean {
  const share = 1e-3;
  return grid.center.every(
    (c, axis) =>
      c + grid.size[axis] / 2 > min[axis] + share * grid.size[axis] &&
      c - grid.size[axis] / 2 < max[axis] - share * grid.size[axis],
  );
}
