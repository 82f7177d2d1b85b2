// Tone curves: how exposed light becomes what a display shows. Those but the first are three.js's own.
import { ShaderChunk } from 'three';

/** Curves by name, and what people call them. */
export const CURVES = [
  ['shoulder', 'Soft shoulder'], ['linear', 'Linear, clipped'], ['reinhard', 'Reinhard'], ['agx', 'Filmic (AgX)'], ['aces', 'Filmic (ACES)'],
] as const;
export type Curve = (typeof CURVES)[number][0];

/** Where it is kept which curve a person likes. */
const KEPT = 'radiosity.curve';

/** The curve that was chosen last on this machine. */
export function kept(): Curve {
  try {
    const name = localStorage.getItem(KEPT);
    return CURVES.find(([curve]) => curve === name)?.[0] ?? 'shoulder';
  } catch {
    // Browsers may refuse to remember anything.
    return 'shoulder';
  }
}

/** Remembers it. */
export function keep(curve: Curve): void {
  try {
    localStorage.setItem(KEPT, curve);
  } catch {
    // It is as chosen until the page is left.
  }
}

/** What the shaders know a curve by. */
export const numberOf = (curve: Curve) => CURVES.findIndex(([name]) => name === curve);

/** `toneMap`, by the uniform `curve`; the shoulder is that of crates/scene/src/display.rs. */
export const TONE_MAP = /* glsl */ `
  ${ShaderChunk.tonemapping_pars_fragment}
  uniform int curve;
  const float KNEE = 0.5;
  const float WHITE = 8.0;

  vec3 shoulder(vec3 colour) {
    float peak = max(colour.r, max(colour.g, colour.b));
    if (peak <= KNEE) return colour;
    float range = 1.0 - KNEE;
    float end = 1.0 - exp(-(WHITE - KNEE) / range);
    float mapped = KNEE + range * (1.0 - exp(-(peak - KNEE) / range)) / end;
    float fade = clamp((peak - 1.0) / (WHITE - 1.0), 0.0, 1.0);
    vec3 hue = colour / peak * mapped;
    return min(hue + fade * (mapped - hue), 1.0);
  }

  vec3 toneMap(vec3 colour) {
    if (curve == ${numberOf('linear')}) return LinearToneMapping(colour);
    if (curve == ${numberOf('reinhard')}) return ReinhardToneMapping(colour);
    if (curve == ${numberOf('agx')}) return AgXToneMapping(colour);
    if (curve == ${numberOf('aces')}) return ACESFilmicToneMapping(colour);
    return shoulder(colour);
  }
`;
