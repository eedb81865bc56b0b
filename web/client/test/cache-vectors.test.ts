/** `vectors/cache.json`, which Rust reads too: what a cache makes of what comes, and shows at times. */
import { describe, expect, it } from 'vitest';
import type { VolumeLight } from '../src/api.js';
import { Cache } from '../src/cache.js';
import { isVolume } from '../src/codec/catalog.js';
import { valuesPerProbe } from '../src/codec/volume-shape.js';
import { WireError } from '../src/wire-error.js';
import { FakeServer, json, TICK } from './support/fake-server.js';
import { lightFile } from './support/light-file.js';
import { readVectors } from './support/vectors.js';

interface Scenario {
  readonly name: string;
  /** The name under which the client's edits come back. */
  readonly client: string;
  readonly steps: readonly Step[];
}

/** One thing that comes, or is asked, at a time in seconds. */
interface Step {
  readonly at: number;
  readonly catalog?: unknown;
  readonly state?: unknown;
  readonly light?: {
    readonly field: number;
    readonly region: number;
    readonly layer: number;
    readonly frame: string;
  };
  /** A `.light` file. */
  readonly load?: string;
  /** Whether the light is newer than what its region had. */
  readonly news?: boolean;
  /**
   * The kind of error by which what comes is refused: `no_catalog` before there is one, `unknown` for fields
   * and regions that it lacks.
   */
  readonly refused?: string;
  readonly shows?: Shown;
}

const MEMBERS = ['at', 'catalog', 'state', 'light', 'load', 'news', 'refused', 'shows'];

/** What is to be seen. Of members that are absent nothing is said. */
interface Shown {
  /** Red of coefficient 0 of a field's first and last probe; `null` where nothing is shown. */
  readonly fields?: readonly {
    readonly field: number;
    readonly first: number | null;
    readonly last: number | null;
  }[];
  readonly age?: number | null;
  readonly scene_time?: number | null;
}

function play({ client, steps }: Scenario): void {
  const cache = new Cache(client);
  steps.forEach((step, number) => {
    const where = `step ${number}`;
    expect(MEMBERS, where).toEqual(expect.arrayContaining(Object.keys(step)));
    const { news, refused } = take(cache, step);
    expect(refused, where).toBe(step.refused);
    if (step.news !== undefined) expect(news, where).toBe(step.news);
    if (step.shows) expectShown(cache, step.at, step.shows, where);
  });
}

/** Hands to the cache what comes in a step. */
function take(cache: Cache, { at, catalog, state, light, load }: Step): { news?: boolean; refused?: string } {
  try {
    if (catalog !== undefined) cache.addCatalog(json(catalog), at);
    if (state !== undefined) cache.addState(json(state), at);
    if (load !== undefined) cache.load(bytesOfHex(load), at);
    if (!light) return {};
    const { field, region, layer, frame } = light;
    const received = cache.addLight(field, region, layer, bytesOfHex(frame), at);
    return received ? { news: received.news } : { refused: cache.catalog ? 'unknown' : 'no_catalog' };
  } catch (error) {
    if (error instanceof WireError) return { refused: error.kind };
    throw error;
  }
}

function expectShown(cache: Cache, at: number, shown: Shown, where: string): void {
  const light = cache.light(at);
  for (const { field, first, last } of shown.fields ?? []) {
    const lit = light.fields.filter(isVolume).find((one) => one.field.id === field);
    // Regions without light are dark.
    const [firstShown, lastShown] = lit ? endsOf(lit) : [0, 0];
    expectNear(firstShown, first ?? 0, 0.01, `${where}, first of field ${field}`);
    expectNear(lastShown, last ?? 0, 0.01, `${where}, last of field ${field}`);
  }
  expectTime(light.age, shown.age, `${where}, age`);
  expectTime(cache.sceneTime(at), shown.scene_time, `${where}, scene time`);
}

/** Red of coefficient 0 of the first and the last probe. */
function endsOf({ coefficients, field }: VolumeLight): [number, number] {
  return [coefficients[0], coefficients[coefficients.length - valuesPerProbe(field.shape.order)]];
}

/** Expects a time, or with `null` that there is none. */
function expectTime(found: number | undefined, wanted: number | null | undefined, what: string): void {
  if (wanted === undefined) return;
  if (wanted === null || found === undefined) expect(found ?? null, what).toBe(wanted);
  else expectNear(found, wanted, 0, what);
}

/** Expects a number within a share of it and 10⁻⁶. */
function expectNear(found: number, wanted: number, share: number, what: string): void {
  expect(Math.abs(found - wanted), `${what}: ${found}`).toBeLessThan(share * Math.abs(wanted) + 1e-6);
}

function bytesOfHex(hex: string): Uint8Array {
  return Uint8Array.from(Buffer.from(hex, 'hex'));
}

describe('vectors/cache.json', () => {
  const { scenarios } = readVectors<{ scenarios: readonly Scenario[] }>('cache');
  it.each(scenarios.map((scenario) => [scenario.name, scenario] as const))('%s', (_, scenario) =>
    play(scenario),
  );
});

describe('a scenario', () => {
  const hexOf = (bytes: Uint8Array) => Buffer.from(bytes).toString('hex');
  const read = (bytes: Uint8Array) => JSON.parse(new TextDecoder().decode(bytes)) as unknown;

  /** A file, the server's first updates, one of them lost, and its restart. */
  function scenario(): Scenario {
    const server = new FakeServer({ brightness: (update) => [1, 3][update] ?? 9 });
    const catalog = read(server.catalog);
    const [zero, one] = [server.step(), server.step()];
    while (server.tick < 4) server.step();
    const five = server.step();
    const light = (frame: { probes: { bytes: Uint8Array }[] }, layer: number) => ({
      field: 0,
      region: 0,
      layer,
      frame: hexOf(frame.probes[0].bytes),
    });
    const shows = (value: number | null) => ({ fields: [{ field: 0, first: value, last: value }] });
    const restarted = new FakeServer({ epoch: '00000000000000bb', regions: 2 });
    return {
      name: 'inline',
      client: 'me',
      steps: [
        { at: 0, shows: { ...shows(null), age: null, scene_time: null } },
        { at: 0, light: light(zero, 0), refused: 'no_catalog' },
        { at: 0, load: hexOf(lightFile(new FakeServer({ brightness: () => 7 }))) },
        { at: 0, shows: { ...shows(7), age: null, scene_time: null } },
        { at: 1, catalog },
        { at: 1, light: light(zero, 1), refused: 'malformed' },
        { at: 1, light: { ...light(zero, 0), region: 5 }, refused: 'unknown' },
        { at: 1, shows: shows(7) },
        { at: 1, light: light(zero, 0), news: true },
        // The file's light fades in half a second at most.
        { at: 1.25, shows: shows(4) },
        { at: 2, state: read(zero.state) },
        { at: 2, shows: { ...shows(1), age: 0, scene_time: 0 } },
        { at: 2 + TICK, light: light(one, 2), news: true },
        { at: 2 + TICK, light: light(one, 2), news: false },
        { at: 2.25 + TICK, shows: shows(2) },
        { at: 3, light: light(five, 2), refused: 'missing_base' },
        { at: 3.5, shows: { ...shows(3), age: 1.5 - TICK, scene_time: 1 } },
        { at: 4, catalog: read(restarted.catalog) },
        { at: 4, shows: { ...shows(3), age: null, scene_time: null } },
      ],
    };
  }

  it('is played', () => play(scenario()));

  it('fails where other light is shown', () => {
    const { steps, ...rest } = scenario();
    const last = steps[steps.length - 1];
    const wrong = { at: last.at, shows: { fields: [{ field: 0, first: 3.1, last: 3 }] } };
    expect(() => play({ ...rest, steps: [...steps.slice(0, -1), wrong] })).toThrow('first of field 0');
    const unrefused = steps.map(({ refused: _, ...step }) => step);
    expect(() => play({ ...rest, steps: unrefused })).toThrow('step 1:');
    const stale = steps.map((step) => (step.news === false ? { ...step, news: true } : step));
    expect(() => play({ ...rest, steps: stale })).toThrow('step 13:');
  });
});
