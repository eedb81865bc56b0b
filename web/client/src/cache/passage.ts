/** Seconds that a change takes to show at most, however long the silence before it was. */
export const LONGEST_PASSAGE = 0.5;

/**
 * The way of a region's light from what was shown when its newest update came to that update. It takes as
 * long as that was waited for, so the light never jumps, is late by one interval, and stands still when an
 * update is overdue. Times in seconds.
 */
export class Passage {
  private began: number | undefined;
  private seconds = 0;

  /**
   * Newer light came. `made`: how long after the light before it was computed, 0 where nobody knows; what
   * comes in a burst passes over the time in which it was made.
   */
  begin(now: number, made: number): void {
    // The first light is there at once.
    this.seconds = this.began === undefined ? 0 : Math.min(Math.max(now - this.began, made), LONGEST_PASSAGE);
    this.began = now;
  }

  /** How far along the way, 0 to 1. */
  at(now: number): number {
    if (this.began === undefined || !(this.seconds > 0)) return 1;
    return Math.min(1, Math.max(0, (now - this.began) / this.seconds));
  }
}
