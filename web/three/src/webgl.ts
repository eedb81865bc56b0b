import type { WebGLRenderer } from 'three';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { gridExposure, patchMaterials, unpatchMaterials } from './patch.js';
import type { Platform } from './platform.js';
import { unitsTaken } from './units.js';

export function webglPlatform(renderer: WebGLRenderer): Platform {
  const gl = renderer.getContext() as WebGL2RenderingContext;
  return {
    createGrid: (size, resolution) => new LightProbeGridWebGL(...size, ...resolution),
    scaleIn: 'atlas',
    gridExposure,
    freeGrids: (scene) => renderer.capabilities.maxTextures - unitsTaken(scene, 'webgl'),
    max3DTextureSize: gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number,
    patch: patchMaterials,
    unpatch: unpatchMaterials,
  };
}
