import { type LightmapLight, LONGEST_PASSAGE, type LumelRegion } from '@lumencast/client';
import type { Texture } from 'three';
import type { AtlasPlan } from './lumel-atlas.js';
import { bytesOf, PicturePool, type PictureTextures } from './picture-textures.js';
import type { PagesTarget, Paint, Stroke } from './platform.js';

/** What the pages hold: the light, or what one looks into it by, the lumels themselves or their age. */
export type LumelLook = 'light' | 'lumels' | 'age';

/** Milliseconds between two looks at how old pictures are. */
const AGE_INTERVAL = 250;
/** Ages that are shown as young and as old, seconds. */
const AGES = [0.1, 10] as const;

/**
 * Milliseconds without a frame after which new pictures are painted whole, and all at once. What was
 * painted before them is light of long ago, which other pictures have replaced unseen.
 */
const REST = 1000 * LONGEST_PASSAGE;

/**
 * Bytes of pictures that are brought to the device in a frame, unless one alone has more: about a
 * millisecond of a page's time. Others wait for the next one.
 */
const LOAD = 1 << 20;

/** What has been painted of a region. */
interface Painted {
  revision: number;
  /** When its newest picture came, milliseconds. */
  at: number;
  /** The part of the way to that picture that is painted; −1 before there was any. */
  shown: number;
  /** Where the picture is, until all of the way is painted. */
  textures: PictureTextures | undefined;
  /** Which picture these hold. */
  loaded: number;
  /** Frames that it waits to be loaded. */
  waited: number;
}

/** A stroke that is to be painted. */
interface Planned {
  readonly painted: Painted;
  readonly region: LumelRegion;
  readonly place: Pick<Stroke, 'x' | 'y' | 'width' | 'height'>;
  /** The part of the way that is to be painted, and the share of the picture that does so. */
  readonly to: number;
  readonly share: number;
}

/**
 * All pages of lumels in one half-float texture, painted on the device. It holds irradiance over `scale`.
 * A picture that comes is mixed into what is there by as much as the part of its passage that has gone
 * by, so that the texture alone is kept of what was shown before.
 *
 * Costs 8 bytes a lumel; while a picture is under way 8 more, of a video picture 1.5 or 3.
 */
export class LumelPages {
  readonly #painted = new Map<string, Painted>();
  readonly #pool = new PicturePool();
  #scale = 0;
  #look: LumelLook = 'light';
  #agedAt = -Infinity;
  /** When pages were last asked to be up to date, milliseconds. */
  #updatedAt = -Infinity;

  /** `fields`: numbers of the lightmaps, in the plan's order. */
  constructor(
    private readonly target: PagesTarget,
    readonly plan: AtlasPlan,
    private readonly fields: readonly number[],
  ) {}

  get texture(): Texture {
    return this.target.texture;
  }

  /** Irradiance over what the texture holds while it shows light; 0 before there was any. */
  get scale(): number {
    return this.#scale;
  }

  /** Paints what has changed, `now` in milliseconds; whether anything has. */
  update(lightmaps: readonly LightmapLight[], look: LumelLook, now: number): boolean {
    const scale = Math.max(0, ...lightmaps.map((lightmap) => lightmap.scale)) || this.#scale;
    let isAnew = (scale !== this.#scale && this.#scale > 0) || look !== this.#look;
    if (look === 'age' && now - this.#agedAt > AGE_INTERVAL) {
      this.#agedAt = now;
      isAnew = true;
    }
    const hasRested = now - this.#updatedAt > REST;
    this.#updatedAt = now;
    this.#scale = scale;
    this.#look = look;
    const planned = lightmaps.flatMap((lightmap) => this.#planOf(lightmap, isAnew, hasRested, now));
    const strokes =
      look === 'light'
        ? this.#paint(planned, isAnew || hasRested)
        : planned.map((plan) => this.#flat(plan, now));
    if (strokes.length === 0) return false;
    this.target.paint(strokes);
    this.#release();
    return true;
  }

  /** What of a lightmap is not painted yet as it should be. */
  #planOf({ field, regions }: LightmapLight, isAnew: boolean, hasRested: boolean, now: number): Planned[] {
    const lightmap = this.fields.indexOf(field.id);
    if (lightmap < 0) return [];
    const planned: Planned[] = [];
    for (const region of regions) {
      if (region.slopes && this.plan.slopes === 0) continue;
      const { revision } = region;
      const key = `${field.id}/${region.region}`;
      const before = this.#painted.get(key);
      const painted = before ?? unpainted(now);
      if (!before) this.#painted.set(key, painted);
      const isNew = revision !== painted.revision;
      if (isNew) Object.assign(painted, { revision, at: now, shown: painted.shown < 0 ? -1 : 0 });
      // What lies there is nothing, of another scale or no light: there is no way from it.
      const isWhole = isAnew || painted.shown < 0 || (isNew && (hasRested || this.#look !== 'light'));
      const to = isWhole ? 1 : region.shown;
      const share = isWhole ? 1 : this.#look === 'light' ? shareOf(painted.shown, to) : 0;
      if (share <= 0) continue;
      const [left, first] = this.plan.corner(lightmap, region.page);
      const top = region.slopes ? first + this.plan.slopes : first;
      const [x, y] = region.min;
      const [width, height] = region.size;
      planned.push({ painted, region, place: { x: left + x, y: top + y, width, height }, to, share });
    }
    return planned;
  }

  /** Strokes of pictures: of all, or of as many as a frame may load, those that waited longest first. */
  #paint(planned: readonly Planned[], loadsAll: boolean): Stroke[] {
    const isLoaded = ({ painted, region }: Planned) => painted.textures && painted.loaded === region.revision;
    const waiting = planned
      .filter((plan) => !isLoaded(plan))
      .sort((a, b) => b.painted.waited - a.painted.waited);
    let bytes = 0;
    for (const [i, { painted, region }] of waiting.entries()) {
      const { picture, revision } = region;
      bytes += bytesOf(picture);
      if (i > 0 && bytes > LOAD && !loadsAll) {
        painted.waited++;
        continue;
      }
      painted.textures = this.#pool.load(picture, region.size, painted.textures);
      painted.loaded = revision;
      painted.waited = 0;
    }
    return planned.filter(isLoaded).map(({ painted, region, place, to, share }) => {
      painted.shown = to;
      const scale = region.slopes ? 1 : this.#scale;
      return { ...place, share, paint: painted.textures!.paint(region.picture, scale) };
    });
  }

  /** Frees the textures of pictures of which the whole way is painted. */
  #release(): void {
    for (const painted of this.#painted.values()) {
      if (!painted.textures || painted.shown < 1) continue;
      this.#pool.release(painted.textures);
      painted.textures = undefined;
    }
  }

  /** A stroke that is looked into lumels by. */
  #flat({ painted, place }: Planned, now: number): Stroke {
    painted.shown = 1;
    const paint: Paint =
      this.#look === 'lumels'
        ? { kind: 'flat', color: [0.8, 0.8, 0.8], checkered: true }
        : { kind: 'flat', color: ageColor((now - painted.at) / 1000), checkered: false };
    return { ...place, share: 1, paint };
  }

  dispose(): void {
    this.#pool.dispose();
    this.target.dispose();
  }
}

function unpainted(now: number): Painted {
  return { revision: -1, at: now, shown: -1, textures: undefined, loaded: -1, waited: 0 };
}

/**
 * The share of a picture that brings what is there from one part of the way to it to another. Mixed by it,
 * `(1 − s) · was + s · picture` becomes the same with the other part. The whole way needs nothing of what
 * was there: its share is 1 to the last bit.
 */
export function shareOf(from: number, to: number): number {
  if (to <= from) return 0;
  return to >= 1 ? 1 : (to - from) / (1 - from);
}

/** From green by yellow to red as light grows old, in even steps of its logarithm. */
export function ageColor(seconds: number): readonly [number, number, number] {
  const [young, old] = AGES;
  const part = Math.log(Math.max(seconds, young) / young) / Math.log(old / young);
  const t = Math.min(part, 1);
  return [Math.min(2 * t, 1), Math.min(2 - 2 * t, 1), 0];
}
