//! A closed room filled with small boxes, turned at random, lit by one lamp: geometry without any order.

use super::{BOX, FLOOR, LAMP, PLASTER, Part, RED, Visit, corners};
use crate::hash::Random;
use glam::{EulerRot, Quat, Vec3, vec3};

/// Half the room's width, and the thickness of its walls.
const HALF: f32 = 5.0;
const WALL: f32 = 0.2;

/// Share of the room's volume that the boxes fill: light still crosses the room at any number of boxes' sizes, since
/// the free path shrinks only with the size of a box.
const FILLED: f32 = 0.02;

/// About a given number of triangles, as boxes of twelve.
pub struct Soup {
    boxes: u32,
}

impl Soup {
    /// A soup of `triangles` triangles, rounded up to whole boxes; the room and its lamp (36) are counted in.
    pub fn new(triangles: u32) -> Soup {
        Soup { boxes: triangles.saturating_sub(36).div_ceil(12).max(1) }
    }
}

impl Visit for Soup {
    fn visit(&self, sink: &mut dyn FnMut(Part)) {
        let room = corners(Vec3::splat(-HALF), Vec3::splat(HALF));
        let outside = corners(Vec3::splat(-HALF - WALL), Vec3::splat(HALF + WALL));
        // The shell is one solid: a box outside, and the same box inside out within it.
        let points: Vec<Vec3> = outside.into_iter().chain(room).collect();
        let triangles: Vec<[u32; 3]> = BOX.into_iter().chain(BOX.map(|[a, b, c]| [a + 8, c + 8, b + 8])).collect();
        sink(Part { material: PLASTER, points: &points, triangles: &triangles });
        let lamp = corners(vec3(-1.0, HALF - 0.1, -1.0), vec3(1.0, HALF + 0.01, 1.0));
        sink(Part { material: LAMP, points: &lamp, triangles: &BOX });

        let mean = (FILLED * (2.0 * HALF).powi(3) / self.boxes as f32).cbrt().min(2.0);
        // Far enough from the walls and the lamp that nothing touches them: half the diagonal of the largest box.
        let reach = HALF - 0.15 - 0.5 * 3.0_f32.sqrt() * 1.4 * mean;
        let mut random = Random::new(2);
        for _ in 0..self.boxes {
            let mut number = |low: f32, high: f32| random.range(low.into(), high.into()) as f32;
            let middle = vec3(number(-reach, reach), number(-reach, reach), number(-reach, reach));
            let half = 0.5 * mean * vec3(number(0.6, 1.4), number(0.6, 1.4), number(0.6, 1.4));
            let tau = std::f32::consts::TAU;
            let turn = Quat::from_euler(EulerRot::XYZ, number(0.0, tau), number(0.0, tau), number(0.0, tau));
            let material = [FLOOR, RED, RED + 1, RED + 2][(number(0.0, 4.0) as usize).min(3)];
            let points = corners(-half, half).map(|p| middle + turn * p);
            sink(Part { material, points: &points, triangles: &BOX });
        }
    }

    fn camera(&self) -> [Vec3; 2] {
        [vec3(-4.8, 1.0, 4.8), vec3(0.0, -0.5, 0.0)]
    }
}
