import { DirectionalLight, Group, PointLight, SpotLight, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { exposureFor } from '../src/view/exposure.js';
import { findFlashlight } from '../src/view/flashlight.js';
import { setSunAngles, sunAngles } from '../src/view/sun.js';

describe('exposureFor', () => {
  it('scales with the light', () => {
    const picture = Array.from({ length: 1000 }, (_, i) => 0.1 + i / 1000);
    const exposure = exposureFor(picture)!;
    expect(exposureFor(picture.map((value) => value * 1000))).toBeCloseTo(exposure / 1000, 6);
  });

  it('brings an even picture to middle grey', () => {
    expect(exposureFor(new Array(100).fill(50))).toBeCloseTo(0.2 / 50);
  });

  it('does not burn out a small bright part', () => {
    const picture = [...new Array(900).fill(0.01), ...new Array(100).fill(10)];
    expect(exposureFor(picture)! * 10).toBeLessThanOrEqual(3);
  });

  it('leaves a black picture alone', () => {
    expect(exposureFor(new Array(100).fill(0))).toBeUndefined();
  });
});

describe('sun angles', () => {
  it.each([
    [0, 0.5],
    [2, 0.1],
    [-3, 1.2],
  ])('survive a turned parent (%d, %d)', (azimuth, elevation) => {
    const parent = new Group();
    parent.rotation.set(0.3, -1, 2);
    const sun = new DirectionalLight();
    parent.add(sun);
    parent.updateMatrixWorld();
    setSunAngles(sun, { azimuth, elevation });
    parent.updateMatrixWorld();
    expect(sunAngles(sun).azimuth).toBeCloseTo(azimuth, 6);
    expect(sunAngles(sun).elevation).toBeCloseTo(elevation, 6);
  });

  it('mean where the light comes from', () => {
    const sun = new DirectionalLight();
    setSunAngles(sun, { azimuth: 0, elevation: Math.PI / 2 });
    const shines = new Vector3(0, 0, -1).applyQuaternion(sun.quaternion);
    expect(shines.y).toBeCloseTo(-1);
  });
});

describe('findFlashlight', () => {
  it('prefers the one that is named so', () => {
    const [ceiling, flashlight] = [new SpotLight(), new SpotLight()];
    ceiling.name = 'ceiling';
    new Group().add(flashlight).name = 'Flashlight';
    expect(findFlashlight([new PointLight(), ceiling, flashlight])).toBe(flashlight);
    expect(findFlashlight([ceiling])).toBe(ceiling);
    expect(findFlashlight([new PointLight()])).toBeUndefined();
  });
});
