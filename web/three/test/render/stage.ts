/** What the measurements share: a renderer, light that stands still, a floor, and pictures read back. */
import type { FieldInfo, LightState, SessionEvents, Vec3 } from '@lumencast/client';
import {
  type Camera,
  DataTexture,
  DoubleSide,
  FloatType,
  Mesh,
  MeshLambertMaterial,
  OrthographicCamera,
  PlaneGeometry,
  Scene,
  WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import { WebGPURenderer } from 'three/webgpu';
import { attach, type AttachOptions, type LightSession, type LumencastLight } from '../../src/index.js';
import { attach as attachWebGPU } from '../../src/webgpu.js';

export type Kind = 'webgl' | 'webgpu';
export type Radiance = [r: number, g: number, b: number];
export const SIZE = 64;

export async function rendererOf(kind: Kind): Promise<WebGLRenderer | WebGPURenderer> {
  if (kind === 'webgl') return new WebGLRenderer();
  const renderer = new WebGPURenderer();
  await renderer.init();
  return renderer;
}

/** A session that stands still. */
export function session(light: LightState, fields: readonly FieldInfo[] = []): LightSession {
  const catalog: SessionEvents['catalog'] = {
    epoch: '0000000000000000',
    scene: { name: 'test', root: 'test.glb' },
    tickSeconds: 0.04,
    fields,
    unknown: [],
  };
  return {
    files: `${location.origin}/scene/`,
    catalog,
    status: { state: 'connected', transport: 'websocket' },
    light: () => light,
    on: () => () => {},
    sceneTime: () => 0,
    setCamera: () => {},
    close: () => {},
    edit: () => Promise.resolve(),
  } as unknown as LightSession;
}

export function lit(
  kind: Kind,
  renderer: WebGLRenderer | WebGPURenderer,
  of: LightSession,
  options: AttachOptions,
): LumencastLight {
  return kind === 'webgl'
    ? attach(of, { shadows: false, ...options, renderer: renderer as WebGLRenderer })
    : attachWebGPU(of, { shadows: false, ...options, renderer: renderer as WebGPURenderer });
}

/** Radiances along the middle row of a picture. */
export async function middleRow(
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
export function floor(occlusion?: number): { scene: Scene; camera: OrthographicCamera } {
  const scene = new Scene();
  const material = new MeshLambertMaterial({ color: 0xffffff, side: DoubleSide });
  if (occlusion !== undefined) {
    material.aoMap = new DataTexture(new Uint8Array([255 * occlusion, 0, 0, 255]), 1, 1);
    material.aoMap.needsUpdate = true;
  }
  const plane = new Mesh(new PlaneGeometry(4, 4), material);
  plane.rotation.x = -Math.PI / 2;
  scene.add(plane);
  return { scene, camera: fromAbove() };
}

/** Sees four metres by four, from five metres above. */
export function fromAbove(): OrthographicCamera {
  const camera = new OrthographicCamera(-2, 2, 2, -2, 0.1, 10);
  camera.position.y = 5;
  camera.up.set(0, 0, -1);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
  return camera;
}

/** A volume four metres across, with the same light everywhere or light of each probe's own. */
export function volumeLight(
  coefficients: readonly number[],
  {
    scale = 1,
    order = 2,
    id = 0,
    center = [0, 0, 0],
    size = [4, 4, 4],
    resolution = [4, 2, 3],
  }: {
    scale?: number;
    order?: number;
    id?: number;
    center?: Vec3;
    size?: Vec3;
    resolution?: Vec3;
  } = {},
): LightState['fields'][number] {
  const field: FieldInfo<'volume'> = {
    id,
    use: 'all',
    kind: 'volume',
    shape: {
      basis: 'sh',
      order,
      grid: { center, rotation: [0, 0, 0, 1], size, resolution },
      offset: { cells: 0.5 },
      cellsMin: [0, 0, 0],
      regions: [],
      layers: 1,
    },
  };
  return {
    kind: 'volume',
    field,
    coefficients: new Float32Array(coefficients),
    scale,
    revision: 1,
    age: 0,
    sceneVersion: 1,
    tick: 1,
    regions: { lit: 1, all: 1 },
  };
}
