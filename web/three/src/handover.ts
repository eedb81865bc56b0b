/**
 * The exponent of a display's codes. On the way from probes to lumels, light passes by even steps of these: an
 * even passage of light itself would be seen to jump where it comes out of black.
 */
export const GAMMA = 2.2;

/** Milliseconds in which a surface passes from probes to lumels, or back. */
const PASSAGE = 500;

/**
 * How far a surface has come on its way from probes to lumels, so many milliseconds later.
 * Twin: crates/cache/src/handover.rs.
 */
export function laterWay(way: number, comes: boolean, milliseconds: number): number {
  const step = Math.max(milliseconds, 0) / PASSAGE;
  return comes ? Math.min(way + step, 1) : Math.max(way - step, 0);
}
