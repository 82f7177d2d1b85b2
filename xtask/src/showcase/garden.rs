//! What the window looks out on: a lawn, a hedge that hides the horizon, and trees too low to shade the window.

use super::paint::Paint;
use super::solid::{Solid, cuboid, lattice_cuboid, rod, sphere};
use super::{Piece, Shape, sharp};
use crate::hash::noise;
use glam::{DAffine3, DVec3, dvec3};

/// Height of the lawn; the house's plinth reaches 0.3 m below the floor.
const LAWN: f64 = -0.15;

pub fn pieces() -> Vec<Piece> {
    let lawn = cuboid([-10.0, LAWN - 0.3, -11.5], [8.5, LAWN, -2.4]);
    let low = LAWN - 0.05;
    let hedges = [
        lattice_cuboid(dvec3(-9.4, low, -8.6), dvec3(8.0, 1.95, -7.7), [70, 10, 4]),
        lattice_cuboid(dvec3(-9.5, low, -7.9), dvec3(-8.6, 1.90, -2.7), [4, 10, 22]),
    ]
    .map(|hedge| hedge.displaced(leafy(0.34, 2.4)));
    let mut crowns = Vec::new();
    let mut trunks = Vec::new();
    for (x, z, height, radius) in
        [(-7.6, -9.9, 3.3, 1.0), (-4.0, -10.3, 3.7, 1.2), (-0.4, -9.8, 3.1, 0.95), (3.4, -10.2, 3.6, 1.15)]
    {
        let top = dvec3(x, height - radius, z);
        trunks.push(rod(dvec3(x, LAWN - 0.05, z), top, 0.11, 10));
        for (share, shift) in [(1.0, [0.0, 0.0, 0.0]), (0.68, [0.75, -0.35, 0.3]), (0.62, [-0.7, -0.25, 0.35])] {
            let at = top + DVec3::from_array(shift) * radius;
            let crown = sphere(radius * share, 2).moved(DAffine3::from_translation(at));
            crowns.push(crown.displaced(leafy(0.5 * radius, 2.6 / radius)));
        }
    }
    // Leaves are left flat-faced, in the manner of the kit.
    let faceted = |name, solids| Piece { name, paint: Paint::Hedge, shape: Shape::Solid(Solid::all(solids), 0.05) };
    vec![
        sharp("lawn", Paint::Grass, lawn),
        faceted("hedge", hedges.to_vec()),
        faceted("tree crowns", crowns),
        sharp("tree trunks", Paint::Bark, Solid::all(trunks)),
    ]
}

/// A displacement of up to half of `size` along each axis, with `pitch` bumps a metre.
fn leafy(size: f64, pitch: f64) -> impl Fn(DVec3) -> DVec3 {
    move |p| {
        let q = p * pitch;
        let bump = |seed: f64| size * (noise(q.x + seed, q.y, q.z) - 0.5);
        dvec3(bump(3.0), bump(41.0), bump(87.0))
    }
}
