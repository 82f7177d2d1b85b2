//! Facets that stand for a curved surface receive light as the surface would.

use glam::{DVec2, DVec3};
use radiosity::answer::Station;
use radiosity::stations::station;
use radiosity::transport::Shadowing;
use radiosity::{Indirect, Material, Mesh, Scene, Side, Sky, Solution, SolveOptions, Tracer, Up};
use std::f64::consts::{PI, TAU};

const FACETS: usize = 16;

/// A lying cylinder of radius 1 with the normals of a round one.
fn cylinder() -> Scene {
    let materials = vec![Material { base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() }];
    let sky = Sky::Overcast { horizontal: [1000.0; 3] };
    let mut scene = Scene { materials, sky, up: Up::Z, ..Scene::default() };
    let at = |i: usize, y: f64| {
        let (z, x) = (TAU * (i as f64 + 0.5) / FACETS as f64).sin_cos();
        DVec3::new(x, y, z)
    };
    let facet = |i: usize| {
        let [a, b, c, d] = [at(i, -2.0), at(i, 2.0), at(i + 1, 2.0), at(i + 1, -2.0)];
        [[a, b, c], [a, c, d]]
    };
    scene.add_triangles("cylinder", 0, &(0..FACETS).flat_map(facet).collect::<Vec<_>>());
    scene.normals = scene.positions.iter().map(|p| DVec3::new(p.x, 0.0, p.z).as_vec3()).collect();
    scene
}

/// Irradiance of an open plane whose normal is at an angle from the zenith under the overcast sky: its luminance
/// L (1 + 2 sin γ)/3 integrated over what both the sky and the plane see (Moon and Spencer 1942).
fn under_the_sky(angle: f64) -> f64 {
    let zenith = 9.0 * 1000.0 / (7.0 * PI);
    let (sin, cos) = angle.sin_cos();
    zenith / 3.0 * (0.5 * PI * (1.0 + cos) + 4.0 / 3.0 * ((PI - angle) * cos + sin))
}

/// Directions about the round one's normal that leave through the facet itself see no sky.
#[test]
fn no_light_comes_into_a_closed_solid() {
    let mut scene = cylinder();
    scene.materials[0].double_sided = true;
    let caps: Vec<[DVec3; 3]> = scene
        .positions
        .chunks_exact(6)
        .flat_map(|facet| {
            // The facet's corners are a, b, c and a, c, d, with a and d on one end.
            let [a, b, c, d] = [facet[0], facet[1], facet[2], facet[5]];
            [[DVec3::new(0.0, a.y, 0.0), a, d], [DVec3::new(0.0, b.y, 0.0), c, b]]
        })
        .collect();
    scene.add_triangles("caps", 0, &caps);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solution = Solution::new(&tracer, &SolveOptions { cells: 2000, ..SolveOptions::default() }, &()).unwrap();
    for (side, is_lit) in [(Side::Front, true), (Side::Back, false)] {
        let at = |t: usize| station(&tracer, t, DVec2::splat(0.1), side);
        let stations: Vec<Station> = (0..2 * FACETS).map(at).collect();
        let gather = Indirect::Gather { rays: 256 };
        let light = solution.at(&stations, gather, &Shadowing { places: 1, rays: 1 }, &()).unwrap().irradiance;
        let sum: f64 = light.iter().map(|e| f64::from(e[1])).sum();
        assert!(if is_lit { sum > 1000.0 } else { sum == 0.0 }, "{side:?}: {sum} lx");
    }
}

#[test]
fn the_field_on_facets_is_that_of_the_curved_surface() {
    assert!((under_the_sky(0.0) - 1000.0).abs() < 1e-9);
    let scene = cylinder();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let mut solution = Solution::new(&tracer, &SolveOptions { cells: 4000, ..SolveOptions::default() }, &()).unwrap();
    solution.refine(512, &()).unwrap();
    let field = solution.indirect_field(&()).unwrap();
    let (mut worst, mut of_facets) = (0f64, 0f64);
    for triangle in 0..mesh.triangles.len() {
        for (u, v) in [(0.3, 0.3), (0.05, 0.9), (0.9, 0.05), (0.05, 0.05), (0.5, 0.45), (0.2, 0.6)] {
            let uv = DVec2::new(u, v);
            let round = mesh.point(triangle, uv).with_y(0.0).normalize();
            let read = f64::from(field.at(triangle, uv, Side::Front)[1]);
            let exact = under_the_sky(round.z.acos());
            worst = worst.max((read - exact).abs());
            of_facets = of_facets.max((under_the_sky(mesh.normal(triangle).z.acos()) - exact).abs());
        }
    }
    // What rays below a facet's plane do not bring, as they start inside, is all that is missing.
    assert!(worst < 15.0 && of_facets > 60.0, "{worst} lx off, flat facets {of_facets} lx");
}
