import type { Charts } from '@lumencast/client';
import { FIRST, NO_LUMELS, type Sides } from './charted.js';
import type { Placed, Wanted } from './lumel-wanted.js';

/** Copies that are drawn in one go. */
export interface Copies extends Placed {
  /** What the attribute `LUMEL_CORNER` tells of each copy. */
  readonly each: Float32Array;
  /** Whether each copy has all the lumels that it should have. */
  readonly isWhole: boolean;
}

/** Rectangles of copies begin at each one's corner. */
const ORIGIN = [[0, 0]] as const;

/**
 * Lumels of `count` copies of a primitive. They show one geometry, whose vertices have the charts of most
 * copies on one rectangle. A side of a copy that has others, as where its size differs, has no lumels.
 */
export function lumelsOfCopies({ copies }: Wanted, count: number): Copies {
  const drawn = [...copies].filter(([copy]) => copy < count);
  const sides = ([0, 1] as const).map((side) =>
    mostFrequent(drawn.map(([, { sides }]) => sides[side]).filter((charts) => charts?.sizes.length === 1)),
  ) as unknown as Sides;
  const each = new Float32Array(4 * count).fill(NO_LUMELS);
  let isWhole = true;
  for (const [copy, placed] of drawn) {
    placed.sides.forEach((charts, side) => {
      if (charts === undefined) return;
      if (charts !== sides[side]) return void (isWhole = false);
      const [x, y] = placed.corners[side][0];
      each.set([FIRST + x, FIRST + y], 4 * copy + 2 * side);
    });
  }
  return { sides, corners: [ORIGIN, ORIGIN], each, isWhole };
}

function mostFrequent(all: readonly (Charts | undefined)[]): Charts | undefined {
  const counts = new Map<Charts | undefined, number>();
  for (const charts of all) counts.set(charts, (counts.get(charts) ?? 0) + 1);
  return [...counts].sort(([, a], [, b]) => b - a)[0]?.[0];
}
