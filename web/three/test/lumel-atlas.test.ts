import { describe, expect, it } from 'vitest';
import { planAtlas } from '../src/lumel-atlas.js';

describe('an atlas of pages', () => {
  it.each([
    [[{ pageSize: 512, pages: 1 }], 512, 512],
    [[{ pageSize: 512, pages: 2 }], 1024, 512],
    [[{ pageSize: 512, pages: 5 }], 1536, 1024],
    [
      [
        { pageSize: 300, pages: 3 },
        { pageSize: 512, pages: 1 },
      ],
      1024,
      1024,
    ],
  ])('of %j has room for all, and for little else', (lightmaps, width, height) => {
    const plan = planAtlas(lightmaps, 4096)!;
    expect([plan.width, plan.height]).toEqual([width, height]);
    const boxes = lightmaps.flatMap(({ pageSize, pages }, lightmap) =>
      Array.from({ length: pages }, (_, page) => [...plan.corner(lightmap, page), pageSize]),
    );
    for (const [i, [x, y, side]] of boxes.entries()) {
      expect(x + side).toBeLessThanOrEqual(width);
      expect(y + side).toBeLessThanOrEqual(height);
      for (const [left, top, other] of boxes.slice(i + 1)) {
        const isApart = x + side <= left || left + other <= x || y + side <= top || top + other <= y;
        expect(isApart).toBe(true);
      }
    }
  });

  it('is none where textures are too small', () => {
    expect(planAtlas([{ pageSize: 1024, pages: 4 }], 2048)).toBeDefined();
    expect(planAtlas([{ pageSize: 1024, pages: 5 }], 2048)).toBeUndefined();
    expect(planAtlas([{ pageSize: 4096, pages: 1 }], 2048)).toBeUndefined();
  });
});
