//! Parts: the facets of an enclosure as convex polygons, with the points that cubature over them needs.

use glam::DVec3;
use radiosity_scene::Facet;

/// Orders of the rules that are kept: points 1 to 4 along an edge.
pub const ORDERS: usize = 4;

/// Corners of a part at most, so that shafts need no memory of their own; what has more is taken as triangles.
pub const CORNERS: usize = 12;

/// A convex polygon of a facet.
#[derive(Clone, Debug)]
pub struct Part {
    /// The facet that it belongs to.
    pub facet: u32,
    /// The polygon.
    pub shape: Facet,
    /// Radius about the centroid.
    pub radius: f64,
    /// Points and weights (m²) of each order.
    rules: [Vec<[f64; 4]>; ORDERS],
}

impl Part {
    /// The convex parts of facet `index`.
    pub fn of(index: u32, facet: &Facet) -> Vec<Part> {
        let part = |shape: Facet| Part { facet: index, radius: shape.radius(), rules: rules(&shape), shape };
        if facet.is_convex() && facet.corners().len() <= CORNERS {
            return vec![part(facet.clone())];
        }
        facet.triangles().into_iter().filter_map(|t| Facet::new(t.to_vec()).ok()).map(part).collect()
    }

    /// Points (x, y, z, weight) of the rule of an order (1 to [`ORDERS`]).
    #[inline]
    pub fn rule(&self, order: usize) -> &[[f64; 4]] {
        &self.rules[order - 1]
    }
}

/// Nodes of Gauss and Legendre on [−1, 1] with weights that sum to two.
const GAUSS: [&[[f64; 2]]; ORDERS] = [
    &[[0.0, 2.0]],
    &[[-0.577_350_269_189_625_8, 1.0], [0.577_350_269_189_625_8, 1.0]],
    &[[-0.774_596_669_241_483_4, 5.0 / 9.0], [0.0, 8.0 / 9.0], [0.774_596_669_241_483_4, 5.0 / 9.0]],
    &[
        [-0.861_136_311_594_052_6, 0.347_854_845_137_453_85],
        [-0.339_981_043_584_856_26, 0.652_145_154_862_546_1],
        [0.339_981_043_584_856_26, 0.652_145_154_862_546_1],
        [0.861_136_311_594_052_6, 0.347_854_845_137_453_85],
    ],
];

/// A symmetric rule on triangles.
struct Triangle {
    /// Weight of the centroid.
    centre: f64,
    /// Barycentric a and weight of the three points (a, a, 1 − 2a).
    threes: &'static [[f64; 2]],
    /// Barycentric a, b and weight of the six points (a, b, 1 − a − b).
    sixes: &'static [[f64; 3]],
}

/// Degrees 1, 4, 5 and 8 (Dunavant 1985): no less than Gauss's on squares.
const DUNAVANT: [Triangle; ORDERS] = [
    Triangle { centre: 1.0, threes: &[], sixes: &[] },
    Triangle {
        centre: 0.0,
        threes: &[[0.445_948_490_915_965, 0.223_381_589_678_011], [0.091_576_213_509_771, 0.109_951_743_655_322]],
        sixes: &[],
    },
    Triangle {
        centre: 0.225,
        threes: &[[0.470_142_064_105_115, 0.132_394_152_788_506], [0.101_286_507_323_456, 0.125_939_180_544_827]],
        sixes: &[],
    },
    Triangle {
        centre: 0.144_315_607_677_787,
        threes: &[
            [0.459_292_588_292_723, 0.095_091_634_267_285],
            [0.170_569_307_751_760, 0.103_217_370_534_718],
            [0.050_547_228_317_031, 0.032_458_497_623_198],
        ],
        sixes: &[[0.263_112_829_634_638, 0.008_394_777_409_958, 0.027_230_314_174_435]],
    },
];

fn rules(shape: &Facet) -> [Vec<[f64; 4]>; ORDERS] {
    let with_weight = |p: DVec3, w: f64| [p.x, p.y, p.z, w];
    std::array::from_fn(|order| {
        if let Some([origin, u, v]) = parallelogram(shape) {
            let gauss = GAUSS[order];
            let point = |[x, wx]: [f64; 2], [y, wy]: [f64; 2]| {
                with_weight(origin + 0.5 * (1.0 + x) * u + 0.5 * (1.0 + y) * v, 0.25 * wx * wy * shape.area())
            };
            return gauss.iter().flat_map(|x| gauss.iter().map(|y| point(*x, *y))).collect();
        }
        if order == 0 {
            return vec![with_weight(shape.centroid(), shape.area())];
        }
        let Triangle { centre, threes, sixes } = DUNAVANT[order];
        let mut rule = Vec::new();
        for [a, b, c] in shape.triangles() {
            let area = 0.5 * (b - a).cross(c - a).length();
            let turns = [[a, b, c], [b, c, a], [c, a, b]];
            for [s, weight] in threes {
                rule.extend(turns.map(|[p, q, r]| with_weight(*s * (p + q) + (1.0 - 2.0 * s) * r, weight * area)));
            }
            for [s, t, weight] in sixes {
                let point = |[p, q, r]: [DVec3; 3]| *s * p + *t * q + (1.0 - s - t) * r;
                rule.extend(turns.map(|turn| with_weight(point(turn), weight * area)));
                rule.extend(turns.map(|[p, q, r]| with_weight(point([q, p, r]), weight * area)));
            }
            if centre > 0.0 {
                rule.push(with_weight((a + b + c) / 3.0, centre * area));
            }
        }
        rule
    })
}

/// Corner and edges of a parallelogram; `None` for other polygons.
pub fn parallelogram(shape: &Facet) -> Option<[DVec3; 3]> {
    let [a, b, c, d] = *shape.corners() else { return None };
    let off = (a + c - b - d).length();
    (off <= 1e-12 * (c - a).length()).then_some([a, b - a, d - a])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rules are exact for polynomials of their degree: 1, 3, 5 and 7.
    #[test]
    fn rules_integrate_their_degree() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 1.0);
        let triangle = Facet::new(vec![p(0., 0.), p(1., 0.), p(0., 1.)]).unwrap();
        let square = Facet::new(vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)]).unwrap();
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        for (order, degree) in [(1, 1), (2, 3), (3, 5), (4, 7)] {
            for a in 0..=degree {
                let b = degree - a;
                let sum = |shape: &Facet| -> f64 {
                    let parts = Part::of(0, shape);
                    parts[0].rule(order).iter().map(|[x, y, _, w]| w * x.powi(a as i32) * y.powi(b as i32)).sum()
                };
                let exact = factorial(a) * factorial(b) / factorial(a + b + 2);
                assert!((sum(&triangle) - exact).abs() < 1e-13, "order {order}, x^{a} y^{b}");
                let exact = 1.0 / f64::from((a + 1) * (b + 1));
                assert!((sum(&square) - exact).abs() < 1e-13, "order {order}, x^{a} y^{b}");
            }
        }
    }
}
