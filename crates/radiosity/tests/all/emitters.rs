//! What gives light: surfaces that are partly there, lamps with pictures, the sun of a sky.

use glam::{DAffine2, DVec3, Vec2};
use radiosity::transport::PointReceivers;
use radiosity::{
    AlphaMode, Elements, Material, MeasureOptions, Mesh, Place, Referee, Scene, Side, Sky, Solution, SolveOptions,
    Texture, TextureRef, Tracer, Up, Wrap, measure,
};
use std::f64::consts::PI;

/// A square about the vertical axis at a height, facing up or down.
fn square(half: f64, z: f64, up: bool) -> [DVec3; 4] {
    let p = |x: f64, y: f64| DVec3::new(x * half, y * half, z);
    let corners = [p(-1., -1.), p(1., -1.), p(1., 1.), p(-1., 1.)];
    if up { corners } else { [corners[0], corners[3], corners[2], corners[1]] }
}

fn black(luminance: f32) -> Material {
    Material { base_color: [0.0, 0.0, 0.0, 1.0], emissive: [luminance; 3], ..Material::default() }
}

/// A floor under a lamp of 1000 cd/m² that faces down. With so much that faces away and is as bright, the lamp is not much
/// brighter than what is around all on average and goes through the rows.
fn lamp_over_floor(alpha: f32, alpha_mode: AlphaMode, glow: bool) -> Scene {
    let lamp = Material { base_color: [0.0, 0.0, 0.0, alpha], alpha_mode, ..black(1000.0) };
    let materials = vec![black(0.0), lamp, black(1000.0)];
    let mut scene = Scene { materials, up: Up::Z, ..Scene::default() };
    scene.add_quad("floor", 0, square(1.0, 0.0, true));
    scene.add_quad("lamp", 1, square(0.5, 1.0, false));
    if glow {
        for z in [3.0, 3.1, 3.2, 3.3] {
            scene.add_quad("glow", 2, square(2.0, z, true));
        }
    }
    scene
}

/// Mean illuminance of the floor by direct columns, by rows, and by the referee at its middle.
fn floor_light(scene: &Scene) -> [f64; 3] {
    let mesh = Mesh::new(scene);
    let tracer = Tracer::new(scene, &mesh);
    let options = SolveOptions { cells: 2000, rays: 1024, ..SolveOptions::default() };
    let solution = Solution::new(&tracer, &options, &()).unwrap();
    let (mut direct, mut indirect, mut area) = (0.0, 0.0, 0.0);
    for e in 0..solution.elements.len() {
        let (triangle, _) = solution.elements.place(e as u32);
        if scene.triangle_object[mesh.source[triangle] as usize] == 0 {
            area += solution.area[e];
            direct += solution.area[e] * f64::from(solution.columns.mean(e)[1]);
            indirect += solution.area[e] * f64::from(solution.indirect()[e][1]);
        }
    }
    let place = Place { point: DVec3::new(0.01, 0.02, 0.0), normal: DVec3::Z, triangle: u32::MAX };
    let referee = Referee::new(&tracer).irradiance(&place, 1 << 18, 7);
    [direct / area, indirect / area, f64::from(referee[1])]
}

/// A lamp that is cut out gave light all the same; one of half opacity gave half through rows and all of it by samples.
#[test]
fn surfaces_give_light_as_far_as_they_are_there() {
    for glow in [false, true] {
        let whole = floor_light(&lamp_over_floor(1.0, AlphaMode::Opaque, glow));
        // The lamp goes one way or the other.
        let [used, unused] = if glow { [1, 0] } else { [0, 1] };
        assert!(whole[used] > 300.0 && whole[unused] == 0.0, "{whole:?}");
        let cut = floor_light(&lamp_over_floor(0.0, AlphaMode::Mask { cutoff: 0.5 }, glow));
        assert_eq!(cut, [0.0; 3]);
        for alpha in [0.5, 0.25] {
            let part = floor_light(&lamp_over_floor(alpha, AlphaMode::Blend, glow));
            for k in [used, 2] {
                let share = part[k] / whole[k];
                // Of 262,144 paths enough are stopped for 0.5 %; what stops a row's ray is chosen for each ray anew.
                assert!((share / f64::from(alpha) - 1.0).abs() < 0.02, "{k}: {share} for {alpha}");
            }
            assert_eq!(part[unused], 0.0);
        }
    }
}

/// Light that enters leaves, also where surfaces let a part of it through.
#[test]
fn the_balance_closes_with_blended_surfaces() {
    let mut scene = lamp_over_floor(0.5, AlphaMode::Blend, false);
    scene.materials[0].base_color = [0.5, 0.5, 0.5, 1.0];
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let balance =
        Solution::new(&tracer, &SolveOptions { rays: 512, ..SolveOptions::default() }, &()).unwrap().balance().unwrap();
    assert!((f64::from(balance.emitted[1]) / (0.5 * 1000.0 * PI) - 1.0).abs() < 1e-3, "{balance:?}");
    assert!(balance.defect.iter().all(|d| d.abs() < 0.01), "{balance:?}");
}

/// Where the samples of an element met dark texels only, near rays of a gather added what the lamp gave already.
#[test]
fn lamps_with_pictures_are_counted_once() {
    const SIZE: u32 = 1024;
    const ELEMENT: f64 = 0.4;
    let picture =
        TextureRef { texture: 0, uv_set: 0, transform: DAffine2::IDENTITY, wrap: [Wrap::Clamp; 2], nearest: false };
    let lamp = Material { emissive_texture: Some(picture), ..black(1000.0) };
    let texels = vec![[255; 4]; (SIZE * SIZE) as usize];
    let bright = Texture { name: String::new(), width: SIZE, height: SIZE, texels };
    let mut scene = Scene { materials: vec![black(0.0), lamp], textures: vec![bright], up: Up::Z, ..Scene::default() };
    scene.add_quad("floor", 0, square(2.0, 0.0, true));
    scene.add_quad("lamp", 1, square(0.5, 0.3, false));
    let uv = |p: &DVec3| Vec2::new(p.x as f32 + 0.5, p.y as f32 + 0.5);
    scene.uvs[0] = scene.positions.iter().map(uv).collect();

    // Every other element of the lamp is bright all over but for the places where it is sampled.
    let mesh = Mesh::new(&scene);
    let elements = Elements::new(&scene, &mesh, ELEMENT);
    let mut dark = Vec::new();
    for e in (0..elements.len() as u32).step_by(2) {
        let (triangle, _) = elements.place(e);
        if scene.triangle_object[mesh.source[triangle] as usize] == 1 {
            dark.push(e as usize);
            let sampled: Vec<_> = elements.places(&scene, &mesh, e).collect();
            for at in sampled {
                let [a, b, c] = scene.corners(at.triangle);
                let p = (uv(&(a + at.uv.x * (b - a) + at.uv.y * (c - a))) * SIZE as f32).as_ivec2();
                for (x, y) in (-3..=3).flat_map(|y| (-3..=3).map(move |x| (p.x + x, p.y + y))) {
                    let clamp = |i: i32| i.clamp(0, SIZE as i32 - 1) as u32;
                    scene.textures[0].texels[(clamp(y) * SIZE + clamp(x)) as usize] = [0, 0, 0, 255];
                }
            }
        }
    }
    let tracer = Tracer::new(&scene, &mesh);
    let options = SolveOptions { element_size: Some(ELEMENT), ..SolveOptions::default() };
    let solution = Solution::new(&tracer, &options, &()).unwrap();
    assert!(!dark.is_empty() && dark.iter().all(|&e| solution.luminaires.promoted[e] == [0.0; 4]));
    assert!(solution.luminaires.carries(elements.place(dark[0] as u32).0, Side::Front));
    let places = [Place { point: DVec3::new(0.1, 0.1, 0.0), normal: DVec3::Z, triangle: u32::MAX }];
    let receivers = PointReceivers { places: &places, shaded: &[], salt: 0 };
    assert_eq!(solution.gather().irradiance(&receivers, 256, &()).unwrap(), [[[0.0; 3]; 2]]);
}

/// A floor under a clear sky with a sun of 0.53°, against the integral of the map. Rows and gathers met the sun by chance,
/// and so did the referee: the audit saw no more than its own noise.
#[test]
fn a_sun_in_the_sky_is_measured_and_certified() {
    let (width, height) = (1024, 512);
    let to_sun = DVec3::new(0.4, 0.5, 0.6).normalize();
    let mut pixels = Vec::with_capacity(width * height);
    let mut expected = 0.0;
    for y in 0..height {
        for x in 0..width {
            let mut mean = 0.0;
            // 8 × 8 places in each pixel.
            for k in 0..64 {
                let (u, v) = (x as f64 + ((k % 8) as f64 + 0.5) / 8.0, y as f64 + ((k / 8) as f64 + 0.5) / 8.0);
                let (azimuth, elevation) = (2.0 * PI * (u / width as f64 - 0.5), PI * (0.5 - v / height as f64));
                let level = elevation.cos();
                let direction = DVec3::new(level * azimuth.sin(), level * azimuth.cos(), elevation.sin());
                let angle = to_sun.angle_between(direction);
                let sky = if elevation > 0.0 { 2000.0 + 10_000.0 * (-3.0 * angle).exp() } else { 500.0 };
                mean += (sky + if angle < 0.00465 { 1.2e9 } else { 0.0 }) / 64.0;
            }
            pixels.push([mean as f32; 3]);
            let [top, bottom] = [y, y + 1].map(|y| PI * (0.5 - y as f64 / height as f64));
            let cosine = 0.5 * (top.sin().powi(2) - bottom.sin().powi(2));
            expected += mean * cosine.max(0.0) * 2.0 * PI / width as f64;
        }
    }
    let mut scene = Scene { materials: vec![Material::default()], up: Up::Z, ..Scene::default() };
    scene.add_quad("floor", 0, square(2.0, 0.0, true));
    let sky = Sky::Map { width, height, pixels };
    scene.set_sky(sky.clone(), "clear.hdr");
    // A file that was written of it has its sun, and is opened under the same sky.
    scene.set_sky(sky, "clear.hdr");
    assert_eq!(scene.lights.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["sun of clear.hdr"]);

    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let points: Vec<_> = (0..9).map(|i| (DVec3::new(0.4 * f64::from(i) - 1.6, 0.3, 0.0), DVec3::Z)).collect();
    let measured =
        measure(&tracer, &points, &MeasureOptions { error: 0.02, ..MeasureOptions::default() }, &()).unwrap();
    assert!(measured.achieved, "{:?}", measured.audit);
    for e in measured.irradiance {
        assert!((f64::from(e[1]) / expected - 1.0).abs() < 0.02, "{} for {expected}", e[1]);
    }
}
