import { type Camera, FloatType, type Object3D, type Scene, WebGLRenderTarget } from 'three';
import type { AnyRenderer } from './renderer.js';

/** Exposures that the page offers, in stops: 0 is 1 / (cd/m²). A white ground at noon asks for −17. */
export const STOPS = { min: -20, max: 14 } as const;

const WIDTH = 96;
const HEIGHT = 54;

/** Measures how bright the picture is and says which exposure suits it; see {@link exposureFor}. */
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

/** What the middle of a picture's luminances becomes, unless too much burns out. */
export const MIDDLE_GREY = 0.2;
/** Luminance times exposure from which on tone mappings give up contrast and colour. */
const SHOULDER = 0.5;
/** Stops up the shoulder past which it makes no difference: a lamp in the picture is to be white. */
const LOST = 4;
/** So far may a picture be up the shoulder, in stops, on average of all its points. */
export const MOST_BURNT = 0.18;
/** Stops that exposure goes down for the sake of bright parts: a room with a window is not to be black. */
const MOST_STOPS_DOWN = 2;

/**
 * Exposure for these luminances; `undefined` when (nearly) all is black. The logarithmic average of the
 * middle 85 % comes to middle grey, or so far below it that no more than {@link MOST_BURNT} burns out.
 */
export function exposureFor(all: readonly number[]): number | undefined {
  const lit = all.filter((value) => value > 1e-6).sort((a, b) => a - b);
  if (lit.length < all.length * 0.02) return undefined;
  const middle = lit.slice(Math.floor(lit.length * 0.1), Math.ceil(lit.length * 0.95));
  const average = middle.reduce((sum, value) => sum + Math.log2(value), 0) / middle.length;
  const key = Math.log2(MIDDLE_GREY) - average;
  if (burnt(lit, 2 ** key) <= MOST_BURNT) return 2 ** key;
  let [dark, bright] = [key - MOST_STOPS_DOWN, key];
  while (bright - dark > 0.01) {
    const stops = (dark + bright) / 2;
    if (burnt(lit, 2 ** stops) > MOST_BURNT) bright = stops;
    else dark = stops;
  }
  return 2 ** dark;
}

/** How far luminances are up the shoulder, in stops, on average; few that are far up count like many that are not. */
export function burnt(luminances: readonly number[], exposure: number): number {
  const stops = (value: number) => Math.log2((value * exposure) / SHOULDER);
  const sum = luminances.reduce((sum, value) => sum + Math.min(Math.max(stops(value), 0), LOST), 0);
  return sum / luminances.length;
}
