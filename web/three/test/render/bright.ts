/** Draws what is brighter than a half float can hold, on the canvas, with the plugin's pre-exposure and without. */
import {
  DataTexture,
  DirectionalLight,
  EquirectangularReflectionMapping,
  FloatType,
  LinearSRGBColorSpace,
  LinearToneMapping,
  Mesh,
  MeshBasicMaterial,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  RGBAFormat,
  Scene,
  WebGLRenderer,
} from 'three';
import type { WebGPURenderer } from 'three/webgpu';
import { type Kind, lit, rendererOf, session, SIZE, volumeLight } from './stage.js';

/** Where the light comes from. */
export type Source = 'sun' | 'volume' | 'emission' | 'unlit' | 'background' | 'light map';

type Pixel = [r: number, g: number, b: number];

/** Radiance that is to be seen: twice what a half float can hold. */
const RADIANCE = 2 ** 17;
const EXPOSURE = 2 ** -18;

/** The middle of the picture: of light made so dim beforehand, of bright light pre-exposed, and of bright light as it is. */
export async function bright(
  kind: Kind,
  source: Source,
  throughGlass: boolean,
): Promise<Record<'dim' | 'preExposed' | 'plain', Pixel>> {
  const renderer = await rendererOf(kind);
  renderer.setSize(SIZE, SIZE, false);
  renderer.toneMapping = LinearToneMapping;
  const draw = (radiance: number, preExposure: number, exposure: number) =>
    middle(kind, renderer, source, throughGlass, radiance, preExposure, exposure);
  const pixels = {
    dim: await draw(RADIANCE * EXPOSURE, 1, 1),
    preExposed: await draw(RADIANCE, EXPOSURE, 1),
    plain: await draw(RADIANCE, 1, EXPOSURE),
  };
  renderer.dispose();
  if (renderer instanceof WebGLRenderer) renderer.forceContextLoss();
  return pixels;
}

async function middle(
  kind: Kind,
  renderer: WebGLRenderer | WebGPURenderer,
  source: Source,
  throughGlass: boolean,
  radiance: number,
  preExposure: number,
  exposure: number,
): Promise<Pixel> {
  const scene = new Scene();
  const coefficients = Array.from({ length: 24 * 27 }, (_, i) =>
    source === 'volume' && i % 27 < 3 ? radiance / 0.282095 : 0,
  );
  const volume = volumeLight(coefficients, { scale: 2 ** Math.ceil(Math.log2(radiance)) });
  addSource(scene, source, radiance);
  if (throughGlass) {
    const pane = new Mesh(
      new PlaneGeometry(4, 4),
      new MeshPhysicalMaterial({ roughness: 0, transmission: 1 }),
    );
    pane.position.z = 1;
    scene.add(pane);
  }
  const camera = new PerspectiveCamera(20, 1, 0.1, 20);
  camera.position.z = 4;
  camera.updateMatrixWorld();
  const light = lit(kind, renderer, session({ fields: [volume], age: 0 }, [volume.field]), { scene });
  light.preExposure = preExposure;
  renderer.toneMappingExposure = exposure;
  light.update(camera);
  renderer.render(scene, camera);
  const copy = document.createElement('canvas');
  copy.width = copy.height = SIZE;
  const context = copy.getContext('2d')!;
  // At once: a canvas holds its picture only until the browser has shown it.
  context.drawImage(renderer.domElement, 0, 0);
  const { data } = context.getImageData(SIZE / 2, SIZE / 2, 1, 1);
  light.dispose();
  return [data[0], data[1], data[2]];
}

/** A wall that sends a radiance towards the camera, or a background that does. */
function addSource(scene: Scene, source: Source, radiance: number): void {
  const wall = new Mesh(new PlaneGeometry(4, 4), new MeshStandardMaterial({ roughness: 1 }));
  const { material } = wall;
  if (source !== 'background') scene.add(wall);
  switch (source) {
    case 'sun': {
      // From aside, so that the pane does not mirror it.
      const sun = new DirectionalLight(0xffffff, radiance * Math.PI * Math.SQRT2);
      sun.position.set(1, 0, 1);
      scene.add(sun);
      break;
    }
    case 'emission':
      material.emissive.setScalar(2);
      material.emissiveIntensity = radiance / 2;
      break;
    case 'unlit':
      (wall as Mesh).material = new MeshBasicMaterial();
      (wall as unknown as Mesh<never, MeshBasicMaterial>).material.color.setScalar(radiance);
      break;
    case 'background':
      scene.background = surroundings();
      scene.backgroundIntensity = radiance;
      break;
    case 'light map':
      material.lightMap = surroundings();
      material.lightMapIntensity = radiance * Math.PI;
      break;
    case 'volume':
  }
}

/** White all around. */
function surroundings(): DataTexture {
  const texels = new Float32Array(8 * 4 * 4).fill(1);
  const texture = new DataTexture(texels, 8, 4, RGBAFormat, FloatType);
  texture.mapping = EquirectangularReflectionMapping;
  texture.colorSpace = LinearSRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}
