/** Charts: how the triangles of a primitive lie on rectangles of lumels (docs/wire.md, "Charts"). */

/** How the triangles of a primitive lie on rectangles of lumels. */
export interface Charts {
  /** Lumels of each rectangle along x and y. */
  readonly sizes: readonly (readonly [number, number])[];
  /** Of each chart vertex the vertex of the primitive, as numbered in the glTF file. */
  readonly sources: Uint32Array;
  /** The rectangle of each chart vertex. */
  readonly rectangle: Uint32Array;
  /**
   * x, y of each chart vertex, lumels from its rectangle's corner; the middle of the first lumel is at
   * 0.5, 0.5.
   */
  readonly at: Float32Array;
  /**
   * Three chart vertices for each triangle of the primitive, in its order; −1, −1, −1 where it has no
   * lumels.
   */
  readonly triangles: Int32Array;
}
