import type { LightProbeGrid } from 'three/addons/lighting/LightProbeGrid.js';
import { LightProbeGridNode } from 'three/addons/tsl/lighting/LightProbeGridNode.js';
import { Light, type Texture } from 'three';
import {
  attribute,
  float,
  Fn,
  frontFacing,
  If,
  INFINITY,
  renderGroup,
  texture,
  uniform,
  varying,
  vec2,
  vec3,
} from 'three/tsl';
import { AnalyticLightNode, type Node, type NodeBuilder, type NodeFrame } from 'three/webgpu';
import { FIRST, LUMELS } from './charted.js';
import { sizeOf } from './webgpu-pages.js';

/** Uniforms of all scenes; other than neutral only while a scene is drawn. */
export const factors = {
  lumels: uniform(1).setGroup(renderGroup),
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

/** A light that lets what it lights read irradiance at lumels, in place of that of probe grids. */
export class LumelLight extends Light {
  readonly _lightNode = LumelNode;

  constructor(readonly pages: Texture) {
    super();
    this.name = 'lumencast lumels';
  }
}

/**
 * Stands among the nodes of probe grids as one of the highest priority, wherever a side has lumels. A
 * shader is built for each set of attributes: of geometries without charts it knows nothing of lumels.
 */
class LumelNode extends AnalyticLightNode<LumelLight> {
  static get type(): string {
    return 'LumelNode';
  }

  override setup(builder: NodeBuilder): undefined {
    const stored = lumelsAttributeOf(builder);
    if (!stored) return;
    const pages = texture(this.light!.pages);
    const at = seen(stored);
    const context = builder.context as ProbeContext;
    context.lightProbeIrradiance ??= vec3().toVar('lightProbeIrradiance');
    context.lightProbePriority ??= INFINITY.negate().toVar('lightProbePriority');
    const { lightProbeIrradiance, lightProbePriority } = context;
    If(at.x.greaterThan(BELOW_COORDINATES), () => {
      const uv = at.div(sizeOf(pages));
      const texel = pages.sample(uv).level(float(0)) as Node<'vec4'>;
      lightProbeIrradiance.assign(texel.rgb.mul(factors.lumels));
      lightProbePriority.assign(INFINITY);
    });
  }
}

/** What tells where lumels lie, of the front alone or of both sides; `undefined` where nothing does. */
function lumelsAttributeOf({ geometry }: NodeBuilder): Stored | undefined {
  const stored = geometry?.getAttribute(LUMELS);
  if (!stored) return undefined;
  if (stored.itemSize !== 4) return { front: attribute<'vec2'>(LUMELS, 'vec2'), back: undefined };
  const both = attribute<'vec4'>(LUMELS, 'vec4');
  return { front: both.xy, back: both.zw };
}

interface Stored {
  readonly front: Node<'vec2'>;
  readonly back: Node<'vec2'> | undefined;
}

/** Where the lumels of the side that is seen lie. */
function seen({ front, back }: Stored): Node<'vec2'> {
  const handedOn = (stored: Node<'vec2'> | undefined) =>
    stored ? varying(stored.x.greaterThan(1.5).select(stored.sub(FIRST), vec2(NOWHERE))) : vec2(NOWHERE);
  return frontFacing.select(handedOn(front), handedOn(back));
}

/** By what light of probe grids counts on a geometry, known once a shader is built for it. */
const gridFactor = Fn((_: unknown, builder: NodeBuilder) =>
  lumelsAttributeOf(builder) ? factors.still : factors.moving,
) as unknown as () => Node<'float'>;

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
