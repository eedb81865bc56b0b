import { STEEPEST } from '@lumencast/client';
import type { LightProbeGrid } from 'three/addons/lighting/LightProbeGrid.js';
import { LightProbeGridNode } from 'three/addons/tsl/lighting/LightProbeGridNode.js';
import { InterpolationSamplingType, Light, type Texture } from 'three';
import {
  attribute,
  float,
  Fn,
  frontFacing,
  If,
  INFINITY,
  mix,
  negateOnBackSide,
  normalWorld,
  normalWorldGeometry,
  renderGroup,
  texture,
  uniform,
  varying,
  vec2,
  vec3,
  vec4,
} from 'three/tsl';
import { AnalyticLightNode, type Node, type NodeBuilder, type NodeFrame } from 'three/webgpu';
import { FIRST, LUMEL_CORNER, LUMEL_SHARE, LUMELS } from './charted.js';
import { GAMMA } from './handover.js';
import { sizeOf } from './webgpu-pages.js';

/** Uniforms of all scenes; other than neutral only while a scene is drawn. */
export const factors = {
  lumels: uniform(1).setGroup(renderGroup),
  slopes: uniform(0).setGroup(renderGroup),
  still: uniform(1).setGroup(renderGroup),
  moving: uniform(1).setGroup(renderGroup),
};

/** What a vertex hands on where its side has no lumels, and what is above that. Twin: lumels-glsl.ts. */
const NOWHERE = -1e6;
const BELOW_COORDINATES = -5e5;

/** What probe grids hand to one another while a shader is built. */
interface ProbeContext {
  lightProbeIrradiance?: Node<'vec3'>;
  lightProbePriority?: Node<'float'>;
}

/** A light that lets what it lights read irradiance at lumels, in place of that of probe grids or beside it. */
export class LumelLight extends Light {
  readonly _lightNode = LumelNode;

  constructor(readonly pages: Texture) {
    super();
    this.name = 'lumencast lumels';
  }
}

/**
 * Puts irradiance at lumels in place of that of probe grids, or on the way from these, wherever a side has
 * some. Where it is all there is, this stands among the nodes of grids as one of the highest priority, so that
 * none is read. A shader is built for each set of attributes: of geometries without charts it knows nothing of
 * lumels.
 */
class LumelNode extends AnalyticLightNode<LumelLight> {
  static get type(): string {
    return 'LumelNode';
  }

  override setup(builder: NodeBuilder): undefined {
    const seen = seenBy(builder);
    if (!seen) return;
    const { at, share } = seen;
    const pages = texture(this.light!.pages);
    const context = builder.context as unknown as ProbeContext;
    const ofGrids = (context.lightProbeIrradiance ??= vec3().toVar('lightProbeIrradiance'));
    const priority = (context.lightProbePriority ??= INFINITY.negate().toVar('lightProbePriority'));
    const light = vec3(0).toVar();
    If(hasLumels(seen), () => {
      const uv = at.div(sizeOf(pages));
      const texel = pages.sample(uv).level(float(0)) as Node<'vec4'>;
      light.assign(texel.rgb.mul(factors.lumels));
      If(factors.slopes.greaterThan(0), () => {
        const below = at.add(vec2(0, factors.slopes)).div(sizeOf(pages));
        light.mulAssign(tilt(pages.sample(below).level(float(0)) as Node<'vec4'>));
      });
      If(share.greaterThanEqual(1), () => void priority.assign(INFINITY));
    });
    // three.js adds it once all grids have been assigned to it.
    const both = hasLumels(seen).select(between(ofGrids, light, share), ofGrids);
    context.lightProbeIrradiance = Object.assign(both, { assign: (value: Node) => ofGrids.assign(value) });
  }
}

/** Light on the way from one to another: its codes on a display change evenly. Twin: lumels-glsl.ts. */
function between(from: Node<'vec3'>, to: Node<'vec3'>, way: Node<'float'>): Node<'vec3'> {
  const code = (light: Node<'vec3'>) => light.max(vec3(0)).pow(vec3(1 / GAMMA));
  const mixed = mix(code(from), code(to), way).pow(vec3(GAMMA));
  return way.greaterThanEqual(1).select(to, mixed);
}

/**
 * Irradiance on the normal of shading over that on the surface's own, by what a lumel's slope is told by. What
 * is not painted yet is 0 in all channels. Twin: lumelTilt in lumels-glsl.ts.
 */
function tilt(told: Node<'vec4'>): Node<'float'> {
  const slope = told.rgb.mul(2).sub(vec3(told.a)).mul(STEEPEST);
  return slope
    .dot(normalWorld.sub(negateOnBackSide(normalWorldGeometry)))
    .add(1)
    .max(0);
}

/** What a fragment knows of the lumels of the side that is seen. */
interface Seen {
  /** Where they lie, or {@link NOWHERE}. */
  readonly at: Node<'vec2'>;
  /** How much of the light they make. */
  readonly share: Node<'float'>;
}

/** `undefined` where the geometry knows nothing of lumels. Varyings of one name are one. */
function seenBy({ geometry }: NodeBuilder): Seen | undefined {
  const stored = geometry?.getAttribute(LUMELS);
  if (!stored) return undefined;
  const both = attribute<'vec4'>(LUMELS, 'vec4');
  const hasBack = stored.itemSize === 4;
  const hasCopies = geometry?.hasAttribute(LUMEL_CORNER);
  const corners = hasCopies ? attribute<'vec4'>(LUMEL_CORNER, 'vec4') : vec4(FIRST);
  const handedOn = (lumels: Node<'vec2'>, corner: Node<'vec2'>, name: string) => {
    const has = lumels.x.greaterThan(1.5).and(corner.x.greaterThan(1.5));
    return varying(has.select(lumels.add(corner).sub(2 * FIRST), vec2(NOWHERE)), name);
  };
  const ofFront = hasBack ? both.xy : attribute<'vec2'>(LUMELS, 'vec2');
  const front = handedOn(ofFront, corners.xy, 'vLumelsOfFront');
  const back = hasBack ? handedOn(both.zw, corners.zw, 'vLumelsOfBack') : vec2(NOWHERE);
  const share = varying(attribute<'float'>(LUMEL_SHARE, 'float'), 'vLumelShare');
  return {
    at: frontFacing.select(front, back),
    share: share.setInterpolation(InterpolationSamplingType.FLAT),
  };
}

function hasLumels({ at }: Seen): Node<'bool'> {
  return at.x.greaterThan(BELOW_COORDINATES);
}

/** By what light of probe grids counts on a geometry, known once a shader is built for it. */
const gridFactor = Fn((_: unknown, builder: NodeBuilder) => {
  const seen = seenBy(builder);
  if (!seen) return factors.moving;
  return hasLumels(seen).select(factors.moving, mix(factors.moving, factors.still, seen.share));
}) as unknown as () => Node<'float'>;

/** A part of three.js' node that its types leave out. */
interface WithIntensity {
  _intensity: Node<'float'> & { value?: number };
}

/** The node of a probe grid, whose light counts by the factor of what it falls on. */
export class FactorGridNode extends LightProbeGridNode {
  readonly #intensity: WithIntensity['_intensity'];

  static get type(): string {
    return 'FactorGridNode';
  }

  constructor(light: LightProbeGrid) {
    super(light);
    const grid = this as unknown as WithIntensity;
    this.#intensity = grid._intensity;
    grid._intensity = this.#intensity.mul(gridFactor());
  }

  override update(frame: NodeFrame): undefined {
    super.update(frame);
    this.#intensity.value = this.light!.intensity;
  }
}
