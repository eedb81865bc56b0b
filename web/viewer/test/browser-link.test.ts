/**
 * A link that is made too slow while the light comes over it: upper layers are dropped, near regions stay
 * new, far ones old but not dark, and all is as before when the link is wide again. The page does not draw.
 *
 * Prints what it has measured. Where no such link can be made it is left out and says so, unless
 * LUMENCAST_LINK is `required`.
 */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, it } from 'vitest';
import { chromiumProgram, launchProgram } from '../../testing/chromium.js';
import { buildPage, openPage } from './browser.js';
import { NarrowLink, SLOW_ADDRESS } from './narrow-link.js';
import { lumencastProgram, Server } from './server.js';

const program = lumencastProgram();
const VIEWPORT = { width: 200, height: 150 };
const PORT = 4443;

/**
 * Eight regions in a row, x growing with their number. Few samples: noise makes long frames. Two layers of the
 * light pass over 0.8 Mbit/s, not over 0.6.
 */
const SCENE = ['cornell', '--volume', '80x5x5', '--samples', '2..2'];
const REGIONS = 8;
/** Ticks a second of the server. */
const TICKS = 25;
/** Beyond the first region's end. */
const CAMERA: [number, number, number] = [-5, 0, 0];
/** Megabits a second. */
const RATES = { wide: 100, half: 0.6, tooNarrow: 0.22 } as const;
/** Milliseconds to adapt in once layers are dropped, turns that begin meanwhile included, and to measure for. */
const ADAPT = 12_000;
const MEASURE = 5000;

const link = await NarrowLink.open().catch((error: Error) => {
  if (process.env.LUMENCAST_LINK === 'required') throw error;
  console.warn(`the test of slow links is left out: ${error.message}`);
  return undefined;
});

describe.skipIf(!link)('a link that is too slow', () => {
  let folder: string;
  let browser: Browser;
  let server: Server;
  let page: Page;

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), 'lumencast-link-'));
    await buildPage(join(folder, 'page'));
    if (!chromiumProgram) throw new Error('the test needs Chromium');
    browser = await launchProgram(link!.wrap(chromiumProgram, join(folder, 'chromium')));
    const [scene, ...options] = SCENE;
    const where = { host: SLOW_ADDRESS, inside: link!.inside };
    server = await Server.start(
      program,
      scene,
      PORT,
      [...options, '--fields', 'volume', '--page', join(folder, 'page')],
      where,
    );
  });

  // A page that stays open takes its share of the link.
  afterEach(() => page?.close());

  afterAll(async () => {
    await browser?.close();
    await server?.kill();
    link?.close();
    rmSync(folder, { recursive: true, force: true });
  });

  const layers = (count: number) =>
    page.waitForFunction((count) => window.lumencast!.session.stats.layers === count, count);

  it.each(['webtransport', 'websocket'])(
    'over %s',
    async (transport) => {
      await link!.carry(RATES.wide);
      page = await openPage(browser, server.address, VIEWPORT, { transport });
      await page.evaluate(watch, CAMERA);
      await layers(3);
      const measureAt = async (rate: number, ms = MEASURE) => {
        await link!.carry(rate);
        if (rate === RATES.wide) {
          // A page that has just begun may stall for a moment, and take fewer layers until it is over that.
          await page.waitForTimeout(1000);
          await layers(3);
        } else {
          // What has heaped up until the upper layers are dropped is to pass first.
          await layers(1);
          await page.waitForTimeout(ADAPT);
        }
        const figures = await page.evaluate((ms) => window.watched!.measure(ms), ms);
        console.log(row(transport, rate, figures));
        return figures;
      };

      const wide = await measureAt(RATES.wide, MEASURE / 2);
      expect(wide.layers).toContain(3);
      for (const { updates, median } of wide.regions) {
        expect(updates).toBeGreaterThan(0.8 * wide.tickRate);
        expect(median).toBeLessThan(0.2);
      }

      // Where more came than the server sent meanwhile, some had waited in the page.
      const rate = Math.min(wide.tickRate, TICKS);
      const half = await measureAt(RATES.half);
      expect(half.layers).toContain(1);
      expect(half.tickRate).toBeGreaterThan(0.9 * rate);
      for (const { updates, median, p99 } of half.regions) {
        // Layer 0 is every fourth update; trying more than the link carries costs some.
        expect(updates).toBeGreaterThan(0.125 * rate);
        expect(median).toBeLessThan(0.5);
        expect(p99).toBeLessThan(2);
      }

      const slow = await measureAt(RATES.tooNarrow, 3 * MEASURE);
      const [near, far] = [slow.regions[0], slow.regions[REGIONS - 1]];
      expect(slow.layers).toContain(1);
      expect(slow.tickRate).toBeGreaterThan(0.8 * rate);
      expect(near.updates).toBeGreaterThan(0.1 * rate);
      expect(near.median).toBeLessThan(1);
      expect(near.updates).toBeGreaterThan(3 * far.updates);
      expect(near.median).toBeLessThan(far.median / 3);
      // Far regions are old, but get their turn: without one they would be as old as the narrow link.
      const narrowFor = (ADAPT + 3 * MEASURE) / 1000;
      for (const { p99 } of slow.regions) expect(p99).toBeLessThan((2 / 3) * narrowFor);

      await link!.carry(RATES.wide);
      await layers(3);
      const after = await measureAt(RATES.wide, MEASURE / 2);
      for (const { updates, median } of after.regions) {
        expect(updates).toBeGreaterThan(0.8 * after.tickRate);
        expect(median).toBeLessThan(0.2);
      }

      expect(await page.evaluate(() => window.watched!.lost)).toBe(0);
    },
    300_000,
  );
});

/** Of one region over a while: updates a second, and the age of its light in seconds. */
interface RegionFigures {
  readonly updates: number;
  readonly median: number;
  readonly p99: number;
}

interface Figures {
  /** That were read, every half second: a layer that was dropped is tried again now and then. */
  readonly layers: readonly number[];
  /** Frames of the scene's state a second. */
  readonly tickRate: number;
  /** By number, and so by distance. */
  readonly regions: readonly RegionFigures[];
}

/** What a page knows of itself since it was opened. */
interface Watched {
  /** Connections lost. */
  lost: number;
  measure(ms: number): Promise<Figures>;
}

declare global {
  interface Window {
    watched?: Watched;
  }
}

/** In the page: keeps the books from now on. */
function watch(camera: [number, number, number]): void {
  const { session } = window.lumencast!;
  session.setCamera(camera);
  const count = session.catalog!.fields.find((field) => field.kind === 'volume')!.shape.regions.length;
  const fresh = () => Array.from({ length: count }, () => ({ updates: 0, ages: [] as number[] }));
  const newest = Array.from({ length: count }, () => -Infinity);
  let regions = fresh();
  let last = 0;
  // The server's clock less this page's, seconds: the way takes no time where it takes the least.
  let ahead = -Infinity;
  const note = () => {
    const now = performance.timeOrigin + performance.now();
    for (const { region, clock, decoded } of session.timings()) {
      if (decoded <= last) continue;
      // The state that tells it may still come.
      if (clock === undefined && now - decoded < 1000) break;
      last = decoded;
      regions[region].updates++;
      if (clock === undefined) continue;
      ahead = Math.max(ahead, clock - decoded / 1000);
      newest[region] = Math.max(newest[region], clock);
    }
    regions.forEach(({ ages }, region) => ages.push(now / 1000 + ahead - newest[region]));
  };
  const watched: Watched = {
    lost: 0,
    async measure(ms) {
      const rates: number[] = [];
      const layers: number[] = [];
      regions = fresh();
      for (let at = 0; at < ms; at += 500) {
        await new Promise((resolve) => setTimeout(resolve, 500));
        rates.push(session.stats.tickRate ?? 0);
        layers.push(session.stats.layers);
      }
      return {
        layers,
        tickRate: rates.reduce((a, b) => a + b) / rates.length,
        regions: regions.map(({ updates, ages }) => {
          const sorted = ages.toSorted((a, b) => a - b);
          const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))];
          return { updates: updates / (ms / 1000), median: at(0.5), p99: at(0.99) };
        }),
      };
    },
  };
  window.watched = watched;
  session.on('status', ({ state }) => (watched.lost += state === 'lost' ? 1 : 0));
  setInterval(note, 20);
}

/** A line of the table in docs/results/link.md. */
function row(transport: string, rate: number, { layers, regions }: Figures): string {
  const ms = (seconds: number) => `${Math.round(seconds * 1000)} ms`;
  const cells = ({ updates, median, p99 }: RegionFigures) =>
    `${updates.toFixed(1)} | ${ms(median)} / ${ms(p99)}`;
  const [near, far] = [regions[0], regions[REGIONS - 1]];
  const usual = layers.toSorted()[layers.length >> 1];
  return `| ${transport} | ${rate} | ${usual} | ${cells(near)} | ${cells(far)} |`;
}
