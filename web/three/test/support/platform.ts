import { Box3, Light, Vector3 } from 'three';
import type { Platform, ProbeGrid } from '../../src/platform.js';

class FakeGrid extends Light {
  resolution = new Vector3();
  boundingBox = new Box3();
  priority = 0;
  texture: ProbeGrid['texture'] = null;
  width = 0;
  height = 0;
  depth = 0;
  updateBoundingBox(): void {}
}

/** A renderer of which nothing is drawn. */
export const platform: Platform = {
  createGrid: () => new FakeGrid() as ProbeGrid,
  scaleIn: 'atlas',
  factors: { lumels: { value: 1 }, slopes: { value: 0 }, still: { value: 1 }, moving: { value: 1 } },
  pages: { value: null },
  freeUnits: () => 2,
  max3DTextureSize: 256,
  maxTextureSize: 2048,
  createPages: () => undefined,
  patch: () => {},
  unpatch: () => {},
};
