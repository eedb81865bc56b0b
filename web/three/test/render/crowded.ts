/** Draws a floor of a material of many maps under several volumes, and counts the texture units bound. */
import { halfBits, type LightmapLight, type Vec3 } from '@lumencast/client';
import {
  BufferAttribute,
  DataTexture,
  DirectionalLight,
  EquirectangularReflectionMapping,
  type Material,
  Mesh,
  MeshPhysicalMaterial,
  PlaneGeometry,
  Scene,
  WebGLRenderer,
} from 'three';
import { unitsTaken } from '../../src/units.js';
import { chartsOf, layout, lightmapField, lightmapLight, region, surface } from '../support/lightmaps.js';
import {
  fromAbove,
  type Kind,
  lit,
  middleRow,
  type Radiance,
  rendererOf,
  session,
  volumeLight,
} from './stage.js';

/** What a floor is made of; three.js binds textures for each. */
export type Part =
  'gltf' | 'specular' | 'clearcoat' | 'glass' | 'shadow' | 'environment' | 'morphs' | 'lumels';

export interface Crowd {
  readonly row: Radiance[];
  readonly grids: number;
  readonly warnings: readonly string[];
  /** Texture units that the renderer bound for its fullest program. */
  readonly bound: number;
  /** What the plugin counts, grids included. */
  readonly counted: number;
  /** Texture units of the device. */
  readonly limit: number;
}

export async function crowded(kind: Kind, parts: readonly Part[], volumes: number): Promise<Crowd> {
  const textures = kind === 'webgpu' ? countBindings() : undefined;
  const renderer = await rendererOf(kind);
  renderer.shadowMap.enabled = true;
  const scene = new Scene();
  const plane = new Mesh(new PlaneGeometry(4, 4), materialOf(parts));
  plane.rotation.x = -Math.PI / 2;
  scene.add(plane);
  if (parts.includes('morphs')) {
    const { geometry } = plane;
    const still = new BufferAttribute(new Float32Array(geometry.getAttribute('position').array.length), 3);
    geometry.morphAttributes.position = [still];
    geometry.morphTargetsRelative = true;
    plane.updateMorphTargets();
  }
  if (parts.includes('shadow')) {
    const sun = new DirectionalLight(0xffffff, 1);
    sun.position.y = 3;
    sun.castShadow = plane.receiveShadow = true;
    scene.add(sun);
  }
  if (parts.includes('environment')) {
    scene.environment = texel(255, 255, 255);
    scene.environment.mapping = EquirectangularReflectionMapping;
  }
  const warnings: string[] = [];
  const fields = Array.from({ length: volumes }, (_, id) => {
    const size: Vec3 = [4 / volumes, 4, 4];
    const center: Vec3 = [-2 + (id + 0.5) * size[0], 0, 0];
    const coefficients = Array.from({ length: 8 * 27 }, (_, i) => (i % 27 < 3 ? 2 : 0));
    return volumeLight(coefficients, { id, center, size, resolution: [2, 2, 2] });
  });
  const all = parts.includes('lumels') ? [...fields, lightmap()] : fields;
  const of = session(
    { fields: all, age: 0 },
    all.map(({ field }) => field),
  );
  const camera = fromAbove();
  const onWarning = (message: string) => void warnings.push(message);
  const light = lit(kind, renderer, of, { scene, onWarning });
  light.setNode(plane, 0);
  light.update(camera);
  const row = await middleRow(renderer, scene, camera);
  const bound = textures?.() ?? fullestProgram(renderer as WebGLRenderer);
  const limit = renderer instanceof WebGLRenderer ? renderer.capabilities.maxTextures : 16;
  const counted = unitsTaken(scene, kind) + light.grids.length + Number(light.pages !== undefined);
  renderer.dispose();
  return { row, grids: light.grids.length, warnings, bound, counted, limit };
}

/** Light at lumels of the floor, as bright as that of the volumes. */
function lightmap(): LightmapLight {
  const charts = {
    ...chartsOf([0, 2, 1, 2, 3, 1]),
    at: new Float32Array([1, 1, 2, 1, 1, 2, 2, 2]),
    sizes: [[3, 3]] as const,
  };
  const texels = Uint16Array.from({ length: 4 * 64 }, () => halfBits(2 * 0.282095 * Math.PI));
  const regions = [region({ picture: { kind: 'halves', scale: 1, texels } })];
  return lightmapLight(regions, layout(surface({ charts })), lightmapField(99));
}

function materialOf(parts: readonly Part[]): Material {
  const material = new MeshPhysicalMaterial({ roughness: 1, metalness: 0 });
  const white = () => texel(255, 255, 255);
  if (parts.includes('gltf')) {
    // Red for occlusion, green for roughness, blue for metalness.
    const rough = texel(255, 255, 0);
    Object.assign(material, { map: white(), normalMap: texel(128, 128, 255), emissiveMap: texel(0, 0, 0) });
    Object.assign(material, { metalnessMap: rough, roughnessMap: rough, aoMap: rough });
  }
  if (parts.includes('specular'))
    Object.assign(material, { specularColorMap: white(), specularIntensityMap: white() });
  if (parts.includes('clearcoat'))
    Object.assign(material, { clearcoat: 1, clearcoatMap: white(), clearcoatRoughnessMap: white() });
  if (parts.includes('glass'))
    Object.assign(material, { transmission: 0.5, transmissionMap: white(), thicknessMap: white() });
  return material;
}

function texel(r: number, g: number, b: number): DataTexture {
  const texture = new DataTexture(new Uint8Array([r, g, b, 255]), 1, 1);
  texture.needsUpdate = true;
  return texture;
}

function fullestProgram(renderer: WebGLRenderer): number {
  const gl = renderer.getContext() as WebGL2RenderingContext;
  const samplers = new Set<number>([
    ...[gl.SAMPLER_2D, gl.SAMPLER_3D, gl.SAMPLER_CUBE, gl.SAMPLER_2D_ARRAY],
    ...[gl.SAMPLER_2D_SHADOW, gl.SAMPLER_CUBE_SHADOW],
  ]);
  const units = (renderer.info.programs ?? []).map(({ program }) => {
    const uniforms = gl.getProgramParameter(program as WebGLProgram, gl.ACTIVE_UNIFORMS) as number;
    return Array.from({ length: uniforms }, (_, i) => gl.getActiveUniform(program as WebGLProgram, i)!)
      .filter(({ type }) => samplers.has(type))
      .reduce((sum, { size }) => sum + size, 0);
  });
  return Math.max(0, ...units);
}

/** Watches which textures pipelines bind for fragments; the function returned says the most, and ends it. */
function countBindings(): () => number {
  const { createBindGroupLayout, createPipelineLayout } = GPUDevice.prototype;
  const FRAGMENT = 2;
  const textures = new Map<GPUBindGroupLayout | null | undefined, number>();
  let most = 0;
  GPUDevice.prototype.createBindGroupLayout = function (description) {
    const layout = createBindGroupLayout.call(this, description);
    const bound = [...description.entries].filter((entry) => entry.texture && entry.visibility & FRAGMENT);
    textures.set(layout, bound.length);
    return layout;
  };
  GPUDevice.prototype.createPipelineLayout = function (description) {
    const layouts = [...description.bindGroupLayouts];
    most = Math.max(
      most,
      layouts.reduce((sum, layout) => sum + (textures.get(layout) ?? 0), 0),
    );
    return createPipelineLayout.call(this, description);
  };
  return () => {
    Object.assign(GPUDevice.prototype, { createBindGroupLayout, createPipelineLayout });
    return most;
  };
}
