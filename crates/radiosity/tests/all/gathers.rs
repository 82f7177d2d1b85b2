//! What points gather from places nearby, by paths from there.

use glam::DVec3;
use radiosity::transport::Shadowing;
use radiosity::{Mesh, Place, Referee, Scene, Solution, SolveOptions, Tracer, cornell_box, luminance, stations};

/// The Cornell box with so many lamps more beneath its ceiling, each an object, a pyramid of four triangles that points down. Each hangs over a
/// shelf as wide as itself, so that elements and what is seen of them get light from few.
fn with_lamps(count: usize) -> Scene {
    let mut scene = cornell_box();
    for k in 0..count {
        let at = DVec3::new(0.07 + 0.1 * (k % 5) as f64, 0.42, 0.05 + 0.13 * (k / 5) as f64);
        let corner =
            |k: usize| at + 0.02 * DVec3::new([1.0, 1.0, -1.0, -1.0][k % 4], 0.0, [-1.0, 1.0, 1.0, -1.0][k % 4]);
        let tip = at - 0.02 * DVec3::Y;
        let sides: Vec<[DVec3; 3]> = (0..4).map(|k| [tip, corner(k), corner(k + 1)]).collect();
        scene.add_triangles(&format!("lamp {k}"), 3, &sides);
        scene.add_quad("shelf", 0, [3, 2, 1, 0].map(|k| corner(k) - 0.05 * DVec3::Y));
        scene.add_quad("shelf", 0, [0, 1, 2, 3].map(|k| corner(k) - 0.051 * DVec3::Y));
    }
    scene
}

/// Of few lamps each spot looks at all, of many at one by what elements received. Elements are so large that most
/// of what is hit is near, and half of that goes on as paths: the mean light of points is that of the path tracer, up to a hundredth. It is within 0.5 % here, and 4 % off where
/// the probability of either way is left out. Far elements are few and small, hence their many rays: with 16 the mean is 2 % off whichever way.
#[test]
fn paths_from_nearby_find_the_light_of_all_lamps() {
    for count in [3, 20] {
        let scene = with_lamps(count);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = SolveOptions { element_size: Some(0.3), rays: 1024, looked_up: true, ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &options, &()).unwrap();
        assert_eq!(solution.luminaires.lights.len(), count + 1);
        let places: Vec<Place> = (0..64)
            .map(|k| {
                let (x, z) = (0.03 + 0.07 * f64::from(k % 8), 0.03 + 0.07 * f64::from(k / 8));
                stations::snap(&tracer, DVec3::new(x, 0.0, z), DVec3::Y)
            })
            .collect();
        let answer = solution.gathered(&places, 2048, &Shadowing { places: 1, rays: 1024 }, &()).unwrap();
        let referee = Referee::new(&tracer);
        let (mut found, mut truth) = (0.0, 0.0);
        for (k, (place, e)) in (0..).zip(places.iter().zip(&answer.irradiance)) {
            found += f64::from(luminance(*e));
            truth += f64::from(luminance(referee.irradiance(place, 4096, k)));
        }
        assert!((found / truth - 1.0).abs() < 0.01, "{count} lamps: {}", found / truth);
    }
}
