/** Milliseconds in which a surface passes from probes to lumels, or back. */
const PASSAGE = 500;

/**
 * How much of a surface's light its lumels make, so many milliseconds later on its way to all or nothing.
 * Twin: crates/cache/src/handover.rs.
 */
export function laterShare(share: number, comes: boolean, milliseconds: number): number {
  const step = Math.max(milliseconds, 0) / PASSAGE;
  return comes ? Math.min(share + step, 1) : Math.max(share - step, 0);
}
