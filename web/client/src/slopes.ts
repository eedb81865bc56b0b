/** The length of the steepest slope that pictures tell. */
export const STEEPEST = 3;

/**
 * A component of a lumel's slope s, by what a picture of slopes tells as if it were irradiance. s tells how
 * irradiance depends on the normal n' that a surface with normal n is shaded by:
 * E(n') = E(n) · max(0, 1 + s · (n' − n)), in axes of the world.
 */
export function slopeOf(told: number): number {
  return STEEPEST * (2 * Math.min(told, 1) - 1);
}
