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

  it('leaves pages where they are as others are added', () => {
    for (let pages = 1; pages < 20; pages++) {
      const [before, after] = [pages, pages + 1].map((pages) => planAtlas([{ pageSize: 8, pages }], 4096)!);
      for (let page = 0; page < pages; page++) expect(after.corner(0, page)).toEqual(before.corner(0, page));
    }
  });

  it('has slopes below all pages, where there is room', () => {
    const lightmaps = [
      { pageSize: 8, pages: 3, slopes: true },
      { pageSize: 8, pages: 1 },
    ];
    expect(planAtlas(lightmaps, 64)).toMatchObject({ width: 16, height: 32, slopes: 16 });
    expect(planAtlas(lightmaps, 16)).toMatchObject({ width: 16, height: 16, slopes: 0 });
    expect(planAtlas(lightmaps.slice(1), 64)).toMatchObject({ height: 8, slopes: 0 });
  });

  it('is none where textures are too small', () => {
    expect(planAtlas([{ pageSize: 1024, pages: 4 }], 2048)).toBeDefined();
    expect(planAtlas([{ pageSize: 1024, pages: 5 }], 2048)).toBeUndefined();
    expect(planAtlas([{ pageSize: 4096, pages: 1 }], 2048)).toBeUndefined();
  });
});
