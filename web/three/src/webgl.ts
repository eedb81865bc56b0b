import type { WebGLRenderer } from 'three';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { patchMaterials, uniforms, unpatchMaterials } from './patch.js';
import type { Platform } from './platform.js';
import { unitsTaken } from './units.js';
import { webglPages } from './webgl-pages.js';

export function webglPlatform(renderer: WebGLRenderer): Platform {
  const gl = renderer.getContext() as WebGL2RenderingContext;
  return {
    createGrid: (size, resolution) => new LightProbeGridWebGL(...size, ...resolution),
    scaleIn: 'atlas',
    factors: uniforms,
    pages: uniforms.pages,
    freeUnits: (scene) => renderer.capabilities.maxTextures - unitsTaken(scene, 'webgl'),
    max3DTextureSize: gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number,
    maxTextureSize: renderer.capabilities.maxTextureSize,
    createPages: (width, height) => webglPages(renderer, width, height),
    patch: patchMaterials,
    unpatch: unpatchMaterials,
  };
}
