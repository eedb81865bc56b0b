import { describe, expect, it } from 'vitest';
import {
  BufferAttribute,
  type Material,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshPhongMaterial,
  MeshStandardMaterial,
  MeshToonMaterial,
  PlaneGeometry,
  ShaderChunk,
  ShaderLib,
} from 'three';
import { LUMELS } from '../src/charted.js';
import { distanceAttenuation, FALLOFF_GLSL, spotAttenuation } from '../src/falloff.js';
import { patchedLights, patchedShadowCoordinates, patchMaterials, unpatchMaterials } from '../src/patch.js';

describe('spotAttenuation', () => {
  const [inner, outer] = [0.3, 0.7];

  it('is 1 inside the inner cone and 0 outside the outer one', () => {
    expect(spotAttenuation(inner, outer, 0)).toBe(1);
    expect(spotAttenuation(inner, outer, inner)).toBeCloseTo(1);
    expect(spotAttenuation(inner, outer, outer)).toBeCloseTo(0);
    expect(spotAttenuation(inner, outer, 1.2)).toBe(0);
  });

  it('is the recommended lightAngleScale and lightAngleOffset between', () => {
    const scale = 1 / Math.max(0.001, Math.cos(inner) - Math.cos(outer));
    const offset = -Math.cos(outer) * scale;
    for (const angle of [0.35, 0.5, 0.65]) {
      const recommended = Math.min(Math.max(Math.cos(angle) * scale + offset, 0), 1) ** 2;
      expect(spotAttenuation(inner, outer, angle)).toBeCloseTo(recommended, 12);
    }
  });

  it('has no division by zero for a cone without a soft edge', () => {
    expect(spotAttenuation(0.5, 0.5, 0.4)).toBe(1);
    expect(spotAttenuation(0.5, 0.5, 0.6)).toBe(0);
  });
});

describe('distanceAttenuation', () => {
  it('is the inverse square without a range, also near the light', () => {
    for (const d of [0.01, 0.05, 1, 30]) expect(distanceAttenuation(d, 0)).toBeCloseTo(1 / d ** 2, 6);
  });

  it('is windowed once, not squared as in three.js', () => {
    expect(distanceAttenuation(2, 4)).toBeCloseTo((1 - 0.5 ** 4) / 4, 12);
    expect(distanceAttenuation(4, 4)).toBe(0);
    expect(distanceAttenuation(9, 4)).toBe(0);
  });
});

/** Runs GLSL made of one assignment and one return as JavaScript: enough for the falloff functions. */
function fromGlsl(source: string): (...parameters: number[]) => number {
  const [, list, body] = /\(([^)]*)\)\s*\{([^]*)\}/.exec(source)!;
  const names = list.split(',').map((parameter) => parameter.trim().split(' ').at(-1)!);
  const code = body.replaceAll(/\bfloat (\w+) =/g, 'const $1 =');
  const saturate = (x: number) => Math.min(Math.max(x, 0), 1);
  const pow4 = (x: number) => x ** 4;
  const make = new Function('max', 'pow', 'saturate', 'pow4', `return (${names.join()}) => {${code}}`);
  return make(Math.max, Math.pow, saturate, pow4) as (...parameters: number[]) => number;
}

describe('the shader twins', () => {
  it('agree with the functions', () => {
    const spot = fromGlsl(FALLOFF_GLSL.getSpotAttenuation);
    const distance = fromGlsl(FALLOFF_GLSL.getDistanceAttenuation);
    for (const angle of [0, 0.2, 0.4, 0.6, 0.8]) {
      expect(spot(Math.cos(0.7), Math.cos(0.3), Math.cos(angle))).toBeCloseTo(
        spotAttenuation(0.3, 0.7, angle),
        12,
      );
    }
    for (const d of [0, 0.05, 1, 3, 10]) {
      for (const range of [0, 5]) expect(distance(d, range, 2)).toBeCloseTo(distanceAttenuation(d, range), 6);
    }
  });

  it('stand in the place of three.js own', () => {
    const chunk = patchedLights();
    for (const body of Object.values(FALLOFF_GLSL)) expect(chunk).toContain(body.trim());
    for (const name of ['getSpotAttenuation', 'getDistanceAttenuation']) {
      expect(chunk.split(`float ${name}(`)).toHaveLength(2);
    }
    expect(chunk).not.toContain('smoothstep( coneCosine');
    expect(chunk).toContain('exp2( s6.w )');
    expect(patchedShadowCoordinates().split('faceforward(')).toHaveLength(4);
  });
});

describe('patchMaterials', () => {
  const compile = (material: Material, { vertexShader, fragmentShader } = SHORT) => {
    const shader = { uniforms: {}, vertexShader, fragmentShader } as Parameters<
      typeof material.onBeforeCompile
    >[0];
    material.onBeforeCompile(shader, undefined!);
    return shader;
  };

  it('changes lit materials only, once, and gives them back', () => {
    const material = new MeshStandardMaterial();
    const calls: string[] = [];
    material.onBeforeCompile = () => void calls.push('own');
    const own = material.onBeforeCompile;
    const basic = new MeshBasicMaterial();
    const mesh = new Mesh(undefined, material);
    mesh.add(new Mesh(undefined, basic));
    const before = ShaderChunk.lights_pars_begin;

    patchMaterials(mesh);
    patchMaterials(mesh);
    expect(compile(material).fragmentShader).toBe(patchedLights());
    expect(calls).toEqual(['own']);
    expect(material.customProgramCacheKey()).not.toBe(new MeshStandardMaterial().customProgramCacheKey());
    expect(basic.onBeforeCompile).toBe(MeshBasicMaterial.prototype.onBeforeCompile);
    expect(ShaderChunk.lights_pars_begin).toBe(before);

    unpatchMaterials(mesh);
    expect(material.onBeforeCompile).toBe(own);
  });

  const LIT = [
    ['lambert', new MeshLambertMaterial()],
    ['phong', new MeshPhongMaterial()],
    ['toon', new MeshToonMaterial()],
    ['physical', new MeshStandardMaterial()],
  ] as const;
  const withLumels = (material: Material) => {
    const geometry = new PlaneGeometry();
    return new Mesh(geometry.setAttribute(LUMELS, new BufferAttribute(new Float32Array(8), 2)), material);
  };

  it.each(LIT)('lets %s materials of meshes with lumels read these', (kind, material) => {
    const shader = compile(patched(withLumels(material)), ShaderLib[kind]);
    const [vertex, fragment] = [shader.vertexShader, shader.fragmentShader];
    // Once declared, before it is used.
    for (const text of ['vec4 lumels;', 'float lumelShare;', 'vec4 vLumels;', 'float vLumelShare;']) {
      expect(vertex.split(text)).toHaveLength(2);
    }
    expect(vertex.indexOf('vLumels.xy =')).toBeGreaterThan(vertex.indexOf('void main()'));
    expect(fragment.indexOf('vec3 lumelIrradiance()')).toBeLessThan(fragment.indexOf('void main()'));
    expect(fragment).toContain('if ( ! isLumelsAlone() && isInsideLightProbeGrid(');
    const lit = 'irradiance += gridsOrLumels( gridIrradiance, nonPerturbedNormal, normal );';
    const added = fragment.indexOf(lit);
    expect(added).toBeGreaterThan(fragment.indexOf('vec3 irradiance = getAmbientLightIrradiance'));
    expect(added).toBeGreaterThan(fragment.indexOf('#include <normal_fragment_maps>'));
    expect(fragment).toContain('#include <normal_fragment_maps>');
    expect(added).toBeGreaterThan(fragment.indexOf('gridIrradiance += getLightProbeGridIrradiance('));
    // Where a scene has no grids, too.
    expect(fragment).toContain(`#if defined( RE_IndirectDiffuse )\n\t${lit}\n#endif`);
    const declared = fragment.indexOf('vec3 gridIrradiance = vec3( 0.0 );');
    expect(fragment.indexOf('#if NUM_LIGHT_PROBE_GRIDS > 0', declared)).toBeLessThan(added);
    expect(fragment.indexOf('vec3 probeWorldPos')).toBeGreaterThan(declared);
    expect(fragment).toContain('exp2( s6.w ) * gridFactor()');
  });

  it('takes a material anew when a mesh with lumels shows it, and another program', () => {
    const material = new MeshStandardMaterial();
    const plain = new Mesh(new PlaneGeometry(), material);
    patched(plain);
    const key = material.customProgramCacheKey();
    const { version } = material;
    expect(compile(material, ShaderLib.physical).fragmentShader).not.toContain('vLumels');
    patched(plain);
    expect(material.version).toBe(version);
    patched(withLumels(material));
    expect(material.version).toBeGreaterThan(version);
    expect(material.customProgramCacheKey()).not.toBe(key);
    expect(compile(material, ShaderLib.physical).fragmentShader).toContain('vLumels');
    unpatchMaterials(plain);
    patched(plain);
    expect(material.customProgramCacheKey()).toBe(key);
  });

  function patched(mesh: Mesh): Material {
    patchMaterials(mesh);
    return mesh.material as Material;
  }
});

/** The chunks that are replaced in every material. */
const SHORT = {
  vertexShader: '#include <shadowmap_vertex>',
  fragmentShader: '#include <lights_pars_begin>',
};
