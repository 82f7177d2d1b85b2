//! From the centroid of one facet to the whole of the other: F ≈ (1/2π) Σ_k Γ_k · n (Lambert 1760; catalogue 16), the
//! inner integral of the form factor in closed form, the outer one by one point. As the hemicube does, it fails in
//! proximity: 20 % for opposite faces of a cube. The error is a bound where the facets are apart, and an estimate from
//! what the corners of `from` see where they are not. Where something may stand between, the closed form is multiplied
//! by the share of `to` that shadows leave visible from the centroid, cut exactly where polygons are all that stands
//! there and else found by segments.

use super::area::Places;
use super::shadow::seen;
use super::sight::obstructed;
use super::smooth::{gap, is_cut, kernel, largest, spread, variation};
use super::{Factor, Occlusion, Pair};
use crate::polygon::point_to_polygon;
use glam::DVec3;
use radiosity_scene::Facet;
use radiosity_trace::sampling::Sequence;

/// Segments that find the visible share: a tenth of a percent of a half-visible facet, far less than the outer
/// integral's error.
const SEGMENTS: u32 = 256;

/// How far towards a corner the estimate looks from: short of it, for a corner may lie on the other facet.
const TOWARDS: f64 = 1.0 - 1e-6;

/// Points within `from` that the estimate looks from beside the corners and the middles of edges, and what the largest
/// deviation found is multiplied by: the mean that is asked for deviates less, but the largest may lie between. With
/// half as many points, a few in a thousand nearly touching pairs are off by more.
const LOOKS: u32 = 16;
const SAFETY: f64 = 2.0;

/// Form factor from the differential area at `point` with unit `normal` to a facet with nothing between: the polygon
/// above the horizon.
pub fn lambert(point: DVec3, normal: DVec3, to: &Facet) -> f64 {
    point_to_polygon(point, normal, to.corners())
}

/// Differential area to polygon, from the centroid.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lambert;

impl Pair for Lambert {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        from_centroid(from, to, occlusion, |point| lambert(point, from.normal(), to))
    }
}

/// The factor from the centroid of `from`, by a formula for points that sees nothing between.
pub(super) fn from_centroid(
    from: &Facet,
    to: &Facet,
    occlusion: &dyn Occlusion,
    formula: impl Fn(DVec3) -> f64,
) -> Factor {
    let value = formula(from.centroid());
    let mut error = variation(from, to, spread(from)).min(value.max(largest(from, to) - value));
    // Where `to` is not small beside `from` and no plane cuts, the view changes little between a few points: no peak is
    // missed.
    if !is_cut(from, to) && to.radius() + gap(from, to) > from.radius() {
        let (places, sequence) = (Places::new(from), Sequence::new(0, 0));
        let within = (0..LOOKS).map(|i| sequence.point(i).map(f64::from)).map(|[x, y, ..]| places.at(x, y));
        let looks = from.edges().flat_map(|[a, b]| [a, 0.5 * (a + b)]).chain(within);
        let off = |p: DVec3| (formula(from.centroid().lerp(p, TOWARDS)) - value).abs();
        error = error.min(SAFETY * looks.map(off).fold(0.0, f64::max));
    }
    // What Lambert's formula loses to rounding.
    let free = Factor { value, error: error + 8.0 * f64::EPSILON };
    if !occlusion.may_block(from, to) {
        return free;
    }
    obstructed(free, visible_share(from, to, occlusion), from, to, occlusion)
}

/// The share of what the centroid of `from` would see of `to` that it sees.
fn visible_share(from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> f64 {
    let (point, normal) = (from.centroid(), from.normal());
    if let Some(blockers) = occlusion.polygons(from, to) {
        let parts: Vec<Vec<DVec3>> = to.triangles().into_iter().map(Vec::from).collect();
        let whole = seen(point, normal, &parts, &[]);
        return if whole > 0.0 { seen(point, normal, &parts, &blockers) / whole } else { 0.0 };
    }
    let (places, sequence) = (Places::new(to), Sequence::new(0, 0));
    let (mut visible, mut all) = (0.0, 0.0);
    for i in 0..SEGMENTS {
        let [x, y, ..] = sequence.point(i).map(f64::from);
        let q = places.at(x, y);
        let weight = kernel(point, normal, q, to.normal());
        all += weight;
        if weight > 0.0 && occlusion.is_clear(point, q) {
            visible += weight;
        }
    }
    if all > 0.0 { visible / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::Unoccluded;
    use crate::pair::exact::exact;
    use crate::pair::polygons::{moved, rectangle};
    use glam::DQuat;
    use radiosity_trace::sampling::Random;

    #[test]
    fn catalogue_16_below_the_corner_of_a_square() {
        let square = moved(&rectangle(1.0, 1.0).flipped(), DQuat::IDENTITY, DVec3::Z);
        let value = lambert(DVec3::ZERO, DVec3::Z, &square);
        assert!((value - 0.138_531_605_994_893).abs() < 1e-15, "{value}");
        // A concave one is the sum of its triangles, above and across the horizon.
        let outline = [[-1., -1.], [2., -1.], [0.2, 0.3], [1.5, 2.], [-1., 1.]];
        let concave = Facet::new(outline.iter().map(|[y, z]| DVec3::new(2.0, -*y, *z)).collect()).unwrap();
        assert!(!concave.is_convex());
        for normal in [DVec3::X, DVec3::Z, -DVec3::Z, DVec3::new(0.1, 0.9, 0.3).normalize()] {
            let parts: f64 = concave.triangles().iter().map(|t| point_to_polygon(DVec3::ZERO, normal, t)).sum();
            let whole = lambert(DVec3::ZERO, normal, &concave);
            assert!((whole - parts).abs() < 1e-15 && whole > 0.0, "{whole} {parts}");
        }
    }

    /// What the infinitely fine hemicube at the centre of a cube's face is off by (catalogue 24).
    #[test]
    fn catalogue_24_proximity_shows_in_the_error() {
        let floor = rectangle(1.0, 1.0);
        let opposite = moved(&floor.flipped(), DQuat::IDENTITY, DVec3::Z);
        let factor = Lambert.factor(&floor, &opposite, &Unoccluded);
        assert!((factor.value - 0.239_456).abs() < 1e-6, "{factor:?}");
        assert!(factor.error > factor.value - exact(&floor, &opposite));
        let adjacent = moved(&floor, DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2), DVec3::Z);
        let factor = Lambert.factor(&floor, &adjacent, &Unoccluded);
        assert!((factor.value - 0.190_136).abs() < 1e-6, "{factor:?}");
        assert!(factor.error > exact(&floor, &adjacent) - factor.value);
    }

    #[test]
    fn the_error_covers_facets_of_any_size_and_turn() {
        let mut random = Random::new(2);
        let mut next = || random.next_unit();
        for k in 0..4000 {
            let from = rectangle(0.2 + 2.0 * next(), 0.2 + 2.0 * next());
            let axis = DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize();
            let distance = 10f64.powf(2.0 * next() - 1.0);
            let shift = distance * DVec3::new(next() - 0.5, next() - 0.5, next());
            let size = 0.05 + 2.0 * next();
            let to = moved(
                &rectangle(size, 0.05 + 2.0 * next()).flipped(),
                DQuat::from_axis_angle(axis, 6.3 * next()),
                shift,
            );
            let truth = exact(&from, &to) / from.area();
            let factor = Lambert.factor(&from, &to, &Unoccluded);
            assert!((factor.value - truth).abs() <= factor.error, "{truth} {factor:?} {k}");
        }
    }
}
