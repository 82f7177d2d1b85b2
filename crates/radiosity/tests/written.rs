//! Light that is written is made finer until it is read back as well as was asked.

use glam::DVec3;
use radiosity::{
    BakeOptions, Baked, Material, Mesh, PointLight, PointLightKind, Scene, SolveOptions, Tracer, Up, bake, lightmap,
    vertex_light,
};

/// A floor in the sun under small roofs, and a meadow beside it: edges of hard shadows on one chart of many.
fn roofs_over_floor() -> Scene {
    let materials = vec![Material { base_color: [0.1, 0.1, 0.1, 1.0], ..Material::default() }];
    let mut scene = Scene { materials, up: Up::Z, ..Scene::default() };
    let quad = |x: f64, y: f64, z: f64, half: f64| {
        [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(u, v)| DVec3::new(x + half * u, y + half * v, z))
    };
    scene.add_quad("floor", 0, quad(0.0, 0.0, 0.0, 1.0));
    for i in 0..25 {
        let at = |i: i32| 0.3 * f64::from(i) - 0.57;
        scene.add_quad("roof", 0, quad(at(i % 5), at(i / 5), 1.0, 0.08));
    }
    scene.add_quad("meadow", 0, quad(6.0, 0.0, 0.0, 4.0));
    let direction = DVec3::new(0.2, 0.1, -1.0).normalize();
    scene.lights.push(PointLight {
        name: "sun".to_owned(),
        kind: PointLightKind::Directional,
        position: DVec3::ZERO,
        direction,
        intensity: [1000.0; 3],
        range: None,
    });
    scene
}

fn with<T>(error: f64, memory: usize, check: impl FnOnce(&Baked) -> T) -> T {
    let scene = roofs_over_floor();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solve = SolveOptions { memory, ..SolveOptions::default() };
    let baked = bake(&tracer, &BakeOptions { error, solve, ..BakeOptions::default() }, &()).unwrap();
    assert!(baked.achieved, "{:?}", baked.audit);
    check(&baked)
}

#[test]
fn a_map_that_misses_the_error_asked_gets_finer_texels_where_shadows_end() {
    with(0.01, 4 << 30, |baked| {
        let map = lightmap(baked, None, 4096, &()).unwrap();
        let [first, .., last] = &map.rounds[..] else { panic!("{:?}", map.rounds) };
        assert!(first.upper > 0.01 && map.audit.upper <= 0.01, "{:?}", map.rounds);
        // One chart of many, and of that what is rough.
        assert!(map.finest > 1.5 * map.density && last.lit < last.points / 2, "{:?}", map.rounds);
        assert_eq!((map.texels, map.needed), (last.points, None));
    });
}

#[test]
fn vertices_that_miss_the_error_asked_get_a_finer_lattice() {
    with(0.03, 4 << 30, |baked| {
        let light = vertex_light(baked, &()).unwrap();
        assert!(light.rounds.len() > 1 && light.rounds[0].upper > 0.03, "{:?}", light.rounds);
        assert!(light.audit.upper <= 0.03, "{:?}", light.rounds);
    });
}

#[test]
fn a_density_that_is_given_is_the_last_word() {
    with(0.01, 4 << 30, |baked| {
        let map = lightmap(baked, Some(20.0), 4096, &()).unwrap();
        assert!(map.rounds.len() == 1 && map.audit.upper > 0.01, "{:?}", map.rounds);
        assert_eq!((map.density, map.finest), (20.0, 20.0));
    });
}

#[test]
fn memory_limits_texels() {
    with(0.01, 100 << 20, |baked| {
        let map = lightmap(baked, None, 4096, &()).unwrap();
        assert!(map.audit.upper > 0.01 && map.texels <= (100 << 20) / 400, "{:?}", map.rounds);
        assert!(map.needed.is_some_and(|texels| texels > map.texels as f64), "{:?}", map.needed);
    });
}
