import type { Box3, Data3DTexture, DataTexture, Light, Object3D, Scene, Texture, Vector3 } from 'three';

/** The part of three.js' two `LightProbeGrid` classes that both renderers sample. */
export interface ProbeGrid extends Light {
  width: number;
  height: number;
  depth: number;
  resolution: Vector3;
  boundingBox: Box3;
  priority: number;
  texture: Data3DTexture | null;
  updateBoundingBox(): void;
  dispose(): void;
}

/** A rectangle that is painted in the texture of all pages, in lumels from its first one. */
export interface Stroke {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
  /** How much of what is there it covers; 1 leaves nothing of it. */
  readonly share: number;
  readonly paint: Paint;
}

/** What a rectangle is painted with. */
export type Paint = HalvesPaint | PlanesPaint | FlatPaint;

/** A picture of half floats, times a factor. */
export interface HalvesPaint {
  readonly kind: 'halves';
  readonly factor: number;
  readonly texels: DataTexture;
}

/** A video picture (`irradianceOf` of the client tells what its codes mean), times a factor. */
export interface PlanesPaint {
  readonly kind: 'planes';
  readonly factor: number;
  readonly toe: number;
  readonly octaves: number;
  readonly y: DataTexture;
  readonly co: DataTexture;
  readonly cg: DataTexture;
}

/** One colour, of which every other lumel is darker where it is checkered. */
export interface FlatPaint {
  readonly kind: 'flat';
  readonly color: readonly [number, number, number];
  readonly checkered: boolean;
}

/** The texture of all pages, on the device. */
export interface PagesTarget {
  readonly texture: Texture;
  /** Paints rectangles that do not overlap; leaves the renderer as it was. */
  paint(strokes: readonly Stroke[]): void;
  dispose(): void;
}

/** What a shader multiplies by, for as long as a scene is drawn. */
export interface IndirectFactors {
  /** What the texture of pages holds. */
  readonly lumels: { value: number };
  /** No factor: rows of that texture from a lumel to its slope, 0 where there are none. */
  readonly slopes: { value: number };
  /** Light of probe grids on meshes that have lumels, where these have none, by as much as lumels count. */
  readonly still: { value: number };
  /** Light of probe grids on all other meshes. */
  readonly moving: { value: number };
}

/** What differs between WebGLRenderer and WebGPURenderer. */
export interface Platform {
  /** An empty grid of the class that the renderer samples. */
  createGrid(
    size: readonly [number, number, number],
    resolution: readonly [number, number, number],
  ): ProbeGrid;
  /**
   * How the field's scale reaches the shader, as halves hold value / scale: `atlas`, its logarithm in
   * the atlas' free channel, or `intensity` of the grid.
   */
  readonly scaleIn: 'atlas' | 'intensity';
  /** Texture units that the scene leaves for light, as it now is. */
  freeUnits(scene: Scene): number;
  readonly factors: IndirectFactors;
  /** Largest size of a 3D texture along an axis, and of a 2D texture. */
  readonly max3DTextureSize: number;
  readonly maxTextureSize: number;
  /** A texture for pages; `undefined` where the device cannot draw into half floats. */
  createPages(width: number, height: number): PagesTarget | undefined;
  /** What shaders read lumels from, where no light tells it; other than `null` only while a scene is drawn. */
  readonly pages?: { value: Texture | null };
  /** A light that tells what meshes with lumels read them from. */
  createLumelLight?(pages: Texture): Light;
  /** Brings a texture's new data to the device, where the renderer does not look for it in each frame. */
  upload?(texture: Data3DTexture): void;
  /** Gives lights glTF's falloff, and what else {@link patchMaterials} lists; may be called again. */
  patch(root: Object3D): void;
  unpatch(root: Object3D): void;
}
