//! Illuminance of many points in a few figures, as lighting is planned by.

use serde::Serialize;

/// Illuminance of points, lx; all zero where there are none.
///
/// ```
/// let levels = radiosity::Levels::of([100.0, 300.0]);
/// assert_eq!((levels.mean, levels.least, levels.largest, levels.uniformity), (200.0, 100.0, 300.0, 0.5));
/// assert_eq!(radiosity::Levels::of([]), radiosity::Levels::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Levels {
    /// Mean.
    pub mean: f64,
    /// Least.
    pub least: f64,
    /// Largest.
    pub largest: f64,
    /// Least over mean; zero in the dark.
    pub uniformity: f64,
}

impl Levels {
    /// Of points with these illuminances.
    pub fn of(lux: impl IntoIterator<Item = f32>) -> Levels {
        let (mut count, mut sum, mut least, mut largest) = (0.0, 0.0, f64::INFINITY, 0.0f64);
        for e in lux.into_iter().map(f64::from) {
            (count, sum, least, largest) = (count + 1.0, sum + e, least.min(e), largest.max(e));
        }
        if count == 0.0 {
            return Levels::default();
        }
        let mean = sum / count;
        Levels { mean, least, largest, uniformity: if mean > 0.0 { least / mean } else { 0.0 } }
    }
}

impl std::fmt::Display for Levels {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Levels { mean, least, largest, uniformity } = self;
        write!(
            f,
            "mean {mean:.4} lx, least {least:.4}, largest {largest:.4}, uniformity {uniformity:.3} (least over mean)"
        )
    }
}
