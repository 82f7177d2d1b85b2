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
    let peak = largest(color);
    if peak <= KNEE {
        return color;
    }
    let (mapped, fade) = (curve(peak), fade(peak));
    color.map(|c| {
        let hue = c / peak * mapped;
        (hue + fade * (mapped - hue)).min(1.0)
    })
}

fn largest(color: Bands) -> f32 {
    color[0].max(color[1]).max(color[2])
}

/// The largest channel as it is shown. Above the knee: y = knee + (1 − knee) · (1 − e^{−s})/(1 − e^{−S}), with slope one
/// at the knee.
fn curve(peak: f32) -> f32 {
    if peak <= KNEE {
        return peak;
    }
    let range = 1.0 - KNEE;
    let end = 1.0 - (-(WHITE - KNEE) / range).exp();
    KNEE + range * (1.0 - (-(peak - KNEE) / range).exp()) / end
}

/// How far hues have faded to white.
fn fade(peak: f32) -> f32 {
    ((peak - 1.0) / (WHITE - 1.0)).clamp(0.0, 1.0)
}

/// Relative slack for what rounding in single precision does to a displayed value, a few units in the last place.
const ROUNDING: f32 = 2e-6;

/// Bounds of [`tone_map`] of every exposed light between `low` and `high`, channel by channel. A channel is its hue, c y/peak
/// with y of the curve, moved towards y by the fade: more of c, y and the fade makes it brighter, and more of the peak
/// alone makes c y/peak darker, as the curve is concave. Each is taken at its own end, so that the bounds are not the tightest.
pub fn tone_map_between(low: Bands, high: Bands) -> [Bands; 2] {
    let clean = |color: Bands| color.map(|c| if c >= 0.0 { c.min(f32::MAX) } else { 0.0 });
    let (low, high) = (clean(low), clean(high));
    let (dim, bright) = (largest(low), largest(high));
    let share = |peak: f32| if peak <= KNEE { 1.0 } else { curve(peak) / peak };
    let channel = |hue: f32, peak: f32| (hue + fade(peak) * (curve(peak) - hue)).min(1.0);
    let below = low.map(|c| channel(c * share(bright), dim) * (1.0 - ROUNDING));
    let above = high.map(|c| channel((c * share(dim)).min(curve(bright)), bright) * (1.0 + ROUNDING));
    [below, above]
}

/// sRGB encoding (IEC 61966-2-1) of a linear value in 0..1.
pub fn srgb(linear: f32) -> f32 {
    let x = linear.clamp(0.0, 1.0);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of an sRGB one, both in 0..1; what [`srgb`] undoes.
///
/// ```
/// use radiosity_scene::display::{linear, srgb};
/// assert!((f64::from(srgb(linear(0.5) as f32)) - 0.5).abs() < 1e-6);
/// ```
pub fn linear(srgb: f64) -> f64 {
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_of_what_is_shown_hold_what_lies_between() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut loosest = 0f32;
        for case in 0..20_000 {
            let level = 20.0 * random().powi(4);
            let low = [0; 3].map(|_| level * random());
            let width = if case % 2 == 0 { 1e-3 * level } else { level };
            let high = low.map(|c| c + width * random());
            let between = [0, 1, 2].map(|k| low[k] + (high[k] - low[k]) * random().round());
            let (shown, [below, above]) = (tone_map(between), tone_map_between(low, high));
            for k in 0..3 {
                assert!(
                    (below[k]..=above[k]).contains(&shown[k]),
                    "{between:?}: {shown:?} not in {below:?}..{above:?}"
                );
                if case % 2 == 0 {
                    loosest = loosest.max((above[k] - below[k]) / (1e-3 * level).max(1e-5));
                }
            }
        }
        // A bound that holds all is none: small differences stay small.
        assert!(loosest < 4.0, "{loosest}");
    }

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
