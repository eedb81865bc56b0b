import {
  DataTexture,
  DoubleSide,
  HalfFloatType,
  LinearFilter,
  type MagnificationTextureFilter,
  NearestFilter,
  RedFormat,
  RGBAFormat,
  UnsignedByteType,
  Vector2,
  Vector3,
} from 'three';
import {
  exp2,
  float,
  int,
  ivec2,
  positionGeometry,
  texture,
  textureSize,
  uniform,
  vec2,
  vec3,
  vec4,
} from 'three/tsl';
import {
  type Node,
  NodeMaterial,
  RenderTarget,
  RendererUtils,
  type TextureNode,
  type WebGPURenderer,
} from 'three/webgpu';
import type { FlatPaint, HalvesPaint, PagesTarget, PlanesPaint, Stroke } from './platform.js';
import { DARK, lumelsPerChroma, type PaintMaterials, Strokes } from './strokes.js';

/** The texture of all pages for WebGPURenderer, whose devices all draw into half floats and blend them. */
export function webgpuPages(renderer: WebGPURenderer, width: number, height: number): PagesTarget {
  const target = new RenderTarget(width, height, { type: HalfFloatType, depthBuffer: false });
  const drawn: Drawn = { stroke: undefined };
  const strokes = new Strokes(paintMaterials(drawn), width, height, true);
  strokes.onDraw = (stroke) => (drawn.stroke = stroke);
  return {
    texture: target.texture,
    paint(all) {
      strokes.set(all);
      const isXr = renderer.xr.enabled;
      const before = RendererUtils.resetRendererState(renderer, {} as never);
      renderer.autoClear = false;
      renderer.xr.enabled = false;
      renderer.setRenderTarget(target);
      renderer.render(strokes.scene, strokes.camera);
      RendererUtils.restoreRendererState(renderer, before);
      renderer.xr.enabled = isXr;
    },
    dispose() {
      strokes.dispose();
      target.dispose();
    },
  };
}

/** The stroke that is being drawn. */
interface Drawn {
  stroke: Stroke | undefined;
}

/**
 * One material a kind, whose uniforms and textures become those of each stroke as it is drawn: building
 * nodes takes milliseconds. Twins of the shaders in webgl-pages.ts.
 */
function paintMaterials(drawn: Drawn): PaintMaterials {
  return { halves: halves(drawn), planes: planes(drawn), flat: flat(drawn) };
}

function halves(drawn: Drawn): NodeMaterial {
  const paint = () => drawn.stroke!.paint as HalvesPaint;
  const texels = texture(halvesTexel()).onObjectUpdate(() => paint().texels);
  const lumels = texels.load(ivec2(lumelsOf(drawn))) as Node<'vec4'>;
  return material(drawn, lumels.rgb.mul(number(() => paint().factor)));
}

function planes(drawn: Drawn): NodeMaterial {
  const paint = () => drawn.stroke!.paint as PlanesPaint;
  const at = lumelsOf(drawn);
  const y = texture(codesTexel()).onObjectUpdate(() => paint().y);
  const luma = (y.load(ivec2(at)) as Node<'vec4'>).r.mul(255);
  const per = uniform(new Vector2()).onObjectUpdate(() => new Vector2(...lumelsPerChroma(paint())));
  const chroma = (plane: () => DataTexture) => {
    const node = texture(codesTexel(LinearFilter)).onObjectUpdate(plane);
    const uv = at.div(per).div(sizeOf(node));
    return (node.sample(uv).level(float(0)) as Node<'vec4'>).r.mul(255).sub(128);
  };
  const orange = chroma(() => paint().co);
  const green = chroma(() => paint().cg);
  const codes = vec3(luma.sub(green).add(orange), luma.add(green), luma.sub(green).sub(orange));
  const octaves = number(() => paint().octaves);
  const powers = exp2(codes.clamp(0, 255).div(255).mul(octaves));
  const factor = number(() => paint().factor / 2 ** paint().toe);
  return material(drawn, powers.sub(1).mul(factor));
}

function flat(drawn: Drawn): NodeMaterial {
  const paint = () => drawn.stroke!.paint as FlatPaint;
  const color = uniform(new Vector3()).onObjectUpdate(() => new Vector3(...paint().color));
  const cell = lumelsOf(drawn).floor();
  const isDark = cell.x
    .add(cell.y)
    .mod(2)
    .greaterThan(0.5)
    .and(number(() => Number(paint().checkered)).greaterThan(0.5));
  return material(drawn, color.mul(isDark.select(float(DARK), float(1))));
}

/** Lumels from the stroke's first one. */
function lumelsOf(drawn: Drawn): Node<'vec2'> {
  const size = uniform(new Vector2()).onObjectUpdate(
    () => new Vector2(drawn.stroke!.width, drawn.stroke!.height),
  );
  return positionGeometry.xy.mul(size);
}

function number(value: () => number): Node<'float'> {
  return uniform(0).onObjectUpdate(value);
}

function material(drawn: Drawn, color: Node<'vec3'>): NodeMaterial {
  const made = new NodeMaterial();
  made.fragmentNode = vec4(
    color,
    number(() => drawn.stroke!.share),
  );
  Object.assign(made, {
    side: DoubleSide,
    transparent: true,
    depthTest: false,
    depthWrite: false,
    fog: false,
    lights: false,
  });
  return made;
}

/**
 * What stands for a texture until the first stroke, and says how to filter it. There is one for each:
 * nodes of one texture are made one.
 */
function halvesTexel(): DataTexture {
  const texel = new DataTexture(new Uint16Array(4), 1, 1, RGBAFormat, HalfFloatType);
  texel.needsUpdate = true;
  return texel;
}

function codesTexel(filter: MagnificationTextureFilter = NearestFilter): DataTexture {
  const texel = new DataTexture(new Uint8Array(1), 1, 1, RedFormat, UnsignedByteType);
  texel.minFilter = texel.magFilter = filter;
  texel.needsUpdate = true;
  return texel;
}

/** Columns and rows of a texture. */
export function sizeOf(node: TextureNode): Node<'vec2'> {
  return vec2(textureSize(node, int(0)) as unknown as Node<'ivec2'>);
}
