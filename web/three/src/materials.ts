import { type Color, type Material, MeshPhysicalMaterial, MeshStandardMaterial, type Vector2 } from 'three';
import type { MaterialChange, Vec3, Vec4 } from '@lumencast/client';
import { setColor } from './lights.js';

type Part = keyof MaterialChange;

/** What `set_material` changes. */
export const MATERIAL_PARTS: readonly Part[] = [
  'base_color',
  'metallic',
  'roughness',
  'emissive',
  'transmission',
  'ior',
  'specular',
  'specular_color',
  'normal_scale',
  'alpha_cutoff',
];

/** What three.js has for MeshPhysicalMaterial alone. */
const PHYSICAL: ReadonlySet<Part> = new Set<Part>(['transmission', 'ior', 'specular', 'specular_color']);

/** Stands for an infinite index of refraction, as in GLTFLoader. */
export const INFINITE_IOR = 1000;

/** A part of a material as edits have it; `undefined` where the material has no such thing. */
export function materialPart(material: Material | undefined, part: Part): unknown {
  if (material === undefined) return undefined;
  if (part === 'base_color')
    return hasColor(material) ? [...material.color.toArray(), material.opacity] : undefined;
  if (part === 'alpha_cutoff') return material.alphaTest;
  if (!(material instanceof MeshStandardMaterial)) return undefined;
  if (part === 'metallic') return material.metalness;
  if (part === 'roughness') return material.roughness;
  if (part === 'emissive')
    return material.emissive.clone().multiplyScalar(material.emissiveIntensity).toArray();
  if (part === 'normal_scale') return material.normalScale.x;
  if (!(material instanceof MeshPhysicalMaterial)) return undefined;
  if (part === 'transmission') return material.transmission;
  if (part === 'ior') return material.ior;
  if (part === 'specular') return material.specularIntensity;
  return material.specularColor.toArray();
}

/** Sets a part, where the material has such a thing. */
export function setMaterialPart(material: Material, part: Part, value: unknown): void {
  if (part === 'base_color' && hasColor(material)) {
    const [r, g, b, opacity] = value as Vec4;
    setColor(material.color, [r, g, b]);
    material.opacity = opacity;
  } else if (part === 'alpha_cutoff') material.alphaTest = value as number;
  if (!(material instanceof MeshStandardMaterial)) return;
  if (part === 'metallic') material.metalness = value as number;
  else if (part === 'roughness') material.roughness = value as number;
  else if (part === 'emissive') {
    setColor(material.emissive, value as Vec3);
    material.emissiveIntensity = 1;
  } else if (part === 'normal_scale') setNormalScale(material.normalScale, value as number);
  if (!(material instanceof MeshPhysicalMaterial)) return;
  if (part === 'transmission') material.transmission = value as number;
  else if (part === 'ior') material.ior = (value as number) || INFINITE_IOR;
  else if (part === 'specular') material.specularIntensity = value as number;
  else if (part === 'specular_color') setColor(material.specularColor, value as Vec3);
}

/**
 * Whether a part would show, had the material been loaded as a MeshPhysicalMaterial: GLTFLoader makes
 * one only of a material with an extension that needs it.
 */
export function lacksPhysical(material: Material, part: Part): boolean {
  return (
    PHYSICAL.has(part) &&
    material instanceof MeshStandardMaterial &&
    !(material instanceof MeshPhysicalMaterial)
  );
}

/** Gives a material what edits have made of another of the same number. */
export function copyParts(from: Material, to: Material): void {
  for (const part of MATERIAL_PARTS) {
    const value = materialPart(from, part);
    if (value !== undefined) setMaterialPart(to, part, value);
  }
}

/** GLTFLoader turns y around for meshes without tangents: that stays, through a scale of 0 (±0) too. */
function setNormalScale(scale: Vector2, value: number): void {
  const turned = 1 / scale.x < 0 !== 1 / scale.y < 0;
  scale.set(value, turned ? -value : value);
}

function hasColor(material: Material): material is Material & { color: Color } {
  return 'color' in material;
}
