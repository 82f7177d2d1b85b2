//! Shapes drawn at random for tests, from a fixed seed.

use glam::DVec3;
use radiosity_scene::Facet;

use super::shape::{Facing, Shape};

/// A linear congruential generator (Knuth's MMIX).
pub(super) struct Random(pub(super) u64);

impl Random {
    /// Uniform in [0, 1).
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.next() * (high - low)
    }

    pub(super) fn direction(&mut self) -> DVec3 {
        let (z, turn) = (self.between(-1.0, 1.0), self.between(0.0, std::f64::consts::TAU));
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * turn.cos(), r * turn.sin(), z)
    }

    fn facing(&mut self) -> Facing {
        if self.next() < 0.5 { Facing::Outside } else { Facing::Inside }
    }

    /// A bounded shape of any kind within about `size` of a point, planar ones within a right angle of `towards`.
    pub(super) fn shape(&mut self, kind: usize, at: DVec3, size: f64, towards: DVec3) -> Shape {
        let normal = (towards.normalize() + 0.9 * self.direction()).normalize();
        let radius = self.between(0.3, 1.0) * size;
        let axis = self.direction();
        match kind % 9 {
            0 => Shape::disc(at, normal, radius),
            1 => Shape::Disc { center: at, normal, radius, inner_radius: 0.6 * radius },
            2 => Shape::Ellipse { center: at, normal, axis, semi_axes: [radius, self.between(0.2, 0.9) * size] },
            3 => Shape::Sphere { center: at, radius, facing: Facing::Outside },
            4 => {
                let half_angle = self.between(0.3, 2.8);
                Shape::Cap { center: at, axis, radius, half_angle, facing: self.facing() }
            }
            5 => Shape::cylinder(at, axis, self.between(0.2, 0.8) * size, 0.6 * radius, self.facing()),
            6 => Shape::cone(at, axis, self.between(0.2, 0.8) * size, 0.6 * radius, self.facing()),
            7 => {
                let (radius_base, radius_top) = (0.7 * radius, self.between(0.1, 0.5) * size);
                let height = self.between(0.2, 0.8) * size;
                Shape::Frustum { base: at, axis, height, radius_base, radius_top, facing: self.facing() }
            }
            _ => {
                let (u, v) = normal.any_orthonormal_pair();
                let count = 3 + (3.0 * self.next()) as usize;
                let corner = |i: usize| {
                    let turn = std::f64::consts::TAU * (i as f64 + 0.3 * self.next()) / count as f64;
                    at + radius * (turn.cos() * u + turn.sin() * v)
                };
                Facet::new((0..count).map(corner).collect()).map_or(Shape::disc(at, normal, radius), Shape::Facet)
            }
        }
    }
}
