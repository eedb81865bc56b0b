import type { Environment } from '@lumencast/client';
import type { Light, Material, Mesh, Object3D } from 'three';

/** A clear sky that gives level ground 1,000 lux: `--environment sky:1000`. */
export const SKY: Environment = {
  type: 'sky',
  zenith: [196.798, 284.264, 437.33],
  horizon: [371.73, 406.717, 437.33],
  ground: [111.519, 122.015, 131.199],
};

/** Whether nothing in a scene gives light: no lamp, no surface, nothing from afar. */
export function isDark(scene: Object3D, environment: Environment | undefined): boolean {
  if (environment && shines(environment)) return false;
  let isDark = true;
  scene.traverseVisible((object) => {
    const { isLight, intensity = 0, color } = object as Partial<Light>;
    if (isLight && color) isDark &&= intensity === 0 || isBlack(color);
    const { material = [] } = object as Partial<Mesh>;
    for (const each of [material].flat()) isDark &&= !emits(each);
  });
  return isDark;
}

function shines(environment: Environment): boolean {
  if (environment.type === 'image') return environment.intensity !== 0;
  const parts =
    environment.type === 'sky'
      ? [environment.zenith, environment.horizon, environment.ground]
      : [environment.radiance];
  return parts.flat().some((value) => value > 0);
}

/** Materials that are not lit show their colour by themselves. */
function emits(material: Material): boolean {
  if ('isMeshBasicMaterial' in material) return true;
  const { emissive, emissiveIntensity = 1 } = material as Material & {
    emissive?: { r: number; g: number; b: number };
    emissiveIntensity?: number;
  };
  return emissive !== undefined && emissiveIntensity > 0 && !isBlack(emissive);
}

function isBlack({ r, g, b }: { r: number; g: number; b: number }): boolean {
  return Math.max(r, g, b) <= 0;
}
