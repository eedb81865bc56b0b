import type { LightSpec, Transform } from '@lumencast/client';
import { Matrix4, type Object3D, PointLight, Quaternion, Vector3 } from 'three';
import { lightSpec, type PunctualLight } from './lights.js';

/** Least time between two edits of one object, milliseconds: 30 a second. */
export const FOLLOW_INTERVAL = 1000 / 30;

/** What an edit could say of an object at one moment. */
export interface Pose {
  readonly transform: Required<Transform>;
  readonly light: LightSpec | undefined;
}

/** A node's place relative to its parent, and its light where it has one. */
export function poseOf(object: Object3D, light: PunctualLight | undefined): Pose {
  const isAimed = light === object && 'target' in light && light.target.parent !== light;
  const rotation = isAimed ? aimed(light) : object.quaternion;
  return {
    transform: {
      translation: object.position.toArray(),
      rotation: rotation.toArray() as [number, number, number, number],
      scale: object.scale.toArray(),
    },
    light: light && lightSpec(light),
  };
}

/** The rotation below its parent by which a light shines at a target that is not its own. */
function aimed(light: PunctualLight): Quaternion {
  const { rotation } = worldPoseOf(light).transform;
  const parent = light.parent?.getWorldQuaternion(new Quaternion()) ?? new Quaternion();
  return parent.invert().multiply(new Quaternion(...rotation));
}

/** The same in world space, for a light of the program's own: it may have a parent, and a target. */
export function worldPoseOf(light: PunctualLight): Pose {
  light.updateWorldMatrix(true, false);
  const position = new Vector3().setFromMatrixPosition(light.matrixWorld);
  const rotation = new Quaternion();
  if (!(light instanceof PointLight)) {
    light.target.updateWorldMatrix(true, false);
    const target = new Vector3().setFromMatrixPosition(light.target.matrixWorld);
    rotation.setFromRotationMatrix(new Matrix4().lookAt(position, target, light.up));
  }
  return {
    transform: {
      translation: position.toArray(),
      rotation: rotation.toArray() as [number, number, number, number],
      scale: [1, 1, 1],
    },
    light: lightSpec(light),
  };
}

/** The parts of `now` that differ from `before`; `undefined` when none does. */
export function changedParts<T extends object>(before: T | undefined, now: T): Partial<T> | undefined {
  const changed = Object.entries(now).filter(([name, value]) => !equal(before?.[name as keyof T], value));
  return changed.length > 0 ? (Object.fromEntries(changed) as Partial<T>) : undefined;
}

function equal(a: unknown, b: unknown): boolean {
  if (Array.isArray(a) && Array.isArray(b))
    return a.length === b.length && a.every((value, i) => value === b[i]);
  return a === b;
}
