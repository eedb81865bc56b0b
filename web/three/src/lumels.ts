import {
  type FieldInfo,
  hasMorePages,
  isLightmap,
  type LightmapLight,
  type LightState,
} from '@lumencast/client';
import type { Light, Scene, Texture } from 'three';
import type { Content } from './content.js';
import { planAtlas } from './lumel-atlas.js';
import { type LumelLook, LumelPages } from './lumel-pages.js';
import { LumelSurfaces } from './lumel-surfaces.js';
import type { PlacedLayout } from './lumel-wanted.js';
import type { Platform } from './platform.js';

/** A field that is a lightmap. */
type Lightmap = FieldInfo<'lightmap'>;

/** Lightmaps of a scene: their pages on the device, and the meshes that read them. */
export class Lumels {
  /** What the pages show. */
  look: LumelLook = 'light';

  readonly #surfaces: LumelSurfaces;
  #lightmaps: readonly Lightmap[] = [];
  #pages: LumelPages | undefined;
  #light: Light | undefined;
  #layouts: readonly LightmapLight['layout'][] = [];
  #time = 0;

  constructor(
    private readonly scene: Scene,
    content: Content,
    private readonly platform: Platform,
    private readonly warn: (message: string) => void,
  ) {
    this.#surfaces = new LumelSurfaces(scene, content, warn);
  }

  /**
   * Makes room for the pages of these lightmaps, in place of those there are. Where others are but added,
   * meshes keep their lumels.
   */
  setLightmaps(lightmaps: readonly Lightmap[]): void {
    if (isSameRoom(lightmaps, this.#lightmaps) && (this.#pages || lightmaps.length === 0)) return;
    const keepsMeshes = this.#pages && isLonger(lightmaps, this.#lightmaps);
    this.#clearPages();
    this.#lightmaps = lightmaps;
    const reason = lightmaps.length > 0 ? this.#plan() : undefined;
    if (!this.#pages || !keepsMeshes) this.#surfaces.clear();
    if (reason) this.warn(`light at lumels is not shown, surfaces are lit by probes: ${reason}`);
  }

  /** Why there is no room, if so. */
  #plan(): string | undefined {
    const { platform, scene } = this;
    if (platform.freeUnits(scene) < 1) return 'no texture unit is free';
    const shapes = this.#lightmaps.map(({ shape }) => shape);
    const plan = planAtlas(shapes, platform.maxTextureSize);
    if (!plan) return 'their pages are larger than textures of this device';
    const target = platform.createPages(plan.width, plan.height);
    if (!target) return 'this device does not draw into half floats';
    this.#pages = new LumelPages(
      target,
      plan,
      this.#lightmaps.map(({ id }) => id),
    );
    this.#light = platform.createLumelLight?.(target.texture);
    if (this.#light) scene.add(this.#light);
    return undefined;
  }

  /** Texture units that materials take for lumels. */
  get units(): number {
    return this.#pages ? 1 : 0;
  }

  /** The texture of all pages: irradiance in lux over {@link scale}, rows from 0 on. */
  get pages(): Texture | undefined {
    return this.#pages?.texture;
  }

  /** By what shaders multiply what the pages hold, to get irradiance in lux. */
  get scale(): number {
    return this.#pages?.scale ?? 0;
  }

  /** Rows of {@link pages} from a lumel to its slope while they show light; 0 where there are no slopes. */
  get slopes(): number {
    return this.look === 'light' ? (this.#pages?.plan.slopes ?? 0) : 0;
  }

  /** Meshes that have lumels now. */
  get meshes(): number {
    return this.#surfaces.count;
  }

  /** Milliseconds that the last {@link update} and {@link follow} took of the page's thread. */
  get time(): number {
    return this.#time;
  }

  /** Takes over light that has changed, `now` in milliseconds; true when some had. */
  update(light: LightState, now: number): boolean {
    const began = performance.now();
    const isChanged = this.#update(light, now);
    this.#time = performance.now() - began;
    return isChanged;
  }

  #update(light: LightState, now: number): boolean {
    const pages = this.#pages;
    if (!pages) return false;
    const lightmaps = light.fields.filter(isLightmap).filter((lit) => this.#isPlanned(lit.field));
    const layouts = this.#lightmaps.map(({ id }) => lightmaps.find(({ field }) => field.id === id)?.layout);
    if (layouts.some((layout, i) => layout !== this.#layouts[i]) || layouts.length !== this.#layouts.length) {
      this.#layouts = layouts;
      const placed = layouts.map((layout, lightmap) => layout && this.#placed(layout, lightmap));
      this.#surfaces.setLayouts(placed.filter((layout) => layout !== undefined));
    }
    return pages.update(lightmaps, this.look, now);
  }

  /** Gives meshes lumels where they stand, and takes them from those that move; see {@link LumelSurfaces}. */
  follow(revision: number, now: number): void {
    const began = performance.now();
    this.#surfaces.update(revision, now);
    this.#time += performance.now() - began;
  }

  /** Whether light is that of a planned lightmap: until there is new light, it may be of a former shape. */
  #isPlanned(lit: Lightmap): boolean {
    return isSameRoom(
      [lit],
      this.#lightmaps.filter(({ id }) => id === lit.id),
    );
  }

  #placed(layout: NonNullable<LightmapLight['layout']>, lightmap: number): PlacedLayout {
    const { plan } = this.#pages!;
    return { layout, corner: (page) => plan.corner(lightmap, page) };
  }

  dispose(): void {
    this.#surfaces.clear();
    this.#clearPages();
  }

  #clearPages(): void {
    this.#layouts = [];
    this.#light?.removeFromParent();
    this.#light = undefined;
    this.#pages?.dispose();
    this.#pages = undefined;
  }
}

/** Whether the last lightmap alone has more pages than before: all others lie where they lay. */
function isLonger(now: readonly Lightmap[], before: readonly Lightmap[]): boolean {
  const [last, lastBefore] = [now.at(-1), before.at(-1)];
  if (!last || !lastBefore || last.id !== lastBefore.id) return false;
  return hasMorePages(last, lastBefore) && isSameRoom(now.slice(0, -1), before.slice(0, -1));
}

/** Whether lightmaps take the same room, wherever surfaces lie in it. */
function isSameRoom(a: readonly Lightmap[], b: readonly Lightmap[]): boolean {
  const room = ({ id, shape }: Lightmap) => `${id} ${shape.pageSize} ${shape.pages} ${!!shape.slopes}`;
  return a.map(room).join() === b.map(room).join();
}
