import { bench, describe } from 'vitest';

import { packAtlas } from '../src/atlas.js';
import { Cache } from '../src/cache.js';
import { LumelDecoder } from '../src/codec/lumels.js';
import { ProbeDecoder } from '../src/codec/probes.js';
import type { Vec3 } from '../src/edit.js';
import { encodeLumels } from '../test/support/lumel-encoder.js';
import { encodeProbes } from '../test/support/probe-encoder.js';
import { random } from '../test/support/random.js';

const SIZE: Vec3 = [16, 16, 16];
const ORDER = 2;
const VALUES = 27;

/** Light that falls off from a corner, with a tenth of noise that differs by `seed`. */
function light(seed: number): Float32Array {
  const next = random(seed);
  return Float32Array.from({ length: 4096 * VALUES }, (_, i) => {
    const probe = Math.floor(i / VALUES);
    const [x, y, z] = [probe % 16, (probe >> 4) % 16, probe >> 8];
    return (100 / (1 + (i % VALUES)) / (4 + x + y + z)) * (1 + 0.1 * (next() - 0.5));
  });
}

const key = encodeProbes(light(1), SIZE, ORDER, -22, { update: 0 });
const delta = encodeProbes(light(2), SIZE, ORDER, -22, { update: 2, base: 0 }, key);
const rgb = new ProbeDecoder(SIZE, ORDER).decode(key.frame).coefficients;
const atlas = packAtlas(rgb, SIZE, ORDER, 32);
const decoder = new ProbeDecoder(SIZE, ORDER);
decoder.decode(key.frame);

const cache = new Cache('me');
const catalog = {
  lumencast: 1,
  epoch: '0123456789abcdef',
  scene: { name: 'x', root: 'x.glb' },
  tick_seconds: 0.04,
  fields: [
    {
      id: 0,
      use: 'all',
      kind: 'volume',
      shape: {
        basis: 'sh',
        order: ORDER,
        grid: { center: [0, 0, 0], rotation: [0, 0, 0, 1], size: [1, 1, 1], resolution: SIZE },
        regions: [{ id: 0, min: [0, 0, 0], size: SIZE }],
        layers: 3,
      },
    },
  ],
};
cache.addCatalog(new TextEncoder().encode(JSON.stringify(catalog)), 0);
cache.addLight(0, 0, 0, key.frame, 0);
cache.addLight(0, 0, 1, delta.frame, 0.1);
let now = 0.1;

describe('a volume of 16×16×16 probes, order 2', () => {
  bench(`keyframe of ${key.frame.length} bytes`, () => void new ProbeDecoder(SIZE, ORDER).decode(key.frame));
  bench(`delta of ${delta.frame.length} bytes`, () => void decoder.decode(delta.frame));
  bench('blend', () => void cache.light((now += 1e-6)));
  bench('pack into halves', () => void packAtlas(rgb, SIZE, ORDER, 32, atlas));
});

const TILE = [256, 256] as const;

/** A tile of light that falls off from a corner, with a hundredth of noise that differs by `seed`. */
function tile(seed: number): number[] {
  const next = random(seed);
  return Array.from({ length: 3 * TILE[0] * TILE[1] }, (_, i) => {
    const lumel = Math.floor(i / 3);
    const [x, y] = [lumel % TILE[0], Math.floor(lumel / TILE[0])];
    return (1000 / (50 + x + y)) * (1 + 0.01 * (next() - 0.5));
  });
}

const tileKey = encodeLumels(tile(1), TILE, { update: 0 });
const tileDelta = encodeLumels(tile(2), TILE, { update: 1, base: 0 }, tileKey);
const unchanged = encodeLumels(tile(1), TILE, { update: 1, base: 0 }, tileKey);
/** Updates 1 to 59, in which nothing changes: the same bytes but for their number. */
const rest = Array.from({ length: 59 }, (_, i) => unchanged.frame.with(2, i + 1));

describe('a tile of 256×256 lumels', () => {
  const bytes = tileKey.frame.length;
  bench(`keyframe of ${bytes} bytes`, () => void new LumelDecoder(TILE).decode(tileKey.frame));
  bench(`that and a delta of ${tileDelta.frame.length} bytes`, () => {
    const decoder = new LumelDecoder(TILE);
    for (const { frame } of [tileKey, tileDelta]) decoder.decode(frame);
  });
  bench('that and 59 deltas without change', () => {
    const decoder = new LumelDecoder(TILE);
    for (const frame of [tileKey.frame, ...rest]) decoder.decode(frame);
  });
});
