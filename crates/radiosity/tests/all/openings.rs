//! Small openings: a hall whose only light is the sky that is seen through one in its roof.

use super::beams::hall;
use glam::DVec3;
use radiosity::{MeasureOptions, Mesh, Place, Referee, Scene, Sky, Tracer, luminance, measure};

/// Luminance of the sky, cd/m².
const SKY: f64 = 5000.0;

/// On the floor below the opening and far from it, on a wall, and on the card.
fn places() -> [(DVec3, DVec3); 4] {
    [
        (DVec3::new(10.3, 9.8, 0.0), DVec3::Z),
        (DVec3::new(3.0, 3.0, 0.0), DVec3::Z),
        (DVec3::new(0.0, 10.0, 5.0), DVec3::X),
        (DVec3::new(10.0, 11.0, 0.3), -DVec3::Y),
    ]
}

fn under_the_sky(opening: [[f64; 2]; 2], is_grey: bool) -> Scene {
    let [x, y] = opening;
    Scene { sky: Sky::Uniform([SKY as f32; 3]), ..hall(x, y, is_grey, []) }
}

fn measured(tracer: &Tracer, error: f64) -> Vec<f64> {
    let options = MeasureOptions { error, ..MeasureOptions::default() };
    let measured = measure(tracer, &places(), &options, &()).unwrap();
    measured.irradiance.iter().map(|e| f64::from(luminance(*e))).collect()
}

/// What an opening in the roof gives to a place, lx, by a sum over small parts of it.
fn from_roof([[x, end], [y, top]]: [[f64; 2]; 2], (point, normal): (DVec3, DVec3)) -> f64 {
    let parts = 64;
    let along = |[low, high]: [f64; 2], k: i32| low + (high - low) * (f64::from(k) + 0.5) / f64::from(parts);
    let of_part = |k: i32| {
        let to = DVec3::new(along([x, end], k % parts), along([y, top], k / parts), 10.0) - point;
        to.dot(normal).max(0.0) * to.z / to.length_squared().powi(2)
    };
    let area = (end - x) * (top - y);
    SKY * area * (0..parts * parts).map(of_part).sum::<f64>() / f64::from(parts * parts)
}

/// A hole of a hand's breadth, one of 1 m, and a slit of 2 mm, between black walls. One ray in ten thousand meets the first and the last.
#[test]
fn the_sky_comes_through_small_openings() {
    let middle = |width: f64| [10.0 - 0.5 * width, 10.0 + 0.5 * width];
    for opening in [[middle(0.1); 2], [middle(1.0); 2], [middle(0.002), [8.0, 11.0]]] {
        let scene = under_the_sky(opening, false);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        // What stands beside the floor sees light that it gives back, too.
        for (place, found) in places().into_iter().zip(measured(&tracer, 0.01)).take(2) {
            let truth = from_roof(opening, place);
            assert!((found - truth).abs() <= 0.02 * truth, "{opening:?}, {place:?}: {found} lx, {truth} lx");
        }
    }
}

/// Light that goes on from wall to wall, too, as a path tracer has it.
#[test]
fn a_grey_hall_is_lit_by_the_sky_again_and_again() {
    let scene = under_the_sky([[8.75, 11.25]; 2], true);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let referee = Referee::new(&tracer);
    for ((point, normal), found) in places().into_iter().zip(measured(&tracer, 0.01)) {
        let place = Place { point, normal, triangle: u32::MAX };
        let truth = f64::from(luminance(referee.irradiance(&place, 1 << 16, 3)));
        assert!((found - truth).abs() <= 0.03 * truth, "{place:?}: {found} lx, {truth} lx");
    }
}
