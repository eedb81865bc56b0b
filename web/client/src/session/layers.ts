/** Seconds, and ticks, of arrivals that one judgement is made from, at least. */
const WINDOW = { seconds: 0.5, ticks: 12 } as const;
/** Seconds after a change before the next judgement: what was under way must pass first. */
const SETTLE = 1.5;
/**
 * Seconds of good delivery before a layer is added again: at first, at least where the estimate says that
 * it would not fit, and at most.
 */
const PATIENCE = { first: 4, tight: 16, most: 64 } as const;
/** A layer that had to be dropped within this time of being added makes the next try wait longer. */
const REGRET = 10;
/** Share of the frames that should have come. */
const SHARE = { bad: 0.75, good: 0.95 } as const;
/** Seconds for which the least delay is remembered. */
const MEMORY = 60;

/** Seconds a second by which the delay falls, at least, where a queue drains. */
const DRAIN = 0.05;

/**
 * Decides how many temporal layers to ask for. The link is too slow when light comes later and later
 * after it was computed, when frames that should have come did not, or when none comes at all while the
 * server goes on; then the top layer is dropped, half the bytes. After some seconds of good delivery it
 * is tried again; each failed try doubles the wait for that layer. Owns no clock; times in seconds.
 */
export class LayerControl {
  private current: number;
  private readonly window: number;
  private least = Infinity;
  private leastBefore = Infinity;
  private leastSince = -Infinity;
  private delays: number[] = [];
  private windowStart = -Infinity;
  private settledAt = -Infinity;
  private goodSince: number | undefined;
  /** By the layer to be added. */
  private readonly patience: number[];
  private addedAt = -Infinity;
  private badWindows = 0;
  private excess: number | undefined;
  private frames = 0;
  private bytes = 0;
  private first = NaN;
  private newest = NaN;
  private lastArrival = -Infinity;

  /**
   * `most`: layers that the server offers. `framesPerUpdate`: how many frames an update of the fields
   * brings on average when so many layers are read; 0 where nothing can be judged.
   */
  constructor(
    private readonly most: number,
    private readonly tickSeconds: number,
    private readonly framesPerUpdate: (layers: number) => number,
  ) {
    this.current = most;
    this.patience = Array<number>(most + 1).fill(PATIENCE.first);
    this.window = Math.max(WINDOW.seconds, WINDOW.ticks * tickSeconds);
  }

  /** Layers to ask for, 1 to what the server offers. */
  get layers(): number {
    return this.current;
  }

  /** Delay of arriving light over the least one seen, seconds. */
  get delay(): number | undefined {
    return this.excess;
  }

  /** A frame came: its update, the seconds between the end of its tick on the server's clock and now. */
  arrived(update: number, delay: number, bytes: number, now: number): void {
    if (now - this.leastSince > MEMORY) {
      this.leastBefore = this.least;
      this.least = Infinity;
      this.leastSince = now;
    }
    this.least = Math.min(this.least, delay);
    this.delays.push(delay);
    this.frames++;
    this.bytes += bytes;
    if (Number.isNaN(this.first)) this.first = update;
    this.newest = Math.max(update, Number.isNaN(this.newest) ? update : this.newest);
    this.lastArrival = now;
  }

  /**
   * To be called some times a second while the server's ticks arrive. `bandwidth`: bits a second that
   * the link carries, if that is known. Returns whether {@link layers} has changed.
   */
  judge(now: number, bandwidth?: number): boolean {
    if (this.windowStart === -Infinity) this.startWindow(now);
    const seconds = now - this.windowStart;
    if (seconds < this.window || now < this.settledAt) return false;
    const verdict = this.verdict(now);
    const bitRate = (8 * this.bytes) / seconds;
    this.startWindow(now);
    if (verdict === 'bad') return this.bad(now);
    this.badWindows = 0;
    if (verdict === 'fair') {
      this.goodSince = undefined;
      return false;
    }
    return this.good(now, bitRate, bandwidth);
  }

  private startWindow(now: number): void {
    this.windowStart = now;
    this.delays = [];
    this.frames = 0;
    this.bytes = 0;
    this.first = this.newest;
  }

  private verdict(now: number): 'good' | 'fair' | 'bad' {
    const tick = this.tickSeconds;
    if (this.framesPerUpdate(1) === 0) return 'fair';
    if (this.frames === 0) {
      const silence = now - Math.max(this.lastArrival, this.settledAt);
      return silence > 3 * this.window ? 'bad' : 'fair';
    }
    const least = Math.min(this.least, this.leastBefore);
    const sorted = this.delays.toSorted((a, b) => a - b);
    const before = this.excess ?? 0;
    this.excess = Math.max(0, sorted[sorted.length >> 1] - least);
    const share = this.share();
    if (share < SHARE.bad) return 'bad';
    if (this.excess > Math.max(3 * tick, 0.15)) {
      // A queue that drains, built up before the last drop, is no reason for another.
      return before - this.excess > DRAIN * this.window ? 'fair' : 'bad';
    }
    return this.excess < Math.max(1.5 * tick, 0.08) && share > SHARE.good ? 'good' : 'fair';
  }

  /** Frames that came, of those that should have: the newest update tells how many there were. */
  private share(): number {
    const expected = (this.newest - this.first) * this.framesPerUpdate(this.current);
    // Over few updates the layers' turns make the count too uneven to judge by.
    return this.newest - this.first < 8 ? 1 : this.frames / expected;
  }

  private bad(now: number): boolean {
    this.goodSince = undefined;
    // One bad window may be a hiccup, of the server or of this machine.
    if (++this.badWindows < 2 || this.current === 1) return false;
    if (now - this.addedAt < REGRET) {
      this.patience[this.current] = Math.min(2 * this.patience[this.current], PATIENCE.most);
    }
    this.change(this.current - 1, now);
    return true;
  }

  private good(now: number, bitRate: number, bandwidth: number | undefined): boolean {
    this.goodSince ??= now;
    if (now - this.addedAt > 3 * REGRET) this.patience[this.current] = PATIENCE.first;
    if (this.current === this.most) return false;
    // Each layer doubles the rate. Estimates of an idle link run low, so this only delays.
    const tight = bandwidth !== undefined && bandwidth < 2.2 * bitRate;
    const wait = Math.max(this.patience[this.current + 1], tight ? PATIENCE.tight : 0);
    if (now - this.goodSince < wait) return false;
    this.addedAt = now;
    this.change(this.current + 1, now);
    return true;
  }

  private change(layers: number, now: number): void {
    this.current = layers;
    this.settledAt = now + SETTLE;
    this.goodSince = undefined;
    this.badWindows = 0;
    this.first = NaN;
    this.newest = NaN;
    this.startWindow(now + SETTLE);
  }
}
