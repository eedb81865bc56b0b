import type { Matrix4 } from 'three';

/** What numbers of a transform may differ by, of 1 and their own size together. */
const ROUNDING = 1e-5;

/**
 * Whether two transforms differ by no more than rounding. The server keeps single precision, so what a hand
 * has put down comes back from it a few bits beside its place.
 */
export function isSamePlace(a: Matrix4, b: Matrix4): boolean {
  return a.elements.every((value, i) => Math.abs(value - b.elements[i]) <= ROUNDING * (1 + Math.abs(value)));
}
