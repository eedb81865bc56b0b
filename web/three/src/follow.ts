import type { LightSpec, Transform } from '@lumencast/client';
import type { Object3D } from 'three';
import { isPunctualLight, lightSpec } from './lights.js';

/** Least time between two edits of one object, milliseconds: 30 a second. */
export const FOLLOW_INTERVAL = 1000 / 30;

/** What an edit could say of an object at one moment. */
export interface Pose {
  readonly transform: Required<Transform>;
  readonly light: LightSpec | undefined;
}

export function poseOf(object: Object3D): Pose {
  return {
    transform: {
      translation: object.position.toArray(),
      rotation: object.quaternion.toArray() as [number, number, number, number],
      scale: object.scale.toArray(),
    },
    light: isPunctualLight(object) ? lightSpec(object) : undefined,
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
