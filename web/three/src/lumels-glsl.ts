import { STEEPEST } from '@lumencast/client';
import { GAMMA } from './handover.js';
import { FIRST, LUMEL_CORNER, LUMEL_SHARE, LUMELS } from './charted.js';

/**
 * What a vertex hands on in place of coordinates where its side has no lumels, and where its geometry
 * knows none at all. Both are so far off that interpolation beyond a triangle's edge, as at samples of a
 * pixel, comes nowhere near a coordinate. Twin: `LumelNode` in webgpu-lumels.ts.
 */
const NOWHERE = '- 1e6';
const UNKNOWN = '- 3e6';
/** What is above this is a coordinate, or else {@link NOWHERE}. */
const BELOW_COORDINATES = '- 5e5';
const BELOW_NOWHERE = '- 2e6';

export const LUMELS_OF_VERTEX = /* glsl */ `
attribute vec4 ${LUMELS};
attribute float ${LUMEL_SHARE};
attribute vec4 ${LUMEL_CORNER};
varying highp vec4 vLumels;
flat varying float vLumelShare;

// A geometry without copies has no corners: below ${FIRST}, they are none.
vec2 lumelsPlaced( vec2 lumels, vec2 corner ) {
	if ( lumels.x < 1.5 || corner.x < 0.0 ) return vec2( ${NOWHERE} );
	return lumels - ${FIRST}.0 + max( corner - ${FIRST}.0, 0.0 );
}
`;

export const LUMELS_OF_VERTEX_MAIN = /* glsl */ `
bool isUnknown = ${LUMELS}.x > -0.5 && ${LUMELS}.x < 1.5;
vLumels.xy = isUnknown ? vec2( ${UNKNOWN} ) : lumelsPlaced( ${LUMELS}.xy, ${LUMEL_CORNER}.xy );
vLumels.zw = lumelsPlaced( ${LUMELS}.zw, ${LUMEL_CORNER}.zw );
vLumelShare = ${LUMEL_SHARE};
`;

export const LUMELS_OF_FRAGMENT = /* glsl */ `
uniform float lumencastStill;
uniform float lumencastMoving;
uniform float lumencastLumels;
uniform float lumencastSlopes;
uniform highp sampler2D lumencastPages;
varying highp vec4 vLumels;
flat varying float vLumelShare;

// Where the lumels of the side that is seen lie.
vec2 lumelsSeen() {
#ifdef FLIP_SIDED
	return gl_FrontFacing ? vLumels.zw : vLumels.xy;
#else
	return gl_FrontFacing ? vLumels.xy : vLumels.zw;
#endif
}

bool hasLumels() {
	return lumelsSeen().x > ${BELOW_COORDINATES};
}

vec3 lumelIrradiance() {
	vec2 uv = lumelsSeen() / vec2( textureSize( lumencastPages, 0 ) );
	return textureLod( lumencastPages, uv, 0.0 ).rgb * lumencastLumels;
}

// Irradiance on the normal of shading over that on the surface's own, both of view space. What is not
// painted yet is 0 in all channels. Twin: tilt in webgpu-lumels.ts.
float lumelTilt( vec3 own, vec3 shading ) {
	if ( lumencastSlopes == 0.0 ) return 1.0;
	vec2 uv = ( lumelsSeen() + vec2( 0.0, lumencastSlopes ) ) / vec2( textureSize( lumencastPages, 0 ) );
	vec4 told = textureLod( lumencastPages, uv, 0.0 );
	vec3 slope = ${STEEPEST.toFixed(1)} * ( 2.0 * told.rgb - told.a );
	return max( 0.0, 1.0 + dot( slope, ( vec4( shading - own, 0.0 ) * viewMatrix ).xyz ) );
}

// Whether nothing is to be seen of the grids' light.
bool isLumelsAlone() {
	return hasLumels() && vLumelShare >= 1.0;
}

float gridFactor() {
	if ( vLumels.x < ${BELOW_NOWHERE} || hasLumels() ) return lumencastMoving;
	return mix( lumencastMoving, lumencastStill, vLumelShare );
}

// Irradiance of grids, of lumels, or on the way from one to the other: its codes on a display change evenly.
// Twin: between in webgpu-lumels.ts.
vec3 gridsOrLumels( vec3 grids, vec3 own, vec3 shading ) {
	if ( ! hasLumels() ) return grids;
	vec3 lumels = lumelTilt( own, shading ) * lumelIrradiance();
	if ( vLumelShare >= 1.0 ) return lumels;
	vec3 inverse = vec3( 1.0 / ${GAMMA} );
	return pow( mix( pow( max( grids, 0.0 ), inverse ), pow( lumels, inverse ), vLumelShare ), vec3( ${GAMMA} ) );
}
`;
