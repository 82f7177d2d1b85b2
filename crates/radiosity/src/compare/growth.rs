//! How time and memory grow with the mesh: the same contender on meshes from a quarter of the elements to twice as many,
//! and the exponents of a line through them, both axes logarithmic (catalogue 44).

use super::attempt::{Attempt, attempt};
use super::contender::{Contender, Setting};
use super::problem::Problem;
use crate::{Error, Monitor};
use serde::Serialize;

/// A contender on a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Size {
    /// Elements.
    pub elements: usize,
    /// Wall-clock seconds for all factors.
    pub seconds: f64,
    /// Bytes kept.
    pub bytes: usize,
}

/// A contender over meshes.
#[derive(Clone, Debug, Serialize)]
pub struct Growth {
    /// Its name.
    pub method: &'static str,
    /// Its setting in words.
    pub label: String,
    /// The meshes, ascending.
    pub sizes: Vec<Size>,
    /// p of seconds ∝ N^p; none of fewer than two meshes.
    pub time_exponent: Option<f64>,
    /// p of bytes ∝ N^p.
    pub memory_exponent: Option<f64>,
}

impl Growth {
    /// Fits lines through sizes.
    pub fn new(method: &'static str, label: String, mut sizes: Vec<Size>) -> Growth {
        sizes.sort_by_key(|size| size.elements);
        let fit = |value: &dyn Fn(&Size) -> f64| {
            exponent(&sizes.iter().map(|s| [s.elements as f64, value(s)]).collect::<Vec<_>>())
        };
        let (time_exponent, memory_exponent) = (fit(&|s| s.seconds), fit(&|s| s.bytes as f64));
        Growth { method, label, sizes, time_exponent, memory_exponent }
    }
}

/// Slope of the least-squares line through the logarithms of points (x, y); none where there are not two of them.
pub(super) fn exponent(points: &[[f64; 2]]) -> Option<f64> {
    let logs: Vec<[f64; 2]> = points.iter().filter(|p| p[0] > 0.0 && p[1] > 0.0).map(|p| p.map(f64::ln)).collect();
    let n = logs.len() as f64;
    let mean = [0, 1].map(|k| logs.iter().map(|p| p[k]).sum::<f64>() / n.max(1.0));
    let across: f64 = logs.iter().map(|p| (p[0] - mean[0]).powi(2)).sum();
    let along: f64 = logs.iter().map(|p| (p[0] - mean[0]) * (p[1] - mean[1])).sum();
    (across > 0.0).then(|| along / across)
}

/// A contender on a mesh, if it takes no more than `seconds`.
///
/// # Errors
/// [`Error::Stopped`].
pub(super) fn size(
    contender: Contender,
    setting: Setting,
    problem: &Problem,
    seconds: f64,
    monitor: &dyn Monitor,
) -> Result<Option<Size>, Error> {
    Ok(match attempt(contender, setting, problem, seconds, monitor)? {
        Attempt::Done(made) => Some(Size { elements: problem.len(), seconds: made.seconds, bytes: made.bytes }),
        Attempt::TooSlow(_) => None,
    })
}

#[cfg(test)]
mod tests {
    use super::exponent;

    #[test]
    fn powers_are_found_again() {
        let points = [250.0, 500.0, 1000.0].map(|n: f64| [n, 3e-7 * n.powf(1.7)]);
        assert!((exponent(&points).unwrap() - 1.7).abs() < 1e-12);
        assert_eq!(exponent(&points[..1]), None);
        assert_eq!(exponent(&[]), None);
    }
}
