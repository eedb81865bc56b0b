/** Layouts: where surfaces lie on the pages of a lightmap (docs/wire.md, "Layouts"). */
import type { Charts } from './charts.js';

/** Where surfaces lie on the pages of a lightmap. */
export interface LightmapLayout {
  /** Lumels along both sides of each page. */
  readonly pageSize: number;
  readonly pages: number;
  /** Those of which the charts are known, in ascending order of node, copy, primitive and side. */
  readonly surfaces: readonly LightmapSurface[];
}

/** One side of a primitive of an instance of a node. */
export interface LightmapSurface {
  readonly node: number;
  /** Which of the node's instances. */
  readonly copy: number;
  /** Which primitive of the node's mesh. */
  readonly primitive: number;
  /** Whether it is the side on which triangles wind clockwise. */
  readonly back: boolean;
  readonly charts: Charts;
  /** Where each of the charts' rectangles lies. */
  readonly rectangles: readonly Rectangle[];
}

/** Where a rectangle of lumels lies: its page and its first lumel there. */
export interface Rectangle {
  readonly page: number;
  readonly x: number;
  readonly y: number;
}
