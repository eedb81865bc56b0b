/** Pages of one lightmap. */
export interface PageSet {
  /** Lumels along both sides of each. */
  readonly pageSize: number;
  readonly pages: number;
  /** Whether they have slopes, which take as much room again. */
  readonly slopes?: boolean;
}

/** Where pages lie in the one texture that holds all of them. */
export interface AtlasPlan {
  readonly width: number;
  readonly height: number;
  /** Rows from a lumel to its slope; 0 where there are none, or no room for them. */
  readonly slopes: number;
  /** The first lumel of a page of the lightmap of a number. */
  corner(lightmap: number, page: number): readonly [x: number, y: number];
}

/**
 * Lays the pages of all lightmaps out in a square, or in one without its last row: one texture takes one
 * unit. Each square grows by a column and then by a row, so that pages stay where they are as others are
 * added behind them. Between pages nothing is left free, as charts keep two lumels from their page's border.
 * Slopes lie below all pages.
 * @returns `undefined` where a texture of this device has no room for them
 */
export function planAtlas(lightmaps: readonly PageSet[], textureSize: number): AtlasPlan | undefined {
  const side = Math.max(0, ...lightmaps.map(({ pageSize }) => pageSize));
  const count = lightmaps.reduce((sum, { pages }) => sum + pages, 0);
  const columns = Math.ceil(Math.sqrt(count));
  if (columns * side > textureSize) return undefined;
  const first = lightmaps.map((_, i) => lightmaps.slice(0, i).reduce((sum, { pages }) => sum + pages, 0));
  const rows = Math.ceil(count / Math.max(columns, 1)) * side;
  const hasSlopes = lightmaps.some(({ slopes }) => slopes) && 2 * rows <= textureSize;
  return {
    width: columns * side,
    height: hasSlopes ? 2 * rows : rows,
    slopes: hasSlopes ? rows : 0,
    corner(lightmap, page) {
      const cell = first[lightmap] + page;
      const square = Math.floor(Math.sqrt(cell));
      const beyond = cell - square ** 2;
      const [column, row] = beyond < square ? [square, beyond] : [beyond - square, square];
      return [column * side, row * side];
    },
  };
}
