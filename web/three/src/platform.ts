import type { Box3, Data3DTexture, Light, Object3D, Scene, Vector3 } from 'three';

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
  /** Grids that the scene leaves texture units for, as it now is. */
  freeGrids(scene: Scene): number;
  /** What the shader multiplies the light of all grids by, where their own intensity does not reach it. */
  readonly gridExposure?: { value: number };
  /** Largest size of a 3D texture along an axis. */
  readonly max3DTextureSize: number;
  /** Brings a texture's new data to the device, where the renderer does not look for it in each frame. */
  upload?(texture: Data3DTexture): void;
  /** Gives lights glTF's falloff, and what else {@link patchMaterials} lists; may be called again. */
  patch(root: Object3D): void;
  unpatch(root: Object3D): void;
}
