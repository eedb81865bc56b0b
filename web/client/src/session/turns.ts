/** Seconds, and ticks, without light after which a region counts as starved. */
const STARVED = { seconds: 3, ticks: 12 } as const;
/** Seconds, and ticks, that a turn takes at most. A region that is asked for has light within 4 ticks. */
const LONGEST = { seconds: 4, ticks: 8 } as const;
/** Regions that have a turn at once, where the link carries them. */
const PLACES = 16;
/**
 * Of these, how many give way at a beat: each turn begins with a keyframe, and they should not all come at
 * once.
 */
const GIVE_WAY = 4;
/** Seconds without want after which more than one region at a time has a turn again. */
const CALM = 10;

/** A turn of a region. */
interface Turn {
  readonly since: number;
  /** Whether it goes before all others. */
  readonly first: boolean;
  lit: boolean;
}

/**
 * Who is read now: near regions all the time, and in turn those for which there is no room. They wait, first
 * come, first served:
 *
 * - Far regions, where there are more than may be read at once. Of so many, all but {@link PLACES} are near.
 * - Regions that starve, where the link is too slow for the lowest layer of all that are near. By distance
 *   alone the farther ones would get nothing, while what the server sends for them heaps up at its end.
 *
 * A turn lasts until light comes. Where the link is good {@link PLACES} regions have one at once, after all
 * others, and {@link GIVE_WAY} give way at a beat. So with four beats a second n far regions have light every
 * n/16 seconds, or every ⌈n/16⌉ times the time that it takes to come where that is longer: of 112 regions
 * with room for 80, 48 are far and have light every 3 seconds; of 1000, every minute.
 *
 * Where somebody starves, or a turn brings nothing, the link is too slow for that. Then one region at a time
 * goes before all others, and nobody for as long as that took, which leaves half of the link to near regions.
 * Regions that starve and far ones take it in turns, so each of n has light after 2n turns of at most
 * {@link LONGEST} and as long rests.
 *
 * Owns no clock; times in seconds, in which the server ticks.
 */
export class Turns {
  /** When the light of each near region last came, or it began to be read. */
  private near = new Map<string, number>();
  private far: ReadonlySet<string> = new Set();
  /** Those that are not read, in the order in which they will be. */
  private waiting = new Set<string>();
  private readonly turns = new Map<string, Turn>();
  /** Of whom light came since the last beat. */
  private readonly lit = new Set<string>();
  /** Those that went before all others and had no light while others had: that is not the link's doing. */
  private readonly mute = new Set<string>();
  private starvedWasLast = true;
  private restUntil = -Infinity;
  private narrowUntil = -Infinity;

  /** `names`: the tracks of the regions' lowest layers, nearest first; `most` may be read at once. */
  constructor(
    names: readonly string[],
    private readonly tickSeconds: number,
    now: number,
    private readonly most = Infinity,
  ) {
    this.order(names, now);
  }

  /** The track that goes before all others. */
  get turn(): string | undefined {
    for (const [name, { first }] of this.turns) if (first) return name;
    return undefined;
  }

  /** Whether a track is to be read at all. */
  reads(name: string): boolean {
    return !this.waiting.has(name);
  }

  /** Whether a track is read in turns only. */
  isFar(name: string): boolean {
    return this.far.has(name);
  }

  /** Newer light of a region came. */
  heard(name: string): void {
    this.lit.add(name);
    this.mute.delete(name);
  }

  /** Takes in who is near now: the same names, nearest first. */
  order(names: readonly string[], now: number): void {
    const before = this.near;
    const count = names.length > this.most ? this.most - PLACES : names.length;
    this.near = new Map(names.slice(0, count).map((name) => [name, before.get(name) ?? now]));
    this.far = new Set(names.slice(count));
    for (const name of this.near.keys()) {
      if (before.has(name)) continue;
      this.waiting.delete(name);
      this.turns.delete(name);
    }
    for (const name of this.far) if (!this.turns.has(name)) this.waiting.add(name);
  }

  /**
   * A beat: to be called some times a second. `slow`: whether no more than the lowest layers is read. Returns
   * whether what is to be read has changed.
   */
  judge(now: number, slow: boolean): boolean {
    const { turn, waiting } = this;
    this.waiting = new Set(waiting);
    this.findStarved(now, slow, Math.max(STARVED.seconds, STARVED.ticks * this.tickSeconds));
    // In this order, so that places stay empty for a beat: streams count until the other end has closed them.
    this.beginTurns(now);
    this.endTurns(now, Math.max(LONGEST.seconds, LONGEST.ticks * this.tickSeconds));
    this.lit.clear();
    return (
      this.turn !== turn ||
      this.waiting.size !== waiting.size ||
      ![...this.waiting].every((name) => waiting.has(name))
    );
  }

  /** Near regions that starve wait for a turn; those that do no longer are read again. */
  private findStarved(now: number, slow: boolean, patience: number): void {
    for (const [name, heardAt] of this.near) {
      if (this.lit.has(name) || !slow) {
        this.near.set(name, now);
        this.waiting.delete(name);
        this.end(name, now);
      } else if (now - heardAt >= patience) {
        if (!this.turns.has(name)) this.waiting.add(name);
        if (!this.mute.has(name)) this.narrowUntil = now + CALM;
      }
    }
  }

  private beginTurns(now: number): void {
    const first = now < this.narrowUntil;
    const places = first ? (now < this.restUntil ? 0 : 1) : PLACES;
    while (this.turns.size < places && this.waiting.size > 0) {
      const name = this.next();
      this.waiting.delete(name);
      this.turns.set(name, { since: now, first, lit: false });
      this.starvedWasLast = this.starves(name);
    }
  }

  /** Of those that wait a far one after one that starves, and the other way round, where there are both. */
  private next(): string {
    const names = [...this.waiting];
    return names.find((name) => this.starves(name) !== this.starvedWasLast) ?? names[0];
  }

  private starves(name: string): boolean {
    return !this.far.has(name) && !this.mute.has(name);
  }

  private endTurns(now: number, longest: number): void {
    let giveWay = Math.min(GIVE_WAY, this.waiting.size);
    for (const [name, turn] of this.turns) {
      turn.lit ||= this.lit.has(name);
      const late = !turn.lit && now - turn.since >= longest;
      if (late && !turn.first && !this.mute.has(name)) this.narrowUntil = now + CALM;
      else if (late || turn.lit) {
        if (late && turn.first && this.lit.size > 0) this.mute.add(name);
        if (!turn.first && giveWay-- <= 0) continue;
        this.end(name, now);
        this.waiting.add(name);
      }
    }
    if (now < this.narrowUntil) this.stopTurns();
  }

  private end(name: string, now: number): void {
    const turn = this.turns.get(name);
    this.turns.delete(name);
    if (turn?.first) this.restUntil = now + (now - turn.since);
  }

  /** Ends the turns of many at once; those that had nothing from theirs will be the next. */
  private stopTurns(): void {
    const stopped = [...this.turns].filter(([, { first }]) => !first);
    const names = (lit: boolean) => stopped.filter(([, turn]) => turn.lit === lit).map(([name]) => name);
    for (const [name] of stopped) this.turns.delete(name);
    this.waiting = new Set([...names(false), ...this.waiting, ...names(true)]);
  }
}
