import type { Timing } from '../api.js';
import { Rate } from './rates.js';

/** Arrivals that are remembered. */
const TIMINGS = 1000;

/** Counts what arrives, for stats and measurements. Times in seconds unless said otherwise. */
export class Meter {
  readonly ticks = new Rate();
  readonly bytes = new Rate();
  private readonly byTrack = new Map<string, Rate>();
  private readonly arrivals: Omit<Timing, 'clock'>[] = [];
  /** Of each field, which numbers its updates by itself, the newest and their rate. */
  private readonly updates = new Map<number, { newest: number; readonly rate: Rate }>();
  dropped = 0;

  /** Any frame of any track. */
  frame(track: string, bytes: number, now: number): void {
    this.bytes.add(bytes, now);
    let rate = this.byTrack.get(track);
    if (!rate) this.byTrack.set(track, (rate = new Rate()));
    rate.add(bytes, now);
  }

  /** A frame of light that was of use. */
  update(update: number, timing: Omit<Timing, 'clock'>, now: number): void {
    const known = this.updates.get(timing.field) ?? { newest: -1, rate: new Rate() };
    this.updates.set(timing.field, known);
    if (update > known.newest) {
      known.newest = update;
      known.rate.add(1, now);
    }
    this.arrivals.push(timing);
    if (this.arrivals.length > TIMINGS) this.arrivals.shift();
  }

  /** Updates are numbered anew, and tracks may be others. */
  restart(): void {
    for (const known of this.updates.values()) known.newest = -1;
    this.byTrack.clear();
  }

  /** Updates a second, of the field that gets most. */
  updateRate(now: number): number {
    return Math.max(0, ...[...this.updates.values()].map(({ rate }) => rate.at(now)));
  }

  bandwidthByTrack(now: number): Map<string, number> {
    return new Map([...this.byTrack].map(([track, rate]) => [track, rate.at(now)]));
  }

  /** The last arrivals, with the server's clock at the end of their ticks. */
  timings(clockOfTick: (field: number, tick: number) => number | undefined): Timing[] {
    return this.arrivals.map((arrival) => ({ ...arrival, clock: clockOfTick(arrival.field, arrival.tick) }));
  }
}
