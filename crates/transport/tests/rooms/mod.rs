//! Rooms that several tests look into: those of this folder, and those inside the crate, which name this file by its path.

use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};

/// The rectangle from `corner` along u and v; its active side is that of u × v.
pub fn rectangle(corner: DVec3, u: DVec3, v: DVec3) -> Facet {
    Facet::new(vec![corner, corner + u, corner + u + v, corner + v]).unwrap()
}

/// Adds a rectangle cut into k × k.
pub fn add_cut(enclosure: &mut Enclosure, k: usize, [corner, u, v]: [DVec3; 3]) {
    let n = k as f64;
    for i in 0..k * k {
        let at = corner + u * ((i % k) as f64 / n) + v * ((i / k) as f64 / n);
        enclosure.add(format!("{i}"), rectangle(at, u / n, v / n));
    }
}

/// Floor, ceiling, then the walls of a box from the origin, each cut into k × k, active inside.
pub fn box_of(size: DVec3, k: usize) -> Enclosure {
    let [x, y, z] = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
    let mut room = Enclosure { is_closed: true, ..Enclosure::default() };
    for face in [[DVec3::ZERO, x, y], [z, y, x], [DVec3::ZERO, y, z], [x, z, y], [DVec3::ZERO, z, x], [y, x, z]] {
        add_cut(&mut room, k, face);
    }
    room
}

/// A room of 2 × 1.5 × 1, its faces cut into k × k, with a block that stands turned in the middle, its six faces last.
pub fn room_with_block(k: usize) -> Enclosure {
    let mut room = box_of(DVec3::new(2.0, 1.5, 1.0), k);
    let (u, v) = (DVec3::new(0.4, 0.15, 0.0), DVec3::new(-0.15, 0.4, 0.0));
    let (corner, up) = (DVec3::new(0.85, 0.5, 0.25), DVec3::Z * 0.5);
    for [at, a, b] in [
        [corner, v, u],
        [corner + up, u, v],
        [corner, u, up],
        [corner + u, v, up],
        [corner + u + v, -u, up],
        [corner + v, -v, up],
    ] {
        add_cut(&mut room, 1, [at, a, b]);
    }
    room
}
