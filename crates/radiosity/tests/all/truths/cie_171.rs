//! Cases of CIE 171:2006 that this path touches: reflectors, interreflection, skies through openings.

use super::*;

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
