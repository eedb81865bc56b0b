import { random } from './random.js';

/** A link that loses, delays and so reorders what is sent over it; time is the caller's. */
export class SimulatedLink<T> {
  private readonly under: { at: number; what: T }[] = [];
  private readonly random: () => number;
  lost = 0;
  reordered = 0;

  constructor(private readonly options: { loss?: number; delay?: [number, number]; seed?: number } = {}) {
    this.random = random(options.seed ?? 1);
  }

  send(what: T, now: number): void {
    if (this.random() < (this.options.loss ?? 0)) {
      this.lost++;
      return;
    }
    const [least, most] = this.options.delay ?? [0, 0];
    const at = now + least + (most - least) * this.random();
    if (this.under.some((other) => other.at > at)) this.reordered++;
    this.under.push({ at, what });
  }

  /** What has arrived by `now`, in order of arrival. */
  *arrived(now: number): Generator<{ at: number; what: T }> {
    this.under.sort((a, b) => a.at - b.at);
    while (this.under.length > 0 && this.under[0].at <= now) {
      const next = this.under.shift();
      if (next) yield next;
    }
  }
}
