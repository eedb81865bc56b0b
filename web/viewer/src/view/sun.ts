import { type Object3D, Quaternion, Vector3 } from 'three';

/** Where a directional light comes from, radians. */
export interface SunAngles {
  /** From −Z towards +X. */
  readonly azimuth: number;
  /** Above the horizon. */
  readonly elevation: number;
}

/** Reads the angles off an object that shines along its −Z. */
export function sunAngles(object: Object3D): SunAngles {
  const towards = new Vector3(0, 0, 1).applyQuaternion(object.getWorldQuaternion(new Quaternion()));
  return {
    azimuth: Math.atan2(towards.x, -towards.z),
    elevation: Math.asin(Math.min(Math.max(towards.y, -1), 1)),
  };
}

/** Turns an object so that it shines from there. */
export function setSunAngles(object: Object3D, { azimuth, elevation }: SunAngles): void {
  const flat = Math.cos(elevation);
  const towards = new Vector3(Math.sin(azimuth) * flat, Math.sin(elevation), -Math.cos(azimuth) * flat);
  const world = new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), towards);
  const parent = object.parent?.getWorldQuaternion(new Quaternion()) ?? new Quaternion();
  object.quaternion.copy(parent.invert().multiply(world));
}
