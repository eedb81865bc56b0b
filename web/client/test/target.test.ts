import { describe, expect, it } from 'vitest';
import { parseTarget, type TargetOptions } from '../src/session/target.js';

describe('an address', () => {
  it.each<[address: string, options: TargetOptions, base: string, scene: string]>([
    ['https://host/cornell', {}, 'https://host/', 'cornell'],
    ['https://host:4443/light/cornell/', {}, 'https://host:4443/light/', 'cornell'],
    ['http://host/a%20b/c%20d?jwt=x', {}, 'http://host/a%20b/', 'c d'],
    ['https://host/light/', { scene: 'cornell' }, 'https://host/light/', 'cornell'],
    ['https://host/light/cornell', { scene: 'cornell' }, 'https://host/light/', 'cornell'],
    ['https://host/light/a/b', { scene: 'a/b' }, 'https://host/light/', 'a/b'],
    ['https://host', { scene: 'cornell' }, 'https://host/', 'cornell'],
  ])('%s with %o', (address, options, base, scene) => {
    const target = parseTarget(new URL(address), options);
    expect([target.base.href, target.scene]).toEqual([base, scene]);
  });

  it('that cannot be decoded is refused', () => {
    for (const address of ['https://host/100%', 'https://host/%ff']) {
      expect(() => parseTarget(new URL(address), {})).toThrow(TypeError);
    }
  });
});
