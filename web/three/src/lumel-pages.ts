import type { LightmapLight, LumelRegion } from '@lumencast/client';
import type { Texture } from 'three';
import type { AtlasPlan } from './lumel-atlas.js';
import { PicturePool, type PictureTextures } from './picture-textures.js';
import type { PagesTarget, Paint, Stroke } from './platform.js';

/** What the pages hold: the light, or what one looks into it by, the lumels themselves or their age. */
export type LumelLook = 'light' | 'lumels' | 'age';

/** Milliseconds between two looks at how old pictures are. */
const AGE_INTERVAL = 250;
/** Ages that are shown as young and as old, seconds. */
const AGES = [0.1, 10] as const;

/** What has been painted of a region. */
interface Painted {
  revision: number;
  /** When its newest picture came, milliseconds. */
  at: number;
  /** The part of the way to that picture that is painted. */
  shown: number;
  /** Where the picture is, until all of the way is painted. */
  textures: PictureTextures | undefined;
  /** Which picture these hold. */
  loaded: number;
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

  get look(): LumelLook {
    return this.#look;
  }

  /** Paints what has changed, `now` in milliseconds; whether anything has. */
  update(lightmaps: readonly LightmapLight[], look: LumelLook, now: number): boolean {
    const scale = Math.max(0, ...lightmaps.map((lightmap) => lightmap.scale)) || this.#scale;
    let isAnew = scale !== this.#scale || look !== this.#look;
    if (look === 'age' && now - this.#agedAt > AGE_INTERVAL) {
      this.#agedAt = now;
      isAnew = true;
    }
    this.#scale = scale;
    this.#look = look;
    const strokes = lightmaps.flatMap((lightmap) => this.#strokesOf(lightmap, isAnew, now));
    if (strokes.length === 0) return false;
    this.target.paint(strokes);
    this.#release();
    return true;
  }

  #strokesOf({ field, regions }: LightmapLight, isAnew: boolean, now: number): Stroke[] {
    const lightmap = this.fields.indexOf(field.id);
    if (lightmap < 0) return [];
    const strokes: Stroke[] = [];
    for (const region of regions) {
      const stroke = this.#strokeOf(`${field.id}/${region.region}`, region, isAnew, now);
      if (!stroke) continue;
      const [left, top] = this.plan.corner(lightmap, region.page);
      const [x, y] = region.min;
      const [width, height] = region.size;
      strokes.push({ x: left + x, y: top + y, width, height, ...stroke });
    }
    return strokes;
  }

  #strokeOf(
    key: string,
    region: LumelRegion,
    isAnew: boolean,
    now: number,
  ): Pick<Stroke, 'share' | 'paint'> | undefined {
    const { picture, revision } = region;
    const before = this.#painted.get(key);
    const painted = before ?? { revision: -1, at: now, shown: 0, textures: undefined, loaded: -1 };
    if (!before) this.#painted.set(key, painted);
    const isNew = revision !== painted.revision;
    if (isNew) Object.assign(painted, { revision, at: now, shown: 0 });
    if (this.#look !== 'light')
      return isNew || isAnew ? { share: 1, paint: this.#flat(painted, now) } : undefined;
    // What lies there is nothing, of another scale or no light: there is no way from it.
    const to = isAnew || !before ? 1 : region.shown;
    const share = isAnew ? 1 : shareOf(painted.shown, to);
    if (share <= 0) return undefined;
    if (!painted.textures || painted.loaded !== revision) {
      painted.textures = this.#pool.load(picture, region.size, painted.textures);
      painted.loaded = revision;
    }
    painted.shown = to;
    return { share, paint: painted.textures.paint(picture, this.#scale) };
  }

  /** Frees the textures of pictures of which the whole way is painted. */
  #release(): void {
    for (const painted of this.#painted.values()) {
      if (!painted.textures || painted.shown < 1) continue;
      this.#pool.release(painted.textures);
      painted.textures = undefined;
    }
  }

  #flat({ at }: Painted, now: number): Paint {
    if (this.#look === 'lumels') return { kind: 'flat', color: [0.8, 0.8, 0.8], checkered: true };
    return { kind: 'flat', color: ageColor((now - at) / 1000), checkered: false };
  }

  dispose(): void {
    this.#pool.dispose();
    this.target.dispose();
  }
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
