import { describe, expect, it } from 'vitest';

import { LayerControl } from '../src/session/layers.js';
import { random } from './support/random.js';

const TICK = 0.04;
const FRAME = 1000;
const perUpdate = (layers: number) => [0.25, 0.5, 1][layers - 1];

/** A link with a rate and an endless buffer, as behind many a home router. */
class Link {
  private free = 0;
  delivered: { update: number; at: number; sent: number }[] = [];

  /** Bits a second at a time. */
  constructor(private readonly rate: (now: number) => number) {}

  send(update: number, now: number): void {
    // A buffer of two seconds; what finds it full is lost.
    if (this.free > now + 2) return;
    this.free = Math.max(this.free, now) + (8 * FRAME) / this.rate(now);
    this.delivered.push({ update, at: this.free, sent: now });
  }
}

/** Runs a server of 25 updates a second over a link; tells the layers asked for at each time. */
function simulate(
  rate: (now: number) => number,
  seconds: number,
  jitter = 0,
): { now: number; layers: number }[] {
  const control = new LayerControl(3, TICK, perUpdate);
  const link = new Link(rate);
  const noise = random(2);
  const history = [];
  for (let tick = 0; tick * TICK < seconds; tick++) {
    const now = tick * TICK;
    const layer = tick % 4 === 0 ? 0 : tick % 2 === 0 ? 1 : 2;
    if (layer < control.layers) link.send(tick, now);
    while (link.delivered.length > 0 && link.delivered[0].at <= now + TICK) {
      const { update, at, sent } = link.delivered.shift() as (typeof link.delivered)[0];
      control.arrived(update, at - sent + 0.02 + jitter * noise(), FRAME, at);
    }
    control.judge(now + TICK);
    history.push({ now, layers: control.layers });
  }
  return history;
}

/** Bits a second of all layers. */
const FULL = 25 * 8 * FRAME;

describe('temporal layers', () => {
  it('are all kept on a link that is fast enough, also with jitter', () => {
    for (const jitter of [0, 0.06]) {
      const history = simulate(() => 2 * FULL, 60, jitter);
      expect(history.every(({ layers }) => layers === 3)).toBe(true);
    }
  });

  it('are dropped until the rest gets through', () => {
    for (const [share, layers] of [
      [0.7, 2],
      [0.35, 1],
    ]) {
      const history = simulate(() => share * FULL, 60);
      const settled = history.filter(({ now }) => now > 8);
      const time = settled.filter((moment) => moment.layers === layers).length / settled.length;
      expect(time).toBeGreaterThan(0.75);
      expect(settled.some((moment) => moment.layers < layers)).toBe(false);
    }
  });

  it('are tried again ever more seldom while the link stays slow', () => {
    const history = simulate(() => 0.7 * FULL, 200);
    const tries = history
      .filter(({ now, layers }, i) => now > 5 && layers === 3 && history[i - 1].layers === 2)
      .map(({ now }) => now);
    expect(tries.length).toBeGreaterThan(2);
    expect(tries.length).toBeLessThan(8);
    const gaps = tries.slice(1).map((now, i) => now - tries[i]);
    expect(gaps.at(-1)).toBeGreaterThan(1.8 * gaps[0]);
  });

  it('come back when the link recovers', () => {
    const history = simulate((now) => (now < 20 ? 0.35 : 3) * FULL, 60);
    expect(history.find(({ now }) => now > 18)?.layers).toBe(1);
    expect(history.at(-1)?.layers).toBe(3);
  });

  it('come back soon also after many tries that failed', () => {
    // Two layers of three pass, for long: the third is tried ever more seldom. Then hardly one, then all.
    const rate = (now: number) => (now < 150 ? 0.7 : now < 160 ? 0.3 : 3) * FULL;
    const history = simulate(rate, 240);
    const back = (layers: number) =>
      history.find((moment) => moment.now > 160 && moment.layers === layers)!.now - 160;
    expect(history.find(({ now }) => now > 159)?.layers).toBe(1);
    expect(back(2)).toBeLessThan(12);
    expect(back(3)).toBeLessThan(75);
  });

  it('are dropped when nothing comes though the server goes on', () => {
    const control = new LayerControl(3, TICK, perUpdate);
    for (let tick = 0; tick < 50; tick++) {
      control.arrived(tick, 0.02, FRAME, tick * TICK);
      control.judge(tick * TICK);
    }
    expect(control.layers).toBe(3);
    for (let now = 2; now < 6; now += 0.25) control.judge(now);
    expect(control.layers).toBeLessThan(3);
  });

  it('stay where nothing tells how delivery should be', () => {
    const control = new LayerControl(3, TICK, () => 0);
    for (let now = 0; now < 20; now += 0.25) control.judge(now);
    expect(control.layers).toBe(3);
  });

  it('wait longer where the estimate says that one more would not fit', () => {
    const recovery = (bandwidth: number | undefined) => {
      const control = new LayerControl(2, TICK, perUpdate);
      for (let tick = 0; tick < 2000; tick++) {
        const now = tick * TICK;
        const due = tick % 4 === 0 || (control.layers === 2 && tick % 4 === 2);
        // Late until second 4, in time from then on.
        if (due) control.arrived(tick, now < 4 ? 0.02 + now / 2 : 0.02, FRAME, now);
        control.judge(now, bandwidth);
        if (now > 5 && control.layers === 2) return now;
      }
      return Infinity;
    };
    expect(recovery(0.1 * FULL)).toBeGreaterThan(recovery(FULL) + 5);
    expect(recovery(undefined)).toBe(recovery(FULL));
  });
});
