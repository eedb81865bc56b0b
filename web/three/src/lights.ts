import type { Light as LightData, LightSpec } from '@lumencast/client';
import {
  type Color,
  DirectionalLight,
  LinearSRGBColorSpace,
  type Object3D,
  PointLight,
  SpotLight,
} from 'three';

/** The lights that glTF knows. They shine along their node's −Z, as GLTFLoader sets them up. */
export type PunctualLight = PointLight | SpotLight | DirectionalLight;

export function isPunctualLight(object: Object3D): object is PunctualLight {
  return object instanceof PointLight || object instanceof SpotLight || object instanceof DirectionalLight;
}

/** A three.js light like the one described. */
export function createLight(data: LightData): PunctualLight {
  const light =
    data.type === 'point'
      ? new PointLight()
      : data.type === 'spot'
        ? new SpotLight()
        : new DirectionalLight();
  if (!(light instanceof PointLight)) {
    light.target.position.set(0, 0, -1);
    light.add(light.target);
  }
  light.position.set(0, 0, 0);
  setLight(light, { color: [1, 1, 1], intensity: 1, ...data });
  return light;
}

/** What a three.js light is, in glTF's terms. */
export function describeLight(light: PunctualLight): LightData {
  const spec = lightSpec(light);
  if (light instanceof SpotLight) return { type: 'spot', inner: 0, outer: Math.PI / 4, ...spec };
  return { type: light instanceof PointLight ? 'point' : 'directional', ...spec };
}

/** What lights of three.js lack. GLTFLoader keeps a light's extras in its `userData`, as is done here. */
type Size = Pick<LightSpec, 'radius' | 'angle'>;

/** All parts of a light that the server knows; `range` is left out where it is infinite. */
export function lightSpec(light: PunctualLight): LightSpec {
  const spec: LightSpec = {
    color: light.color.toArray() as [number, number, number],
    intensity: light.intensity,
  };
  if (!(light instanceof DirectionalLight) && light.distance > 0) spec.range = light.distance;
  if (light instanceof SpotLight) {
    spec.inner = light.angle * (1 - light.penumbra);
    spec.outer = light.angle;
  }
  const { radius = 0, angle = 0 } = (light.userData.lumencast ?? {}) as Size;
  if (light instanceof DirectionalLight) spec.angle = angle;
  else spec.radius = radius;
  return spec;
}

/** Whether edits can make of one light what another is: they change neither its kind nor an end to its reach. */
export function canBecome(from: PunctualLight, to: PunctualLight): boolean {
  const [before, after] = [describeLight(from), describeLight(to)];
  return before.type === after.type && (before.range === undefined || after.range !== undefined);
}

/** Sets those parts of a light that are given. */
export function setLight(light: PunctualLight, spec: LightSpec): void {
  if (spec.color) setColor(light.color, spec.color);
  if (spec.intensity !== undefined) light.intensity = spec.intensity;
  if (spec.range !== undefined && !(light instanceof DirectionalLight)) light.distance = spec.range;
  if (light instanceof SpotLight) {
    const outer = spec.outer ?? light.angle;
    const inner = spec.inner ?? light.angle * (1 - light.penumbra);
    light.angle = outer;
    light.penumbra = outer > 0 ? 1 - Math.min(inner / outer, 1) : 0;
  }
  const extras = light.userData.lumencast as Size | undefined;
  if (light instanceof DirectionalLight) {
    if (spec.angle !== undefined) light.userData.lumencast = { ...extras, angle: spec.angle };
  } else if (spec.radius !== undefined) light.userData.lumencast = { ...extras, radius: spec.radius };
}

/** Sets a colour from linear values. */
export function setColor(color: Color, [r, g, b]: readonly [number, number, number]): void {
  color.setRGB(r, g, b, LinearSRGBColorSpace);
}
