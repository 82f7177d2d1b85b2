//! Form factor of a polygon seen from a point, by the contour integral (Lambert 1760; Cohen and Wallace 1993, ch. 4):
//! F = (1/2π) Σ_k Γ_k · n, where Γ_k has the length of the angle that edge k subtends and the direction of the edge's
//! plane. The polygon is first clipped to the receiver's horizon. Exact for an unoccluded receiver; loses digits when
//! the point lies within 1e-6 of the polygon's plane and inside its outline.

mod four;

pub use four::Four;
pub(crate) use four::quads_above;

use glam::DVec3;

/// Twice the area of a planar polygon, along its normal (Newell's), m².
pub(crate) fn twice_area(corners: &[DVec3]) -> DVec3 {
    let Some(first) = corners.first() else { return DVec3::ZERO };
    corners[1..].windows(2).map(|pair| (pair[0] - *first).cross(pair[1] - *first)).sum()
}

/// The part of a polygon where `heights`, those of its corners above a plane, are not negative (Sutherland and Hodgman
/// 1974). A concave one may come back in pieces joined along the plane, where both ways cancel.
pub(crate) fn above(corners: &[DVec3], heights: &[f64]) -> Vec<DVec3> {
    let n = corners.len();
    let mut kept = Vec::with_capacity(n + 2);
    for i in 0..n {
        let j = (i + 1) % n;
        if heights[i] >= 0.0 {
            kept.push(corners[i]);
        }
        if heights[i] * heights[j] < 0.0 {
            kept.push(corners[i] + heights[i] / (heights[i] - heights[j]) * (corners[j] - corners[i]));
        }
    }
    kept
}

/// Form factor from the differential area at `point` with unit `normal` to the polygon `corners`, which emits towards
/// the side from which its corners run counter-clockwise. Zero when the point is behind it.
pub fn point_to_polygon(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let Some(first) = corners.first() else { return 0.0 };
    // Behind the emitting side, or in its plane: nothing arrives.
    if twice_area(corners).dot(*first - point) >= 0.0 { 0.0 } else { around(point, normal, corners) }
}

/// [`point_to_polygon`] for a triangle.
#[inline]
pub fn point_to_triangle(point: DVec3, normal: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    if (b - a).cross(c - a).dot(a - point) >= 0.0 { 0.0 } else { around(point, normal, &corners) }
}

/// The contour integral around the outline above the horizon; where it dips below, along the horizon to where it comes
/// up again.
#[inline]
fn around(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let Some(last) = corners.last() else { return 0.0 };
    let mut sum = 0.0;
    let (mut set, mut risen): (Option<Corner>, Option<Corner>) = (None, None);
    let mut a = Corner::new(*last - point);
    let mut height_a = a.to.dot(normal);
    for corner in corners {
        let b = Corner::new(*corner - point);
        let height_b = b.to.dot(normal);
        if height_a >= 0.0 && height_b >= 0.0 {
            sum += contour(a, b, normal);
        } else if height_a >= 0.0 || height_b >= 0.0 {
            let c = Corner::new(a.to + height_a / (height_a - height_b) * (b.to - a.to));
            if height_a >= 0.0 {
                sum += contour(a, c, normal);
                set = Some(c);
            } else {
                match set.take() {
                    Some(set) => sum += contour(set, c, normal),
                    None => risen = Some(c),
                }
                sum += contour(c, b, normal);
            }
        }
        (a, height_a) = (b, height_b);
    }
    if let (Some(set), Some(risen)) = (set, risen) {
        sum += contour(set, risen, normal);
    }
    (sum / std::f64::consts::TAU).max(0.0)
}

/// Lambert's formula for a polygon above the horizon of `point`, which it faces. Nothing is looked at that could be
/// clipped: the innermost loop of what cuts shadows.
#[inline]
pub(crate) fn point_to_polygon_above(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    let mut a = Corner::new(corners[corners.len() - 1] - point);
    for corner in corners {
        let b = Corner::new(*corner - point);
        sum += contour(a, b, normal);
        a = b;
    }
    (sum / std::f64::consts::TAU).max(0.0)
}

/// A corner relative to the receiver.
#[derive(Clone, Copy)]
struct Corner {
    to: DVec3,
    /// Of its distance.
    inverse: f64,
}

impl Corner {
    #[inline]
    fn new(to: DVec3) -> Corner {
        let length = to.length();
        Corner { to, inverse: if length > 0.0 { 1.0 / length } else { 0.0 } }
    }
}

/// Γ · n of the edge from a to b. The corners of an emitter run counter-clockwise seen from the receiver, so Γ points
/// away from the normal; hence the order b × a.
#[inline]
fn contour(a: Corner, b: Corner, normal: DVec3) -> f64 {
    let cross = b.to.cross(a.to);
    let inverse = a.inverse * b.inverse;
    let cosine = a.to.dot(b.to) * inverse;
    if cosine >= 0.0 {
        return angle_over_sine(cosine) * inverse * cross.dot(normal);
    }
    // Of an obtuse angle by its supplement; an edge through the receiver or its continuation turns nothing.
    let sine = cross.length();
    let over = std::f64::consts::PI / sine - angle_over_sine(-cosine) * inverse;
    if sine > 0.0 { over * cross.dot(normal) } else { 0.0 }
}

/// θ/sin θ by its cosine from 0 to 1. It is smooth there, and a quotient of polynomials of degree six that meets it at the
/// 13 Chebyshev nodes is off by 6·10⁻¹⁷ of it; as all coefficients are positive, rounding adds no more than 5·10⁻¹⁶.
#[inline]
fn angle_over_sine(cosine: f64) -> f64 {
    let horner = |of: &[f64; 7]| of.iter().rev().fold(0.0, |sum, c| sum * cosine + c);
    horner(&ABOVE) / horner(&BELOW)
}

/// Coefficients of the numerator, ascending.
const ABOVE: [f64; 7] = [
    std::f64::consts::FRAC_PI_2,
    3.771424387905608,
    3.257899236511664,
    1.2243394185020005,
    0.19051684381249967,
    0.009188301638923485,
    2.6897910831215643e-5,
];

/// And of the denominator.
const BELOW: [f64; 7] = [
    1.0,
    3.037583107697575,
    3.5078285369157536,
    1.9182133142852882,
    0.5027353561831069,
    0.0559996120488944,
    0.0018314859458057275,
];

/// A point of a spherical triangle, uniform by solid angle (Arvo 1995, "Stratified sampling of spherical triangles"). All of
/// it comes from products of the corners, with one arc tangent for the solid angle (Van Oosterom and Strackee 1983): the
/// three angles of the triangle are never asked for.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    a: DVec3,
    b: DVec3,
    c: DVec3,
    /// Unit, at a right angle to a and towards c.
    towards_c: DVec3,
    sin_alpha: f64,
    cos_alpha: f64,
    cos_c: f64,
    /// Solid angle, steradian.
    pub solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle `corners` as seen from `point`; `None` where it degenerates.
    pub fn new(point: DVec3, corners: [DVec3; 3]) -> Option<SphericalTriangle> {
        let [a, b, c] = corners.map(|p| (p - point).normalize_or_zero());
        let (ab, bc, ca) = (a.dot(b), b.dot(c), c.dot(a));
        // Of the sides the parts at a right angle to a; by differences, which small triangles have all their digits in.
        let (to_b, to_c) = ((b - a) - (ab - 1.0) * a, (c - a) - (ca - 1.0) * a);
        let volume = a.dot((b - a).cross(c - a)).abs();
        let (squares, squared) = (to_b.length_squared() * to_c.length_squared(), to_c.length_squared());
        if volume <= 0.0 || squares <= 0.0 {
            return None;
        }
        let lengths = squares.sqrt();
        Some(SphericalTriangle {
            a,
            b,
            c,
            towards_c: to_c / squared.sqrt(),
            sin_alpha: volume / lengths,
            cos_alpha: to_b.dot(to_c) / lengths,
            cos_c: ab,
            solid_angle: 2.0 * arc_tangent(volume, 1.0 + ab + bc + ca),
        })
    }

    /// The unit direction that (x, y) in the unit square maps to.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let SphericalTriangle { a, b, towards_c, sin_alpha, cos_alpha, cos_c, solid_angle, .. } = *self;
        // Sine and cosine of the part of the solid angle less alpha.
        let (sine, cosine) = sine_cosine(x * solid_angle);
        let (s, t) = (sine * cos_alpha - cosine * sin_alpha, cosine * cos_alpha + sine * sin_alpha);
        let u = t - cos_alpha;
        let v = s + sin_alpha * cos_c;
        let denominator = (v * s + u * t) * sin_alpha;
        let q =
            if denominator == 0.0 { 1.0 } else { (((v * t - u * s) * cos_alpha - v) / denominator).clamp(-1.0, 1.0) };
        let c = q * a + (1.0 - q * q).max(0.0).sqrt() * towards_c;
        let z = 1.0 - y * (1.0 - c.dot(b));
        z * b + (1.0 - z * z).max(0.0).sqrt() * (c - c.dot(b) * b).normalize_or_zero()
    }
}

/// Angles up to this are worked out by series that are good to 1e-15 there, others by the library.
const SMALL: f64 = 0.25;

/// The angle from 0 to π whose tangent is y/x, of y above zero.
#[inline]
fn arc_tangent(y: f64, x: f64) -> f64 {
    if y > SMALL * x {
        return y.atan2(x);
    }
    let tangent = y / x;
    let square = tangent * tangent;
    // 1/(2k + 1), of alternating sign.
    let series = (0..12).rev().fold(0.0, |sum, k| 1.0 / f64::from(2 * k + 1) - square * sum);
    tangent * series
}

/// Sine and cosine of an angle.
#[inline]
fn sine_cosine(angle: f64) -> (f64, f64) {
    if angle.abs() > SMALL {
        return angle.sin_cos();
    }
    let square = angle * angle;
    let series = |of: [f64; 6]| of.iter().rev().fold(0.0, |sum, c| c - square * sum);
    let sine = series([1.0, 1.0 / 6.0, 1.0 / 120.0, 1.0 / 5040.0, 1.0 / 362_880.0, 1.0 / 39_916_800.0]);
    let cosine = series([1.0, 0.5, 1.0 / 24.0, 1.0 / 720.0, 1.0 / 40_320.0, 1.0 / 3_628_800.0]);
    (angle * sine, cosine)
}

/// Least density of a corner relative to the highest: what lies at or below the horizon is still drawn now and then,
/// as the density between corners is only like the cosine.
const LEAST_DENSITY: f64 = 0.02;

/// A spherical triangle sampled nearly in proportion to the cosine: the unit square is first warped by the bilinear
/// density that has the cosines of the triangle's corners (Hart, Pharr, Müller, Lopes, McGuire and Shirley 2020,
/// "Practical product sampling by fitting and composing warps").
#[derive(Clone, Copy, Debug)]
pub struct CosineTriangle {
    triangle: SphericalTriangle,
    normal: DVec3,
    /// Density at the corners (0, 0), (1, 0), (0, 1), (1, 1) of the unit square, of mean 1.
    density: [f64; 4],
}

impl CosineTriangle {
    /// The triangle `corners` as seen from `point` with unit `normal`; `None` where it degenerates.
    pub fn new(point: DVec3, normal: DVec3, corners: [DVec3; 3]) -> Option<CosineTriangle> {
        let triangle = SphericalTriangle::new(point, corners)?;
        // Directions run from corner b (y = 0) to the edge from a (x = 0) to c (x = 1).
        let cosines = [triangle.b, triangle.b, triangle.a, triangle.c].map(|d| d.dot(normal).max(0.0));
        let highest = cosines.iter().copied().fold(0.0, f64::max);
        if highest <= 0.0 {
            return None;
        }
        let density = cosines.map(|c| c.max(LEAST_DENSITY * highest));
        let mean = density.iter().sum::<f64>() / 4.0;
        Some(CosineTriangle { triangle, normal, density: density.map(|d| d / mean) })
    }

    /// The unit direction that (x, y) in the unit square maps to, and cos θ/π over its density.
    pub fn direction(&self, x: f64, y: f64) -> (DVec3, f64) {
        let [d00, d10, d01, d11] = self.density;
        // The marginal density in y, then the conditional one in x: both linear.
        let y = linear(y, d00 + d10, d01 + d11);
        let (low, high) = (d00 + y * (d01 - d00), d10 + y * (d11 - d10));
        let x = linear(x, low, high);
        let direction = self.triangle.direction(x, y);
        let cosine = direction.dot(self.normal).max(0.0);
        let density = low + x * (high - low);
        (direction, cosine * self.triangle.solid_angle / (std::f64::consts::PI * density))
    }
}

/// Inverts the distribution on [0, 1] whose density runs linearly from `a` to `b`.
fn linear(x: f64, a: f64, b: f64) -> f64 {
    let root = (a * a + x * (b * b - a * a)).max(0.0).sqrt();
    (x * (a + b) / (a + root)).min(1.0)
}

/// Solid angle of a triangle whose corners are given relative to the eye, less than zero where they run counter-clockwise as
/// seen from there (Van Oosterom and Strackee 1983).
pub(crate) fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let (x, y, z) = (a.length(), b.length(), c.length());
    let below = x * y * z + a.dot(b) * z + a.dot(c) * y + b.dot(c) * x;
    2.0 * a.dot(b.cross(c)).atan2(below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_are_those_of_the_library() {
        for i in 1..=2000 {
            let x = 1e-9 + f64::from(i) / 2000.0 * 1.2 * SMALL;
            for far in [-2f64, 0.3, 1.0, 7.0] {
                let off = (arc_tangent(x * far.abs(), far) - (x * far.abs()).atan2(far)).abs();
                assert!(off < 2e-15, "{off} at {x} of {far}");
            }
            let ((sine, cosine), (s, c)) = (sine_cosine(x), x.sin_cos());
            assert!((sine - s).abs() < 2e-15 && (cosine - c).abs() < 2e-15, "{x}");
        }
    }

    /// θ/sin θ from the quotient, against that of the functions where those lose nothing.
    #[test]
    fn angles_over_their_sines_are_exact() {
        for k in 0..=1000 {
            let angle = 0.5 * std::f64::consts::PI * f64::from(k) / 1000.0;
            let exact = if k == 0 { 1.0 } else { angle / angle.sin() };
            let found = angle_over_sine(angle.cos());
            assert!((found - exact).abs() < 4.0 * f64::EPSILON * exact, "{angle}: {found} {exact}");
        }
    }

    /// Receivers on an edge, its continuation or a corner: nothing that is not a number.
    #[test]
    fn edges_through_the_receiver_turn_nothing() {
        let p = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        let corners = [p(-1., 0.), p(-1., 1.), p(1., 1.), p(1., 0.)];
        for x in [-2.0, -1.0, 0.0, 0.5, 1.0, 3.0] {
            let found = point_to_polygon(DVec3::new(x, 0.0, 0.0), DVec3::Z, &corners);
            assert!(found.is_finite(), "{x}: {found}");
        }
    }

    fn unit_square_above(height: f64) -> [[DVec3; 3]; 2] {
        // Faces down, over the first quadrant.
        let p = |x: f64, y: f64| DVec3::new(x, y, height);
        [[p(0., 0.), p(0., 1.), p(1., 1.)], [p(0., 0.), p(1., 1.), p(1., 0.)]]
    }

    /// Catalogue 16: below the corner of a parallel unit square at distance 1.
    #[test]
    fn catalogue_16_point_below_the_corner_of_a_square() {
        let f: f64 = unit_square_above(1.0).iter().map(|&t| point_to_triangle(DVec3::ZERO, DVec3::Z, t)).sum();
        assert!((f - 0.138_531_606_0).abs() < 1e-10, "{f}");
    }

    #[test]
    fn what_lies_behind_or_below_gives_nothing() {
        for triangle in unit_square_above(1.0) {
            assert_eq!(point_to_triangle(DVec3::ZERO, -DVec3::Z, triangle), 0.0);
            let [a, b, c] = triangle;
            assert_eq!(point_to_triangle(DVec3::ZERO, DVec3::Z, [a, c, b]), 0.0);
        }
    }

    /// A square standing half below the horizon gives what its upper half gives.
    #[test]
    fn the_horizon_clips() {
        let square = |low: f64, high: f64| {
            let p = |y: f64, z: f64| DVec3::new(1.0, y, z);
            [[p(-1., low), p(-1., high), p(1., high)], [p(-1., low), p(1., high), p(1., low)]]
        };
        let sum = |s: [[DVec3; 3]; 2]| s.iter().map(|&t| point_to_triangle(DVec3::ZERO, DVec3::Z, t)).sum::<f64>();
        assert!(sum(square(0.0, 2.0)) > 0.05);
        assert!((sum(square(-3.0, 2.0)) - sum(square(0.0, 2.0))).abs() < 1e-12);
    }

    /// The mean of cos θ/π over a spherical triangle is its form factor: sampling and contour agree.
    #[test]
    fn solid_angle_sampling_agrees_with_the_contour() {
        let corners = [DVec3::new(0.3, -0.4, 0.5), DVec3::new(-0.2, 1.0, 0.7), DVec3::new(0.9, 0.3, 0.6)];
        let exact = point_to_triangle(DVec3::ZERO, DVec3::Z, corners)
            + point_to_triangle(DVec3::ZERO, DVec3::Z, [corners[0], corners[2], corners[1]]);
        let triangle = SphericalTriangle::new(DVec3::ZERO, corners).unwrap();
        let (n, mut sum) = (400, 0.0);
        for i in 0..n * n {
            let d = triangle.direction(((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
            assert!((d.length() - 1.0).abs() < 1e-9);
            sum += d.z;
        }
        let sampled = sum / f64::from(n * n) * triangle.solid_angle / std::f64::consts::PI;
        assert!((sampled - exact).abs() < 1e-5 * exact, "{sampled} {exact}");

        // Drawn by the cosine, the weights have the same mean and hardly vary.
        let triangle = CosineTriangle::new(DVec3::ZERO, DVec3::Z, corners).unwrap();
        let weight = |i: i32| {
            triangle.direction((f64::from(i % n) + 0.5) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n)).1
        };
        let mean = (0..n * n).map(weight).sum::<f64>() / f64::from(n * n);
        assert!((mean - exact).abs() < 1e-5 * exact, "{mean} {exact}");
        let spread = ((0..n * n).map(|i| (weight(i) - mean).powi(2)).sum::<f64>() / f64::from(n * n)).sqrt();
        assert!(spread < 0.15 * mean, "{spread} of {mean}");
    }
}
