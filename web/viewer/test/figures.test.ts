/**
 * Figures of the whole way, server and page on one machine: the delay from the end of a tick to the
 * update in the page; the time that lumels take of the page's thread by the clock, and that the whole update
 * works on it; and the time that the page's light takes to follow a moved sun. The page does not draw
 * meanwhile: without a GPU that would take the server's processor.
 *
 *     LUMENCAST_BIN=target/release/lumencast npm run figures
 *
 * LUMENCAST_FIGURES names a file for the figures as JSON.
 */
import { writeFileSync } from 'node:fs';
import { cpus } from 'node:os';
import { resolve } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { openPage } from './browser.js';
import { freePort, lumencastProgram, Server, sharedScene } from './server.js';

const VIEWPORT = { width: 400, height: 300 };
/** Updates whose way is timed; the session remembers 1,000 arrivals. */
const UPDATES_SECONDS = 38;
/** Seconds in which the time that lumels take is measured. */
const UPKEEP_SECONDS = 30;

const program = lumencastProgram();
const sponza = sharedScene('sponza/Sponza.glb');
const figures: Record<string, unknown> = { processor: cpus()[0]?.model, cores: cpus().length };

let browser: Browser;
beforeAll(async () => {
  browser = await launchBrowser();
});
afterAll(async () => {
  await browser.close();
  console.log(JSON.stringify(figures, undefined, 2));
  const file = process.env.LUMENCAST_FIGURES;
  if (file) writeFileSync(file, `${JSON.stringify(figures, undefined, 2)}\n`);
});

describe('the delay from the end of a tick to the update in a page', () => {
  it.each(['webtransport', 'websocket'])(
    'over %s',
    async (transport) => {
      // Fewer samples than there is time for: queueing behind the tracer is no part of the way.
      const server = await Server.start(program, 'cornell', await freePort(), ['--samples', '16'], {
        environment: { RUST_LOG: 'warn,lumencast_server=debug' },
      });
      try {
        const page = await openPage(browser, server.address, VIEWPORT, { transport });
        await page.waitForTimeout(UPDATES_SECONDS * 1000);
        const { timings, status } = await page.evaluate(() => {
          const { session } = window.lumencast!;
          return { timings: session.timings(), status: session.status };
        });
        expect(status).toMatchObject({ state: 'connected', transport });
        const ended = ticksEnded(server.output);
        // On joining, frames of the group under way come late.
        const first = timings[0].tick + 50;
        const delays = timings
          .filter(({ tick }) => tick > first && ended.has(tick))
          .map(({ tick, decoded }) => decoded - ended.get(tick)!);
        expect(delays.length).toBeGreaterThan(500);
        figures[`delay_ms_${transport}`] = { updates: delays.length, ...summary(delays) };
        await page.close();
      } finally {
        await server.kill();
      }
    },
    120_000,
  );
});

describe('the time of each picture that lumels take of the page’s thread, while a lamp moves', () => {
  const scripts = { cornell: 'minute', door: 'minute-door', tomb: 'minute-tomb' };
  const renderers = ['webgl', 'webgpu'];
  it.each(
    Object.entries(scripts).flatMap(([scene, script]) =>
      renderers.map((renderer) => ({ scene, script, renderer })),
    ),
  )(
    'in $scene by $renderer',
    async ({ scene, script, renderer }) => {
      const edits = resolve(import.meta.dirname, `../../../benches/${script}.jsonl`);
      const server = await Server.start(program, scene, await freePort(), ['--edits', edits]);
      // One of its own: without a GPU, what a page has asked for may be painted long after it is closed.
      const browser = await launchBrowser();
      try {
        const page = await openPage(browser, server.address, VIEWPORT, { renderer });
        const endTrace = await traceThread(page);
        const times = await page.evaluate(lumelTimes, UPKEEP_SECONDS);
        figures[`lumels_ms_${scene}_${renderer}`] = { pictures: times.length, ...summary(times) };
        figures[`update_thread_ms_${scene}_${renderer}`] = summary(threadTimes(await endTrace()));
      } finally {
        await browser.close();
        await server.kill();
      }
    },
    240_000,
  );
});

describe('the time from a moved sun to 95 % of its new light', () => {
  it.skipIf(!sponza)(
    'in Sponza',
    async () => {
      const options = ['--volume', '10x6x7', '--samples', '4..256'];
      const server = await Server.start(program, sponza!, await freePort(), options);
      try {
        const page = await openPage(browser, server.address, VIEWPORT);
        const followed = [];
        for (const degrees of [40, -40, 25]) followed.push(await page.evaluate(turnSun, degrees));
        figures.sun = followed;
        await page.close();
        for (const { toShare } of followed) expect(toShare['0.95']).toBeLessThan(30_000);
      } finally {
        await server.kill();
      }
    },
    300_000,
  );
});

/** When each tick ended, in milliseconds of the system's clock, as the server's log has it. */
function ticksEnded(log: string): Map<number, number> {
  const ended = new Map<number, number>();
  for (const [, day, microseconds, tick] of log.matchAll(
    /^(\S+T[\d:]+)\.(\d{6})Z .*tick published.*?tick=(\d+)/gm,
  )) {
    ended.set(Number(tick), Date.parse(`${day}Z`) + Number(microseconds) / 1000);
  }
  return ended;
}

function summary(values: readonly number[]): Record<'median' | 'p95' | 'p99' | 'max', number> {
  const sorted = values.toSorted((a, b) => a - b);
  const at = (q: number): number => sorted[Math.round(q * (sorted.length - 1))];
  return { median: at(0.5), p95: at(0.95), p99: at(0.99), max: at(1) };
}

/** In the page: what each update of the light takes for lumels, milliseconds by the clock. */
async function lumelTimes(seconds: number): Promise<number[]> {
  const { camera, light } = window.lumencast!;
  const times: number[] = [];
  for (const end = performance.now() + 1000 * seconds; performance.now() < end;) {
    await new Promise(requestAnimationFrame);
    performance.mark('update');
    light.update(camera);
    times.push(light.lumelTime);
  }
  return times;
}

/** What a trace tells of a stretch of a thread's work: when it began, and what it took; microseconds. */
interface TraceEvent {
  readonly name: string;
  readonly tid: number;
  readonly ts: number;
  readonly dur?: number;
  /** Time in which the thread ran: others may have had its core meanwhile. */
  readonly tdur?: number;
}

/** Traces what the page's threads do, until its result is called. */
async function traceThread(page: Page): Promise<() => Promise<TraceEvent[]>> {
  const client = await page.context().newCDPSession(page);
  const events: TraceEvent[] = [];
  client.on('Tracing.dataCollected', ({ value }) => void events.push(...(value as unknown as TraceEvent[])));
  const complete = new Promise((resolve) => client.on('Tracing.tracingComplete', resolve));
  await client.send('Tracing.start', {
    traceConfig: { includedCategories: ['devtools.timeline', 'blink.user_timing'] },
    transferMode: 'ReportEvents',
  });
  return async () => {
    await client.send('Tracing.end');
    await complete;
    return events;
  };
}

/** Milliseconds of work of each frame's callback in which the light was updated. */
function threadTimes(events: readonly TraceEvent[]): number[] {
  const marks = events.filter(({ name }) => name === 'update');
  const callbacks = events.filter(({ name }) => name === 'FireAnimationFrame');
  return marks.flatMap((mark) => {
    const around = callbacks.find(
      ({ tid, ts, dur = 0 }) => tid === mark.tid && ts <= mark.ts && mark.ts <= ts + dur,
    );
    return around?.tdur === undefined ? [] : [around.tdur / 1000];
  });
}

/**
 * In the page: turns the sun about the vertical and watches the light go from the old steady state A
 * to the new one B. The share at a moment is the light's projection on the way from A to B.
 */
async function turnSun(degrees: number) {
  const SETTLE = 20_000;
  const AVERAGE = 4_000;
  const { light, session, viewer } = window.lumencast!;
  const wait = (ms: number) => new Promise((resolve) => setTimeout(resolve, ms));
  const volume = () => session.light().fields.find((field) => field.kind === 'volume')!;
  const look = () => new Float32Array(volume().coefficients);
  const watch = async (ms: number) => {
    const seen: { at: number; light: Float32Array }[] = [];
    for (const start = performance.now(); performance.now() - start < ms; await wait(20)) {
      seen.push({ at: performance.now(), light: look() });
    }
    return seen;
  };
  const mean = (seen: { light: Float32Array }[]) =>
    seen[0].light.map((_, i) => seen.reduce((sum, { light }) => sum + light[i], 0) / seen.length);
  const dot = (a: Float32Array, b: Float32Array) => a.reduce((sum, value, i) => sum + value * b[i], 0);
  const minus = (a: Float32Array, b: Float32Array) => a.map((value, i) => value - b[i]);

  await wait(SETTLE);
  const before = mean(await watch(AVERAGE));
  const sun = viewer.lights[0];
  const turn = (degrees * Math.PI) / 180;
  const worldFromParent = sun.parent!.getWorldQuaternion(sun.quaternion.clone());
  const about = sun.quaternion.clone().set(0, Math.sin(turn / 2), 0, Math.cos(turn / 2));
  const rotation = worldFromParent
    .clone()
    .invert()
    .multiply(about)
    .multiply(worldFromParent)
    .multiply(sun.quaternion);
  const moved = performance.now();
  void light.edit({
    edit: 'move_node',
    node: light.content.nodeOf(sun)!,
    rotation: rotation.toArray() as [number, number, number, number],
  });
  const seen = await watch(SETTLE);
  const after = mean(await watch(AVERAGE));
  const { samples, tickRate } = session.stats;

  const way = minus(after, before);
  const length = dot(way, way);
  const shares = seen.map(({ light }) => dot(minus(light, before), way) / length);
  const toShare: Record<string, number> = {};
  for (const share of [0.5, 0.9, 0.95]) {
    const last = shares.findLastIndex((value) => value < share);
    toShare[share] = seen[Math.min(last + 1, seen.length - 1)].at - moved;
  }
  // What chance makes of steady light, to be compared with the 5 % that are left.
  const noise = Math.sqrt(
    shares.slice(-100).reduce((sum, value) => sum + (value - 1) ** 2, 0) / Math.min(shares.length, 100),
  );
  const change = Math.sqrt(length / dot(before, before));
  return { degrees, change, toShare, noise, samples, tickRate };
}
