import type { WebGLRenderer } from 'three';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { patchMaterials, unpatchMaterials } from './patch.js';
import type { Platform } from './platform.js';

/**
 * Texture units that a lit material of a glTF file may take: base colour, normal, metallic-roughness,
 * emission, occlusion, three.js' own table for rough reflections, and one spare.
 */
const MATERIAL_UNITS = 7;

export function webglPlatform(renderer: WebGLRenderer): Platform {
  const gl = renderer.getContext() as WebGL2RenderingContext;
  return {
    createGrid: (size, resolution) => new LightProbeGridWebGL(...size, ...resolution),
    scaleIn: 'atlas',
    freeGrids: (shadowLights) => renderer.capabilities.maxTextures - MATERIAL_UNITS - shadowLights,
    max3DTextureSize: gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number,
    patch: patchMaterials,
    unpatch: unpatchMaterials,
  };
}
