//! From light to what a display shows: the tone curve and the transfer curve.

use crate::Bands;

/// Exposed light up to this is shown as it is.
const KNEE: f32 = 0.5;

/// Exposed light that is shown white.
const WHITE: f32 = 8.0;

/// Exposed light on a display: linear up to one half, then a shoulder, by the largest channel so that hues stay, until
/// they fade to white at 8 as on film. A plain cut at 1 would show sun and shade alike.
pub fn tone_map(color: Bands) -> Bands {
    let color = color.map(|c| if c >= 0.0 { c.min(f32::MAX) } else { 0.0 });
    let peak = color[0].max(color[1]).max(color[2]);
    if peak <= KNEE {
        return color;
    }
    // Above the knee: y = knee + (1 − knee) · (1 − e^{−s})/(1 − e^{−S}), with slope one at the knee.
    let range = 1.0 - KNEE;
    let end = 1.0 - (-(WHITE - KNEE) / range).exp();
    let mapped = KNEE + range * (1.0 - (-(peak - KNEE) / range).exp()) / end;
    let fade = ((peak - 1.0) / (WHITE - 1.0)).clamp(0.0, 1.0);
    color.map(|c| {
        let hue = c / peak * mapped;
        (hue + fade * (mapped - hue)).min(1.0)
    })
}

/// sRGB encoding (IEC 61966-2-1) of a linear value in 0..1.
pub fn srgb(linear: f32) -> f32 {
    let x = linear.clamp(0.0, 1.0);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tone_mapping_is_linear_below_the_knee_and_monotonic_above() {
        assert_eq!(tone_map([0.2, 0.4, 0.5]), [0.2, 0.4, 0.5]);
        let mut last = 0.0;
        for i in 1..2000 {
            let y = tone_map([i as f32 * 0.01; 3])[1];
            assert!(y >= last && y <= 1.0, "{i}");
            last = y;
        }
        assert!((tone_map([8.0; 3])[0] - 1.0).abs() < 1e-3);
    }
}
