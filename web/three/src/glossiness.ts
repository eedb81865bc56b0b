import {
  Color,
  LinearSRGBColorSpace,
  MeshPhysicalMaterial,
  type MeshPhysicalMaterialParameters,
  NoColorSpace,
  Source,
  SRGBColorSpace,
  type Texture,
} from 'three';
import type { GLTFLoaderPlugin, GLTFParser } from 'three/addons/loaders/GLTFLoader.js';
import { INFINITE_IOR } from './materials.js';

interface TextureInfo {
  readonly index: number;
}

/** The extension's part of a material, as glTF has it. */
interface Glossiness {
  readonly diffuseFactor?: readonly [number, number, number, number];
  readonly diffuseTexture?: TextureInfo;
  readonly specularFactor?: readonly [number, number, number];
  readonly glossinessFactor?: number;
  readonly specularGlossinessTexture?: TextureInfo;
}

const NAME = 'KHR_materials_pbrSpecularGlossiness';

interface Materials {
  readonly materials?: readonly { readonly extensions?: { readonly [NAME]?: Glossiness } }[];
}

/**
 * Reads KHR_materials_pbrSpecularGlossiness, which GLTFLoader does not, as the server does: a dielectric
 * whose reflection at normal incidence is a colour, and a roughness of one less glossiness.
 */
export class SpecularGlossiness implements GLTFLoaderPlugin {
  readonly name = NAME;

  constructor(private readonly parser: GLTFParser) {}

  getMaterialType(index: number): typeof MeshPhysicalMaterial | null {
    return this.#of(index) ? MeshPhysicalMaterial : null;
  }

  async extendMaterialParams(index: number, params: MeshPhysicalMaterialParameters): Promise<void> {
    const gloss = this.#of(index);
    if (!gloss) return;
    const { diffuseFactor = [1, 1, 1, 1], specularFactor = [1, 1, 1], glossinessFactor = 1 } = gloss;
    const [r, g, b, opacity] = diffuseFactor;
    params.color = new Color().setRGB(r, g, b, LinearSRGBColorSpace);
    params.opacity = opacity;
    params.metalness = 0;
    params.roughness = 1 - glossinessFactor;
    params.ior = INFINITE_IOR;
    params.specularIntensity = 1;
    params.specularColor = new Color().setRGB(...specularFactor, LinearSRGBColorSpace);
    for (const map of ['map', 'metalnessMap', 'roughnessMap'] as const) delete params[map];
    await Promise.all([
      this.#assign(params, 'map', gloss.diffuseTexture),
      this.#assign(params, 'specularColorMap', gloss.specularGlossinessTexture),
    ]);
    const rough = params.specularColorMap && roughness(params.specularColorMap, glossinessFactor);
    if (rough) Object.assign(params, { roughness: 1, roughnessMap: rough });
  }

  #of(index: number): Glossiness | undefined {
    return (this.parser.json as Materials).materials?.[index]?.extensions?.[NAME];
  }

  async #assign(
    params: MeshPhysicalMaterialParameters,
    map: 'map' | 'specularColorMap',
    info: TextureInfo | undefined,
  ): Promise<void> {
    if (info) await this.parser.assignTexture(params, map, info, SRGBColorSpace);
  }
}

/** Roughness as green, where glossiness, a texture's alpha, varies. */
function roughness(specular: Texture, factor: number): Texture | undefined {
  const image = specular.image as (CanvasImageSource & { width: number; height: number }) | undefined;
  if (!image || typeof document === 'undefined') return undefined;
  const canvas = document.createElement('canvas');
  canvas.width = image.width;
  canvas.height = image.height;
  const context = canvas.getContext('2d', { willReadFrequently: true })!;
  context.drawImage(image, 0, 0);
  const pixels = context.getImageData(0, 0, image.width, image.height);
  if (!roughen(pixels.data, factor)) return undefined;
  context.putImageData(pixels, 0, 0);
  const texture = specular.clone();
  // Not its image: the two share their source.
  texture.source = new Source(canvas);
  texture.colorSpace = NoColorSpace;
  texture.needsUpdate = true;
  return texture;
}

/** Makes roughness of glossiness, red, green, blue and alpha a texel; `false` where it varies nowhere. */
export function roughen(texels: Uint8ClampedArray, factor: number): boolean {
  let varies = false;
  for (let at = 0; at < texels.length; at += 4) {
    varies ||= texels[at + 3] < 255;
    texels[at + 1] = 255 - factor * texels[at + 3];
    texels[at] = texels[at + 2] = 0;
    texels[at + 3] = 255;
  }
  return varies;
}
