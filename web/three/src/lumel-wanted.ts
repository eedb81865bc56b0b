/** Which primitives are to have lumels, as layouts say, and where each copy of them has its own. */
import type { LightmapLayout, LightmapSurface } from '@lumencast/client';
import type { Corners, Sides } from './charted.js';

/** Where surfaces lie in the texture of all pages. */
export interface PlacedLayout {
  readonly layout: LightmapLayout;
  /** The first lumel of a page there. */
  readonly corner: (page: number) => readonly [x: number, y: number];
}

/** Charts of both sides, and where their rectangles lie. */
export interface Placed {
  readonly sides: Sides;
  readonly corners: readonly [front: Corners, back: Corners];
}

/** A primitive of a node that is to have lumels. */
export interface Wanted {
  readonly node: number;
  readonly primitive: number;
  /** Of the node's instances by number; a node that is not instanced has number 0 alone. */
  readonly copies: ReadonlyMap<number, Placed>;
}

/** What layouts give lumels to, by node and primitive. */
export function wantedBy(layouts: readonly PlacedLayout[]): ReadonlyMap<string, Wanted> {
  const all = new Map<string, Wanted & { readonly copies: Map<number, Placed> }>();
  for (const { layout, corner } of layouts) {
    for (const surface of layout.surfaces) {
      if (surface.rectangles.length !== surface.charts.sizes.length) continue;
      const { node, primitive, copy } = surface;
      const key = `${node}/${primitive}`;
      const wanted = all.get(key) ?? { node, primitive, copies: new Map<number, Placed>() };
      all.set(key, wanted);
      wanted.copies.set(copy, withSurface(wanted.copies.get(copy), surface, cornersOf(surface, corner)));
    }
  }
  return all;
}

/** A side that several layouts have is that of the first one. */
function withSurface(known: Placed | undefined, surface: LightmapSurface, corners: Corners): Placed {
  const before: Placed = known ?? { sides: [undefined, undefined], corners: [[], []] };
  const side = Number(surface.back);
  if (before.sides[side]) return before;
  return {
    sides: before.sides.with(side, surface.charts) as unknown as Sides,
    corners: before.corners.with(side, corners) as unknown as Placed['corners'],
  };
}

function cornersOf({ rectangles }: LightmapSurface, corner: PlacedLayout['corner']): Corners {
  return rectangles.map(({ page, x, y }) => {
    const [left, top] = corner(page);
    return [left + x, top + y] as const;
  });
}

export function isSame(a: Wanted, b: Wanted): boolean {
  return a.copies.size === b.copies.size && [...a.copies].every(([copy, of]) => isAt(of, b.copies.get(copy)));
}

function isAt(a: Placed, b: Placed | undefined): boolean {
  return (
    b !== undefined &&
    a.sides.every((charts, side) => charts === b.sides[side] && areAt(a.corners[side], b.corners[side]))
  );
}

function areAt(a: Corners, b: Corners): boolean {
  return a.length === b.length && a.every(([x, y], i) => x === b[i][0] && y === b[i][1]);
}
