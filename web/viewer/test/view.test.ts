import type { Environment } from '@lumencast/client';
import {
  BufferGeometry,
  DirectionalLight,
  Group,
  Mesh,
  MeshStandardMaterial,
  PointLight,
  SpotLight,
  Vector3,
} from 'three';
import { describe, expect, it } from 'vitest';
import { readVectors } from '../../client/test/support/vectors.js';
import { INTENSITY, intensityAt, intensityText } from '../src/ui/intensity.js';
import { burnt, exposureFor, MIDDLE_GREY, MOST_BURNT, STOPS, withinStops } from '../src/view/exposure.js';
import { findFlashlight } from '../src/view/flashlight.js';
import { irradianceWeights } from '../src/view/probes.js';
import { isDark, SKY } from '../src/view/sky.js';
import { setSunAngles, sunAngles } from '../src/view/sun.js';
import { lumelWords, missingFile, unshownWords, wordsFor } from '../src/words.js';

describe('exposureFor', () => {
  it('scales with the light', () => {
    const picture = Array.from({ length: 1000 }, (_, i) => 0.1 + i / 1000);
    const exposure = exposureFor(picture)!;
    expect(exposureFor(picture.map((value) => value * 1000))).toBeCloseTo(exposure / 1000, 6);
  });

  it('brings an even picture to middle grey', () => {
    expect(exposureFor(new Array(100).fill(50))).toBeCloseTo(0.2 / 50);
  });

  /** Luminances of a dim room, two stops to either side of 0.1, a part of which a lamp makes so much brighter. */
  const room = (share: number, times: number) =>
    Array.from({ length: 1000 }, (_, i) => {
      const luminance = 0.1 * 2 ** (((i * 7) % 41) / 10 - 2);
      return i < share * 1000 ? luminance * times : luminance;
    });

  it('keeps contrast and colour in what a flashlight shows', () => {
    for (const times of [8, 16, 32]) {
      const picture = room(0.16, times);
      const exposure = exposureFor(picture)!;
      expect(burnt(picture, exposure)).toBeLessThanOrEqual(MOST_BURNT);
      // Above 1, colours pale; the room around is not given up for it.
      expect(picture.filter((value) => value * exposure > 1).length).toBeLessThan(100);
      expect(exposure * 0.1).toBeGreaterThan(MIDDLE_GREY / 8);
    }
  });

  it('takes a lamp of few pixels for what it is', () => {
    const [without, withLamp] = [exposureFor(room(0, 1))!, exposureFor(room(0.03, 1000))!];
    expect(Math.abs(Math.log2(withLamp / without))).toBeLessThan(0.3);
  });

  it('does not jump where a bright part grows', () => {
    for (const times of [10, 30, 100]) {
      const parts = Array.from({ length: 60 }, (_, i) => i / 200);
      const stops = parts.map((share) => Math.log2(exposureFor(room(share, times))!));
      for (let i = 1; i < stops.length; i++) {
        expect(stops[i]).toBeLessThan(stops[i - 1] + 0.02);
        expect(stops[i - 1] - stops[i]).toBeLessThan(0.8);
      }
    }
  });

  it('leaves a room with a large window visible', () => {
    expect(exposureFor(room(0.3, 1000))! * 0.1).toBeGreaterThan(MIDDLE_GREY / 64);
  });

  it('leaves a black picture alone', () => {
    expect(exposureFor(new Array(100).fill(0))).toBeUndefined();
  });
});

describe('the exposures that the page offers', () => {
  it('hold what a picture in the sun asks for, and one by moonlight', () => {
    // White ground under 100,000 and 0.1 lx.
    for (const illuminance of [1e5, 0.1]) {
      const exposure = exposureFor(new Array(100).fill(illuminance / Math.PI))!;
      expect(withinStops(exposure)).toBe(exposure);
    }
  });

  it('are all that is ever set', () => {
    const brightest = exposureFor(new Array(100).fill(1e12))!;
    expect(Math.log2(withinStops(brightest))).toBe(STOPS.min);
    expect(Math.log2(withinStops(1e9))).toBe(STOPS.max);
  });
});

describe('intensities of the inspector', () => {
  const text = intensityText('lx');

  it('are what the light has, however faint', () => {
    for (const intensity of [1e-8, 1e-4, 1e-3, 0.02, 1, 60, 1e5, 1e6])
      expect(text(Math.log10(intensity))).toBe(`${intensity} lx`);
    expect(text(Math.log10(0))).toBe('0 lx');
  });

  it('reach from off over 0.001 lx to the sun', () => {
    expect(intensityAt(INTENSITY.min)).toBe(0);
    expect(intensityAt(-3)).toBeCloseTo(1e-3, 12);
    expect(intensityAt(5)).toBe(1e5);
    expect(INTENSITY.min).toBeLessThan(-3);
    expect(INTENSITY.max).toBeGreaterThan(Math.log10(130_000));
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
  it('takes the one that is named so, and no other lamp', () => {
    const [ceiling, flashlight] = [new SpotLight(), new SpotLight()];
    ceiling.name = 'ceiling';
    new Group().add(flashlight).name = 'Flashlight';
    expect(findFlashlight([new PointLight(), ceiling, flashlight])).toBe(flashlight);
    expect(findFlashlight([ceiling])).toBeUndefined();
    expect(findFlashlight([new PointLight()])).toBeUndefined();
  });
});

describe('spheres at probes', () => {
  interface Case {
    order: number;
    normal: number[];
    coefficients: number[][];
    lux: number[];
  }
  const { irradiance } = readVectors<{ irradiance: Case[] }>('sh');
  const cases = irradiance.filter(({ order }) => order === 2);
  const found = ({ normal, coefficients }: Case, channel: number) => {
    const weights = irradianceWeights(new Float32Array(normal));
    return weights.reduce((sum, weight, k) => sum + weight * coefficients[k][channel], 0) * Math.PI;
  };

  it('have the irradiance that Rust finds', () => {
    expect(cases.length).toBeGreaterThan(3);
    for (const one of cases) one.lux.forEach((lux, c) => expect(found(one, c)).toBeCloseTo(lux, 4));
  });

  it('have another one where axes are exchanged', () => {
    const turned = (one: Case) => ({ ...one, normal: [one.normal[1], one.normal[2], one.normal[0]] });
    const off = cases.map((one) => Math.abs(found(turned(one), 0) - one.lux[0]));
    expect(Math.max(...off)).toBeGreaterThan(0.01);
  });
});

describe('isDark', () => {
  const sky = readVectors<{ environment: Environment }>('sky').environment;
  const black: Environment = { type: 'constant', radiance: [0, 0, 0] };

  it('is said of a scene that nothing lights', () => {
    const wall = new Mesh(new BufferGeometry(), new MeshStandardMaterial());
    const scene = new Group().add(wall);
    expect([isDark(scene, undefined), isDark(scene, black)]).toEqual([true, true]);
    expect(isDark(scene, sky)).toBe(false);
    wall.material.emissive.set(1, 1, 1);
    expect(isDark(scene, black)).toBe(false);
    wall.material.emissiveIntensity = 0;
    expect(isDark(scene, black)).toBe(true);
    const lamp = new PointLight(0xffffff, 1);
    scene.add(lamp);
    expect(isDark(scene, black)).toBe(false);
    // As after remove_light, and below a hidden node.
    lamp.intensity = 0;
    expect(isDark(scene, black)).toBe(true);
    lamp.intensity = 1;
    lamp.visible = false;
    expect(isDark(scene, black)).toBe(true);
  });

  it('is mended by the sky of the command line', () => {
    expect(SKY).toEqual(sky);
  });
});

describe('what the page says', () => {
  const technical = 'no answer from http://host:4443 (WebSocket connection failed)';
  const lost = (reason: string, problem = '') => ({ state: 'lost', reason, ...(problem && { problem }) });

  it('is plain when the server is gone, with the reason for those who ask', () => {
    const words = wordsFor(lost(technical), true)!;
    expect(words.message).toBe('The server is gone. The light stays; trying again.');
    expect(words.details).toBe(technical);
    expect(wordsFor(lost(technical), false)!.message).toBe('The server does not answer. Trying again.');
  });

  it('names what keeps it out', () => {
    const said = (reason: string, problem?: string) => wordsFor(lost(reason, problem), false)!.message;
    expect(said(`${technical}; the token may be wrong or have expired`)).toContain('token');
    expect(said('http://host has no scene named tomb')).toContain('does not show this scene');
    expect(said(technical, 'origin')).toContain('no pages from this address');
    expect(wordsFor({ state: 'closed', reason: 'a catalog of version 9' }, false)!.message).toContain(
      'version',
    );
  });

  it('is nothing where all is well', () => {
    for (const state of ['connecting', 'connected', 'saved'])
      expect(wordsFor({ state }, true)).toBeUndefined();
  });

  it('calls a missing file missing, and gives its address', () => {
    const address = 'https://host/light/room.light';
    expect(missingFile('The file', address, '404').message).toBe(`The file is missing: ${address}`);
    expect(missingFile('The file', address, '503').message).toContain('503');
  });
});

describe('words for lumels', () => {
  it('say how many there are', () => {
    const shown = { pages: 2, pageSize: 512, meshes: 7 };
    expect(lumelWords(shown)).toBe('On 2 pages of 512 × 512; they light 7 meshes.');
    expect(lumelWords({ ...shown, pages: 1, meshes: 1 })).toBe(
      'On one page of 512 × 512; they light one mesh.',
    );
  });

  it('say why there are none, and what helps', () => {
    expect(unshownWords({ secureContext: true })).toMatch(/video.*this browser/);
    expect(unshownWords({ secureContext: false })).toMatch(/secure pages.*https/);
  });
});
