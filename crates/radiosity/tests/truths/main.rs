//! The engine against closed forms and independent references.

use glam::{DVec3, Vec2};
use radiosity::io::gltf_out::Light;
use radiosity::transport::{ElementReceivers, Exposure, HitTable, IdSpace, Shadowing};
use radiosity::view::lightmap::look_up;
use radiosity::{
    BakeOptions, Elements, Material, MeasureOptions, Mesh, PointLight, PointLightKind, Scene, Side, Sky, SkyPatches,
    Solution, SolveOptions, Tracer, Up, bake, lightmap, luminance, measure, vertex_light,
};
use serde_json::Value;
use std::ops::Range;

mod closed_forms;

const PI: f64 = std::f64::consts::PI;

fn truths(name: &str) -> Value {
    let path = format!("{}/tests/data/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn case(file: &str, id: &str) -> Value {
    let cases = truths(file)["cases"].as_array().unwrap().clone();
    cases.into_iter().find(|c| c["id"] == id).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().map(|x| x.as_f64().unwrap()).collect(),
        one => vec![one.as_f64().unwrap()],
    }
}

fn point(value: &Value) -> DVec3 {
    let p = numbers(value);
    DVec3::new(p[0], p[1], p[2])
}

fn matte(name: &str, reflectance: [f32; 3], exitance: [f64; 3]) -> Material {
    Material {
        name: name.to_owned(),
        base_color: [reflectance[0], reflectance[1], reflectance[2], 1.0],
        emissive: exitance.map(|e| (e / PI) as f32),
        ..Material::default()
    }
}

/// The inside of a box, one object per face, one material.
fn room(size: DVec3, material: Material) -> Scene {
    let mut scene = Scene { materials: vec![material], up: Up::Z, ..Scene::default() };
    let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) * size;
    let faces = [
        ("floor", [p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.)]),
        ("ceiling", [p(0., 0., 1.), p(0., 1., 1.), p(1., 1., 1.), p(1., 0., 1.)]),
        ("south", [p(0., 0., 0.), p(0., 0., 1.), p(1., 0., 1.), p(1., 0., 0.)]),
        ("north", [p(0., 1., 0.), p(1., 1., 0.), p(1., 1., 1.), p(0., 1., 1.)]),
        ("west", [p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 1.), p(0., 0., 1.)]),
        ("east", [p(1., 0., 0.), p(1., 0., 1.), p(1., 1., 1.), p(1., 1., 0.)]),
    ];
    for (name, corners) in faces {
        scene.add_quad(name, 0, corners);
    }
    scene
}

/// Illuminance at points to the given error, the audit included in the call.
fn illuminance(scene: &Scene, points: &[(DVec3, DVec3)], error: f64) -> Vec<f64> {
    let mesh = Mesh::new(scene);
    let tracer = Tracer::new(scene, &mesh);
    let options = MeasureOptions { error, ..MeasureOptions::default() };
    let measured = measure(&tracer, points, &options, &()).unwrap();
    assert!(measured.achieved, "{:?}", measured.audit);
    measured.irradiance.iter().map(|e| f64::from(e[1])).collect()
}

/// Mean irradiance of each object over its whole area: what is buried under other solids receives nothing.
fn object_means(scene: &Scene, options: &SolveOptions) -> Vec<[f64; 3]> {
    let mesh = Mesh::new(scene);
    let tracer = Tracer::new(scene, &mesh);
    let solution = Solution::new(&tracer, options, &()).unwrap();
    let mut sums = vec![[0.0; 4]; scene.objects.len()];
    for (e, area) in solution.exposed_area().iter().enumerate() {
        let (triangle, _) = solution.elements.place(e as u32);
        let sum = &mut sums[scene.triangle_object[mesh.source[triangle] as usize] as usize];
        (0..3).for_each(|band| sum[band] += area * f64::from(solution.irradiance()[e][band]));
        sum[3] += solution.area[e];
    }
    sums.iter().map(|s| [s[0] / s[3], s[1] / s[3], s[2] / s[3]]).collect()
}

/// Catalogue 5: a closed enclosure with the same E and ρ everywhere has B = E/(1 − ρ) everywhere, whatever its shape.
#[test]
fn catalogue_5_white_furnace() {
    for rho in [0.0f32, 0.5, 0.9, 0.95] {
        let scene = room(DVec3::new(3.0, 2.0, 1.0), matte("wall", [rho; 3], [0.5; 3]));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = SolveOptions { element_size: Some(0.25), rays: 16, ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &options, &()).unwrap();
        let exact = 0.5 / (1.0 - f64::from(rho));
        for b in solution.radiosity() {
            assert!((f64::from(b[0]) / exact - 1.0).abs() < 2e-4, "rho {rho}: {} for {exact}", b[0]);
        }
    }
}

/// Catalogue 41: the ambient term is exact in a furnace, and near what the rows then find elsewhere; each doubling of the
/// rays is a whole answer that comes nearer.
#[test]
fn catalogue_41_first_pictures() {
    let scene = room(DVec3::new(1.0, 2.0, 3.0), matte("glowing", [0.5; 3], [100.0; 3]));
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let first = Solution::begin(&tracer, &SolveOptions::default(), &()).unwrap();
    assert!(first.irradiance().iter().flatten().all(|h| (h / 200.0 - 1.0).abs() < 1e-5));

    let scene = radiosity::cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let options = SolveOptions { element_size: Some(0.05), ..SolveOptions::default() };
    let best = Solution::new(&tracer, &SolveOptions { rays: 1024, ..options }, &()).unwrap();
    let weight = best.exposed_area();
    let error = |solution: &Solution| {
        let square = |e: &[f32; 3]| f64::from(luminance(*e)).powi(2);
        let (mut difference, mut all) = (0.0, 0.0);
        for ((h, e), w) in solution.irradiance().iter().zip(best.irradiance()).zip(&weight) {
            difference += w * square(&std::array::from_fn(|band| h[band] - e[band]));
            all += w * square(e);
        }
        (difference / all).sqrt()
    };
    let mut solution = Solution::begin(&tracer, &options, &()).unwrap();
    let mut last = error(&solution);
    assert!(last < 0.35, "{last}");
    for rays in [16, 64, 256] {
        solution.refine(rays, &()).unwrap();
        let now = error(&solution);
        assert!(now < 0.7 * last, "{rays}: {now} after {last}");
        last = now;
    }
}

/// Catalogue 6: inside a sphere the irradiance is uniform for any emission; the error of the octahedral sphere used
/// here falls with its facets.
#[test]
fn catalogue_6_sphere_cavity() {
    let mut worst_before = f64::INFINITY;
    for steps in [4, 8, 16] {
        let materials = vec![matte("dark", [0.5; 3], [0.0; 3]), matte("lamp", [0.5; 3], [1.0; 3])];
        let mut scene = Scene { materials, ..Scene::default() };
        let mut lists = [Vec::new(), Vec::new()];
        for face in 0..8 {
            let sign = |bit: u32| if face >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let axes = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
            let flip = sign(0) * sign(1) * sign(2) > 0.0;
            let at = |i: i32, j: i32| {
                let (a, b) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                ((1.0 - a - b) * axes[0] + a * axes[1] + b * axes[2]).normalize()
            };
            for i in 0..steps {
                for j in 0..steps - i {
                    let mut add = |t: [DVec3; 3]| {
                        let t = if flip { [t[0], t[2], t[1]] } else { t };
                        // The cap z > 0.5 emits: a fraction (1 − 0.5)/2 of the sphere.
                        let lamp = (t[0] + t[1] + t[2]).z / 3.0 > 0.5;
                        lists[usize::from(lamp)].push(t);
                    };
                    add([at(i, j), at(i + 1, j), at(i, j + 1)]);
                    if i + j + 2 <= steps {
                        add([at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)]);
                    }
                }
            }
        }
        let area =
            |list: &[[DVec3; 3]]| -> f64 { list.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum() };
        let (dark, lamp) = (area(&lists[0]), area(&lists[1]));
        scene.add_triangles("dark", 0, &lists[0]);
        scene.add_triangles("lamp", 1, &lists[1]);
        let exact = lamp / (4.0 * PI - 0.5 * (dark + lamp));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let shadowing = Shadowing { places: 1, rays: 64 };
        let options = SolveOptions { rays: 256, element_size: Some(0.3), shadowing, ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &options, &()).unwrap();
        let (mut squares, mut weight) = (0.0, 0.0);
        for (h, area) in solution.irradiance().iter().zip(&solution.area) {
            squares += area * (f64::from(h[1]) / exact - 1.0).powi(2);
            weight += area;
        }
        let error = (squares / weight).sqrt();
        assert!(error < worst_before, "{steps}: {error} after {worst_before}");
        worst_before = error;
    }
    assert!(worst_before < 0.015, "{worst_before}");
}

/// Catalogue 3, and every surface of the three reference scenes: mean irradiance within 1 % or four standard errors.
#[test]
fn mean_irradiance_of_the_reference_scenes() {
    for id in ["cornell-box", "cornell-box-empty", "room-with-box"] {
        let case = case("scene_references", id);
        let mut scene = Scene::default();
        let surfaces = case["surfaces"].as_object().unwrap();
        let mut expected = Vec::new();
        for (name, surface) in surfaces {
            let rho = numbers(&surface["reflectance"]);
            let band = |k: usize| rho[k.min(rho.len() - 1)] as f32;
            let exitance = surface["exitance"].as_f64().unwrap();
            scene.materials.push(matte(name, [band(0), band(1), band(2)], [exitance; 3]));
            let mut triangles = Vec::new();
            for polygon in surface["polygons"].as_array().unwrap() {
                let p: Vec<DVec3> = polygon.as_array().unwrap().iter().map(point).collect();
                triangles.extend([[p[0], p[1], p[2]], [p[0], p[2], p[3]]]);
            }
            scene.add_triangles(name, scene.materials.len() - 1, &triangles);
            expected.push((numbers(&surface["mean_irradiance"]), numbers(&surface["standard_error"])));
        }
        let means = object_means(&scene, &SolveOptions { rays: 256, ..SolveOptions::default() });
        for ((name, mean), (exact, se)) in surfaces.keys().zip(&means).zip(&expected) {
            for band in 0..exact.len() {
                let tolerance = 0.01 * exact[band] + 4.0 * se[band];
                let difference = (mean[band] - exact[band]).abs();
                assert!(difference < tolerance, "{id}, {name}, band {band}: {} for {}", mean[band], exact[band]);
            }
        }
    }
}

/// Points of a CIE 171 case by name, with what is expected there.
fn named_points(case: &Value, results: &str) -> (Vec<(DVec3, DVec3)>, Vec<f64>) {
    let points = case["given"]["points"].as_object().unwrap();
    let places = points.values().map(|p| (point(&p["position"]), point(&p["normal"]))).collect();
    (places, points.keys().map(|name| case["results"][results][name].as_f64().unwrap()).collect())
}

/// CIE 171:2006, 5.6 and 5.7: what a diffuse reflector gives to points beside it, free and behind a screen. What it
/// reflects it may as well emit.
#[test]
fn cie_171_diffuse_reflectors() {
    for id in ["cie-5.6-1", "cie-5.6-2", "cie-5.7-3"] {
        let case = case("cie171", id);
        let corners = |value: &Value| -> [DVec3; 4] {
            let list: Vec<DVec3> = value.as_array().unwrap().iter().map(point).collect();
            [list[0], list[1], list[2], list[3]]
        };
        let mut scene = Scene { up: Up::Z, ..Scene::default() };
        scene.materials.push(matte("reflector", [0.0; 3], [1000.0; 3]));
        scene.materials.push(Material { double_sided: true, ..matte("screen", [0.0; 3], [0.0; 3]) });
        scene.add_quad("reflector", 0, corners(&case["given"]["reflector_polygon"]));
        if !case["given"]["obstruction"].is_null() {
            scene.add_quad("screen", 1, corners(&case["given"]["obstruction"]));
        }
        let (points, expected) = named_points(&case, "E_over_rhoE_reflector");
        for (e, exact) in illuminance(&scene, &points, 0.01).iter().zip(&expected) {
            // 1 % over all points together leaves faint ones more.
            assert!((e / 1000.0 - exact).abs() < 0.03 * exact + 1e-9, "{id}: {e} for {exact}");
        }
    }
}

/// CIE 171:2006, 5.8: mean indirect illuminance of a cube with a point source, at reflectances up to 0.95.
#[test]
fn cie_171_cube_of_one_reflectance() {
    let case = case("cie171", "cie-5.8-1");
    let given = &case["given"];
    let side = given["side"].as_f64().unwrap();
    let expected = numbers(&case["results"]["mean_total_lx"]);
    for (rho, exact) in numbers(&given["reflectance"]).iter().zip(expected) {
        let mut scene = room(DVec3::splat(side), matte("wall", [*rho as f32; 3], [0.0; 3]));
        scene.lights.push(PointLight {
            name: String::new(),
            kind: PointLightKind::Point,
            position: DVec3::splat(0.5 * side),
            direction: -DVec3::Z,
            intensity: [(given["flux_lm"].as_f64().unwrap() / (4.0 * PI)) as f32; 3],
            range: None,
        });
        let means = object_means(&scene, &SolveOptions { cells: 2000, ..SolveOptions::default() });
        let mean = means.iter().map(|m| m[1]).sum::<f64>() / 6.0;
        assert!((mean / exact - 1.0).abs() < 0.005, "{rho}: {mean} for {exact}");
    }
}

/// A square about the vertical axis that faces up.
fn square_at(half: f64, z: f64) -> [DVec3; 4] {
    [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| DVec3::new(x, y, z))
}

/// A black room of 4 × 4 × 3 m with an opening in its ceiling or west wall: a corner and two edges. Its walls are
/// `double_sided` around the opening, or black from outside.
fn opened(window: &[DVec3], double_sided: bool) -> Scene {
    let black = matte("black", [0.0; 3], [0.0; 3]);
    let full = room(DVec3::new(4.0, 4.0, 3.0), black.clone());
    let mut scene = Scene { up: Up::Z, ..Scene::default() };
    scene.materials = vec![black.clone(), Material { double_sided, ..black }];
    let holed = if window[0].z == 3.0 { "ceiling" } else { "west" };
    for object in full.objects.iter().filter(|o| o.name != holed) {
        let triangles: Vec<_> = object.triangles.clone().map(|t| full.corners(t)).collect();
        scene.add_triangles(&object.name, 0, &triangles);
    }
    // Four pieces around the opening, in coordinates along its edges, that look into the room.
    let (u, v) = (window[1].normalize(), window[2].normalize());
    let origin = window[0] - window[0].dot(u) * u - window[0].dot(v) * v;
    let most = |axis: DVec3| if axis.z > 0.5 { 3.0 } else { 4.0 };
    let [low, high] = [window[0], window[0] + window[1] + window[2]].map(|p| [p.dot(u), p.dot(v)]);
    let bands = [
        [0.0, 0.0, most(u), low[1]],
        [0.0, high[1], most(u), most(v)],
        [0.0, low[1], low[0], high[1]],
        [high[0], low[1], most(u), high[1]],
    ];
    let is_outward = u.cross(v).dot(DVec3::new(2.0, 2.0, 1.5) - window[0]) < 0.0;
    for [a, b, c, d] in bands.into_iter().filter(|[a, b, c, d]| c > a && d > b) {
        let p = |x: f64, y: f64| origin + x * u + y * v;
        let mut corners = [p(a, b), p(c, b), p(c, d), p(a, d)];
        if is_outward {
            corners.reverse();
        }
        scene.add_quad(holed, 1, corners);
    }
    scene
}

/// A sky of the CIE general standard (CIE S 011, ISO 15469) whose zenith has 1000 cd/m², as a map: types 1, 5 and 12, the
/// sun in the direction of +x.
fn general_sky(sky_type: u64, sun_elevation: f64) -> Sky {
    let [a, b, c, d, e] = match sky_type {
        1 => [4.0, -0.7, 0.0, -1.0, 0.0],
        5 => return Sky::Uniform([1000.0; 3]),
        12 => [-1.0, -0.32, 10.0, -3.0, 0.45],
        other => panic!("type {other} is not tested"),
    };
    let gradation = |cosine: f64| 1.0 + a * (b / cosine).exp();
    let indicatrix = |angle: f64| 1.0 + c * ((d * angle).exp() - (0.5 * d * PI).exp()) + e * angle.cos().powi(2);
    let sun = DVec3::new(sun_elevation.cos(), 0.0, sun_elevation.sin());
    let (width, height) = (512, 256);
    let luminance = |i: usize| {
        let elevation = PI * (0.5 - (i / width) as f64 / height as f64 - 0.5 / height as f64);
        if elevation <= 0.0 {
            return [0.0; 3];
        }
        // The middle looks along +y, and its right half towards +x.
        let azimuth = 2.0 * PI * (((i % width) as f64 + 0.5) / width as f64 - 0.5);
        let (sin, cos) = azimuth.sin_cos();
        let direction = DVec3::new(sin * elevation.cos(), cos * elevation.cos(), elevation.sin());
        let at = indicatrix(direction.dot(sun).clamp(-1.0, 1.0).acos()) * gradation(direction.z);
        [(1000.0 * at / (indicatrix(0.5 * PI - sun_elevation) * gradation(1.0))) as f32; 3]
    };
    Sky::Map { width, height, pixels: (0..width * height).map(luminance).collect() }
}

/// CIE 171:2006, 5.9, 5.11 and 5.13: uniform, overcast and clear skies through an opening of the roof, of a wall, and
/// under a mask.
#[test]
fn cie_171_sky_through_openings() {
    for (id, results) in [
        ("cie-5.9-1", "sky_component_percent"),
        ("cie-5.9-2", "sky_component_percent"),
        ("cie-5.9-3", "sky_component_percent"),
        ("cie-5.11-5", "sky_component_percent"),
        ("cie-5.13-1", "SC_percent"),
    ] {
        let case = case("cie171", id);
        let given = &case["given"];
        let window: Vec<DVec3> = given["window_parallelogram"].as_array().unwrap().iter().map(point).collect();
        let mut scene = opened(&window, true);
        if let Some(mask) = given["mask_polygon"].as_array() {
            let p: Vec<DVec3> = mask.iter().map(point).collect();
            scene.add_quad("mask", 1, [p[0], p[1], p[2], p[3]]);
        }
        // What lies below the horizon is asked for apart.
        scene.add_quad("ground", 1, square_at(2000.0, -0.1));
        let sun = given["sun_elevation_deg"].as_f64().unwrap_or(60.0).to_radians();
        scene.sky = general_sky(given["sky_type"].as_u64().unwrap_or(5), sun);
        let (points, expected) = named_points(&case, results);
        let on_the_ground = 1000.0 * case["results"]["Eh_over_Lz"].as_f64().unwrap_or(PI);
        for (e, exact) in illuminance(&scene, &points, 0.01).iter().zip(&expected) {
            let percent = 100.0 * e / on_the_ground;
            assert!((percent - exact).abs() < 0.03 * exact + 0.02, "{id}: {percent} for {exact}");
        }
    }
}

/// CIE 171:2006, 5.4: the flux through an opening is that on the black surfaces of the room.
#[test]
fn cie_171_flux_through_an_opening() {
    for id in ["cie-5.4-1", "cie-5.4-2"] {
        let case = case("cie171", id);
        let [width, depth] = numbers(&case["given"]["opening"])[..] else { panic!("{id}") };
        let corner = DVec3::new(0.5 * (4.0 - width), 0.5 * (4.0 - depth), 3.0);
        let mut scene = opened(&[corner, width * DVec3::X, depth * DVec3::Y], false);
        scene.sky = Sky::Uniform([(case["given"]["E_on_opening"].as_f64().unwrap() / PI) as f32; 3]);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let mut solution = Solution::new(&tracer, &SolveOptions::default(), &()).unwrap();
        solution.refine(512, &()).unwrap();
        let of_elements = solution.irradiance().iter().zip(solution.exposed_area());
        let flux: f64 = of_elements.map(|(e, area)| area * f64::from(e[1])).sum();
        let exact = case["results"]["total_flux_on_inner_surfaces_lm"].as_f64().unwrap();
        assert!((flux / exact - 1.0).abs() < 2e-3, "{id}: {flux} lm for {exact}");
    }
}

/// CIE 171:2006, 5.2: a point source over a floor; catalogue 84, E = I cos θ/d².
#[test]
fn catalogue_84_point_source() {
    let case = case("cie171", "cie-5.2-1");
    let given = &case["given"];
    let mut scene = Scene { up: Up::Z, ..Scene::default() };
    scene.materials.push(matte("black", [0.0; 3], [0.0; 3]));
    scene.add_quad("floor", 0, [[0., 0., 0.], [4., 0., 0.], [4., 4., 0.], [0., 4., 0.]].map(DVec3::from));
    scene.lights.push(PointLight {
        name: String::new(),
        kind: PointLightKind::Point,
        position: point(&given["source"]),
        direction: -DVec3::Z,
        intensity: [(given["flux_lm"].as_f64().unwrap() / (4.0 * PI)) as f32; 3],
        range: None,
    });
    let points: Vec<_> = given["points"].as_array().unwrap().iter().map(|p| (point(p), DVec3::Z)).collect();
    let expected = numbers(&case["results"]["illuminance_lx"]);
    for (e, exact) in illuminance(&scene, &points, 0.001).iter().zip(expected) {
        assert!((e / exact - 1.0).abs() < 1e-5, "{e} for {exact}");
    }
}

/// CIE 171:2006, 5.3: a diffuse area source without reflections; catalogue 16, the exact polygon factor, without noise.
#[test]
fn catalogue_16_area_source() {
    let case = case("cie171", "cie-5.3-1");
    let given = &case["given"];
    let mut scene = room(DVec3::new(4.0, 4.0, 3.0), matte("black", [0.0; 3], [0.0; 3]));
    scene.materials.push(matte("lamp", [0.0; 3], [1000.0; 3]));
    let lamp = [[1.5, 1.5, 2.999_999], [1.5, 2.5, 2.999_999], [2.5, 2.5, 2.999_999], [2.5, 1.5, 2.999_999]];
    scene.add_quad("lamp", 1, lamp.map(DVec3::from));
    for (points, normal, results) in [("floor_points", DVec3::Z, "floor_lx"), ("wall_points", DVec3::X, "wall_lx")] {
        let places: Vec<_> = given[points].as_array().unwrap().iter().map(|p| (point(p), normal)).collect();
        let expected = numbers(&case["results"][results]);
        for (e, exact) in illuminance(&scene, &places, 0.01).iter().zip(expected) {
            assert!((e / exact - 1.0).abs() < 1e-4, "{points}: {e} for {exact}");
        }
    }
}

/// Catalogue 84: on open ground a sky gives its horizontal illuminance, 7πL_z/9 for the overcast one, and 0.396177 of
/// it on a wall.
#[test]
fn catalogue_84_skies() {
    let mut scene = Scene { up: Up::Z, ..Scene::default() };
    scene.materials.push(matte("black", [0.0; 3], [0.0; 3]));
    scene.add_quad("ground", 0, [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(DVec3::from));
    let places = [
        (DVec3::new(0.5, 0.5, 0.0), DVec3::Z),
        (DVec3::new(0.5, 0.5, 1.0), DVec3::Z),
        (DVec3::new(0.5, 0.5, 9.0), DVec3::X),
    ];
    scene.sky = Sky::Overcast { horizontal: [10_000.0; 3] };
    let overcast = illuminance(&scene, &places, 0.005);
    assert!((overcast[0] / 10_000.0 - 1.0).abs() < 0.005, "{overcast:?}");
    assert!((overcast[1] / 10_000.0 - 1.0).abs() < 0.005, "{overcast:?}");
    assert!((overcast[2] / 3961.77 - 1.0).abs() < 0.01, "{overcast:?}");
    scene.sky = Sky::Uniform([1000.0; 3]);
    let uniform = illuminance(&scene, &places[..1], 0.005);
    assert!((uniform[0] / (1000.0 * PI) - 1.0).abs() < 1e-5, "{uniform:?}");
}

/// A sealed dark room, x > 2, beside a bright one, their common wall of zero thickness: one-sided faces back to back,
/// or a single double-sided sheet. Objects of the dark room are called so.
fn dark_beside_bright(sheet: bool) -> Scene {
    let bright = room(DVec3::splat(2.0), matte("bright", [0.8; 3], [0.0; 3]));
    let dark = room(DVec3::splat(2.0), Material::default());
    let mut scene = Scene { materials: bright.materials.clone(), up: Up::Z, ..Scene::default() };
    scene.materials.push(Material { double_sided: true, ..matte("sheet", [0.8; 3], [0.0; 3]) });
    scene.materials.push(matte("lamp", [0.0; 3], [1000.0; 3]));
    for (rooms, shift, prefix) in [(&bright, 0.0, ""), (&dark, 2.0, "dark ")] {
        for object in &rooms.objects {
            let is_wall = object.name == if shift > 0.0 { "west" } else { "east" };
            if sheet && is_wall && shift > 0.0 {
                continue;
            }
            let corners = |t| rooms.corners(t).map(|p| p + shift * DVec3::X);
            let triangles: Vec<[DVec3; 3]> = object.triangles.clone().map(corners).collect();
            scene.add_triangles(&format!("{prefix}{}", object.name), usize::from(sheet && is_wall), &triangles);
        }
    }
    let lamp = [[0.5, 0.5, 1.9], [0.5, 1.5, 1.9], [1.5, 1.5, 1.9], [1.5, 0.5, 1.9]];
    scene.add_quad("lamp", 2, lamp.map(DVec3::from));
    scene
}

/// Nothing leaks through walls of zero thickness.
#[test]
fn no_light_leaks_through_walls_of_zero_thickness() {
    for sheet in [false, true] {
        let scene = dark_beside_bright(sheet);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = SolveOptions { element_size: Some(0.1), rays: 256, ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &options, &()).unwrap();
        let (mut bright, mut leaked) = (0f32, 0f32);
        for (e, h) in solution.irradiance().iter().enumerate() {
            let centre = solution.elements.centre(&mesh, e as u32) + 1e-6 * solution.elements.normal(&mesh, e as u32);
            if centre.x > 2.0 {
                leaked = leaked.max(h[1]);
            } else {
                bright = bright.max(h[1]);
            }
        }
        assert!(bright > 100.0);
        assert!(leaked < 1e-6 * bright, "sheet {sheet}: {leaked} of {bright}");
    }
}

/// Nor does it between charts of a lightmap, when seams are fitted, or where vertices of two rooms are at one place.
#[test]
fn no_light_leaks_into_texels_and_vertices() {
    for sheet in [false, true] {
        let scene = dark_beside_bright(sheet);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let baked = bake(&tracer, &BakeOptions { error: 0.05, ..BakeOptions::default() }, &()).unwrap();
        let map = lightmap(&baked, Some(30.0), 4096, &()).unwrap();
        let vertices = vertex_light(&baked, &()).unwrap();
        let (mut bright, mut leaked) = (0f32, 0f32);
        let mut count = |object: usize, flipped: bool, light: f32| {
            // The sheet belongs to the bright room; its back looks into the dark one.
            let name = &scene.objects[object].name;
            let most = if name.starts_with("dark") || (sheet && name == "east" && flipped) {
                &mut leaked
            } else {
                &mut bright
            };
            *most = most.max(light);
        };
        for primitive in map.primitives.iter().chain(&vertices.primitives) {
            match &primitive.light {
                Light::Lightmap { page, uv } => {
                    for corners in &primitive.triangles {
                        let [a, b, c] = corners.map(|v| Vec2::from(uv[v as usize]));
                        for k in 0..100u16 {
                            let (u, v) = (f32::from(k % 10) / 9.0, f32::from(k / 10) / 9.0);
                            let at = a + u * (1.0 - v) * (b - a) + v * (c - a);
                            let read = look_up(map.pages[*page], &map.irradiance[*page], at);
                            count(primitive.object, primitive.flipped, read[1]);
                        }
                    }
                }
                Light::Vertex { irradiance } => {
                    irradiance.iter().for_each(|e| count(primitive.object, primitive.flipped, e[1]));
                }
                Light::None => panic!("an object came back without light"),
            }
        }
        assert!(bright > 100.0);
        assert!(leaked < 1e-6 * bright, "sheet {sheet}: {leaked} of {bright}");
    }
}

/// A double-sided sheet at x = 2 that parts a room of four metres, in so many quads; and a floor that ends there.
fn behind_a_sheet(quads: u32, one_floor: bool) -> Scene {
    let mut scene = room(DVec3::new(4.0, 2.0, 2.0), matte("wall", [0.8; 3], [0.0; 3]));
    if !one_floor {
        let mut whole = std::mem::take(&mut scene);
        scene = Scene { materials: std::mem::take(&mut whole.materials), up: Up::Z, ..Scene::default() };
        for object in &whole.objects[1..] {
            let triangles: Vec<[DVec3; 3]> = object.triangles.clone().map(|t| whole.corners(t)).collect();
            scene.add_triangles(&object.name, 0, &triangles);
        }
        for x in [0.0, 2.0] {
            let floor = [[x, 0., 0.], [x + 2., 0., 0.], [x + 2., 2., 0.], [x, 2., 0.]];
            scene.add_quad("floor", 0, floor.map(DVec3::from));
        }
    }
    let part = |i: u32| {
        let [y, v] = [i, i + 1].map(|i| 2.0 * f64::from(i) / f64::from(quads));
        let [a, b, c, d] = [[2., y, 0.], [2., y, 2.], [2., v, 2.], [2., v, 0.]].map(DVec3::from);
        [[a, b, c], [a, c, d]]
    };
    let sheet: Vec<[DVec3; 3]> = (0..quads).flat_map(part).collect();
    scene.materials.push(Material { double_sided: true, ..matte("sheet", [0.8; 3], [0.0; 3]) });
    scene.add_triangles("sheet", 1, &sheet);
    scene
}

/// A wall that parts a room of 3 × 2 × 2.5 m at x = 1.537, a sheet or a closed box so thick, and sunk so deep into floor,
/// ceiling and both sides, each of one polygon.
fn behind_a_wall(thickness: f64, sunk: f64) -> Scene {
    let size = DVec3::new(3.0, 2.0, 2.5);
    let mut scene = room(size, matte("wall", [0.8; 3], [0.0; 3]));
    let low = DVec3::new(1.537, -sunk, -sunk);
    let high = DVec3::new(1.537 + thickness, size.y + sunk, size.z + sunk);
    if thickness == 0.0 {
        scene.materials.push(Material { double_sided: true, ..matte("sheet", [0.8; 3], [0.0; 3]) });
        let sheet = [low, low.with_z(high.z), high, high.with_z(low.z)];
        scene.add_quad("sheet", 1, sheet);
        return scene;
    }
    // A room turned inside out.
    let wall = room(high - low, Material::default());
    for object in &wall.objects {
        let turned = |t: usize| wall.corners(t).map(|p| low + p);
        let triangles: Vec<[DVec3; 3]> = object.triangles.clone().map(turned).map(|[a, b, c]| [a, c, b]).collect();
        scene.add_triangles("box", 0, &triangles);
    }
    scene
}

/// What must hold of a scene of two rooms parted at `middle`: with a lamp in the lower one of them, the other reads less
/// than a millionth of it, in elements, at points, in texels and at vertices.
fn assert_no_light_leaks(mut scene: Scene, middle: Range<f64>, named: &str) {
    let lamp = [[0.5, 0.5, 1.9], [0.5, 1.5, 1.9], [1.2, 1.5, 1.9], [1.2, 0.5, 1.9]];
    scene.materials.push(matte("lamp", [0.0; 3], [1000.0; 3]));
    scene.add_quad("lamp", scene.materials.len() - 1, lamp.map(DVec3::from));
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let (mut bright, mut leaked) = ([0f32; 4], [0f32; 4]);
    // The front of a sheet looks into the bright room.
    let is_dark = |object: usize, x: f64, flipped: bool| {
        if scene.objects[object].name == "sheet" { flipped } else { x > middle.end - 1e-9 }
    };
    let mut count = |way: usize, dark: bool, light: f32| {
        let most = if dark { &mut leaked[way] } else { &mut bright[way] };
        *most = most.max(light);
    };

    let solve = SolveOptions { element_size: Some(0.2), rays: 64, ..SolveOptions::default() };
    let solution = Solution::new(&tracer, &solve, &()).unwrap();
    for (e, h) in solution.irradiance().iter().enumerate() {
        let (triangle, side) = solution.elements.place(e as u32);
        let object = scene.triangle_object[mesh.source[triangle] as usize] as usize;
        count(0, is_dark(object, solution.elements.centre(&mesh, e as u32).x, side == Side::Back), h[1]);
    }

    // On the floor, within a decimetre of the wall.
    let across = |i: u32| {
        let near = 0.01 + 0.02 * f64::from(i % 5);
        let x = if i % 10 < 5 { middle.start - near } else { middle.end + near };
        (DVec3::new(x, 0.07 + 0.2 * f64::from(i / 10), 0.0), DVec3::Z)
    };
    let points: Vec<_> = (0..100).map(across).collect();
    let options = MeasureOptions { error: 0.1, solve, ..MeasureOptions::default() };
    let measured = measure(&tracer, &points, &options, &()).unwrap();
    for ((point, _), h) in points.iter().zip(&measured.irradiance) {
        count(1, point.x > middle.end, h[1]);
    }

    let baked = bake(&tracer, &BakeOptions { error: 0.1, solve, ..BakeOptions::default() }, &()).unwrap();
    let map = lightmap(&baked, Some(10.0), 4096, &()).unwrap();
    let vertices = vertex_light(&baked, &()).unwrap();
    for primitive in map.primitives.iter().chain(&vertices.primitives) {
        let object = &scene.objects[primitive.object];
        for corners in &primitive.triangles {
            let place = |v: u32| {
                let vertex = &primitive.vertices[v as usize];
                let at = vertex.corners.map(|c| scene.positions[object.vertices.start + c as usize]);
                (0..3).map(|k| f64::from(vertex.weights[k]) * at[k]).sum::<DVec3>()
            };
            let [a, b, c] = corners.map(place);
            let dark = is_dark(primitive.object, (a + b + c).x / 3.0, primitive.flipped);
            match &primitive.light {
                Light::Lightmap { page, uv } => {
                    let [a, b, c] = corners.map(|v| Vec2::from(uv[v as usize]));
                    for k in 0..100u16 {
                        let (u, v) = (f32::from(k % 10) / 9.0, f32::from(k / 10) / 9.0);
                        let at = a + u * (1.0 - v) * (b - a) + v * (c - a);
                        count(2, dark, look_up(map.pages[*page], &map.irradiance[*page], at)[1]);
                    }
                }
                Light::Vertex { irradiance } => {
                    corners.iter().for_each(|v| count(3, dark, irradiance[*v as usize][1]));
                }
                Light::None => panic!("an object came back without light"),
            }
        }
    }
    for way in 0..4 {
        assert!(bright[way] > 100.0, "{named}: {bright:?}");
        assert!(leaked[way] < 1e-6 * bright[way], "{named}: {leaked:?} of {bright:?}");
    }
}

/// A floor in one piece below a wall without thickness carried light into the next room, 0.5 %; and so did one that
/// ends at the wall, where the wall was divided otherwise than the floor.
#[test]
fn no_light_leaks_below_a_sheet_on_one_floor() {
    for (quads, one_floor) in [(1, true), (5, true), (5, false)] {
        assert_no_light_leaks(behind_a_sheet(quads, one_floor), 2.0..2.0, &format!("{quads} {one_floor}"));
    }
}

/// Elements wider than a wall carried 0.01 % of the light below it, and 0.6 % where a sheet went through the floor.
#[test]
fn no_light_leaks_below_walls_on_and_through_one_floor() {
    for (thickness, sunk) in [(0.1, 0.0), (0.1, 0.03), (0.0, 0.03)] {
        let scene = behind_a_wall(thickness, sunk);
        assert_no_light_leaks(scene, 1.537..1.537 + thickness, &format!("{thickness} thick, {sunk} sunk"));
    }
}

/// Irradiance at 500 points of a closed box with two blocks, with references of another program's path tracer (their own
/// noise is 0.3 %): 1 % was asked, and the audit has to agree with what is found here.
#[test]
fn points_with_reference_irradiances() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/box");
    let scene = radiosity::io::load(&folder.join("cornell.obj"), &Default::default()).unwrap().scene;
    let points = radiosity::io::read_points_csv(&folder.join("points.csv")).unwrap().points;
    let text = std::fs::read_to_string(folder.join("reference.csv")).unwrap();
    let reference: Vec<f64> = text
        .lines()
        .skip(1)
        .map(|line| {
            let bands: Vec<f32> = line.split(',').take(3).map(|x| x.parse().unwrap()).collect();
            f64::from(luminance([bands[0], bands[1], bands[2]]))
        })
        .collect();
    assert_eq!(points.len(), reference.len());
    let points: Vec<_> = points.iter().map(|p| (p.position, p.normal)).collect();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let measured = measure(&tracer, &points, &MeasureOptions::default(), &()).unwrap();
    assert!(measured.achieved && measured.audit.upper <= 0.01, "{:?}", measured.audit);
    let answer = measured.irradiance.iter().map(|e| f64::from(luminance(*e)));
    let (mut square, mut bias) = (0.0, 0.0);
    for (h, e) in answer.zip(&reference) {
        square += (h - e).powi(2);
        bias += h - e;
    }
    let n = reference.len() as f64;
    let mean = reference.iter().sum::<f64>() / n;
    assert!((square / n).sqrt() < 0.012 * mean, "{}", (square / n).sqrt() / mean);
    assert!((bias / n).abs() < 0.003 * mean, "{}", bias / n / mean);
}

/// One point alone once came back as certified with error and bound of zero.
#[test]
fn a_single_point_is_not_certified_for_nothing() {
    let scene = radiosity::cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let options = MeasureOptions { error: 0.05, ..MeasureOptions::default() };
    let measured = measure(&tracer, &[(DVec3::new(0.1, 0.0, 0.1), DVec3::Y)], &options, &()).unwrap();
    assert!(measured.audit.upper > 0.0 && measured.audit.upper.is_finite(), "{:?}", measured.audit);
    assert_eq!(measured.achieved, measured.audit.upper <= 0.05);
}

/// The same bytes on one thread and on two.
#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let scene = radiosity::cornell_box();
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            let options = SolveOptions { element_size: Some(0.05), rays: 32, ..SolveOptions::default() };
            let solution = Solution::new(&tracer, &options, &()).unwrap();
            let places = [(DVec3::new(0.1, 0.0, 0.1), DVec3::Y), (DVec3::new(0.3, 0.3, 0.559), -DVec3::Z)];
            let measured = measure(&tracer, &places, &MeasureOptions::default(), &()).unwrap();
            let bits = |values: &[[f32; 3]]| values.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
            (bits(solution.irradiance()), bits(&measured.irradiance), measured.audit.error.to_bits())
        })
    };
    assert_eq!(run(1), run(2));
}

/// The rows of a box 1 × 2 × 10 seen from inside, the number of ids, and by element the area and the number of the face.
fn rows_of_a_box(columns: usize) -> (HitTable, usize, Vec<f64>, Vec<usize>) {
    let scene = room(DVec3::new(1.0, 2.0, 10.0), Material::default());
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let elements = Elements::new(&scene, &mesh, 0.5);
    let all = 0..elements.len() as u32;
    let area: Vec<f64> = all.clone().map(|e| elements.area(&mesh, e)).collect();
    let ids = IdSpace { elements: &elements, sky: SkyPatches::new(&scene.sky, scene.up.direction()) };
    let mut table = HitTable::new(area.clone(), &ids);
    let exposure = Exposure::default();
    let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    table.extend(&tracer, (&ids, &[]), &receivers, columns, &()).unwrap();
    let face = |e: u32| scene.triangle_object[mesh.source[elements.place(e).0] as usize] as usize;
    (table, ids.len(), area, all.map(face).collect())
}

/// Catalogue 8: A_i F_ij = A_j F_ji between faces of areas 1 : 10, each direction found by rays of its own; and the
/// factors are the known ones (Howell, C-11, of the opposite faces 2 × 10 that are 1 apart: 0.573376).
#[test]
fn catalogue_8_reciprocity_between_unequal_faces() {
    let (table, _, area, face) = rows_of_a_box(2048);
    let mut flow = [[0f64; 6]; 6];
    for (i, &from) in face.iter().enumerate() {
        for id in table.row_ids(i) {
            flow[from][face[id as usize]] += area[i] / 2048.0;
        }
    }
    for (i, row) in flow.iter().enumerate() {
        for (j, there) in row.iter().enumerate() {
            let back = flow[j][i];
            assert!((there - back).abs() < 0.01 * there.max(back) + 1e-3, "{i} {j}: {there} {back}");
        }
    }
    // West and east are the last two faces of a room.
    let opposite = flow[4][5] / 20.0;
    assert!((opposite / 0.573_376 - 1.0).abs() < 0.005, "{opposite}");
}

/// Catalogue 0b, 35: every row sums to one, before any repair.
#[test]
fn catalogue_35_rows_sum_to_one() {
    let (table, ids, _, _) = rows_of_a_box(64);
    assert!(table.rows_mean(&vec![[1f32; 4]; ids]).iter().all(|sum| sum[0] == 1.0));
}

/// Catalogue 1: emitted = absorbed + escaped, as far as the rays can tell.
#[test]
fn catalogue_1_energy_is_conserved() {
    let scene = radiosity::cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let options = SolveOptions { rays: 256, ..SolveOptions::default() };
    let balance = Solution::new(&tracer, &options, &()).unwrap().balance();
    for band in 0..3 {
        assert!(balance.defect[band].abs() < 4e-3, "{balance:?}");
        assert!(balance.lost_on_backs[band] < 1e-3 * balance.emitted[band], "{balance:?}");
    }
}
