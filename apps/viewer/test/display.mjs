// From light to the bytes of a pixel, as crates/scene/src/display.rs has it.
const [KNEE, WHITE] = [0.5, 8];

function toneMap(colour) {
  const peak = Math.max(...colour);
  if (peak <= KNEE) return colour;
  const range = 1 - KNEE;
  const mapped = KNEE + (range * (1 - Math.exp(-(peak - KNEE) / range))) / (1 - Math.exp(-(WHITE - KNEE) / range));
  const fade = Math.min(1, Math.max(0, (peak - 1) / (WHITE - 1)));
  return colour.map((c) => Math.min(1, (c / peak) * mapped + fade * (mapped - (c / peak) * mapped)));
}

/** Tone curves that are told by a formula. */
export const curves = {
  shoulder: toneMap,
  linear: (colour) => colour.map((c) => Math.min(1, c)),
  reinhard: (colour) => colour.map((c) => c / (1 + c)),
};

/** What a place should look like at an exposure (log2), by the light that falls on it. */
export function shown({ irradiance, behind, reflectance, transmittance, emission }, exposure, curve = 'shoulder') {
  const luminance = irradiance.map((h, k) => (reflectance[k] * h + transmittance[k] * behind[k]) / Math.PI + emission[k]);
  return curves[curve](luminance.map((l) => l * 2 ** exposure)).map((c) => 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055));
}
