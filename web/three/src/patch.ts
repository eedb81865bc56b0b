import { type Material, type Mesh, type Object3D, REVISION, ShaderChunk } from 'three';
import { FALLOFF_GLSL } from './falloff.js';

/**
 * Changes of WebGLRenderer's shaders, made material by material through `onBeforeCompile`, so that
 * other scenes and renderers of the page keep three.js' own:
 *
 * - falloff of spot and point lights as in glTF ({@link FALLOFF_GLSL});
 * - shadow lookups offset towards the light also where it falls on a surface's back, else the lit
 *   back of a curtain shadows itself;
 * - irradiance of probe grids times 2^w, w the fourth channel of the atlas' last sub-volume, which is
 *   free: 0 in grids that three.js bakes, the logarithm of the field's scale in ours; and times
 *   {@link gridExposure}.
 */
export function patchedLights(): string {
  const lights = Object.entries(FALLOFF_GLSL).reduce(
    (chunk, [name, body]) => replaceFunction(chunk, 'float', name, body),
    ShaderChunk.lights_pars_begin,
  );
  const scaled = replaceText(
    ShaderChunk.lightprobes_pars_fragment,
    'return max( result, vec3( 0.0 ) );',
    'return max( result, vec3( 0.0 ) ) * ( exp2( s6.w ) * lumencastExposure );',
  );
  const samplers = 'uniform highp sampler3D probesSH[';
  const probes = replaceText(scaled, samplers, `uniform float lumencastExposure;\n${samplers}`);
  return replaceText(lights, '#include <lightprobes_pars_fragment>', probes);
}

export function patchedShadowCoordinates(): string {
  // Row 2 of an orthographic shadow matrix points along the light; a point light's matrix gives the
  // vector from the light; a spot light's row 3 is the depth along its axis.
  const towardsLight: [light: string, along: string][] = [
    ['directionalLightShadows', rowOf('directionalShadowMatrix', 2)],
    ['pointLightShadows', '( pointShadowMatrix[ i ] * worldPosition ).xyz'],
    ['spotLightShadows', rowOf('spotLightMatrix', 3)],
  ];
  return towardsLight.reduce(
    (chunk, [shadows, along]) =>
      replaceText(
        chunk,
        `shadowWorldNormal * ${shadows}[ i ].shadowNormalBias`,
        `faceforward( shadowWorldNormal, ${along}, shadowWorldNormal ) * ${shadows}[ i ].shadowNormalBias`,
      ),
    ShaderChunk.shadowmap_vertex,
  );
}

/** Replaces a function's definition; its body must not hold a `}` at the start of a line. */
function replaceFunction(source: string, type: string, name: string, definition: string): string {
  const found = new RegExp(`${type} ${name}\\([^{]*\\{[^]*?\\n\\}`).exec(source)?.[0];
  return replaceText(source, found, definition.trim());
}

/** @throws Error when three.js' shaders are not those that this module knows. */
function replaceText(source: string, from: string | undefined, to: string): string {
  if (from === undefined || !source.includes(from)) {
    throw new Error(
      `three.js r${REVISION} has other shaders than r187: ${from ?? to.split('\n')[0]} is not in them`,
    );
  }
  return source.replace(from, () => to);
}

/** A matrix row as GLSL: element [column][row]. */
function rowOf(matrices: string, row: number): string {
  return `vec3( ${[0, 1, 2].map((column) => `${matrices}[ i ][ ${column} ][ ${row} ]`).join(', ')} )`;
}

/** The uniform that multiplies light of probe grids; other than 1 only while a scene is drawn. */
export const gridExposure = { value: 1 };

let chunks: { lights: string; shadows: string } | undefined;
const originals = new WeakMap<Material, Pick<Material, 'onBeforeCompile' | 'customProgramCacheKey'>>();

/** Patches the materials of an object and of all below it; those that are patched already stay. */
export function patchMaterials(root: Object3D): void {
  root.traverse((object) => materialsOf(object).forEach(patchMaterial));
}

/** The materials of an object: none unless it is drawn. */
export function materialsOf(object: Object3D): readonly Material[] {
  const { material } = object as Partial<Mesh>;
  return Array.isArray(material) ? material : material ? [material] : [];
}

function patchMaterial(material: Material): void {
  if (originals.has(material) || !isLit(material)) return;
  const { lights, shadows } = (chunks ??= { lights: patchedLights(), shadows: patchedShadowCoordinates() });
  const { onBeforeCompile, customProgramCacheKey } = material;
  originals.set(material, { onBeforeCompile, customProgramCacheKey });
  const key = customProgramCacheKey.call(material);
  material.onBeforeCompile = (shader, renderer) => {
    onBeforeCompile.call(material, shader, renderer);
    shader.uniforms.lumencastExposure = gridExposure;
    shader.fragmentShader = shader.fragmentShader.replace('#include <lights_pars_begin>', () => lights);
    shader.vertexShader = shader.vertexShader.replace('#include <shadowmap_vertex>', () => shadows);
  };
  material.customProgramCacheKey = () => `${key}|lumencast`;
  material.needsUpdate = true;
}

/** The materials that WebGLRenderer lights. */
function isLit(material: Material): boolean {
  return ['Lambert', 'Toon', 'Phong', 'Standard'].some((kind) => `isMesh${kind}Material` in material);
}

/** Gives the materials of an object and of all below it back as they were. */
export function unpatchMaterials(root: Object3D): void {
  root.traverse((object) => {
    for (const material of materialsOf(object)) {
      const original = originals.get(material);
      if (original === undefined) continue;
      Object.assign(material, original);
      originals.delete(material);
      material.needsUpdate = true;
    }
  });
}
