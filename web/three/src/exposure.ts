import { type Material, type Object3D, type Scene, SRGBColorSpace, Texture } from 'three';
import { materialsOf } from './patch.js';

/** Gives an object another value for as long as its scene is drawn. */
export type SetWhileDrawn = (owner: object, key: string, value: unknown) => void;

/**
 * Changes a scene for the time of drawing only, so that the program's own values stay; returns what
 * ends that.
 */
export function whileDrawn(scene: Scene, change: (set: SetWhileDrawn) => void): () => void {
  const { onBeforeRender, onAfterRender } = scene;
  const undo: (() => void)[] = [];
  let depth = 0;
  const restore = () => {
    depth = 0;
    for (let last = undo.pop(); last; last = undo.pop()) last();
  };
  scene.onBeforeRender = (...parameters) => {
    onBeforeRender.apply(scene, parameters);
    // Shadow maps and mirrors draw the scene while it is being drawn.
    if (depth++ > 0) return;
    change((owner, key, value) => {
      const values = owner as Record<string, unknown>;
      const before = values[key];
      undo.push(() => (values[key] = before));
      values[key] = value;
    });
    // After an error, and in WebGPURenderer's `compileAsync`, `onAfterRender` is not called.
    queueMicrotask(restore);
  };
  scene.onAfterRender = (...parameters) => {
    if (--depth <= 0) restore();
    onAfterRender.apply(scene, parameters);
  };
  return () => Object.assign(scene, { onBeforeRender, onAfterRender });
}

/**
 * Multiplies what a scene's materials, environment and background radiate, lights apart. What three.js
 * shows as it is, without exposure, stays: unlit materials with `toneMapped = false`, sRGB pictures and
 * single colours as background, fog. So do a program's own shaders and nodes, and environment maps that
 * materials other than standard ones mix in or add.
 */
export function expose(scene: Scene, factor: number, set: SetWhileDrawn): void {
  const multiply = (owner: object, key: string) => {
    const value = (owner as Record<string, number | undefined>)[key];
    if (value !== undefined) set(owner, key, value * factor);
  };
  for (const material of materialsBelow(scene)) {
    if ('emissiveIntensity' in material) {
      multiply(material, 'emissiveIntensity');
      multiply(material, 'lightMapIntensity');
      // Others multiply by their environment what is multiplied already.
      if ('metalness' in material) multiply(material, 'envMapIntensity');
    } else if ('color' in material && material.toneMapped) {
      for (const channel of ['r', 'g', 'b']) multiply(material.color as object, channel);
    }
  }
  multiply(scene, 'environmentIntensity');
  const { background } = scene;
  if (!(background instanceof Texture && background.colorSpace === SRGBColorSpace))
    multiply(scene, 'backgroundIntensity');
}

function materialsBelow(root: Object3D): Set<Material> {
  const materials = new Set<Material>();
  root.traverse((object) => materialsOf(object).forEach((material) => materials.add(material)));
  return materials;
}
