/** Draws light that changes under objects that stand still, again and again into one target. */
import type { LightState } from '@lumencast/client';
import { FloatType, WebGLRenderTarget } from 'three';
import { WebGPURenderer } from 'three/webgpu';
import { attach } from '../../src/webgpu.js';
import { floor, session, SIZE, volumeLight } from './stage.js';

export interface Changes {
  readonly backend: 'webgl' | 'webgpu';
  /** Red of the floor's middle, for each radiance. */
  readonly seen: number[];
  /** Textures of the renderer after each picture. */
  readonly textures: number[];
  /** Textures once the light is disposed of. */
  readonly left: number;
}

/** One picture for each mean radiance of a volume; `undefined` is light of which nothing has come yet. */
export async function changing(
  forceWebGL: boolean,
  radiances: readonly (number | undefined)[],
): Promise<Changes> {
  const renderer = new WebGPURenderer({ forceWebGL });
  await renderer.init();
  const { scene, camera } = floor();
  const volumes = radiances.map((radiance = 0, revision) => ({
    ...volumeLight(Array.from({ length: 24 * 27 }, (_, i) => (i % 27 < 3 ? radiance / 0.282095 : 0))),
    revision,
  }));
  let fields: LightState['fields'] = [];
  const standing = session({ fields, age: 0 }, [volumes[0].field]);
  const light = attach(
    { ...standing, light: () => ({ fields, age: 0 }) },
    { scene, renderer, shadows: false },
  );
  const target = new WebGLRenderTarget(SIZE, SIZE, { type: FloatType });
  renderer.setRenderTarget(target as never);
  const seen: number[] = [];
  const textures: number[] = [];
  for (const [i, radiance] of radiances.entries()) {
    if (radiance !== undefined) fields = [volumes[i]];
    light.update(camera);
    renderer.render(scene, camera);
    const middle = await renderer.readRenderTargetPixelsAsync(target as never, SIZE / 2, SIZE / 2, 1, 1);
    seen.push((middle as Float32Array)[0]);
    textures.push(renderer.info.memory.textures);
  }
  light.dispose();
  const left = renderer.info.memory.textures;
  const backend = 'isWebGLBackend' in renderer.backend ? 'webgl' : 'webgpu';
  renderer.dispose();
  return { backend, seen, textures, left };
}
