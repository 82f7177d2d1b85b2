//! Rooms on sites that are hundreds of times as wide are lit as rooms alone are.

use glam::{DVec3, UVec2, Vec2};
use radiosity::io::gltf_out::{Light, LitPrimitive};
use radiosity::{
    BakeOptions, Material, MeasureOptions, Mesh, Scene, Sky, Solution, SolveOptions, Tracer, bake, lightmap, luminance,
    measure,
};

/// What is asked of what is written.
const ERROR: f64 = 0.05;

const SIDES: DVec3 = DVec3::new(4.0, 2.5, 3.0);

/// A room with a lamp below its ceiling, whose floor is a ground so far to all sides of its middle.
fn room_on(half: DVec3) -> Scene {
    let gray = |name: &str, emissive: f32| Material {
        name: name.to_owned(),
        base_color: [0.6, 0.6, 0.6, 1.0],
        emissive: [emissive; 3],
        ..Material::default()
    };
    let mut scene = Scene { sky: Sky::Uniform([3000.0; 3]), ..Scene::default() };
    scene.materials = vec![gray("wall", 0.0), gray("lamp", 2000.0)];
    let [x, y, z] = [0, 1, 2].map(|k| DVec3::AXES[k] * SIDES[k]);
    let o = DVec3::ZERO;
    scene.add_quad("ceiling", 0, [y, y + x, y + x + z, y + z]);
    scene.add_quad("wall", 0, [o, x, x + y, y]);
    scene.add_quad("wall", 0, [z, z + y, z + x + y, z + x]);
    scene.add_quad("wall", 0, [o, y, y + z, z]);
    scene.add_quad("wall", 0, [x, x + z, x + y + z, x + y]);
    let lamp = [(1.7, 1.2), (2.3, 1.2), (2.3, 1.8), (1.7, 1.8)];
    scene.add_quad("lamp", 1, lamp.map(|(x, z)| DVec3::new(x, 2.45, z)));
    let middle = 0.5 * (x + z);
    let ground = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    scene.add_quad("ground", 0, ground.map(|(u, w)| middle + DVec3::new(u * half.x, 0.0, w * half.z)));
    scene
}

/// Mean illuminance of what counts, by the solution alone.
fn solved(tracer: &Tracer, counts: impl Fn(usize) -> bool) -> f64 {
    let solution = Solution::new(tracer, &SolveOptions { rays: 256, ..SolveOptions::default() }, &()).unwrap();
    let (mut sum, mut all) = (0.0, 0.0);
    for (e, (h, area)) in solution.irradiance().iter().zip(solution.exposed_area()).enumerate() {
        if counts(solution.elements.place(e as u32).0) {
            sum += area * f64::from(luminance(*h));
            all += area;
        }
    }
    sum / all
}

/// Texels between the first two corners of something that is written.
fn texels(primitive: &LitPrimitive, pages: &[[u32; 2]]) -> f32 {
    let Light::Lightmap { page, uv } = &primitive.light else { panic!("written to a map") };
    let [a, b, _] = primitive.triangles[0].map(|vertex| Vec2::from(uv[vertex as usize]));
    ((a - b) * UVec2::from(pages[*page]).as_vec2()).length()
}

#[test]
fn a_room_on_a_wide_site_is_lit_as_it_is_alone() {
    let points: Vec<(DVec3, DVec3)> = (0..48)
        .map(|i| {
            let (u, v) = (0.1 + 0.8 * f64::from(i % 8) / 7.0, 0.1 + 0.8 * f64::from(i / 8 % 3) / 2.0);
            match i / 24 {
                0 => (DVec3::new(u * SIDES.x, 0.0, v * SIDES.z), DVec3::Y),
                _ => (DVec3::new(u * SIDES.x, v * SIDES.y, 0.0), DVec3::Z),
            }
        })
        .collect();
    let eye = DVec3::new(1.0, 1.5, 1.0);
    let light = |scene: &Scene| -> Vec<f32> {
        let mesh = Mesh::new(scene);
        let tracer = Tracer::new(scene, &mesh).seen_from(&[eye]);
        let options = MeasureOptions { error: 0.01, ..MeasureOptions::default() };
        let measured = measure(&tracer, &points, &options, &()).unwrap();
        assert!(measured.achieved, "{:?}", measured.audit);
        measured.irradiance.into_iter().map(luminance).collect()
    };
    let wide = room_on(DVec3::splat(300.0));
    let (on_site, alone) = (light(&wide), light(&room_on(0.5 * SIDES)));
    let off: f32 = on_site.iter().zip(&alone).map(|(a, b)| (a - b).powi(2)).sum();
    let all: f32 = alone.iter().map(|e| e.powi(2)).sum();
    assert!((off / all).sqrt() < 0.02, "{on_site:?} {alone:?}");

    // As it is cut, solved and written: nothing of the room is known to who looks from nowhere.
    let mesh = Mesh::new(&wide);
    let is_room = |t: usize| mesh.corners(t).iter().all(|p| p.distance(0.5 * SIDES) < SIDES.length());
    let small = room_on(0.5 * SIDES);
    let small_mesh = Mesh::new(&small);
    let alone = solved(&Tracer::new(&small, &small_mesh), |_| true);
    let on_site = solved(&Tracer::new(&wide, &mesh).seen_from(&[eye]), is_room);
    assert!((on_site / alone - 1.0).abs() < 0.02, "{on_site} {alone}");
    let written = |tracer: &Tracer| {
        let baked = bake(tracer, &BakeOptions { error: ERROR, ..BakeOptions::default() }, &()).unwrap();
        let map = lightmap(&baked, None, 2048, &()).unwrap();
        let wall = map.primitives.iter().find(|p| wide.objects[p.object].name == "wall").unwrap();
        let solution = &baked.solution;
        let count = (0..solution.elements.len()).filter(|e| is_room(solution.elements.place(*e as u32).0)).count();
        (count, texels(wall, &map.pages), map.audit.upper)
    };
    let (few, coarse, _) = written(&Tracer::new(&wide, &mesh));
    let (many, fine, upper) = written(&Tracer::new(&wide, &mesh).seen_from(&[eye]));
    assert!(many > 20 * few, "{few} {many} elements");
    assert!(fine > 8.0 * coarse, "{coarse} {fine} texels");
    assert!(upper <= ERROR, "{upper}");
}
