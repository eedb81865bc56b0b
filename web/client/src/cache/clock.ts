/** Seconds over which the least delay is remembered, at least; at most twice as long. */
const WINDOW = 10;
/** Ticks of which the clock is remembered. */
const TICKS = 1024;

/**
 * The server's clock as seen from here, by minimum-delay filtering: of all frames that came lately the
 * one that was fastest tells best how the two clocks stand. So server time is late by the least delay
 * of the way, never by the queues on it. All times in seconds.
 */
export class ServerClock {
  private least: number | undefined;
  private leastBefore: number | undefined;
  private windowStart = 0;
  private readonly ticks: { tick: number; clock: number }[] = [];

  constructor(private readonly tickSeconds: number) {}

  /** Takes in that the server sent `clock` in the frame of `tick`, which came at `now`. */
  sample(tick: number, clock: number, now: number): void {
    const difference = now - clock;
    if (this.least === undefined || now - this.windowStart > WINDOW) {
      this.leastBefore = this.least;
      this.least = difference;
      this.windowStart = now;
    }
    this.least = Math.min(this.least, difference);
    this.ticks.push({ tick, clock });
    if (this.ticks.length > TICKS) this.ticks.shift();
  }

  /** The server's clock at `now`. */
  at(now: number): number | undefined {
    if (this.least === undefined) return undefined;
    return now - Math.min(this.least, this.leastBefore ?? Infinity);
  }

  /** The server's clock at the end of a tick: as it was sent, `undefined` when it was not. */
  sent(tick: number): number | undefined {
    return this.ticks.findLast((sample) => sample.tick === tick)?.clock;
  }

  /** The same, reckoned from the newest tick where the tick's own frame has not come. */
  of(tick: number): number | undefined {
    const newest = this.ticks.at(-1);
    if (!newest) return undefined;
    return this.sent(tick) ?? newest.clock + (tick - newest.tick) * this.tickSeconds;
  }
}
