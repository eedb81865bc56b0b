import { type Material, type Mesh, type Object3D, REVISION, ShaderChunk, type Texture } from 'three';
import { LUMELS } from './charted.js';
import { FALLOFF_GLSL } from './falloff.js';
import { LUMELS_OF_FRAGMENT, LUMELS_OF_VERTEX, LUMELS_OF_VERTEX_MAIN } from './lumels-glsl.js';

/**
 * Changes of WebGLRenderer's shaders, made material by material through `onBeforeCompile`, so that
 * other scenes and renderers of the page keep three.js' own:
 *
 * - falloff of spot and point lights as in glTF ({@link FALLOFF_GLSL});
 * - shadow lookups offset towards the light also where it falls on a surface's back, else the lit
 *   back of a curtain shadows itself;
 * - irradiance of probe grids times 2^w, w the fourth channel of the atlas' last sub-volume, which is
 *   free: 0 in grids that three.js bakes, the logarithm of the field's scale in ours; and times a
 *   factor of {@link uniforms};
 * - in materials of meshes that have lumels, irradiance of these in place of the grids', or a share of it
 *   ({@link LUMELS} and its neighbours say what attributes mean).
 */
export function patchedLights(withLumels = false): string {
  const lights = Object.entries(FALLOFF_GLSL).reduce(
    (chunk, [name, body]) => replaceFunction(chunk, 'float', name, body),
    ShaderChunk.lights_pars_begin,
  );
  const scaled = replaceText(
    ShaderChunk.lightprobes_pars_fragment,
    'return max( result, vec3( 0.0 ) );',
    `return max( result, vec3( 0.0 ) ) * ( exp2( s6.w ) * ${withLumels ? 'gridFactor()' : 'lumencastMoving'} );`,
  );
  const probes = replaceText(lights, '#include <lightprobes_pars_fragment>', scaled);
  return (withLumels ? LUMELS_OF_FRAGMENT : 'uniform float lumencastMoving;') + probes;
}

/** The chunk that sums up irradiance, with that of lumels. */
export function patchedIrradiance(): string {
  const probes = replaceText(
    ShaderChunk.lights_fragment_begin,
    'if ( isInsideLightProbeGrid(',
    'if ( ! isLumelsAlone() && isInsideLightProbeGrid(',
  );
  const sum = 'irradiance += getLightProbeGridIrradiance(';
  const summed = replaceText(probes, sum, sum.replace('irradiance', 'gridIrradiance'));
  const begin = '#if NUM_LIGHT_PROBE_GRIDS > 0';
  const begun = replaceText(summed, begin, `vec3 gridIrradiance = vec3( 0.0 );\n\n\t${begin}`);
  const end = '#if defined( RE_IndirectSpecular )';
  const lit = 'irradiance += gridsOrLumels( gridIrradiance, nonPerturbedNormal, normal );';
  return replaceText(begun, end, `#if defined( RE_IndirectDiffuse )\n\t${lit}\n#endif\n\n${end}`);
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

/** Uniforms of patched materials; other than neutral only while a scene is drawn. */
export const uniforms = {
  lumels: { value: 1 },
  slopes: { value: 0 },
  still: { value: 1 },
  moving: { value: 1 },
  pages: { value: null as Texture | null },
};

/** By what each chunk of three.js' shaders is replaced. */
type Replacements = Readonly<Record<string, string>>;
interface Patch {
  readonly vertex: Replacements;
  readonly fragment: Replacements;
}
let patches: { readonly plain: Patch; readonly withLumels: Patch } | undefined;
const originals = new WeakMap<Material, Pick<Material, 'onBeforeCompile' | 'customProgramCacheKey'>>();
/** The patched materials that read lumels: those of meshes that have some, and of other meshes too. */
const reading = new WeakSet<Material>();

/**
 * Patches the materials of an object and of all below it; those that are patched already stay, unless a
 * mesh that has lumels now shows them.
 */
export function patchMaterials(root: Object3D): void {
  root.traverse((object) => {
    const { geometry } = object as Partial<Mesh>;
    const withLumels = geometry?.attributes[LUMELS] !== undefined;
    for (const material of materialsOf(object)) patchMaterial(material, withLumels);
  });
}

/** The materials of an object: none unless it is drawn. */
export function materialsOf(object: Object3D): readonly Material[] {
  const { material } = object as Partial<Mesh>;
  return Array.isArray(material) ? material : material ? [material] : [];
}

function patchMaterial(material: Material, withLumels: boolean): void {
  if (!isLit(material)) return;
  if (withLumels && !reading.has(material)) {
    reading.add(material);
    material.needsUpdate = true;
  }
  if (originals.has(material)) return;
  const { plain, withLumels: lumels } = (patches ??= { plain: plainPatch(), withLumels: lumelsPatch() });
  const { onBeforeCompile, customProgramCacheKey } = material;
  originals.set(material, { onBeforeCompile, customProgramCacheKey });
  const key = customProgramCacheKey.call(material);
  material.onBeforeCompile = (shader, renderer) => {
    onBeforeCompile.call(material, shader, renderer);
    const { vertex, fragment } = reading.has(material) ? lumels : plain;
    Object.assign(shader.uniforms, {
      lumencastMoving: uniforms.moving,
      lumencastStill: uniforms.still,
      lumencastLumels: uniforms.lumels,
      lumencastSlopes: uniforms.slopes,
      lumencastPages: uniforms.pages,
    });
    shader.vertexShader = replaceChunks(shader.vertexShader, vertex);
    shader.fragmentShader = replaceChunks(shader.fragmentShader, fragment);
  };
  material.customProgramCacheKey = () => `${key}|lumencast${reading.has(material) ? ' lumels' : ''}`;
  material.needsUpdate = true;
}

function plainPatch(): Patch {
  return {
    vertex: { shadowmap_vertex: patchedShadowCoordinates() },
    fragment: { lights_pars_begin: patchedLights() },
  };
}

function lumelsPatch(): Patch {
  return {
    vertex: {
      shadowmap_pars_vertex: ShaderChunk.shadowmap_pars_vertex + LUMELS_OF_VERTEX,
      shadowmap_vertex: patchedShadowCoordinates() + LUMELS_OF_VERTEX_MAIN,
    },
    fragment: {
      lights_pars_begin: patchedLights(true),
      lights_fragment_begin: patchedIrradiance(),
    },
  };
}

function replaceChunks(shader: string, replacements: Replacements): string {
  return Object.entries(replacements).reduce(
    (text, [chunk, by]) => text.replace(`#include <${chunk}>`, () => by),
    shader,
  );
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
      reading.delete(material);
      material.needsUpdate = true;
    }
  });
}
