//! A_i F_ij of two planar polygons that see each other unhindered, exact to rounding.
//!
//! Stokes' theorem, applied twice, turns the double integral over the areas into one over the outlines,
//! 2π A_i F_ij = ∮∮ ln r dr_i·dr_j (Sparrow 1963; Schröder and Hanrahan 1993, "On the form factor between two polygons",
//! SIGGRAPH '93), a sum over pairs of edges of cos θ ∫∫ ln r, each in closed form. Polygons may be concave, touch in a
//! corner or share an edge. What reaches behind the other's plane is cut off first. The sum cancels for small and
//! distant polygons: those are integrated over their areas. What stands between is not looked at.

use super::edges::{Edge, log_integral};
use super::gauss::gauss;
use super::{Factor, Occlusion, Pair};
use crate::polygon;
use glam::DVec3;
use radiosity_scene::Facet;
use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

/// Heights that count as none, in roundings of the coordinates that they come from: a few operations each.
const TOUCH: f64 = 16.0 * f64::EPSILON;

/// Sum of the radii over the distance below which the kernel is integrated over both areas, by rules of four points in
/// each direction, good to (1/80)⁸; the contour loses the square of the distance there, some four digits.
const FAR: f64 = 1.0 / 40.0;

/// Relative error of the contour's sum above which another way is tried.
const ROUNDED: f64 = 1e-12;

/// Distance of the smaller polygon from the other's edges, in its radii, from which on Lambert's formula may be
/// integrated over its area, with six points in each direction: good to 12⁻¹².
const SMALL: f64 = 6.0;

/// A_i F_ij = A_j F_ji, m², of two facets with nothing between them. The same bits whichever comes first.
pub fn exact(from: &Facet, to: &Facet) -> f64 {
    exact_within(from, to, 0.0)[0]
}

/// The closed form as a method. It knows of no occlusion: where something stands between the facets, the value is that
/// without it, and as the obstructed one may be anything below, the error is as large as the value.
#[derive(Clone, Copy, Debug, Default)]
pub struct Exact;

impl Pair for Exact {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        let [value, error] = exact_within(from, to, 0.0).map(|x| x / from.area());
        Factor { value, error: if occlusion.may_block(from, to) { value + error } else { error } }
    }
}

/// A_i F_ij and a bound of what rounding does to it: to the sums, and to the coordinates, which are off by as much as
/// corners may be that count as touching. What the contour loses is let pass within a tolerance, m².
pub(crate) fn exact_within(from: &Facet, to: &Facet, tolerance: f64) -> [f64; 2] {
    let (first, second) = if order(from, to) == Ordering::Greater { (to, from) } else { (from, to) };
    let Some([a, b]) = facing(first, second) else { return [0.0; 2] };
    let (a, b) = (Outline::new(a, first.normal()), Outline::new(b, second.normal()));
    let [value, error] = integral(&a, &b, tolerance);
    [value.max(0.0), error + touch(first, second) * a.radius.min(b.radius)]
}

/// The integral by the way that loses fewest digits, or the contour within a tolerance, and a bound of its rounding.
fn integral(a: &Outline, b: &Outline, tolerance: f64) -> [f64; 2] {
    let distance = a.centre.distance(b.centre);
    if a.radius + b.radius < FAR * distance {
        let value = over_both_areas(a, b);
        return [value, 1e-13 * value.abs()];
    }
    let [value, error] = contour(a, b, distance.max(a.radius + b.radius));
    if error > tolerance.max(ROUNDED * value) {
        let (small, large) = if a.radius < b.radius { (a, b) } else { (b, a) };
        if small.radius * SMALL < large.distance_of_edges(small.centre) {
            let value = over_smaller_area(small, large);
            return [value, 1e-12 * value];
        }
    }
    [value, error]
}

/// Any order of facets that does not depend on which is asked for first.
fn order(a: &Facet, b: &Facet) -> Ordering {
    let key = |f: &Facet| [f.area(), f.normal().x, f.normal().y, f.normal().z];
    let numbers = |f: &Facet| f.corners().iter().flat_map(|c| c.to_array()).collect::<Vec<_>>();
    let by = |x: &[f64], y: &[f64]| {
        x.iter().zip(y).map(|(x, y)| x.total_cmp(y)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
    };
    by(&key(a), &key(b)).then_with(|| by(&numbers(a), &numbers(b)))
}

/// The corners of what each facet has before the other's plane, relative to the first facet's first corner; `None`
/// where one lies behind the other.
pub(super) fn facing(a: &Facet, b: &Facet) -> Option<[Vec<DVec3>; 2]> {
    let origin = a.corners()[0];
    let relative = |f: &Facet| f.corners().iter().map(|c| *c - origin).collect::<Vec<_>>();
    let touch = touch(a, b);
    let (of_a, of_b) = (relative(a), relative(b));
    let clipped_a = before(&of_a, of_b[0], b.normal(), touch)?;
    let clipped_b = before(&of_b, of_a[0], a.normal(), touch)?;
    Some([clipped_a, clipped_b])
}

/// The height below which a corner of one facet is in the plane of the other.
pub(super) fn touch(a: &Facet, b: &Facet) -> f64 {
    let size = |f: &Facet| f.corners().iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
    TOUCH * size(a).max(size(b))
}

/// The part of a polygon before a plane; corners less than `touch` from the plane are in it. As [`polygon::above`].
pub(super) fn before(corners: &[DVec3], point: DVec3, normal: DVec3, touch: f64) -> Option<Vec<DVec3>> {
    let heights = corners.iter().map(|c| {
        let height = (*c - point).dot(normal);
        if height.abs() <= touch { 0.0 } else { height }
    });
    let heights: Vec<f64> = heights.collect();
    if heights.iter().all(|h| *h <= 0.0) {
        return None;
    }
    if heights.iter().all(|h| *h >= 0.0) {
        return Some(corners.to_vec());
    }
    Some(polygon::above(corners, &heights))
}

/// A polygon with what the methods ask of it.
struct Outline {
    corners: Vec<DVec3>,
    normal: DVec3,
    centre: DVec3,
    radius: f64,
}

impl Outline {
    fn new(corners: Vec<DVec3>, normal: DVec3) -> Outline {
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = corners.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
        Outline { corners, normal, centre, radius }
    }

    fn edges(&self, scale: f64) -> Vec<Edge> {
        let n = self.corners.len();
        (0..n).filter_map(|i| Edge::new(self.corners[i] * scale, self.corners[(i + 1) % n] * scale)).collect()
    }

    fn distance_of_edges(&self, point: DVec3) -> f64 {
        self.edges(1.0).iter().map(|edge| edge.distance(point)).fold(f64::INFINITY, f64::min)
    }

    /// Points and their signed areas: Gauss points of the bilinear quadrilaterals of the fan about the first corner.
    fn points(&self, n: usize) -> Vec<(DVec3, f64)> {
        let c = &self.corners;
        let mut points = Vec::with_capacity(n * n * c.len() / 2);
        for i in (1..c.len() - 1).step_by(2) {
            let [p, q, r, s] = [c[0], c[i], c[i + 1], *c.get(i + 2).unwrap_or(&c[0])];
            for [u, weight_u] in gauss(n) {
                for [v, weight_v] in gauss(n) {
                    let along_u = (1.0 - v) * (q - p) + v * (r - s);
                    let along_v = (1.0 - u) * (s - p) + u * (r - q);
                    let point = p + u * (q - p) + v * (s - p) + u * v * (r - q - s + p);
                    points.push((point, weight_u * weight_v * along_u.cross(along_v).dot(self.normal)));
                }
            }
        }
        points
    }
}

/// The double integral over the outlines, and a bound of its rounding.
fn contour(a: &Outline, b: &Outline, size: f64) -> [f64; 2] {
    // In units of about the distance logarithms are small; a power of two rounds nothing.
    let unit = size.log2().round().exp2();
    let (of_a, of_b) = (a.edges(1.0 / unit), b.edges(1.0 / unit));
    let (mut sum, mut absolute) = (0.0, 0.0);
    for e in &of_a {
        for f in &of_b {
            let cosine = e.direction().dot(f.direction());
            if cosine.abs() > 2.0 * f64::EPSILON {
                let term = cosine * log_integral(e, f);
                sum += term;
                absolute += term.abs() + cosine.abs() * e.length() * f.length();
            }
        }
    }
    // ln r = ½ ln r².
    [sum, 8.0 * f64::EPSILON * absolute].map(|x| 0.5 * x / TAU * unit * unit)
}

/// The double integral over the areas, for polygons far apart.
fn over_both_areas(a: &Outline, b: &Outline) -> f64 {
    let n = 4;
    let (of_a, of_b) = (a.points(n), b.points(n));
    let mut sum = 0.0;
    for (p, area_p) in &of_a {
        let mut inner = 0.0;
        for (q, area_q) in &of_b {
            let r = *q - *p;
            let squared = r.length_squared();
            inner += area_q * r.dot(a.normal) * -r.dot(b.normal) / (squared * squared);
        }
        sum += area_p * inner;
    }
    sum / PI
}

/// Lambert's formula for the larger polygon, integrated over the smaller.
fn over_smaller_area(small: &Outline, large: &Outline) -> f64 {
    let lambert = |point| polygon::point_to_polygon(point, small.normal, &large.corners);
    small.points(6).into_iter().map(|(point, area)| area * lambert(point)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::Unoccluded;
    use crate::pair::polygons::{facet, moved};
    use glam::DQuat;
    use radiosity_trace::sampling::Random;

    /// The rectangle on the floor over x and y.
    fn floor(x: [f64; 2], y: [f64; 2]) -> Facet {
        facet(&[[x[0], y[0], 0.], [x[1], y[0], 0.], [x[1], y[1], 0.], [x[0], y[1], 0.]])
    }

    /// The rectangle on the wall x = 0 over y and z, active towards +x.
    fn wall(y: [f64; 2], z: [f64; 2]) -> Facet {
        facet(&[[0., y[0], z[0]], [0., y[1], z[0]], [0., y[1], z[1]], [0., y[0], z[1]]])
    }

    fn ceiling(height: f64) -> Facet {
        facet(&[[0., 0., height], [0., 1., height], [1., 1., height], [1., 0., height]])
    }

    const UNIT: [f64; 2] = [0.0, 1.0];
    const OPPOSITE: f64 = 0.199_824_895_698_387_4;
    const ADJACENT: f64 = 0.200_043_776_075_403_15;

    /// Catalogue 20 and 21: the unit cube, also turned, far from the origin, and large.
    #[test]
    fn catalogue_20_the_unit_cube_wherever_it_stands() {
        for (turn, shift, tolerance) in [
            (DQuat::IDENTITY, DVec3::ZERO, 1e-15),
            (DQuat::from_axis_angle(DVec3::new(1., 2., -0.3).normalize(), 0.7), DVec3::ZERO, 1e-14),
            (DQuat::from_axis_angle(DVec3::new(-1., 0.2, 3.).normalize(), 2.1), DVec3::new(1e3, -2e3, 500.), 1e-10),
        ] {
            let [a, b, c] = [floor(UNIT, UNIT), ceiling(1.0), wall(UNIT, UNIT)].map(|f| moved(&f, turn, shift));
            assert!((exact(&a, &b) - OPPOSITE).abs() < tolerance, "{}", exact(&a, &b));
            assert!((exact(&a, &c) - ADJACENT).abs() < tolerance, "{}", exact(&a, &c));
            assert_eq!(exact(&a, &a), 0.0);
        }
    }

    /// Catalogue 0a and 20: F_ij/F_ji = A_j/A_i to the last bits, and the small one sees more of the large one.
    #[test]
    fn catalogue_0a_unequal_areas_tell_the_indices_apart() {
        let (large, small) = (floor([-5., 5.], [-5., 5.]), ceiling(1.0));
        let up = Exact.factor(&large, &small, &Unoccluded);
        let down = Exact.factor(&small, &large, &Unoccluded);
        assert!((down.value / up.value - 100.0).abs() < 1e-12, "{} {}", up.value, down.value);
        assert!(down.value > 0.9 && up.value < 0.01);
    }

    /// Catalogue 22: parts add up, wherever their common corners touch the other facet's edge, however slim they are,
    /// and at whatever angle.
    #[test]
    fn catalogue_22_parts_add_up() {
        for angle in [0.0, 0.3, -0.8, 1.2, -1.5] {
            let wall = moved(&wall(UNIT, UNIT), DQuat::from_rotation_y(angle), DVec3::ZERO);
            let whole = exact(&floor(UNIT, UNIT), &wall);
            for cut in [0.5, 0.1, 1e-3, 1e-6, 1e-9] {
                let off = |[a, b]: [Facet; 2]| (exact(&a, &wall) + exact(&b, &wall) - whole).abs();
                let across = off([floor([0., cut], UNIT), floor([cut, 1.], UNIT)]);
                let along = off([floor(UNIT, [0., cut]), floor(UNIT, [cut, 1.])]);
                assert!(across.max(along) < 1e-13, "{angle} {cut}: {across:e} {along:e}");
            }
        }
    }

    /// Triangles of a polygon, skew to another, add up; so do pieces cut off by the other's plane.
    #[test]
    fn catalogue_22_skew_triangles_add_up() {
        let mut random = Random::new(3);
        let mut next = |scale: f64| scale * (2.0 * random.next_unit() - 1.0);
        let mut worst: f64 = 0.0;
        for k in 0..2000 {
            let size = 10f64.powf(next(1.0));
            let shift = DVec3::new(next(1.0), next(1.0), next(0.8));
            let turn = DQuat::from_axis_angle(DVec3::new(next(1.), next(1.), next(1.)).normalize(), next(3.0));
            let [p, q] = [next(0.5), next(0.5)];
            let outline = [[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [p, q, 0.], [-1., 1., 0.]];
            let outline = outline.map(|c| c.map(|x| x * size));
            let first = moved(&facet(&outline), turn, shift);
            // Every second pair shares a corner.
            let shift = if k % 2 == 0 { first.corners()[1] } else { DVec3::ZERO };
            let second = moved(&floor(UNIT, UNIT), DQuat::IDENTITY, shift);
            let [whole, error] = exact_within(&first, &second, 0.0);
            let of_part = |corners: [DVec3; 3]| exact_within(&Facet::new(corners.to_vec()).unwrap(), &second, 0.0);
            let parts: Vec<[f64; 2]> = first.triangles().into_iter().map(of_part).collect();
            let sum = |k: usize| parts.iter().map(|part| part[k]).sum::<f64>();
            let (off, scale) = ((whole - sum(0)).abs(), first.area().min(1.0));
            assert!(whole <= scale * (1.0 + 1e-12));
            // Rounding makes no more than the errors say.
            assert!(off <= error + sum(1), "{off:e} {error:e} {first:?} {second:?}");
            worst = worst.max(off / scale);
        }
        assert!(worst < 1e-12, "{worst:e}");
    }

    /// Rows of tetrahedra and of slabs of any flatness sum to one: every edge is shared, at every angle.
    #[test]
    fn rows_of_flat_and_slender_solids_sum_to_one() {
        let mut random = Random::new(8);
        let mut next = || 2.0 * random.next_unit() - 1.0;
        for k in 0..300 {
            let flat = 10f64.powi(-(k % 10));
            let mut point = |z: f64| DVec3::new(next(), next(), z * flat);
            let [a, b, c] = [point(0.0), point(0.0), point(0.0)];
            let solid: Vec<Vec<DVec3>> = if k % 2 == 0 {
                let top = point(1.0);
                vec![vec![a, b, c], vec![a, top, b], vec![b, top, c], vec![c, top, a]]
            } else {
                let up = point(1.0) * 0.3;
                let up = DVec3::new(up.x * flat, up.y * flat, flat);
                let [p, q, r] = [a, b, c].map(|x| x + up);
                vec![vec![a, b, c], vec![r, q, p], vec![a, p, q, b], vec![b, q, r, c], vec![c, r, p, a]]
            };
            let inside = solid.iter().flatten().sum::<DVec3>() / solid.iter().flatten().count() as f64;
            let face = |corners: &Vec<DVec3>| {
                let face = Facet::new(corners.clone()).unwrap();
                if face.height(inside) < 0.0 { face.flipped() } else { face }
            };
            let faces: Vec<Facet> = solid.iter().map(face).collect();
            for from in &faces {
                let row = faces.iter().map(|to| exact_within(from, to, 0.0));
                let [sum, error] = row.fold([0.0; 2], |sum, [value, error]| [sum[0] + value, sum[1] + error]);
                let off = (sum / from.area() - 1.0).abs();
                // The narrow sides are as wide as the coordinates say, to their rounding.
                assert!(off <= 1e-13 + 1e-15 / flat && off <= 1e-13 + error / from.area(), "{off:e} at {flat:e}");
            }
        }
    }

    /// Near or far, small or large: the ways of integration agree where one takes over from the other, and distant
    /// factors keep twelve digits of the inverse square with its first correction.
    #[test]
    fn small_and_distant_facets_keep_their_digits() {
        for distance in [10.0, 40.0, 56.0, 57.0, 60.0, 100.0, 1e3, 1e4] {
            let (a, b) = (floor(UNIT, UNIT), ceiling(distance));
            let (x, squared) = (1.0 / distance, 1.0 / (distance * distance));
            // The catalogue's closed form cancels; by its series in x².
            let series = squared / PI
                * (1.0
                    - squared
                        * (2.0 / 3.0 - squared * (17.0 / 30.0 - squared * (0.552_380_952 - squared * 0.593_650_794))));
            let value = exact(&a, &b);
            assert!((value / series - 1.0).abs() < 1e-11 + x.powi(10), "{distance}: {value} {series}");
        }
        for size in [1e-1, 1e-2, 1e-3, 1e-4, 1e-6] {
            // A small square in the corner of the floor, against the wall's part of a cone about it: Lambert's value.
            let small = floor([0.5, 0.5 + size], [0.5, 0.5 + size]);
            let middle = DVec3::new(0.5 + 0.5 * size, 0.5 + 0.5 * size, 0.0);
            let [p, q, r, s] = [0, 1, 2, 3].map(|k| wall(UNIT, UNIT).corners()[k]);
            let lambert = polygon::point_to_triangle(middle, DVec3::Z, [p, q, r])
                + polygon::point_to_triangle(middle, DVec3::Z, [p, r, s]);
            let value = exact(&small, &wall(UNIT, UNIT)) / small.area();
            assert!((value / lambert - 1.0).abs() < 1e-10 + size * size, "{size}: {value} {lambert}");
        }
    }

    #[test]
    fn what_lies_behind_is_cut_off() {
        // A wall that goes as far below the floor as above sees what its upper half sees.
        let through = exact(&floor(UNIT, UNIT), &wall(UNIT, [-1., 1.]));
        assert!((through - ADJACENT).abs() < 1e-15, "{through}");
        assert_eq!(exact(&floor(UNIT, UNIT).flipped(), &wall(UNIT, UNIT)), 0.0);
        assert_eq!(exact(&floor(UNIT, UNIT), &floor([1., 2.], UNIT)), 0.0);
    }

    #[test]
    fn occlusion_shows_in_the_error() {
        struct Wall;
        impl Occlusion for Wall {
            fn is_clear(&self, _: DVec3, _: DVec3) -> bool {
                false
            }
        }
        let factor = Exact.factor(&floor(UNIT, UNIT), &ceiling(1.0), &Wall);
        assert!(factor.error >= factor.value);
    }
}
