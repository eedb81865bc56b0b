import { describe, expect, it, vi } from 'vitest';

import type { Vec3 } from '../src/edit.js';
import { byDistance, catalogOf, World } from './support/region-server.js';

// Minutes of a simulated connection to a thousand regions.
vi.setConfig({ testTimeout: 60_000 });

/** Tracks that may be read at once, and of these those of regions that are always read where some wait. */
const MOST = 80;
const NEAR = 64;
const CORNER: Vec3 = [0, 0, 0];

function join(...[counts, options]: [Vec3, ConstructorParameters<typeof World>[1]?]) {
  const catalog = catalogOf(counts);
  const world = new World(catalog, options);
  world.reading.setCamera(CORNER);
  return { catalog, world, order: byDistance(catalog, CORNER) };
}

describe('more regions than tracks that may be read', () => {
  it.each([
    // As of `--volume 64x32x32`: 48 wait, and 16 have had their turn after a second.
    { counts: [7, 4, 4] as Vec3, seconds: 4 },
    { counts: [10, 10, 10] as Vec3, seconds: 61 },
  ])('are all lit again and again: $counts', ({ counts, seconds }) => {
    const { world, order } = join(counts);
    world.run(0.1);
    const since = new Map(world.since);
    world.run(3 * seconds);
    expect(Math.max(...world.waits(0))).toBeLessThan(seconds);
    expect(world.mostRead).toBe(MOST);
    for (const region of order.slice(0, NEAR)) {
      const track = `f0/r${region}/l0`;
      expect(world.since.get(track), track).toBe(since.get(track));
    }
    // Far ones give their tracks up to each other, a few at a time.
    const asked = world.asked.slice(MOST);
    expect(asked.length).toBeGreaterThan(10 * seconds);
    asked.forEach((time, i) => expect((asked[i + 4] ?? Infinity) - time).toBeGreaterThan(0.2));
  });

  it('are all lit however long the server’s ticks take', () => {
    const { world } = join([7, 4, 4], { tick: 2 });
    world.run(200);
    // Layer 0 comes every 8 s, and a third of those that wait are read at once.
    expect(Math.max(...world.waits(0))).toBeLessThan(3 * 8 + 8);
  });

  it('keep their turn until there is newer light than what they had', () => {
    const { world } = join([7, 4, 4], { tick: 1, again: true });
    world.run(200);
    expect(Math.max(...world.waits(0))).toBeLessThan(3 * 4 + 4);
    // What they had is old, but not for the link's fault.
    expect(world.reading.layers.delay).toBeLessThan(0.1);
  });

  it('are all lit over a long way', () => {
    const { world } = join([7, 4, 4], { way: 0.3 });
    world.run(60);
    expect(Math.max(...world.waits(0))).toBeLessThan(5);
  });

  it('follow the camera: who is near is read at once', () => {
    const { world, catalog } = join([7, 4, 4]);
    world.run(10);
    const corner: Vec3 = [28, 16, 16];
    world.reading.setCamera(corner);
    world.run(10);
    const waits = world.waits(10);
    for (const region of byDistance(catalog, corner).slice(0, NEAR)) {
      expect(waits[region], `region ${region}`).toBeLessThan(0.5);
    }
    expect(Math.max(...world.waits(0))).toBeLessThan(5);
    expect(world.mostRead).toBe(MOST);
  });

  // A near region has 6.25 frames a second. One turn a second: 48 wait, and as many again that starve.
  it.each([
    { link: 'near ones and no more', frames: 64 * 6.25, steady: 48, most: 50 },
    { link: 'all near ones but some', frames: 60 * 6.25, steady: 48, most: 60 },
    { link: 'half of the near ones', frames: 32 * 6.25, steady: 16, most: 60 },
  ])('are all lit over a link that carries light of $link', ({ frames, steady, most }) => {
    const { world, order } = join([7, 4, 4], { rate: () => frames });
    world.run(300);
    const waits = world.waits(30);
    expect(Math.max(...waits)).toBeLessThan(most);
    for (const region of order.slice(0, steady)) expect(waits[region], `region ${region}`).toBeLessThan(1);
  });

  it('starve no longer where there are very many that are far', () => {
    const { world, order } = join([10, 10, 10], { rate: () => 32 * 6.25 });
    world.run(300);
    const waits = world.waits(30);
    // Every other turn of a second is for 32 of those that are near.
    for (const region of order.slice(0, NEAR)) expect(waits[region], `region ${region}`).toBeLessThan(75);
  });

  it('are lit as before some time after a link was too slow', () => {
    const { world } = join([7, 4, 4], { rate: (now) => (now < 60 ? 16 * 6.25 : 1000) });
    world.run(200);
    expect(Math.max(...world.waits(10, 60))).toBeGreaterThan(20);
    expect(Math.max(...world.waits(140))).toBeLessThan(4);
  });

  it.each(['nearest', 'farthest'])(
    'do not wait for long for the %s ones, which never have light',
    (which) => {
      const numbers = byDistance(catalogOf([7, 4, 4]), CORNER);
      const dark = new Set(which === 'nearest' ? numbers.slice(0, 10) : numbers.slice(-10));
      const { world } = join([7, 4, 4], { dark });
      world.run(300);
      const waits = world.waits(200).filter((_, region) => !dark.has(region));
      expect(Math.max(...waits)).toBeLessThan(6);
    },
  );

  it('do not starve while the server stands still', () => {
    const options = { tick: 0.04 };
    const { world, order } = join([7, 4, 4], options);
    world.run(20);
    const since = new Map(world.since);
    options.tick = Infinity;
    world.run(20);
    for (const region of order.slice(0, NEAR)) {
      const track = `f0/r${region}/l0`;
      expect(world.since.get(track), track).toBe(since.get(track));
    }
    options.tick = 0.04;
    world.run(20);
    expect(Math.max(...world.waits(40))).toBeLessThan(4);
  });
});

describe('no more regions than tracks that may be read', () => {
  it.each([
    { counts: [26, 1, 1] as Vec3, tracks: 78 },
    { counts: [80, 1, 1] as Vec3, tracks: 80 },
  ])('are read all the time: $counts', ({ counts, tracks }) => {
    const { world } = join(counts);
    world.run(30);
    expect(world.asked.length).toBe(tracks);
    expect(world.since.size).toBe(tracks);
    expect(Math.max(...world.waits(0))).toBeLessThan(0.3);
  });
  it('starve after so many ticks as are meant to be seconds apart', () => {
    const tick = 1;
    const world = new World(catalogOf([80, 1, 1], tick), { tick, rate: () => 80 / 4 / 2 });
    world.run(11);
    expect(world.since.size).toBe(80);
    world.run(14);
    expect(world.since.size).toBeLessThan(60);
  });
});
