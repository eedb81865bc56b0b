/**
 * Lights a three.js scene, drawn by WebGPURenderer, with the indirect light of a Lumencast server.
 * The names and their meaning are those of `@lumencast/three`.
 */
import { LightProbeGrid } from 'three/addons/lighting/LightProbeGrid.js';
import type { Object3D } from 'three';
import { lightTargetDirection } from 'three/tsl';
import {
  type Node,
  type NodeBuilder,
  PointLight,
  PointLightNode,
  SpotLight,
  SpotLightNode,
  type WebGPURenderer,
} from 'three/webgpu';
import { type ConnectOptions, connectWith, type ShowOptions, showWith } from './connect.js';
import { MIN_CONE, MIN_DISTANCE } from './falloff.js';
import { type AttachOptions, LumencastLight } from './light.js';
import type { LightSession } from './light-session.js';
import type { Platform } from './platform.js';
import { unitsTaken } from './units.js';
import { FactorGridNode, factors, LumelLight } from './webgpu-lumels.js';
import { webgpuPages } from './webgpu-pages.js';

export * from './common.js';

/** See `connect` of `@lumencast/three`; it initialises the renderer where the program has not. */
export async function connect(
  url: string,
  options: ConnectOptions & { renderer: WebGPURenderer },
): Promise<LumencastLight> {
  await options.renderer.init();
  return connectWith(webgpuPlatform(options.renderer), url, options);
}

/** See `show` of `@lumencast/three`; it initialises the renderer where the program has not. */
export async function show(
  light: string | URL | Uint8Array,
  options: ShowOptions & { renderer: WebGPURenderer },
): Promise<LumencastLight> {
  await options.renderer.init();
  return showWith(webgpuPlatform(options.renderer), light, options);
}

/**
 * See `attach` of `@lumencast/three`.
 * @throws Error when the renderer is not initialised: `await renderer.init()`
 */
export function attach(
  session: LightSession,
  options: AttachOptions & { renderer: WebGPURenderer },
): LumencastLight {
  if (!options.renderer.initialized) throw new Error('the renderer needs `await renderer.init()` first');
  return new LumencastLight(session, webgpuPlatform(options.renderer), options);
}

/** Sampled textures of a shader stage that every WebGPU device has, and every WebGL 2 context. */
const MAX_TEXTURES = 16;
/** The least that WebGPU allows a 3D texture along an axis. */
const MAX_3D_TEXTURE_SIZE = 2048;
/** The same of a 2D texture. */
const MAX_TEXTURE_SIZE = 8192;

function webgpuPlatform(renderer: WebGPURenderer): Platform {
  const gl = fallbackContext(renderer);
  return {
    createGrid(size, resolution) {
      const grid = new LightProbeGrid(...size, ...resolution);
      // The target that it would bake into is not needed.
      grid.dispose();
      Object.assign(grid, { _lightNode: FactorGridNode });
      return grid as LightProbeGrid & { dispose(): void };
    },
    scaleIn: 'intensity',
    factors,
    freeUnits: (scene) => MAX_TEXTURES - unitsTaken(scene, 'webgpu'),
    max3DTextureSize: gl ? (gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number) : MAX_3D_TEXTURE_SIZE,
    maxTextureSize: gl ? (gl.getParameter(gl.MAX_TEXTURE_SIZE) as number) : MAX_TEXTURE_SIZE,
    createPages: (width, height) => webgpuPages(renderer, width, height),
    createLumelLight: (pages) => new LumelLight(pages),
    // Objects that stand still do not look for new data of their lights' textures.
    upload: (texture) => renderer.initTexture(texture),
    patch: (root) => eachLight(root, (light, Falloff) => (light._lightNode = Falloff)),
    unpatch: (root) => eachLight(root, (light) => delete light._lightNode),
  };
}

/** The context of the backend that stands in where the browser has no WebGPU. */
function fallbackContext({ backend }: WebGPURenderer): WebGL2RenderingContext | undefined {
  return 'isWebGLBackend' in backend ? (backend as unknown as { gl: WebGL2RenderingContext }).gl : undefined;
}

/** Where WebGPURenderer looks up how a light is shaded: the light itself, then its class. */
type Shaded = Object3D & { _lightNode?: typeof GltfSpotLightNode | typeof GltfPointLightNode };

function eachLight(
  root: Object3D,
  visit: (light: Shaded, Falloff: NonNullable<Shaded['_lightNode']>) => void,
): void {
  root.traverse((object) => {
    if (object instanceof SpotLight) visit(object, GltfSpotLightNode);
    else if (object instanceof PointLight) visit(object, GltfPointLightNode);
  });
}

/** Twin of `distanceAttenuation` in falloff.ts. */
function distanceAttenuation(
  distance: Node<'float'>,
  range: Node<'float'>,
  decay: Node<'float'>,
): Node<'float'> {
  const falloff = distance.max(MIN_DISTANCE).pow(decay).reciprocal();
  const window = distance.div(range).pow4().oneMinus().clamp();
  return range.greaterThan(0).select(falloff.mul(window), falloff);
}

/** Twin of `spotAttenuation` in falloff.ts. */
function spotAttenuation(
  cosOuter: Node<'float'>,
  cosInner: Node<'float'>,
  cos: Node<'float'>,
): Node<'float'> {
  return cos.sub(cosOuter).div(cosInner.sub(cosOuter).max(MIN_CONE)).clamp().pow2();
}

type Float = Node<'float'>;
type Vector = Node<'vec3'>;

class GltfPointLightNode extends PointLightNode {
  static get type(): string {
    return 'GltfPointLightNode';
  }

  override setupDirect(builder: NodeBuilder) {
    const towards = this.getLightVector(builder) as Vector;
    const attenuation = distanceAttenuation(
      towards.length(),
      this.cutoffDistanceNode as Float,
      this.decayExponentNode as Float,
    );
    return {
      lightDirection: towards.normalize(),
      lightColor: (this as unknown as { colorNode: Vector }).colorNode.mul(attenuation),
    };
  }
}

class GltfSpotLightNode extends SpotLightNode {
  static get type(): string {
    return 'GltfSpotLightNode';
  }

  override setupDirect(builder: NodeBuilder) {
    const towards = this.getLightVector(builder) as Vector;
    const lightDirection = towards.normalize();
    const axis = lightTargetDirection(this.light!) as Vector;
    const attenuation = distanceAttenuation(
      towards.length(),
      this.cutoffDistanceNode as Float,
      this.decayExponentNode as Float,
    ).mul(
      spotAttenuation(this.coneCosNode as Float, this.penumbraCosNode as Float, lightDirection.dot(axis)),
    );
    return {
      lightDirection,
      lightColor: (this as unknown as { colorNode: Vector }).colorNode.mul(attenuation),
    };
  }
}
