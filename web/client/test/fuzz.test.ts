/**
 * Each decoder with a counted number of mutated seeds: what a fuzzer would find soonest. `FUZZ_ROUNDS`
 * multiplies the numbers. The twin of `fuzz/tests/mutated.rs`.
 */
import { afterEach, describe, expect, it, vi } from 'vitest';
import { countMemory } from './fuzz/memory.js';
import { mutated, Random } from './fuzz/mutate.js';
import * as seeds from './fuzz/seeds.js';
import * as targets from './fuzz/targets.js';

const MIB = 1 << 20;
const rounds = Number(process.env.FUZZ_ROUNDS ?? 1);

afterEach(() => vi.unstubAllGlobals());

/** The seeds as they are, and so many mutations of them, none of which may take more memory than given. */
function feed(
  target: (data: Uint8Array) => boolean,
  seeds: readonly Uint8Array[],
  mutations: number,
  memory: number,
): void {
  expect(seeds.length).toBeGreaterThan(0);
  const count = countMemory();
  const random = new Random(1);
  let taken = 0;
  for (let number = 0; number < seeds.length + mutations * rounds; number++) {
    const data = number < seeds.length ? seeds[number] : mutated(random.of(seeds), random.of(seeds), random);
    count.asked = 0;
    try {
      if (target(data) && number >= seeds.length) taken++;
      expect(count.asked).toBeLessThanOrEqual(memory);
    } catch (error) {
      throw new Error(`input ${number}: ${Buffer.from(data).toString('base64')}`, { cause: error });
    }
  }
  // Mutations must reach what is behind the first check, and must be refused.
  expect(taken).toBeGreaterThan(0);
  expect(taken).toBeLessThan(mutations * rounds);
}

// However slow the machine is.
describe('of mutated bytes', { timeout: 600_000 * rounds }, () => {
  it.each([
    ['probe frames', targets.probeFrame, seeds.probeFrames, 10_000, 8 * MIB],
    ['lumel frames', targets.lumelFrame, seeds.lumelFrames, 10_000, 8 * MIB],
    ['video frames', targets.videoFrame, seeds.videoFrames, 5000, MIB],
    ['charts', targets.charts, seeds.charts, 10_000, MIB],
    ['layouts', targets.layout, seeds.layouts, 5000, MIB],
    ['catalogs', targets.catalog, seeds.catalogs, 20_000, MIB],
    ['state frames', targets.state, seeds.states, 20_000, MIB],
    ['client edits', targets.clientEdit, seeds.clientEdits, 20_000, MIB],
    ['saved files', targets.lightFile, seeds.lightFiles, 5000, 8 * MIB],
    ['saved lightmaps', targets.lightFile, seeds.lightmapFiles, 2000, 8 * MIB],
    ['streams', targets.stream, seeds.streams, 2000, 64 * MIB],
    ['streams of lightmaps', targets.stream, seeds.lightmapStreams, 2000, 64 * MIB],
  ] as const)('%s are taken or refused', (_, target, seeds, mutations, memory) => {
    feed(target, seeds, mutations, memory);
  });
});

it('the random numbers are those of the Rust crate', () => {
  // SplitMix64 from 0: the first of its reference implementation is 0xE220A8397B1DCDAF.
  expect(new Random(0).below(2 ** 32)).toBe(0x7b1dcdaf);
});
