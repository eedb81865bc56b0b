/** What is painted of pictures of lumels, and when. */
import { Texture } from 'three';
import { beforeEach, describe, expect, it } from 'vitest';
import { planAtlas } from '../src/lumel-atlas.js';
import { ageColor, LumelPages, shareOf } from '../src/lumel-pages.js';
import type { Stroke } from '../src/platform.js';
import { halves, lightmapField, lightmapLight, region } from './support/lightmaps.js';

/** A stroke, and what its texture held when it was painted. */
interface Painting extends Stroke {
  readonly first: number | undefined;
}

let painted: Painting[][];
let disposed: boolean;
let pages: LumelPages;

const target = () => ({
  texture: new Texture(),
  paint: (strokes: readonly Stroke[]) =>
    void painted.push(strokes.map((stroke) => ({ ...stroke, first: firstOf(stroke) }))),
  dispose: () => void (disposed = true),
});

function firstOf({ paint }: Stroke): number | undefined {
  return paint.kind === 'halves' ? (paint.texels.image.data as Uint16Array)[0] : undefined;
}

beforeEach(() => {
  painted = [];
  disposed = false;
  pages = new LumelPages(
    target(),
    planAtlas(
      [
        { pageSize: 8, pages: 1 },
        { pageSize: 8, pages: 2 },
      ],
      64,
    )!,
    [0, 7],
  );
});

const update = (
  regions: Parameters<typeof lightmapLight>[0],
  now = 0,
  look: 'light' | 'lumels' | 'age' = 'light',
) => pages.update([lightmapLight(regions)], look, now);
const shares = () => painted.map((strokes) => strokes.map(({ share }) => share));

describe('the share of a picture', () => {
  it('brings what is there from one part of the way to the next', () => {
    const [was, picture] = [3, 11];
    let shown = was;
    let from = 0;
    for (const to of [0.1, 0.35, 0.8, 1]) {
      const share = shareOf(from, to);
      shown = (1 - share) * shown + share * picture;
      expect(shown).toBeCloseTo(was + to * (picture - was), 12);
      from = to;
    }
  });

  it('is 1 at the end, and nothing where nothing is new', () => {
    expect([shareOf(0.3, 1), shareOf(0, 1), shareOf(0.999, 1)]).toEqual([1, 1, 1]);
    expect([shareOf(1, 1), shareOf(0.5, 0.5), shareOf(0.5, 0.2), shareOf(0, 0)]).toEqual([0, 0, 0, 0]);
  });
});

describe('pages', () => {
  it('take a picture in over its passage, and then rest', () => {
    expect(update([region({ picture: halves(1) })])).toBe(true);
    expect(update([region({ picture: halves(1) })])).toBe(false);
    const next = { revision: 2, picture: halves(2) };
    expect(update([region({ ...next, shown: 0 })])).toBe(false);
    for (const shown of [0.2, 0.6, 0.6, 1, 1]) update([region({ ...next, shown })]);
    expect(shares()).toEqual([[1], [0.2], [0.5], [1]].map(([share]) => [expect.closeTo(share, 12)]));
    expect(painted.flat().map(({ first }) => first)).toEqual([1, 2, 2, 2]);
  });

  it('take a picture in whole after a rest, in which others have come unseen', () => {
    update([region({ picture: halves(1) })], 0);
    update([region({ revision: 2, picture: halves(2), shown: 0.5 })], 500);
    update([region({ revision: 4, picture: halves(4), shown: 0.1 })], 1001);
    update([region({ revision: 5, picture: halves(5), shown: 0.1 })], 1501);
    expect(shares()).toEqual([[1], [0.5], [1], [0.1]]);
  });

  it('begin with the first picture, however far its passage is', () => {
    update([region({ shown: 0.1 })]);
    update([region({ shown: 0.5 })]);
    expect(shares()).toEqual([[1]]);
  });

  it('paint slopes below, as they are, and nowhere where there is no room', () => {
    const [light, slopes] = [region({ picture: halves(1, 64, 32) }), region({ region: 1, slopes: true })];
    const planned = (of: boolean) =>
      new LumelPages(target(), planAtlas([{ pageSize: 8, pages: 1, slopes: of }], 64)!, [0]);
    planned(true).update([{ ...lightmapLight([light, slopes]), scale: 32 }], 'light', 0);
    planned(false).update([{ ...lightmapLight([light, slopes]), scale: 32 }], 'light', 0);
    const factors = painted.map((strokes) =>
      strokes.map(({ y, paint }) => [y, 'factor' in paint && paint.factor]),
    );
    expect(factors).toEqual([
      [
        [0, 1],
        [8, 1],
      ],
      [[0, 1]],
    ]);
  });

  it('paint each tile in its place, of every lightmap', () => {
    const other = lightmapLight(
      [region({ page: 1, min: [2, 4], size: [6, 4], picture: halves(0, 24) })],
      undefined,
      lightmapField(7),
    );
    pages.update([lightmapLight([region()]), other], 'light', 0);
    // Two columns of pages: the second page of the second lightmap is the third of all.
    const places = painted[0].map(({ x, y, width, height }) => [x, y, width, height]);
    expect(places).toEqual([
      [0, 0, 8, 8],
      [2, 12, 6, 4],
    ]);
  });

  it('load each picture once, into textures that no other one still needs', () => {
    const two = (shown: number, first: number) => [
      region({ revision: first, shown, picture: halves(first) }),
      region({ region: 1, revision: first, shown, picture: halves(first + 1) }),
    ];
    update(two(1, 10));
    update(two(0.5, 20));
    update(two(1, 20));
    update(two(0.5, 30));
    const seen = painted.map((strokes) => strokes.map(({ first }) => first));
    expect(seen).toEqual([
      [10, 11],
      [20, 21],
      [20, 21],
      [30, 31],
    ]);
    const textures = painted.flat().map(({ paint }) => paint.kind === 'halves' && paint.texels);
    expect(new Set(textures).size).toBe(2);
  });

  it('take in large pictures one a frame, each in its turn', () => {
    const [large, scale] = [2 ** 18, 1];
    const all = (revision: number) =>
      [0, 1, 2].map((tile) =>
        region({ region: tile, revision, picture: halves(10 * revision + tile, large, scale) }),
      );
    update(all(1));
    painted = [];
    for (let revision = 2; revision <= 7; revision++) update(all(revision));
    const seen = painted.map((strokes) => strokes.map(({ first }) => first! % 10));
    expect(seen).toEqual([[0], [1], [2], [0], [1], [2]]);
    // What has come last is what is painted, and in the end all is.
    update(all(7));
    update(all(7));
    expect(
      painted
        .slice(6)
        .flat()
        .map(({ first }) => first),
    ).toEqual([70, 71]);
    expect(update(all(7))).toBe(false);
  });

  it('take in all pictures at once at first and after a rest', () => {
    const large = (revision: number) =>
      [0, 1, 2].map((tile) => region({ region: tile, revision, picture: halves(tile, 2 ** 18) }));
    update(large(1), 0);
    update(large(2), 501);
    expect(shares()).toEqual([
      [1, 1, 1],
      [1, 1, 1],
    ]);
  });

  it('are painted anew when their scale changes', () => {
    const two = (scale: number, revision: number) => [
      region({ picture: halves(1, 64, 2) }),
      region({ region: 1, revision, picture: halves(2, 64, scale) }),
    ];
    update(two(2, 1));
    expect(pages.scale).toBe(2);
    update(two(8, 2));
    expect(pages.scale).toBe(8);
    const factors = painted.map((strokes) =>
      strokes.map(({ paint }) => paint.kind === 'halves' && paint.factor),
    );
    expect(factors).toEqual([
      [1, 1],
      [0.25, 1],
    ]);
    expect(shares()).toEqual([
      [1, 1],
      [1, 1],
    ]);
  });

  it('show how old tiles are, and then the light again', () => {
    update([region({ picture: halves(5) })], 0);
    update([region({ picture: halves(5) })], 10_000, 'age');
    update([region({ picture: halves(5) })], 10_100, 'age');
    update([region({ picture: halves(5), revision: 2 })], 10_200, 'age');
    update([region({ picture: halves(5), revision: 2 })], 10_300, 'light');
    const colors = painted.map(([{ paint, first }]) => (paint.kind === 'flat' ? paint.color : first));
    expect(colors).toEqual([5, ageColor(10), ageColor(0), 5]);
    expect(ageColor(0)).toEqual([0, 1, 0]);
    expect(ageColor(1)).toEqual([expect.closeTo(1), expect.closeTo(1), 0]);
    expect(ageColor(100)).toEqual([1, 0, 0]);
  });

  it('pass lightmaps over that they have no room for', () => {
    expect(pages.update([lightmapLight([region()], undefined, lightmapField(3))], 'light', 0)).toBe(false);
  });

  it('free what they hold', () => {
    update([region()]);
    const freed: string[] = [];
    const [{ paint }] = painted[0];
    if (paint.kind === 'halves') paint.texels.addEventListener('dispose', () => freed.push('texels'));
    pages.dispose();
    expect([freed, disposed]).toEqual([['texels'], true]);
  });
});
