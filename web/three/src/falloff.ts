/**
 * Falloff of punctual lights as KHR_lights_punctual recommends it, so that page and server mean the
 * same light. three.js r187 differs in three ways: a smoothstep across the cone's edge instead of a
 * squared ramp, a squared range window instead of a plain one, and 1/d² capped at 100.
 *
 * The functions here are the readable twins of the shader code, and what the tests check it by.
 */

/** Least distance, metres, that 1/d² is computed for; keeps a fragment at the light itself finite. */
export const MIN_DISTANCE = 1e-3;
/** Least difference of the cone's cosines, from the extension's own example code. */
export const MIN_CONE = 1e-3;

/**
 * Share of a spot light's intensity at an angle from its axis, 0 to 1: the square of a ramp that is
 * linear in the cosine, from the outer half-angle to the inner one (radians).
 */
export function spotAttenuation(inner: number, outer: number, angle: number): number {
  const cosOuter = Math.cos(outer);
  const ramp = (Math.cos(angle) - cosOuter) / Math.max(MIN_CONE, Math.cos(inner) - cosOuter);
  return Math.min(Math.max(ramp, 0), 1) ** 2;
}

/** Irradiance per candela at a distance (metres); `range` 0 means infinite, as in three.js. */
export function distanceAttenuation(distance: number, range: number): number {
  const falloff = 1 / Math.max(distance, MIN_DISTANCE) ** 2;
  return range > 0 ? falloff * Math.min(Math.max(1 - (distance / range) ** 4, 0), 1) : falloff;
}

/** GLSL twins, under the names that three.js r187's `lights_pars_begin` chunk gives them. */
export const FALLOFF_GLSL = {
  getSpotAttenuation: /* glsl */ `
float getSpotAttenuation( const in float coneCosine, const in float penumbraCosine, const in float angleCosine ) {
	float ramp = saturate( ( angleCosine - coneCosine ) / max( penumbraCosine - coneCosine, ${MIN_CONE} ) );
	return ramp * ramp;
}`,
  getDistanceAttenuation: /* glsl */ `
float getDistanceAttenuation( const in float lightDistance, const in float cutoffDistance, const in float decayExponent ) {
	float falloff = 1.0 / pow( max( lightDistance, ${MIN_DISTANCE} ), decayExponent );
	return cutoffDistance > 0.0 ? falloff * saturate( 1.0 - pow4( lightDistance / cutoffDistance ) ) : falloff;
}`,
} as const;
