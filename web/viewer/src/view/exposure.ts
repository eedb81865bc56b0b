import { type Camera, FloatType, type Object3D, type Scene, WebGLRenderTarget } from 'three';
import type { AnyRenderer } from './renderer.js';

/** Exposures that the page offers, in stops: 0 is 1 / (cd/m²). A white ground at noon asks for −17. */
export const STOPS = { min: -20, max: 14 } as const;

const WIDTH = 96;
const HEIGHT = 54;

/**
 * Measures how bright the picture is and says which exposure suits it: the middle of the picture's
 * luminances comes to middle grey, unless that would burn out more than a few per cent of it.
 */
export async function meter(
  renderer: AnyRenderer,
  scene: Scene,
  camera: Camera,
  hidden: Object3D,
  /** What the scene's radiance is multiplied by as it is drawn. */
  preExposure: number,
): Promise<number | undefined> {
  const target = new WebGLRenderTarget(WIDTH, HEIGHT, { type: FloatType });
  const visible = hidden.visible;
  try {
    hidden.visible = false;
    const before = renderer.getRenderTarget();
    // Both renderers take this kind of target; only their types know two.
    renderer.setRenderTarget(target as never);
    renderer.render(scene, camera);
    renderer.setRenderTarget(before as never);
    hidden.visible = visible;
    const seen = luminances(await read(renderer, target));
    return exposureFor(seen.map((value) => value / preExposure));
  } finally {
    hidden.visible = visible;
    target.dispose();
  }
}

async function read(renderer: AnyRenderer, target: WebGLRenderTarget): Promise<Float32Array> {
  if ('isWebGPURenderer' in renderer) {
    return (await renderer.readRenderTargetPixelsAsync(target as never, 0, 0, WIDTH, HEIGHT)) as Float32Array;
  }
  const pixels = new Float32Array(WIDTH * HEIGHT * 4);
  await renderer.readRenderTargetPixelsAsync(target, 0, 0, WIDTH, HEIGHT, pixels);
  return pixels;
}

function luminances(pixels: Float32Array): number[] {
  const all: number[] = [];
  for (let i = 0; i + 3 < pixels.length; i += 4) {
    const value = 0.2126 * pixels[i] + 0.7152 * pixels[i + 1] + 0.0722 * pixels[i + 2];
    if (Number.isFinite(value)) all.push(value);
  }
  return all;
}

/** The nearest exposure that the page offers. */
export function withinStops(exposure: number): number {
  return Math.min(Math.max(exposure, 2 ** STOPS.min), 2 ** STOPS.max);
}

/** Exposure for these luminances; `undefined` when (nearly) all is black. */
export function exposureFor(all: readonly number[]): number | undefined {
  const lit = all.filter((value) => value > 1e-6).sort((a, b) => a - b);
  if (lit.length < all.length * 0.02) return undefined;
  const at = (share: number) => lit[Math.floor(share * (lit.length - 1))];
  const middle = lit.slice(Math.floor(lit.length * 0.1), Math.ceil(lit.length * 0.95));
  const average = Math.exp(middle.reduce((sum, value) => sum + Math.log(value), 0) / middle.length);
  return Math.min(0.2 / average, 3 / at(0.97));
}
