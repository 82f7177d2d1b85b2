//! Nusselt's analog, done literally (Nusselt 1928; catalogue 19): what a differential area sees is projected on the unit
//! hemisphere above it and from there straight down to the base disc; F is the area covered, over π.
//!
//! An edge becomes an arc of a great circle and on the base an arc of an ellipse about the centre, with half axes 1 and
//! |cos| of the angle between the planes; what is cut off by the horizon is an arc of the rim. The area between the arcs
//! and the centre is a sum of sectors, ½ b Δε with ε the eccentric anomaly. Discs, and spheres, which look like discs,
//! become closed curves whose sectors are integrated by numbers. A reference for points: as slow as it is simple.

use super::gauss::gauss;
use super::lambert::from_centroid;
use super::{Factor, Occlusion, Pair};
use glam::{DVec2, DVec3};
use radiosity_scene::Facet;
use radiosity_trace::sampling::frame;
use std::f64::consts::{PI, TAU};

/// Pieces that a disc's outline is divided in, and Gauss points on each: 1e-12 for discs up to some fifty times as wide
/// as they are far.
const PIECES: usize = 64;
const POINTS: usize = 12;

/// Nusselt's analog from the centroid of one facet to the other; differs from Lambert's formula by rounding only.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nusselt;

impl Pair for Nusselt {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        from_centroid(from, to, occlusion, |point| to_polygon(point, from.normal(), to))
    }
}

/// Form factor from the differential area at `point` with unit `normal` to the front of a facet.
pub fn to_polygon(point: DVec3, normal: DVec3, to: &Facet) -> f64 {
    if to.height(point) <= 0.0 {
        return 0.0;
    }
    let frame = frame(normal);
    // The outline above the horizon; a concave one may run to and fro along it, which adds up to nothing.
    let corners: Vec<DVec3> = to.corners().iter().map(|c| frame.map(|axis| (*c - point).dot(axis)).into()).collect();
    let mut above = Vec::with_capacity(corners.len() + 2);
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        if a.z >= 0.0 {
            above.push(a);
        }
        if (a.z > 0.0 && b.z < 0.0) || (a.z < 0.0 && b.z > 0.0) {
            let c = a + a.z / (a.z - b.z) * (b - a);
            above.push(c.with_z(0.0));
        }
    }
    let area: f64 = (0..above.len()).map(|i| sector(above[i], above[(i + 1) % above.len()])).sum();
    // Counter-clockwise on its front is clockwise as seen from the point.
    (-area / PI).max(0.0)
}

/// Area of the base disc between its centre and the arc that the edge from a to b becomes, counter-clockwise positive;
/// the base is the plane z = 0.
fn sector(a: DVec3, b: DVec3) -> f64 {
    let Some(pole) = a.cross(b).try_normalize() else { return 0.0 };
    let half_axis = pole.z.abs();
    // The long axis lies where the edge's plane meets the base; an upright plane becomes a line, without area.
    let Some(long) = DVec2::new(-pole.y, pole.x).try_normalize() else {
        // The edge is on the horizon.
        return 0.5 * pole.z.signum() * a.angle_between(b);
    };
    if half_axis == 0.0 {
        return 0.0;
    }
    let anomaly = |p: DVec3| {
        let down = p.normalize().truncate();
        (long.perp_dot(down) / half_axis).atan2(long.dot(down))
    };
    let mut turn = anomaly(b) - anomaly(a);
    // An edge covers less than half a turn.
    if turn > PI {
        turn -= TAU;
    } else if turn < -PI {
        turn += TAU;
    }
    0.5 * half_axis * turn
}

/// Form factor from the differential area at `point` with unit `normal` to the front of a disc, the side that its unit
/// `axis` points to.
pub fn to_disc(point: DVec3, normal: DVec3, centre: DVec3, axis: DVec3, radius: f64) -> f64 {
    if (point - centre).dot(axis) <= 0.0 {
        return 0.0;
    }
    let to_base = |v: DVec3| -> DVec3 { frame(normal).map(|base| v.dot(base)).into() };
    let [u, v, _] = frame(axis).map(|side| radius * to_base(side));
    let middle = to_base(centre - point);
    // Height over the horizon along the outline: middle.z + lift cos (t − top).
    let (lift, top) = (u.z.hypot(v.z), v.z.atan2(u.z));
    if middle.z + lift <= 0.0 {
        return 0.0;
    }
    let half = if middle.z >= lift { PI } else { (-middle.z / lift).acos() };
    // Sectors of the projected outline, from the highest point both ways: ½ (p × dp)_z of the unit vectors.
    let at = |t: f64| (middle + t.cos() * u + t.sin() * v, -t.sin() * u + t.cos() * v);
    let mut area = 0.0;
    for piece in 0..PIECES {
        for [x, weight] in gauss(POINTS) {
            let t = top + half * (2.0 * (piece as f64 + x) / PIECES as f64 - 1.0);
            let (p, slope) = at(t);
            area += weight * half / PIECES as f64 * p.cross(slope).z / p.length_squared();
        }
    }
    if half < PI {
        // Back along the rim.
        let (end, start) = (at(top + half).0, at(top - half).0);
        area += 0.5 * end.truncate().angle_to(start.truncate());
    }
    area.abs() / PI
}

/// Form factor from the differential area at `point` with unit `normal` to a sphere, which hides behind the disc that its
/// tangents from the point touch. One within the sphere sees nothing else.
pub fn to_sphere(point: DVec3, normal: DVec3, centre: DVec3, radius: f64) -> f64 {
    let distance = centre.distance(point);
    if distance <= radius {
        return 1.0;
    }
    let (axis, sine) = ((point - centre) / distance, radius / distance);
    to_disc(point, normal, centre + radius * sine * axis, axis, radius * (1.0 - sine * sine).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::lambert::lambert;
    use crate::pair::smooth::kernel;
    use radiosity_trace::sampling::Random;

    /// The same as Lambert's formula for polygons at random, many of them across the horizon.
    #[test]
    fn catalogue_19_polygons_match_lambert() {
        let mut random = Random::new(9);
        let mut next = || 2.0 * random.next_unit() - 1.0;
        let mut seen = 0;
        for _ in 0..3000 {
            let shift = 2.0 * DVec3::new(next(), next(), next());
            let (u, v) = (DVec3::new(next(), next(), next()), DVec3::new(next(), next(), next()));
            let (x, y) = (next(), next());
            let outline = [[-1., -1.], [1., -1.], [1., 1.], [0.5 * x, 0.5 * y], [-1., 1.]];
            let corners = outline.iter().map(|[x, y]| shift + *x * u + *y * v).collect();
            let Ok(facet) = Facet::new(corners) else { continue };
            let normal = DVec3::new(next(), next(), next()).normalize();
            let (value, truth) = (to_polygon(DVec3::ZERO, normal, &facet), lambert(DVec3::ZERO, normal, &facet));
            assert!((value - truth).abs() < 1e-12, "{value} {truth} {facet:?} {normal}");
            seen += usize::from(truth > 0.0);
        }
        assert!(seen > 800, "{seen}");
    }

    /// The hemisphere's integral over directions is the area's over points, dω = cos θ' dA'/r².
    #[test]
    fn catalogue_04_directions_and_areas_agree() {
        let corner = |x: f64, y: f64| DVec3::new(0.3 + x - 0.2 * y, 0.1 + y, 1.0 + 0.4 * x);
        let facet = Facet::new(vec![corner(0., 0.), corner(0., 1.), corner(1., 1.), corner(1., 0.)]).unwrap();
        let mut sum = 0.0;
        for [x, weight_x] in gauss(20) {
            for [y, weight_y] in gauss(20) {
                sum +=
                    weight_x * weight_y * facet.area() * kernel(DVec3::ZERO, DVec3::Z, corner(*x, *y), facet.normal());
            }
        }
        let value = to_polygon(DVec3::ZERO, DVec3::Z, &facet);
        assert!((sum - value).abs() < 1e-13 && value > 0.05, "{sum} {value}");
    }

    #[test]
    fn catalogue_19_discs_and_spheres() {
        for (r, h) in [(1.0, 1.0), (0.5, 2.0), (3.0, 0.2), (1e-3, 1.0)] {
            let value: f64 = to_disc(DVec3::ZERO, DVec3::Z, DVec3::Z * h, -DVec3::Z, r);
            let truth = r * r / (r * r + h * h);
            assert!((value - truth).abs() < 1e-12, "{value} {truth}");
        }
        // Catalogue 30 and the reference's spheres, the last two across the horizon.
        let sphere = |angle: f64| {
            let (sine, cosine) = angle.sin_cos();
            to_sphere(DVec3::ZERO, DVec3::Z, 2.0 * DVec3::new(sine, 0.0, cosine), 1.0)
        };
        assert!((sphere(0.0) - 0.25).abs() < 1e-14);
        for (angle, truth) in
            [(0.3, 0.238_834_122_281_401_5), (1.4, 0.054_061_446_652_913_32), (1.8, 0.007_545_014_598_581_486_5)]
        {
            assert!((sphere(angle) - truth).abs() < 1e-12, "{angle}: {} for {truth}", sphere(angle));
        }
        // Upright element beside a disc.
        let beside = to_disc(DVec3::new(2.0, 0.0, 0.0), -DVec3::X, DVec3::Z * 1.5, -DVec3::Z, 1.0);
        assert!((beside - 0.074_625_912_885_890_65).abs() < 1e-12, "{beside}");
    }
}
