//! Radiosity that is known as a closed form or as the converged solution of an integral equation (`radiosity.json`).

use super::*;
use std::f64::consts::TAU;

/// Facets of what is round.
const FACETS: usize = 48;

/// A gray surface with exitance and reflectance as the cases give them.
fn gray(exitance: f64, reflectance: f64) -> Material {
    matte("gray", [reflectance as f32; 3], [exitance; 3])
}

/// Checks radiosity B = E + ρH at points of surfaces, given as (point, normal, E, ρ, B), H found to the given error.
fn check(id: &str, scene: &Scene, error: f64, expected: &[(DVec3, DVec3, f64, f64, f64)]) {
    let points: Vec<_> = expected.iter().map(|e| (e.0, e.1)).collect();
    let found = illuminance(scene, &points, error);
    for (h, (at, _, e, rho, b)) in found.iter().zip(expected) {
        let radiosity = e + rho * h;
        assert!((radiosity - b).abs() < 0.015 * b, "{id} at {at}: {radiosity} for {b}");
    }
}

/// A disc of the true area at height `z`, facing up or down.
fn disc(radius: f64, z: f64, up: bool) -> Vec<[DVec3; 3]> {
    let step = TAU / FACETS as f64;
    let radius = radius * (step / step.sin()).sqrt();
    let rim = |i: usize| DVec3::new(radius * (step * i as f64).cos(), radius * (step * i as f64).sin(), z);
    let facet = |i| if up { [DVec3::Z * z, rim(i), rim(i + 1)] } else { [DVec3::Z * z, rim(i + 1), rim(i)] };
    (0..FACETS).map(facet).collect()
}

/// Goral et al. 1984: boxes with a radiosity and a reflectance for each face; means of faces.
#[test]
fn boxes() {
    for id in ["rad-box-1", "rad-box-2", "rad-box-3"] {
        let case = case("radiosity", id);
        let (exitance, rho) = (numbers(&case["given"]["exitance"]), numbers(&case["given"]["reflectance"]));
        let mut scene = room(point(&case["given"]["dimensions"]), Material::default());
        scene.materials = exitance.iter().zip(&rho).map(|(e, rho)| gray(*e, *rho)).collect();
        for (face, object) in scene.objects.iter_mut().enumerate() {
            object.material = face;
        }
        let means = object_means(&scene, &SolveOptions { rays: 256, ..SolveOptions::default() });
        for (face, exact) in numbers(&case["results"]["converged_face_means"]).iter().enumerate() {
            let b = exitance[face] + rho[face] * means[face][1];
            assert!((b - exact).abs() < 0.005 * exact, "{id}, face {face}: {b} for {exact}");
        }
    }
}

/// Checks two surfaces that face each other, `gap` apart, at points on both; `at` has their keys in the case, and where they
/// lie for a surface of the given size.
fn check_facing(
    case: &Value,
    sizes: [f64; 2],
    surface: impl Fn(f64, f64, bool) -> Vec<[DVec3; 3]>,
    results: &str,
    at: &[(&str, [f64; 2])],
) {
    let given = |key: &str| numbers(&case["given"][key]);
    let (exitance, rho, gap) = (given("exitance"), given("reflectance"), given("gap")[0]);
    let mut scene = Scene { up: Up::Z, ..Scene::default() };
    let mut expected = Vec::new();
    for (side, normal) in [DVec3::Z, -DVec3::Z].into_iter().enumerate() {
        let (size, z) = (sizes[side], gap * side as f64);
        scene.materials.push(gray(exitance[side], rho[side]));
        scene.add_triangles("surface", side, &surface(size, z, side == 0));
        for (key, [x, y]) in at {
            let exact = case["results"][format!("radiosity_{}{results}", side + 1)][key].as_f64().unwrap();
            expected.push((DVec3::new(size * x, size * y, z), normal, exitance[side], rho[side], exact));
        }
    }
    // Half a percent in the root mean square, where single dark points are held to 1.5 %.
    check(case["id"].as_str().unwrap(), &scene, 0.005, &expected);
}

/// A rectangle of corners (x, y), counter-clockwise from above, that faces up or down at height z.
fn rectangle(corners: [[f64; 2]; 4], z: f64, up: bool) -> Vec<[DVec3; 3]> {
    let [a, b, c, d] = corners.map(|[x, y]| DVec3::new(x, y, z));
    if up { vec![[a, b, c], [a, c, d]] } else { vec![[a, d, c], [a, c, b]] }
}

/// Two squares that face each other: the Fredholm equation at centre, middle of an edge, and corner.
#[test]
fn opposed_squares() {
    let square = |half: f64, z, up| rectangle([[-half, -half], [half, -half], [half, half], [-half, half]], z, up);
    let at = [("centre", [0.0, 0.0]), ("edge_mid", [1.0, 0.0]), ("corner", [1.0, 1.0])];
    for id in ["rad-squares-1", "rad-squares-2"] {
        check_facing(&case("radiosity", id), [0.5; 2], square, "", &at);
    }
}

/// Sparrow and Cess: two coaxial discs, along their radii.
#[test]
fn coaxial_discs() {
    let at = [("0", 0.0), ("0.25", 0.25), ("0.5", 0.5), ("0.75", 0.75), ("1", 1.0)].map(|(key, x)| (key, [x, 0.0]));
    for id in ["rad-coaxial-disks-1", "rad-coaxial-disks-2"] {
        let case = case("radiosity", id);
        let radius = numbers(&case["given"]["radius"]);
        check_facing(&case, [radius[0], radius[1]], disc, "_at_r/R", &at);
    }
}

/// Sparrow 1960: two long strips that face each other, across their width. Strips 200 wide stand for infinite ones.
#[test]
fn facing_strips() {
    let strip = |w: f64, z, up| rectangle([[0.0, -100.0], [w, -100.0], [w, 100.0], [0.0, 100.0]], z, up);
    let at = [("0", 0.0), ("0.1", 0.1), ("0.25", 0.25), ("0.5", 0.5)].map(|(key, x)| (key, [x, 0.0]));
    for id in ["rad-2d-plates-1", "rad-2d-plates-2"] {
        check_facing(&case("radiosity", id), [1.0; 2], strip, "_at_x/w", &at);
    }
}

/// Sparrow and Lin 1962: isothermal V-grooves, at the edge of a wall and in its middle.
#[test]
fn v_grooves() {
    for id in ["v-groove-60", "v-groove-90"] {
        let case = case("radiosity", id);
        let given = |key: &str| case["given"][key].as_f64().unwrap();
        let (emissivity, (sin, cos)) = (given("emissivity"), given("angle_deg").to_radians().sin_cos());
        let mut scene = Scene { up: Up::Z, ..Scene::default() };
        scene.materials = vec![gray(emissivity, 1.0 - emissivity)];
        let [y, rim] = [DVec3::Y * 100.0, DVec3::new(cos, 0.0, sin)];
        scene.add_quad("level", 0, [-y, DVec3::X - y, DVec3::X + y, y]);
        scene.add_quad("steep", 0, [y, rim + y, rim - y, -y]);
        let expected = [("radiosity_at_edge", 1.0), ("radiosity_at_mid", 0.5)].map(|(key, x)| {
            (DVec3::X * x, DVec3::Z, emissivity, 1.0 - emissivity, case["results"][key].as_f64().unwrap())
        });
        check(id, &scene, 0.01, &expected);
    }
}

/// Sparrow, Albers and Eckert 1962: isothermal cylindrical cavities: the bottom's centre, and the means of bottom and wall.
#[test]
fn cylindrical_cavities() {
    for id in ["rad-cylindrical-cavity-1", "rad-cylindrical-cavity-2"] {
        let case = case("radiosity", id);
        let given = |key: &str| case["given"][key].as_f64().unwrap();
        let (depth, emissivity) = (given("depth_over_radius"), given("emissivity"));
        let mut scene = Scene { up: Up::Z, ..Scene::default() };
        scene.materials = vec![gray(emissivity, 1.0 - emissivity)];
        let bottom = disc(1.0, 0.0, true);
        let wall = bottom.iter().flat_map(|[_, p, q]| {
            let up = DVec3::Z * depth;
            [[*q, *p, *p + up], [*q, *p + up, *q + up]]
        });
        scene.add_triangles("wall", 0, &wall.collect::<Vec<_>>());
        scene.add_triangles("bottom", 0, &bottom);
        let result = |key: &str| case["results"][key].as_f64().unwrap();
        let centre = result("bottom_centre_apparent_emissivity");
        check(id, &scene, 0.02, &[(DVec3::ZERO, DVec3::Z, emissivity, 1.0 - emissivity, centre)]);
        let means = object_means(&scene, &SolveOptions { cells: 4000, rays: 256, ..SolveOptions::default() });
        for (object, key) in
            ["mean_wall_radiosity_over_sigmaT4", "mean_bottom_radiosity_over_sigmaT4"].iter().enumerate()
        {
            let (b, exact) = (emissivity + (1.0 - emissivity) * means[object][1], result(key));
            assert!((b / exact - 1.0).abs() < 0.005, "{id}, {key}: {b} for {exact}");
        }
    }
}
