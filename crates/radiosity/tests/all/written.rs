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

/// Of thirty thousand flakes in a room each gets few rays, and what is shown is gathered, not read from them.
#[test]
fn small_things_get_their_share_of_the_rays() {
    let grey = Material { base_color: [0.5, 0.5, 0.5, 1.0], ..Material::default() };
    let lamp = Material { emissive: [100.0; 3], ..grey.clone() };
    let materials = vec![grey.clone(), lamp, Material { double_sided: true, ..grey }];
    let mut scene = Scene { materials, up: Up::Z, ..Scene::default() };
    let sides = DVec3::new(4.0, 3.0, 2.5);
    for axis in 0..3 {
        let [x, y, z] = [axis, (axis + 1) % 3, (axis + 2) % 3].map(|k| DVec3::AXES[k] * sides[k]);
        scene.add_quad("near", 0, [DVec3::ZERO, x, x + y, y]);
        scene.add_quad("far", 0, [z, z + y, z + x + y, z + x]);
    }
    let lamp = |x: f64, y: f64| DVec3::new(2.0 + x, 1.5 + y, 2.49);
    scene.add_quad("lamp", 1, [lamp(-0.3, -0.3), lamp(-0.3, 0.3), lamp(0.3, 0.3), lamp(0.3, -0.3)]);
    for k in 0..15_500u32 {
        let at = DVec3::new(0.01 + 0.03 * f64::from(k % 125), 0.01 + 0.023 * f64::from(k / 125), 0.5);
        let [x, y] = [DVec3::new(0.004, 0.0, 0.001), DVec3::new(0.0, 0.004, 0.002)];
        scene.add_quad("flake", 2, [at, at + x, at + x + y, at + y]);
    }
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let baked = bake(&tracer, &BakeOptions { error: 0.1, ..BakeOptions::default() }, &()).unwrap();
    assert!(baked.achieved && baked.gather > 0, "{:?}", baked.rounds);
    let elements = &baked.solution.elements;
    let shares = (0..elements.len() as u32).map(|e| elements.share(&mesh, e));
    let (small, rays): (usize, f64) = shares.filter(|share| *share < 0.1).fold((0, 0.0), |(n, s), x| (n + 1, s + x));
    assert!(small >= 2 * 31_000 && rays < 0.02 * small as f64, "{small} small elements have {rays} cells' rays");
}
