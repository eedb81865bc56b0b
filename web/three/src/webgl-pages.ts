import {
  DoubleSide,
  HalfFloatType,
  type IUniform,
  ShaderMaterial,
  type WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import type { PagesTarget, Paint, Stroke } from './platform.js';
import { DARK, lumelsPerChroma, Strokes } from './strokes.js';

/** The texture of all pages for WebGLRenderer; `undefined` where it cannot draw into half floats. */
export function webglPages(renderer: WebGLRenderer, width: number, height: number): PagesTarget | undefined {
  // Where half floats can be drawn into, they can be blended (EXT_color_buffer_float asks for it).
  const { extensions } = renderer;
  if (!extensions.has('EXT_color_buffer_float') && !extensions.has('EXT_color_buffer_half_float')) {
    return undefined;
  }
  const target = new WebGLRenderTarget(width, height, { type: HalfFloatType, depthBuffer: false });
  const materials = paintMaterials();
  const strokes = new Strokes(materials, width, height, false);
  strokes.onDraw = (stroke) => setUniforms(materials[stroke.paint.kind], stroke);
  return {
    texture: target.texture,
    paint(all) {
      strokes.set(all);
      const { autoClear, xr } = renderer;
      const before = renderer.getRenderTarget();
      const [face, level] = [renderer.getActiveCubeFace(), renderer.getActiveMipmapLevel()];
      const isXr = xr.enabled;
      renderer.autoClear = false;
      xr.enabled = false;
      renderer.setRenderTarget(target);
      renderer.render(strokes.scene, strokes.camera);
      renderer.setRenderTarget(before, face, level);
      renderer.autoClear = autoClear;
      xr.enabled = isXr;
    },
    dispose() {
      strokes.dispose();
      target.dispose();
    },
  };
}

const VERTEX = /* glsl */ `
uniform vec2 size;
varying highp vec2 at;

void main() {
	at = position.xy * size;
	gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
}
`;

const HALVES = /* glsl */ `
uniform highp sampler2D texels;
uniform float factor;
uniform float share;
varying highp vec2 at;

void main() {
	gl_FragColor = vec4( texelFetch( texels, ivec2( at ), 0 ).rgb * factor, share );
}
`;

const PLANES = /* glsl */ `
uniform highp sampler2D y;
uniform highp sampler2D co;
uniform highp sampler2D cg;
uniform vec2 lumelsPerChroma;
uniform float toe;
uniform float octaves;
uniform float factor;
uniform float share;
varying highp vec2 at;

// Less the code of no chroma; between samples, whose middles are those of the lumels that they are means of.
float chroma( sampler2D plane ) {
	vec2 uv = at / lumelsPerChroma / vec2( textureSize( plane, 0 ) );
	return 255.0 * textureLod( plane, uv, 0.0 ).r - 128.0;
}

void main() {
	float luma = 255.0 * texelFetch( y, ivec2( at ), 0 ).r;
	float orange = chroma( co );
	float green = chroma( cg );
	vec3 codes = vec3( luma - green + orange, luma + green, luma - green - orange );
	vec3 powers = exp2( clamp( codes, 0.0, 255.0 ) / 255.0 * octaves );
	gl_FragColor = vec4( ( powers - 1.0 ) / exp2( toe ) * factor, share );
}
`;

const FLAT = /* glsl */ `
uniform vec3 color;
uniform bool checkered;
varying highp vec2 at;

void main() {
	bool isDark = checkered && mod( floor( at.x ) + floor( at.y ), 2.0 ) > 0.5;
	gl_FragColor = vec4( color * ( isDark ? ${DARK} : 1.0 ), 1.0 );
}
`;

function paintMaterials(): Readonly<Record<Paint['kind'], ShaderMaterial>> {
  return {
    halves: material(HALVES, ['texels', 'factor', 'share']),
    planes: material(PLANES, ['y', 'co', 'cg', 'lumelsPerChroma', 'toe', 'octaves', 'factor', 'share']),
    flat: material(FLAT, ['color', 'checkered']),
  };
}

function material(fragmentShader: string, names: readonly string[]): ShaderMaterial {
  const uniforms = Object.fromEntries(['size', ...names].map((name) => [name, { value: null } as IUniform]));
  return new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader,
    uniforms,
    side: DoubleSide,
    transparent: true,
    depthTest: false,
    depthWrite: false,
  });
}

function setUniforms(material: ShaderMaterial, { width, height, share, paint }: Stroke): void {
  const { kind: _, ...values } = paint;
  const all: Readonly<Record<string, unknown>> = {
    ...values,
    size: [width, height],
    share,
    ...(paint.kind === 'planes' && { lumelsPerChroma: lumelsPerChroma(paint) }),
  };
  for (const [name, uniform] of Object.entries(material.uniforms)) uniform.value = all[name];
  material.uniformsNeedUpdate = true;
}
