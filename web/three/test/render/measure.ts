/**
 * Draws small scenes with the plugin in a real browser and reads radiances back, so that a test can
 * compare them with closed forms: falloff of lights, light of a probe volume, directions of an
 * environment picture.
 */
import type { Field, LightState, SessionEvents } from '@lumencast/client';
import {
  type Camera,
  DataTexture,
  DoubleSide,
  FloatType,
  Mesh,
  MeshLambertMaterial,
  OrthographicCamera,
  PerspectiveCamera,
  PlaneGeometry,
  PointLight,
  Scene,
  SpotLight,
  Vector3,
  WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import { WebGPURenderer } from 'three/webgpu';
import { showEnvironment } from '../../src/environment.js';
import { attach, type LightSession, type LumencastLight } from '../../src/index.js';
import { attach as attachWebGPU } from '../../src/webgpu.js';

type Kind = 'webgl' | 'webgpu';
type Radiance = [r: number, g: number, b: number];
const SIZE = 64;

async function rendererOf(kind: Kind): Promise<WebGLRenderer | WebGPURenderer> {
  if (kind === 'webgl') return new WebGLRenderer();
  const renderer = new WebGPURenderer();
  await renderer.init();
  return renderer;
}

/** A session that stands still. */
function session(light: LightState, field?: Field): LightSession {
  const catalog: SessionEvents['catalog'] = {
    epoch: '0000000000000000',
    scene: { name: 'test', root: 'test.glb' },
    tickSeconds: 0.04,
    fields: field ? [field] : [],
  };
  return {
    origin: location.origin,
    catalog,
    light: () => light,
    on: () => () => {},
    sceneTime: () => 0,
    setCamera: () => {},
    close: () => {},
    edit: () => Promise.resolve(),
  } as unknown as LightSession;
}

function lit(
  kind: Kind,
  renderer: WebGLRenderer | WebGPURenderer,
  scene: Scene,
  of: LightSession,
): LumencastLight {
  return kind === 'webgl'
    ? attach(of, { scene, renderer: renderer as WebGLRenderer, shadows: false })
    : attachWebGPU(of, { scene, renderer: renderer as WebGPURenderer, shadows: false });
}

/** Radiances along the middle row of a picture. */
async function middleRow(
  renderer: WebGLRenderer | WebGPURenderer,
  scene: Scene,
  camera: Camera,
): Promise<Radiance[]> {
  const target = new WebGLRenderTarget(SIZE, SIZE, { type: FloatType });
  renderer.setRenderTarget(target as never);
  renderer.render(scene, camera);
  const pixels = new Float32Array(SIZE * SIZE * 4);
  const read =
    renderer instanceof WebGLRenderer
      ? (await renderer.readRenderTargetPixelsAsync(target, 0, 0, SIZE, SIZE, pixels), pixels)
      : ((await renderer.readRenderTargetPixelsAsync(target as never, 0, 0, SIZE, SIZE)) as Float32Array);
  renderer.setRenderTarget(null);
  const first = (SIZE / 2) * SIZE * 4;
  return Array.from(
    { length: SIZE },
    (_, x) => [...read.subarray(first + x * 4, first + x * 4 + 3)] as Radiance,
  );
}

/** A white floor, four metres across, seen from straight above; with an occlusion map of one value if any. */
function floor(occlusion?: number): { scene: Scene; camera: OrthographicCamera } {
  const scene = new Scene();
  const material = new MeshLambertMaterial({ color: 0xffffff, side: DoubleSide });
  if (occlusion !== undefined) {
    material.aoMap = new DataTexture(new Uint8Array([255 * occlusion, 0, 0, 255]), 1, 1);
    material.aoMap.needsUpdate = true;
  }
  const plane = new Mesh(new PlaneGeometry(4, 4), material);
  plane.rotation.x = -Math.PI / 2;
  scene.add(plane);
  const camera = new OrthographicCamera(-2, 2, 2, -2, 0.1, 10);
  camera.position.y = 5;
  camera.up.set(0, 0, -1);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
  return { scene, camera };
}

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
  if (withPlugin) lit(kind, renderer, scene, session({ fields: [], age: undefined })).update(camera);
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
  const field: Field = {
    id: 0,
    kind: 'volume',
    basis: 'sh',
    order,
    use: 'all',
    grid: { center: [0, 0, 0], rotation: [0, 0, 0, 1], size: [4, 4, 4], resolution: [4, 2, 3] },
    cellsMin: [0, 0, 0],
    regions: [],
    layers: 1,
  };
  const state: LightState = {
    fields: [
      {
        field,
        coefficients: new Float32Array(coefficients),
        scale,
        revision: 1,
        age: 0,
        sceneVersion: 1,
        tick: 1,
        regions: { lit: 1, all: 1 },
      },
    ],
    age: 0,
  };
  const renderer = await rendererOf(kind);
  lit(kind, renderer, scene, session(state, field)).update(camera);
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

declare global {
  interface Window {
    measure?: { lamp: typeof lamp; volume: typeof volume; environment: typeof environment };
  }
}
window.measure = { lamp, volume, environment };
