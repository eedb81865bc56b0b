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

/**
 * How much of a surface's light its lumels make where it has come so far: slowly at both ends. Where a
 * display's codes are dense, in the dark, an even passage would be seen to jump.
 */
export function shownShare(way: number): number {
  return way * way * (3 - 2 * way);
}
