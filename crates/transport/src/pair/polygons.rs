//! Polygons for the tests of pairs.

use glam::{DQuat, DVec3};
use radiosity_scene::Facet;

/// The facet with these corners.
pub fn facet(corners: &[[f64; 3]]) -> Facet {
    Facet::new(corners.iter().map(|c| DVec3::from_array(*c)).collect()).unwrap()
}

/// The rectangle x × y on the floor with a corner in the origin, active upwards.
pub fn rectangle(x: f64, y: f64) -> Facet {
    facet(&[[0., 0., 0.], [x, 0., 0.], [x, y, 0.], [0., y, 0.]])
}

/// The parallelogram from `origin` along u and v; its active side is that of u × v.
pub fn parallelogram(origin: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Facet {
    let [o, u, v] = [origin, u, v].map(DVec3::from_array);
    Facet::new(vec![o, o + u, o + u + v, o + v]).unwrap()
}

/// The unit square on the floor, active upwards.
pub fn floor() -> Facet {
    parallelogram([0., 0., 0.], [1., 0., 0.], [0., 1., 0.])
}

/// The unit square above it at height one, active downwards.
pub fn ceiling() -> Facet {
    parallelogram([0., 0., 1.], [0., 1., 0.], [1., 0., 0.])
}

/// The facet turned about the origin and moved.
pub fn moved(facet: &Facet, turn: DQuat, shift: DVec3) -> Facet {
    Facet::new(facet.corners().iter().map(|c| turn * *c + shift).collect()).unwrap()
}
