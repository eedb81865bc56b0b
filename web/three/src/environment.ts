import type { Environment, Vec3 } from '@lumencast/client';
import {
  DataTexture,
  EquirectangularReflectionMapping,
  FloatType,
  LinearFilter,
  LinearSRGBColorSpace,
  RGBAFormat,
  type Scene,
  type Texture,
} from 'three';

/** Rows of the picture that a sky is drawn into: 0.7° each. */
const SKY_ROWS = 256;

/**
 * Shows an environment behind the scene. It lights nothing here: its light on surfaces is part of the
 * streamed field.
 *
 * @param urlOf the address of a file of the scene's folder
 * @throws Error when a picture cannot be read
 */
export async function showEnvironment(
  scene: Scene,
  environment: Environment,
  urlOf: (file: string) => string,
  still: () => boolean,
): Promise<void> {
  const texture = await environmentTexture(environment, urlOf);
  if (!still()) return texture.dispose();
  if (scene.background !== null && 'dispose' in scene.background) scene.background.dispose();
  scene.background = texture;
  scene.backgroundIntensity = environment.type === 'image' ? (environment.intensity ?? 1) : 1;
  // A picture's middle is −Z here and +X in three.js: a quarter turn.
  scene.backgroundRotation.y = environment.type === 'image' ? (environment.rotation ?? 0) + Math.PI / 2 : 0;
}

async function environmentTexture(
  environment: Environment,
  urlOf: (file: string) => string,
): Promise<Texture> {
  switch (environment.type) {
    case 'constant':
      return skyTexture(() => environment.radiance);
    case 'sky':
      return skyTexture((up) => skyRadiance(environment, up));
    case 'image':
      return imageTexture(environment.uri, urlOf);
  }
}

/** Radiance of a sky at the sine of an elevation. */
export function skyRadiance({ zenith, horizon, ground }: Environment & { type: 'sky' }, up: number): Vec3 {
  const end = up > 0 ? zenith : ground;
  return horizon.map((h, channel) => h + (end[channel] - h) * Math.abs(up)) as Vec3;
}

function skyTexture(radiance: (up: number) => Vec3): Texture {
  const columns = 4;
  const texels = new Float32Array(SKY_ROWS * columns * 4);
  for (let row = 0; row < SKY_ROWS; row++) {
    // The first row of a data texture is the bottom, straight down.
    const [r, g, b] = radiance(-Math.cos(((row + 0.5) / SKY_ROWS) * Math.PI));
    for (let column = 0; column < columns; column++) texels.set([r, g, b, 1], (row * columns + column) * 4);
  }
  const texture = new DataTexture(texels, columns, SKY_ROWS, RGBAFormat, FloatType);
  texture.minFilter = texture.magFilter = LinearFilter;
  return equirectangular(texture);
}

async function imageTexture(uri: string, urlOf: (file: string) => string): Promise<Texture> {
  const exr = uri.toLowerCase().endsWith('.exr');
  const Loader = exr
    ? (await import('three/addons/loaders/EXRLoader.js')).EXRLoader
    : (await import('three/addons/loaders/HDRLoader.js')).HDRLoader;
  return equirectangular(await new Loader().loadAsync(urlOf(uri)));
}

function equirectangular<T extends Texture>(texture: T): T {
  texture.mapping = EquirectangularReflectionMapping;
  texture.colorSpace = LinearSRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}
