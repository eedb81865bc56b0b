/** Seconds, and ticks, without light after which a region counts as starved. */
const STARVED = { seconds: 3, ticks: 12 } as const;
/** Seconds that a turn takes at most. */
const LONGEST = 4;

/** Times in seconds. */
interface Region {
  heard: boolean;
  /** When light last came. */
  heardAt: number;
  /** When the last turn began. */
  turnAt: number;
}

/**
 * What to read where the link is too slow for the lowest layer of all regions. In the order of distance
 * alone far regions would get nothing, while what the server sends for them heaps up at its end. So a
 * region that starves is read no more, but for turns: one region at a time goes before all others, until
 * its light comes. Then nobody has a turn for as long as that took, which leaves half of the link to near
 * regions. Owns no clock; times in seconds.
 */
export class Turns {
  private readonly regions: Map<string, Region>;
  private readonly patience: number;
  private paused: ReadonlySet<string> = new Set();
  private current: string | undefined;
  private restUntil = -Infinity;

  /** `names`: the tracks of the regions' lowest layers. */
  constructor(names: readonly string[], tickSeconds: number, now: number) {
    this.regions = new Map(names.map((name) => [name, { heard: false, heardAt: now, turnAt: -Infinity }]));
    this.patience = Math.max(STARVED.seconds, STARVED.ticks * tickSeconds);
  }

  /** The track that goes before all others. */
  get turn(): string | undefined {
    return this.current;
  }

  /** Whether a track is to be read at all. */
  reads(name: string): boolean {
    return !this.paused.has(name);
  }

  /** Light of a region came. */
  heard(name: string): void {
    const region = this.regions.get(name);
    if (region) region.heard = true;
  }

  /**
   * To be called some times a second; `slow`: whether the link is too slow for more than the lowest
   * layer. Returns whether what is to be read has changed.
   */
  judge(now: number, slow: boolean): boolean {
    const turn = this.current === undefined ? undefined : this.regions.get(this.current);
    const over = turn && (turn.heard || now - turn.turnAt >= LONGEST);
    if (over) this.restUntil = now + (now - turn.turnAt);
    const starved: [string, Region][] = [];
    for (const [name, region] of this.regions) {
      if (region.heard || !slow) region.heardAt = now;
      region.heard = false;
      if (now - region.heardAt >= this.patience) starved.push([name, region]);
    }
    let next = over || !slow ? undefined : this.current;
    if (next === undefined && now >= this.restUntil && starved.length > 0) {
      // Who has waited longest: for light, or since a turn that brought none.
      const waiting = ([, { heardAt, turnAt }]: [string, Region]) => Math.max(heardAt, turnAt);
      const [name, region] = starved.reduce((a, b) => (waiting(b) < waiting(a) ? b : a));
      region.turnAt = now;
      next = name;
    }
    const paused = new Set(starved.map(([name]) => name).filter((name) => name !== next));
    const same =
      next === this.current &&
      paused.size === this.paused.size &&
      [...paused].every((n) => this.paused.has(n));
    this.current = next;
    this.paused = paused;
    return !same;
  }
}
