/**
 * Draws small scenes with the plugin in a real browser and reads radiances back, so that a test can
 * compare them with closed forms: falloff of lights, light of a probe volume, directions of an
 * environment picture.
 */
import { PerspectiveCamera, PointLight, SpotLight, Scene, Vector3 } from 'three';
import { showEnvironment } from '../../src/environment.js';
import { bright } from './bright.js';
import { changing } from './changing.js';
import { crowded } from './crowded.js';
import { lumels } from './lumels.js';
import {
  floor,
  type Kind,
  lit,
  middleRow,
  type Radiance,
  rendererOf,
  session,
  SIZE,
  volumeLight,
} from './stage.js';

/** Radiance along x = −2 … 2 of the floor under a light at a height, shining down. */
async function lamp(
  kind: Kind,
  light: {
    type: 'point' | 'spot';
    height: number;
    intensity: number;
    range: number;
    inner: number;
    outer: number;
  },
  withPlugin = true,
  occlusion?: number,
): Promise<Radiance[]> {
  const { scene, camera } = floor(occlusion);
  const three = light.type === 'point' ? new PointLight() : new SpotLight();
  three.intensity = light.intensity;
  three.distance = light.range;
  three.position.set(0, light.height, 0);
  if (three instanceof SpotLight) {
    three.angle = light.outer;
    three.penumbra = 1 - light.inner / light.outer;
    scene.add(three.target);
  }
  scene.add(three);
  const renderer = await rendererOf(kind);
  if (withPlugin) lit(kind, renderer, session({ fields: [], age: undefined }), { scene }).update(camera);
  return middleRow(renderer, scene, camera);
}

/** Radiance along x of the floor under a volume whose light grows with x. */
async function volume(
  kind: Kind,
  coefficients: number[],
  scale: number,
  order: number,
  occlusion?: number,
): Promise<Radiance[]> {
  const { scene, camera } = floor(occlusion);
  const light = volumeLight(coefficients, { scale, order });
  const renderer = await rendererOf(kind);
  lit(kind, renderer, session({ fields: [light], age: 0 }, [light.field]), { scene }).update(camera);
  return middleRow(renderer, scene, camera);
}

/** Radiance of the environment in a direction. */
async function environment(
  kind: Kind,
  of: Parameters<typeof showEnvironment>[1],
  directions: [number, number, number][],
): Promise<Radiance[]> {
  const scene = new Scene();
  await showEnvironment(
    scene,
    of,
    (uri) => uri,
    () => true,
  );
  const renderer = await rendererOf(kind);
  const camera = new PerspectiveCamera(2, 1, 0.1, 10);
  const seen: Radiance[] = [];
  for (const direction of directions) {
    camera.lookAt(new Vector3(...direction));
    camera.updateMatrixWorld();
    seen.push((await middleRow(renderer, scene, camera))[SIZE / 2]);
  }
  return seen;
}

const measurements = { lamp, volume, environment, crowded, bright, changing, lumels };

declare global {
  interface Window {
    measure?: typeof measurements;
  }
}
window.measure = measurements;
