// What the eye counts of each band of linear Rec. 709; the same weights as in crates/scene.

export const WEIGHTS = [0.2126, 0.7152, 0.0722] as const;

/** Luminance of bands, illuminance of irradiance. */
export function luminance(bands: ArrayLike<number>): number {
  return WEIGHTS[0] * bands[0] + WEIGHTS[1] * bands[1] + WEIGHTS[2] * bands[2];
}
