/** Seconds over which rates are averaged, at least. */
const WINDOW = 1;

/** A rate per second of something that is counted, over the last one to two seconds. */
export class Rate {
  private count = 0;
  private before = 0;
  private windowStart: number | undefined;
  private windowBefore = 0;

  add(amount: number, now: number): void {
    this.turn(now);
    this.count += amount;
  }

  /** Per second at `now`, seconds. */
  at(now: number): number {
    this.turn(now);
    if (this.windowStart === undefined) return 0;
    const seconds = now - this.windowStart + this.windowBefore;
    return (this.count + this.before) / Math.max(seconds, WINDOW);
  }

  private turn(now: number): void {
    this.windowStart ??= now;
    const seconds = now - this.windowStart;
    if (seconds < WINDOW) return;
    // After a silence longer than a window nothing of what was counted is left.
    this.before = seconds < 2 * WINDOW ? this.count : 0;
    this.windowBefore = Math.min(seconds, 2 * WINDOW);
    this.count = 0;
    this.windowStart = now;
  }
}
