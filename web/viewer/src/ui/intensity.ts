/** Positions of a slider for intensities: their decimal logarithms, from moonlight to past a noon sun. The lowest is off. */
export const INTENSITY = { min: -4, max: 6, step: 0.01 } as const;

/** The intensity that a position of the thumb means. */
export function intensityAt(position: number): number {
  return position <= INTENSITY.min ? 0 : 10 ** position;
}

/** Says the intensity that has this logarithm, also past the ends of the slider. */
export function intensityText(unit: string): (logarithm: number) => string {
  return (logarithm) => `${Number((10 ** logarithm).toPrecision(2))} ${unit}`;
}
