import { type Color, type Material, MeshStandardMaterial } from 'three';
import type { Vec3, Vec4 } from '@lumencast/client';
import { setColor } from './lights.js';

/** What `set_material` changes. */
const PARTS = ['base_color', 'metallic', 'roughness', 'emissive'] as const;

/** A part of a material as edits have it; `undefined` where the material has no such thing. */
export function materialPart(material: Material | undefined, part: string | undefined): unknown {
  if (material === undefined) return undefined;
  if (part === 'base_color')
    return hasColor(material) ? [...material.color.toArray(), material.opacity] : undefined;
  if (!(material instanceof MeshStandardMaterial)) return undefined;
  switch (part) {
    case 'metallic':
      return material.metalness;
    case 'roughness':
      return material.roughness;
    default:
      return material.emissive.clone().multiplyScalar(material.emissiveIntensity).toArray();
  }
}

export function setMaterialPart(material: Material, part: string | undefined, value: unknown): void {
  if (part === 'base_color' && hasColor(material)) {
    const [r, g, b, opacity] = value as Vec4;
    setColor(material.color, [r, g, b]);
    material.opacity = opacity;
  }
  if (!(material instanceof MeshStandardMaterial)) return;
  if (part === 'metallic') material.metalness = value as number;
  else if (part === 'roughness') material.roughness = value as number;
  else if (part === 'emissive') {
    setColor(material.emissive, value as Vec3);
    material.emissiveIntensity = 1;
  }
}

/** Gives a material what edits have made of another of the same number. */
export function copyParts(from: Material, to: Material): void {
  for (const part of PARTS) {
    const value = materialPart(from, part);
    if (value !== undefined) setMaterialPart(to, part, value);
  }
}

function hasColor(material: Material): material is Material & { color: Color } {
  return 'color' in material;
}
