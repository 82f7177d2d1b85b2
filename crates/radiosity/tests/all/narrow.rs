//! Rooms whose light comes by a narrow place.

use glam::DVec3;
use radiosity::{Material, MeasureOptions, Mesh, Scene, Sky, Tracer, luminance, measure};

/// Illuminance 0.85 m above the floor at twelve places across the room, 1.25 and 2.75 m from the window's wall, lx: by 20 million paths of light that begin in the window's
/// outer opening and are looked at from the points at all that they meet, right to 1 % each, and to 0.1 % in the mean.
const TRUTH: [[f64; 12]; 2] = [
    [1.824, 2.117, 2.652, 3.561, 5.354, 23.025, 22.998, 5.359, 3.573, 2.640, 2.131, 1.830],
    [1.886, 2.122, 2.486, 3.001, 4.065, 8.272, 8.282, 4.051, 3.019, 2.516, 2.133, 1.921],
];

/// A room of 6 × 2.7 × 4 m behind a window of 20 × 120 cm in a wall of 80 cm, and the outside of the building.
fn room() -> Scene {
    let gray = |rho: f32| Material { base_color: [rho, rho, rho, 1.0], ..Material::default() };
    let mut scene = Scene { sky: Sky::Overcast { horizontal: [10_000.0; 3] }, ..Scene::default() };
    scene.materials = vec![gray(0.8), gray(0.3), gray(0.6)];
    const WHITE: usize = 0;
    const FLOOR: usize = 1;
    const WALL: usize = 2;
    // A rectangle across an axis, between two corners that are given by the two axes after that, seen from its positive side or not.
    let mut rectangle = |material: usize, axis: usize, at: f64, low: [f64; 2], high: [f64; 2], is_positive: bool| {
        let corner = |u: f64, v: f64| {
            let mut p = [at; 3];
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
            DVec3::from(p)
        };
        let [a, b, c, d] =
            [corner(low[0], low[1]), corner(high[0], low[1]), corner(high[0], high[1]), corner(low[0], high[1])];
        scene.add_quad("room", material, if is_positive { [a, b, c, d] } else { [d, c, b, a] });
    };
    rectangle(FLOOR, 1, 0.0, [0.0, 0.0], [4.0, 6.0], true);
    rectangle(WHITE, 1, 2.7, [0.0, 0.0], [4.0, 6.0], false);
    for (z, low, high, inside) in [(0.0, [0.0, 0.0], [6.0, 2.7], true), (-0.8, [-0.8, 0.0], [6.8, 3.5], false)] {
        rectangle(WALL, 2, z, low, [high[0], 0.9], inside);
        rectangle(WALL, 2, z, [low[0], 2.1], high, inside);
        rectangle(WALL, 2, z, [low[0], 0.9], [2.9, 2.1], inside);
        rectangle(WALL, 2, z, [3.1, 0.9], [high[0], 2.1], inside);
    }
    rectangle(WHITE, 0, 2.9, [0.9, -0.8], [2.1, 0.0], true);
    rectangle(WHITE, 0, 3.1, [0.9, -0.8], [2.1, 0.0], false);
    rectangle(WHITE, 1, 0.9, [-0.8, 2.9], [0.0, 3.1], true);
    rectangle(WHITE, 1, 2.1, [-0.8, 2.9], [0.0, 3.1], false);
    rectangle(WALL, 0, 0.0, [0.0, 0.0], [2.7, 4.0], true);
    rectangle(WALL, 0, 6.0, [0.0, 0.0], [2.7, 4.0], false);
    rectangle(WALL, 2, 4.0, [0.0, 0.0], [6.0, 2.7], false);
    rectangle(WALL, 1, 3.5, [-0.8, -0.8], [4.8, 6.8], true);
    rectangle(WALL, 0, -0.8, [0.0, -0.8], [3.5, 4.8], false);
    rectangle(WALL, 0, 6.8, [0.0, -0.8], [3.5, 4.8], true);
    rectangle(WALL, 2, 4.8, [-0.8, 0.0], [6.8, 3.5], true);
    // A table.
    for (axis, [low, high]) in [(0, [1.5, 3.2]), (1, [0.7, 0.76]), (2, [1.5, 2.5])] {
        let sides = [[1.5, 3.2], [0.7, 0.76], [1.5, 2.5]];
        let [u, v] = [sides[(axis + 1) % 3], sides[(axis + 2) % 3]];
        rectangle(WHITE, axis, high, [u[0], v[0]], [u[1], v[1]], true);
        rectangle(WHITE, axis, low, [u[0], v[0]], [u[1], v[1]], false);
    }
    scene
}

/// Light that falls off within the depth of the window, and in whose room there is a thousandth of what lies on the roof, is neither carried on by elements as wide as
/// the window nor taken from the roof: they made the room a tenth too bright where the window is seen, and a quarter elsewhere.
#[test]
fn a_room_behind_a_deep_window_is_no_brighter_than_it_is() {
    let points: Vec<(DVec3, DVec3)> = [1.25, 2.75]
        .into_iter()
        .flat_map(|z| (0..12).map(move |i| (DVec3::new(0.25 + 0.5 * f64::from(i), 0.85, z), DVec3::Y)))
        .collect();
    let scene = room();
    let mesh = Mesh::new(&scene);
    let eyes: Vec<DVec3> = points.iter().map(|(point, _)| *point).collect();
    let tracer = Tracer::new(&scene, &mesh).seen_from(&eyes);
    let measured =
        measure(&tracer, &points, &MeasureOptions { error: 0.03, ..MeasureOptions::default() }, &()).unwrap();
    // Many rays, of all solutions that came of the first.
    assert!(measured.rounds[0].rays >= 256, "{:?}", measured.rounds);
    for is_seen in [true, false] {
        let (mut found, mut truth) = (0.0, 0.0);
        for (e, exact) in measured.irradiance.iter().zip(TRUTH.as_flattened()) {
            if (*exact > 3.0) == is_seen {
                (found, truth) = (found + f64::from(luminance(*e)), truth + exact);
            }
        }
        assert!((found / truth - 1.0).abs() < 0.05, "{is_seen}: {found} for {truth}");
    }
}
