//! A sealed dark room beside a bright one gets less than a millionth of its light.

use super::*;
use radiosity::{Camera, RenderOptions, render};

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
/// Where a vertex lies that was written.
fn place(scene: &Scene, primitive: &LitPrimitive, vertex: u32) -> DVec3 {
    let LitVertex { corners, weights } = &primitive.vertices[vertex as usize];
    let first = scene.objects[primitive.object].vertices.start;
    let part = |k: usize| f64::from(weights[k]) * scene.positions[first + corners[k] as usize];
    (0..3).map(part).sum()
}

/// What is read of a map at so many times as many places, spread over a triangle of it: weights of the second and the third corner, and
/// the light.
fn read_over(map: &Lightmap, page: usize, [a, b, c]: [Vec2; 3], side: u16) -> impl Iterator<Item = ([f32; 2], f32)> {
    (0..side * side).map(move |k| {
        let [u, v] = [k % side, k / side].map(|k| f32::from(k) / f32::from(side - 1));
        let u = u * (1.0 - v);
        ([u, v], look_up(map.pages[page], &map.irradiance[page], a + u * (b - a) + v * (c - a))[1])
    })
}

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
                        let corners = corners.map(|v| Vec2::from(uv[v as usize]));
                        for (_, read) in read_over(&map, *page, corners, 10) {
                            count(primitive.object, primitive.flipped, read);
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
/// than a millionth of it, in elements, at points, in texels, at vertices and in pictures.
fn assert_no_light_leaks(mut scene: Scene, middle: Range<f64>, named: &str) {
    let lamp = [[0.5, 0.5, 1.9], [0.5, 1.5, 1.9], [1.2, 1.5, 1.9], [1.2, 0.5, 1.9]];
    scene.materials.push(matte("lamp", [0.0; 3], [1000.0; 3]));
    scene.add_quad("lamp", scene.materials.len() - 1, lamp.map(DVec3::from));
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let (mut bright, mut leaked) = ([0f32; 5], [0f32; 5]);
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
        for corners in &primitive.triangles {
            let [a, b, c] = corners.map(|v| place(&scene, primitive, v));
            let dark = is_dark(primitive.object, (a + b + c).x / 3.0, primitive.flipped);
            match &primitive.light {
                Light::Lightmap { page, uv } => {
                    let corners = corners.map(|v| Vec2::from(uv[v as usize]));
                    read_over(&map, *page, corners, 10).for_each(|(_, read)| count(2, dark, read));
                }
                Light::Vertex { irradiance } => {
                    corners.iter().for_each(|v| count(3, dark, irradiance[*v as usize][1]));
                }
                Light::None => panic!("an object came back without light"),
            }
        }
    }
    // Seen from the far end of either room, the foot of the wall in the middle.
    for (is_dark, x) in [(false, 0.3), (true, 3.7)] {
        let foot = DVec3::new(if is_dark { middle.end } else { middle.start }, 1.2, 0.0);
        let camera = Camera::look_at("", DVec3::new(x, 0.3, 1.6), foot, DVec3::Z, 1.2);
        let size = RenderOptions { width: 120, height: 90, ..RenderOptions::default() };
        let view = render(&baked, &camera, &size, &()).unwrap();
        view.illuminance.iter().filter(|lux| lux.is_finite()).for_each(|lux| count(4, is_dark, *lux));
    }
    for way in 0..5 {
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

/// The outside of a box.
fn add_box(scene: &mut Scene, name: &str, [low, high]: [DVec3; 2]) {
    let corner = |i: usize| DVec3::from_array([0, 1, 2].map(|k| if i >> k & 1 == 0 { low[k] } else { high[k] }));
    for side in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        scene.add_quad(name, 0, side.map(corner));
    }
}

/// A post in two sleeves that leave three centimetres of it open, where no texel has its middle: those there had light of whatever lay
/// beside them in the map.
#[test]
fn what_is_seen_between_the_middles_of_texels_is_lit() {
    let mut scene = Scene { sky: Sky::Uniform([1000.0; 3]), up: Up::Z, ..Scene::default() };
    scene.materials.push(matte("black", [0.0; 3], [0.0; 3]));
    let (post, sleeve, open) = (0.01, 0.05, 0.57..0.60);
    let around = |half: f64, z: [f64; 2]| [DVec3::new(-half, -half, z[0]), DVec3::new(half, half, z[1])];
    add_box(&mut scene, "post", around(post, [0.0, 1.04]));
    add_box(&mut scene, "sleeve", around(sleeve, [-0.1, open.start]));
    add_box(&mut scene, "sleeve", around(sleeve, [open.end, 1.2]));
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solve = SolveOptions { element_size: Some(0.05), ..SolveOptions::default() };
    let baked = bake(&tracer, &BakeOptions { error: 0.05, solve, ..BakeOptions::default() }, &()).unwrap();
    let map = lightmap(&baked, Some(8.0), 4096, &()).unwrap();
    let middle = (DVec3::new(post, 0.0, 0.585), DVec3::X);
    let options = MeasureOptions { error: 0.02, ..MeasureOptions::default() };
    let truth = measure(&tracer, &[middle], &options, &()).unwrap().irradiance[0][1];
    assert!((600.0..1400.0).contains(&truth), "{truth}");
    let mut count = 0;
    for primitive in map.primitives.iter().filter(|p| scene.objects[p.object].name == "post") {
        let Light::Lightmap { page, uv } = &primitive.light else { panic!("no lightmap") };
        for corners in &primitive.triangles {
            let [a, b, c] = corners.map(|v| place(&scene, primitive, v));
            for ([u, v], read) in read_over(&map, *page, corners.map(|v| Vec2::from(uv[v as usize])), 20) {
                let z = (a + f64::from(u) * (b - a) + f64::from(v) * (c - a)).z;
                if (0.575..0.595).contains(&z) {
                    assert!((0.6 * truth..1.4 * truth).contains(&read), "{read} of {truth} at {z}");
                    count += 1;
                }
            }
        }
    }
    assert!(count > 10, "{count}");
}
