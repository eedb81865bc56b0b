import type { InstancedMesh, Light, Material, Mesh, Object3D, Scene, SpotLight } from 'three';
import { materialsOf } from './patch.js';

/**
 * Texture units that three.js r187 takes in a scene before any probe grid: what the lights take of every
 * material, and the most that a material and its object take besides. WebGLRenderer gives each map a
 * unit of its own, also where it is one texture for several, and counts what vertices read against the
 * same limit; WebGPURenderer binds a texture once, and the limit is that of fragments alone.
 *
 * Rather too many than too few: a map counts also while the lobe that it belongs to is off. Textures of
 * a program's own shaders and nodes are not known, nor coloured shadows (`shadowMap.transmitted`).
 */
export function unitsTaken(scene: Scene, renderer: 'webgl' | 'webgpu'): number {
  const known = new Map<Material, number>();
  let [ofLights, ofTables, most] = [0, 0, 0];
  scene.traverse((object) => {
    const { castShadow, map } = object as Light & Partial<SpotLight>;
    if ('isLight' in object) ofLights += Number(castShadow) + Number(isTexture(map));
    if ('isRectAreaLight' in object) ofTables = 2;
    const ofVertices = renderer === 'webgl' ? vertexUnits(object) : 0;
    for (const material of materialsOf(object)) {
      const units = known.get(material) ?? materialUnits(material, scene, renderer);
      known.set(material, units);
      most = Math.max(most, units + ofVertices);
    }
  });
  return ofLights + ofTables + most;
}

function materialUnits(material: Material, { environment }: Scene, renderer: 'webgl' | 'webgpu'): number {
  const maps: unknown[] = Object.values(material).filter(isTexture);
  const { envMap, transmission = 0 } = material as Material & { envMap?: unknown; transmission?: number };
  const more = [
    // The table for rough reflections.
    'roughness' in material,
    environment !== null && envMap === null,
    // The picture of what is behind.
    transmission > 0,
  ];
  return (renderer === 'webgl' ? maps.length : new Set(maps).size) + more.filter(Boolean).length;
}

/** Bones, morph targets and batches. */
function vertexUnits(object: Object3D): number {
  const { geometry } = object as Partial<Mesh>;
  const { morphTexture } = object as Partial<InstancedMesh>;
  const morphs = Object.keys(geometry?.morphAttributes ?? {}).length > 0;
  return (
    Number('isSkinnedMesh' in object) +
    Number(morphs) +
    Number(isTexture(morphTexture)) +
    // Matrices, indices and colours.
    3 * Number('isBatchedMesh' in object)
  );
}

function isTexture(value: unknown): boolean {
  return typeof value === 'object' && value !== null && 'isTexture' in value;
}
