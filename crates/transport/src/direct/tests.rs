use super::*;
use crate::PointReceivers;
use crate::polygon::point_to_triangle;
use glam::DVec3;
use radiosity_scene::{Elements, Material, Mesh, Scene};
use radiosity_trace::sampling::Random;
use std::f64::consts::PI;

/// A floor, and lamps of 0.2 m side in a row 2 m above it that face down, each half as bright as the one before.
fn lamps(count: u32, blocker: bool) -> Scene {
    let mut scene = Scene::default();
    let lamp = |l: f32| Material { emissive: [l; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
    scene.materials.push(Material::default());
    scene.materials.push(Material { double_sided: true, ..Material::default() });
    scene.materials.extend((0..count).map(|i| lamp(1000.0 * 0.5f32.powi(i as i32))));
    let quad = |low: DVec3, x: DVec3, y: DVec3| [low, low + x, low + x + y, low + y];
    scene.add_quad("floor", 0, quad(DVec3::new(-3., -3., 0.), DVec3::X * 6.0, DVec3::Y * 6.0));
    for i in 0..count {
        let low = DVec3::new(0.3 * f64::from(i), 0.0, 2.0);
        scene.add_quad("lamp", 2 + i as usize, quad(low, DVec3::Y * 0.2, DVec3::X * 0.2));
    }
    if blocker {
        // Half way up: hides what lies beyond x = 0.1 from a point below that.
        scene.add_quad("blocker", 1, quad(DVec3::new(0.1, -1.0, 1.0), DVec3::X * 2.0, DVec3::Y * 2.0));
    }
    scene
}

/// The mesh of a scene, its elements of a size with their areas, and its lights.
pub(crate) fn prepared(scene: &Scene, size: f64) -> (Mesh, Elements, Vec<f64>, Luminaires) {
    let mesh = Mesh::new(scene);
    let elements = Elements::new(scene, &mesh, size);
    let area: Vec<f64> = (0..elements.len() as u32).map(|e| elements.area(&mesh, e)).collect();
    let exitance: Vec<Bands> = (0..elements.len() as u32).map(|e| elements.optics(scene, &mesh, e).1).collect();
    let luminaires = Luminaires::new(&Tracer::new(scene, &mesh), &elements, &area, &exitance);
    (mesh, elements, area, luminaires)
}

fn columns(scene: &Scene, places: &[Place], rays: u32) -> Columns {
    let (mesh, _, _, luminaires) = prepared(scene, 10.0);
    let tracer = Tracer::new(scene, &mesh);
    let receivers = PointReceivers { places, shaded: &[], salt: 0 };
    luminaires.columns(&tracer, &receivers, &Shadowing { places: 1, rays }, &()).unwrap()
}

fn illuminance(scene: &Scene, places: &[Place], rays: u32) -> Vec<f64> {
    let columns = columns(scene, places, rays);
    (0..places.len()).map(|i| f64::from(columns.mean(i)[1])).collect()
}

fn on_the_floor(x: f64, y: f64) -> Place {
    Place { point: DVec3::new(x, y, 0.0), normal: DVec3::Z, triangle: u32::MAX }
}

/// What a lamp of luminance 1000 gives to a point of the floor, by Lambert's factor of the part from `from` to `to`.
fn exact(place: &Place, (from, to): (f64, f64)) -> f64 {
    let p = |x: f64, y: f64| DVec3::new(x, y, 2.0);
    let corners = [p(from, 0.0), p(from, 0.2), p(to, 0.2), p(to, 0.0)];
    let factor = point_to_triangle(place.point, place.normal, [corners[0], corners[1], corners[2]])
        + point_to_triangle(place.point, place.normal, [corners[0], corners[2], corners[3]]);
    1000.0 * PI * factor
}

/// In full light every lamp gives its exact factor, in whatever shares the rays are dealt out.
#[test]
fn full_light_is_exact() {
    let places: Vec<Place> = (0..20).map(|i| on_the_floor(0.1 * f64::from(i) - 0.7, 0.05)).collect();
    for (place, e) in places.iter().zip(illuminance(&lamps(6, false), &places, 64)) {
        let truth: f64 = (0..6)
            .map(|i| {
                let shifted = on_the_floor(place.point.x - 0.3 * f64::from(i), place.point.y);
                0.5f64.powi(i) * exact(&shifted, (0.0, 0.2))
            })
            .sum();
        assert!((e - truth).abs() < 1e-5 * truth, "{e} for {truth}");
    }
}

/// What is reached before time is over has the light that it has without a limit, to the bit; the rest has the mean of it.
#[test]
fn what_time_does_not_reach_has_the_mean() {
    struct After(usize);
    impl Progress for After {
        fn step(&self, done: usize, _total: usize) -> bool {
            done < self.0
        }
    }
    let scene = lamps(1, true);
    let (mesh, elements, area, luminaires) = prepared(&scene, 0.1);
    let (tracer, exposure) = (Tracer::new(&scene, &mesh), crate::Exposure::default());
    let receivers = crate::ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    let shadowing = Shadowing { places: 2, rays: 2 };
    let whole = luminaires.columns(&tracer, &receivers, &shadowing, &()).unwrap();
    let n = elements.len();
    assert!(luminaires.columns(&tracer, &receivers, &shadowing, &After(n / 2)).is_err());
    for after in [0, n / 2, n + 1] {
        let found = luminaires.columns_in_time(&tracer, &receivers, &shadowing, &area, &After(after));
        let is_same = |i: &usize| found.mean(*i) == whole.mean(*i) && found.seen(*i) == whole.seen(*i);
        let (same, other): (Vec<usize>, Vec<usize>) = (0..n).partition(is_same);
        // A little more than asked for: what is under way is brought to its end, on as many threads as there are.
        assert!(same.len() >= after.min(n) && (after > n || other.len() > n / 4), "{} of {n}", same.len());
        for band in 0..3 {
            let of = |i: &usize| area[*i] * f64::from(found.mean(*i)[band]);
            let mean = same.iter().map(of).sum::<f64>() / same.iter().map(|i| area[*i]).sum::<f64>();
            let is_mean = |i: &usize| (f64::from(found.mean(*i)[band]) - mean).abs() < 1e-2 * mean;
            assert!(other.iter().all(is_mean), "{mean}");
        }
    }
}

/// Few rays scatter about the truth and are not drawn to it from one side, in shadow, light and between; pilots that
/// stopped early were.
#[test]
fn penumbrae_are_unbiased() {
    let scene = lamps(1, true);
    for x in [-0.02, 0.002, 0.02, 0.07, 0.098] {
        // From (x, 0) the blocker's edge at (0.1, 1) is seen against the lamp's plane at 0.2 − x.
        let edge = (0.2f64 - x).clamp(0.0, 0.2);
        let truth = exact(&on_the_floor(x, 0.1), (0.0, edge));
        // Places a hair apart have independent rays.
        let places: Vec<Place> = (0..4000).map(|i| on_the_floor(x, 0.1 + 1e-7 * f64::from(i))).collect();
        for rays in [2, 6] {
            let e = illuminance(&scene, &places, rays);
            let mean = e.iter().sum::<f64>() / e.len() as f64;
            let spread = (e.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / e.len() as f64).sqrt();
            let error = spread / (e.len() as f64).sqrt();
            // Five standard errors: a false alarm once in two million.
            assert!((mean - truth).abs() < 5.0 * error + 2e-3 * truth, "{x}, {rays}: {mean} for {truth} ± {error}");
        }
    }
}

/// The lamp of one square in 800 triangles, with or without what hides a part of it.
fn fine_lamp(blocker: bool) -> Scene {
    let mut scene = lamps(0, blocker);
    let lamp = Material { emissive: [1000.0; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
    scene.materials.push(lamp);
    for (i, k) in (0..20).flat_map(|i| (0..20).map(move |k| (i, k))) {
        let low = DVec3::new(0.01 * f64::from(i), 0.01 * f64::from(k), 2.0);
        let corners = [low, low + 0.01 * DVec3::Y, low + 0.01 * (DVec3::X + DVec3::Y), low + 0.01 * DVec3::X];
        scene.add_quad("lamp", 2, corners);
    }
    scene
}

/// A lamp of many triangles is as exact in full light as one of two, where there are rays enough to be worth it; and in penumbrae unbiased
/// by its tree and without.
#[test]
fn lamps_of_many_triangles_are_exact_in_full_light_and_unbiased_in_penumbrae() {
    let places: Vec<Place> = (0..20).map(|i| on_the_floor(0.1 * f64::from(i) - 0.7, 0.05)).collect();
    for (place, e) in places.iter().zip(illuminance(&fine_lamp(false), &places, 16)) {
        let truth = exact(place, (0.0, 0.2));
        assert!((e - truth).abs() < 1e-5 * truth, "{e} for {truth}");
    }
    for x in [0.02, 0.07] {
        let truth = exact(&on_the_floor(x, 0.1), (0.0, 0.2 - x));
        let places: Vec<Place> = (0..4000).map(|i| on_the_floor(x, 0.1 + 1e-7 * f64::from(i))).collect();
        for rays in [8, 16] {
            let e = illuminance(&fine_lamp(true), &places, rays);
            let mean = e.iter().sum::<f64>() / e.len() as f64;
            let error = (e.iter().map(|e| (e - mean).powi(2)).sum::<f64>()).sqrt() / e.len() as f64;
            assert!((mean - truth).abs() < 5.0 * error + 2e-3 * truth, "{x}, {rays}: {mean} for {truth} ± {error}");
        }
    }
}

/// HalvedLight are estimates of the same light, each as good as all that has its rays, and independent of one another; what is known without
/// rays is known in both.
#[test]
fn halves_are_independent() {
    let x = 0.07;
    let truth = exact(&on_the_floor(x, 0.1), (0.0, 0.2 - x));
    let places: Vec<Place> = (0..4000).map(|i| on_the_floor(x, 0.1 + 1e-7 * f64::from(i))).collect();
    let halves = |scene: &Scene| -> Vec<HalvedLight> {
        let (mesh, _, _, luminaires) = prepared(scene, 10.0);
        let receivers = PointReceivers { places: &places, shaded: &[], salt: 0 };
        let shadowing = Shadowing { places: 1, rays: 16 };
        luminaires.halves(&Tracer::new(scene, &mesh), &receivers, &shadowing, &()).unwrap()
    };
    let found = halves(&fine_lamp(true));
    let off = |half: &HalvedLight, k: usize| f64::from(half.light[k][1]) - truth;
    let mean = |f: &dyn Fn(&HalvedLight) -> f64| found.iter().map(f).sum::<f64>() / found.len() as f64;
    let variance = [0, 1].map(|k| mean(&|half| off(half, k).powi(2)));
    let covariance = mean(&|half| off(half, 0) * off(half, 1));
    let alone = illuminance(&fine_lamp(true), &places, 16);
    let of_all = alone.iter().map(|e| (e - truth).powi(2)).sum::<f64>() / alone.len() as f64;
    for k in [0, 1] {
        let error = (variance[k] / found.len() as f64).sqrt();
        // Five standard errors, here and below: a false alarm once in two million.
        assert!(mean(&|half| off(half, k)).abs() < 5.0 * error + 2e-3 * truth, "half {k}");
        assert!((variance[k] / of_all - 1.0).abs() < 0.2, "half {k}: {} and {of_all}", variance[k]);
    }
    assert!(variance[0] > 0.0 && !found.iter().any(|half| half.is_exact));
    assert!(covariance.abs() < 0.1 * (variance[0] * variance[1]).sqrt(), "{covariance} of {variance:?}");
    for half in halves(&lamps(1, true)) {
        assert!(half.is_exact && half.light[0] == half.light[1]);
        assert!(off(&half, 0).abs() < 1e-4 * truth);
    }

    // Elements have other places in either half: both are near the mean over them, and few are the same.
    let scene = lamps(1, true);
    let (mesh, elements, _, luminaires) = prepared(&scene, 0.5);
    let (tracer, exposure) = (Tracer::new(&scene, &mesh), crate::Exposure::default());
    let receivers = crate::ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    let [some, many] = [16, 1024].map(|places| Shadowing { places, rays: 4 });
    let found = luminaires.halves(&tracer, &receivers, &some, &()).unwrap();
    let all = luminaires.columns(&tracer, &receivers, &many, &()).unwrap();
    let peak = (0..elements.len()).map(|e| all.mean(e)[1]).fold(0.0, f32::max);
    for (e, half) in found.iter().enumerate() {
        let is_near = |light: Bands| (light[1] - all.mean(e)[1]).abs() < 0.1 * peak;
        assert!(half.light.iter().all(|light| is_near(*light)), "{e}: {half:?} for {:?}", all.mean(e));
    }
    let lit: Vec<&HalvedLight> = found.iter().filter(|half| !half.is_exact && half.light[0] != [0.0; 3]).collect();
    assert!(lit.len() > 20 && lit.iter().filter(|half| half.light[0] == half.light[1]).count() < lit.len() / 10);
}

/// To a light without area there is one line of sight, which a ray tells exactly, behind a blocker and beside it; unless something
/// lets a part of the light pass, or there are fewer rays than lights.
#[test]
fn lights_without_area_are_exact() {
    use radiosity_scene::{AlphaMode, PointLight, PointLightKind};
    let light = |kind: PointLightKind, x: f64| PointLight {
        name: String::new(),
        kind,
        position: DVec3::new(x, 0.0, 2.0),
        direction: -DVec3::Z,
        intensity: [100.0; 3],
        range: None,
    };
    let mut scene = lamps(0, false);
    let corners = [[0.1, -1.0, 1.0], [2.1, -1.0, 1.0], [2.1, 1.0, 1.0], [0.1, 1.0, 1.0]].map(DVec3::from);
    scene.add_quad("blocker", 1, corners);
    scene.lights = vec![light(PointLightKind::Point, 0.0), light(PointLightKind::Directional, 0.0)];
    let places: Vec<Place> = (0..40).map(|i| on_the_floor(0.0213 * f64::from(i) - 0.3, 0.1)).collect();
    let found = columns(&scene, &places, 4);
    for (i, place) in places.iter().enumerate() {
        // Past twice the blocker's edge the point is hidden, past the edge itself the sun.
        let x = place.point.x;
        let square = x * x + 0.01 + 4.0;
        let of_point = if x < 0.2 { 100.0 * 2.0 / square.powf(1.5) } else { 0.0 };
        let truth = of_point + if x < 0.1 { 100.0 } else { 0.0 };
        assert!(found.is_exact(i) && (f64::from(found.mean(i)[1]) - truth).abs() < 1e-5 * 100.0, "{x}");
    }
    let few = columns(&scene, &places, 1);
    assert!((0..places.len()).any(|i| !few.is_exact(i)));
    scene.materials[1].alpha_mode = AlphaMode::Blend;
    scene.materials[1].base_color[3] = 0.5;
    let parted = columns(&scene, &places, 4);
    assert!(!parted.is_exact(places.len() - 1));
}

/// Where rays would take longer, what stands before a lamp is cut out of it: no noise is left.
#[test]
fn penumbrae_past_few_blockers_are_exact() {
    let scene = lamps(1, true);
    let places: Vec<Place> = (0..60).map(|i| on_the_floor(0.0053 * f64::from(i) - 0.1, 0.1)).collect();
    let columns = columns(&scene, &places, 16);
    for (i, place) in places.iter().enumerate() {
        let truth = exact(place, (0.0, (0.2 - place.point.x).clamp(0.0, 0.2)));
        let e = f64::from(columns.mean(i)[1]);
        assert!(columns.is_exact(i) && (e - truth).abs() < 1e-5 * exact(place, (0.0, 0.2)), "{e} for {truth}");
        assert!(e > 0.0 || place.point.x > 0.2 - 1e-9);
    }
}

/// Whatever stands in the way, and on whatever side of whose planes: cuts and rays agree.
#[test]
fn cuts_are_as_rays_see_it() {
    let mut random = Random::new(6);
    for trial in 0..12 {
        let mut scene = lamps(2, false);
        let mut vector = || DVec3::from_array(std::array::from_fn(|_| random.next_unit() - 0.5));
        for _ in 0..8 {
            let low = DVec3::new(0.2, 0.1, 1.3) + vector() * DVec3::new(1.0, 1.0, 1.8);
            let (x, y) = (0.4 * vector(), 0.4 * vector());
            scene.add_quad("blocker", 1, [low, low + x, low + x + y, low + y]);
        }
        let places: Vec<Place> = (0..8)
            .map(|_| on_the_floor(0.2, 0.1))
            .map(|at| Place { point: at.point + vector() * DVec3::new(2.0, 2.0, 0.0), ..at })
            .collect();
        let told = columns(&scene, &places, 64);
        // Few rays at places a hair apart.
        let near: Vec<Place> = places
            .iter()
            .flat_map(|at| (0..4000).map(|k| Place { point: at.point + 1e-8 * f64::from(k) * DVec3::X, ..*at }))
            .collect();
        let asked = illuminance(&scene, &near, 6);
        for (i, asked) in asked.chunks(4000).enumerate() {
            let mean = asked.iter().sum::<f64>() / 4000.0;
            let error = asked.iter().map(|e| (e - mean).powi(2)).sum::<f64>().sqrt() / 4000.0;
            let e = f64::from(told.mean(i)[1]);
            assert!(told.is_exact(i), "{trial} {i}");
            assert!((e - mean).abs() <= 5.0 * error + 1e-4 * mean, "{trial} {i}: {e}, by rays {mean} ± {error}");
        }
    }
}

/// A lamp behind a wall of triangles that share their edges, in whatever direction: no light at all, and places there may be asked
/// whether they are buried.
#[test]
fn nothing_shines_through_between_triangles() {
    let mut random = Random::new(2);
    let mut unit = || random.next_unit();
    for _ in 0..20 {
        let mut scene = lamps(1, false);
        let turn = glam::DQuat::from_rotation_z(6.0 * unit()) * glam::DQuat::from_rotation_x(0.6 * unit() - 0.3);
        let knots: Vec<Vec<DVec3>> = (0..6)
            .map(|i| {
                let knot = |k: i32| {
                    let at =
                        DVec3::new(f64::from(i) - 2.5 + 0.6 * unit(), f64::from(k) - 2.5 + 0.6 * unit(), 0.3 * unit());
                    DVec3::new(0.1, 0.1, 1.0) + turn * (0.4 * at)
                };
                (0..6).map(knot).collect()
            })
            .collect();
        for (i, k) in (0..5).flat_map(|i| (0..5).map(move |k| (i, k))) {
            scene.add_quad("wall", 1, [knots[i][k], knots[i + 1][k], knots[i + 1][k + 1], knots[i][k + 1]]);
        }
        let places: Vec<Place> = (0..50).map(|_| on_the_floor(0.4 * unit() - 0.1, 0.4 * unit() - 0.1)).collect();
        let columns = columns(&scene, &places, 64);
        assert!((0..places.len()).all(|i| columns.is_exact(i) && columns.mean(i) == [0.0; 3]));
    }
}

/// Light of an element is the same by few places and by many, whether its lamps are settled, asked by rays, or the one and the other.
#[test]
fn elements_have_the_mean_over_their_places() {
    let mut scene = lamps(3, true);
    // Before the last lamp stands more than is cut.
    let at = |i: i32, k: i32| DVec3::new(0.6 + 0.03 * f64::from(i), 0.03 * f64::from(k), 1.9);
    for (i, k) in (0..9).flat_map(|i| (0..9).map(move |k| (i, k))).filter(|(i, k)| (i + k) % 2 == 0) {
        scene.add_quad("check", 1, [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)]);
    }
    let (mesh, elements, area, luminaires) = prepared(&scene, 0.4);
    let tracer = Tracer::new(&scene, &mesh);
    let exposure = crate::Exposure::default();
    let receivers = crate::ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    let floor =
        elements.cells_of(0, radiosity_scene::Side::Front).chain(elements.cells_of(1, radiosity_scene::Side::Front));
    let floor: Vec<usize> = floor.flat_map(|cell| elements.of_cell(cell)).map(|e| e as usize).collect();
    let flux = |places: u32, rays: u32| -> f64 {
        let columns = luminaires.columns(&tracer, &receivers, &Shadowing { places, rays }, &()).unwrap();
        floor.iter().map(|&e| area[e] * f64::from(columns.mean(e)[1])).sum()
    };
    let truth = flux(256, 16);
    for (places, rays) in [(8, 1), (8, 2), (8, 3), (8, 6), (8, 16), (16, 64)] {
        let found = flux(places, rays);
        assert!((found / truth - 1.0).abs() < 0.01, "{places} places, {rays} rays: {found} for {truth}");
    }
}

/// Far from lamps that nothing stands before, three places tell the mean over an element, and near them it is cut: beside a plate, and over the length of a
/// strip, whose width is a thousandth of that. Of three places without cuts three quarters of the light 15 cm below the lamp were missed.
#[test]
fn what_is_near_a_lamp_is_cut_until_few_places_tell_the_mean() {
    let [plate, strip] = [[0.1, 0.4, 0.0, 0.3], [-1.1, 8.9, 0.1, 0.11]];
    for ([west, east, south, north], lit) in [(plate, 100), (strip, 10)] {
        let mut scene = lamps(1, false);
        let corners = [[west, south, 1.7], [east, south, 1.7], [east, north, 1.7], [west, north, 1.7]];
        scene.add_quad("near", 0, corners.map(DVec3::from));
        let (mesh, elements, _, luminaires) = prepared(&scene, 0.3);
        let tracer = Tracer::new(&scene, &mesh);
        let exposure = crate::Exposure::default();
        let receivers = crate::ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
        let columns = luminaires.columns(&tracer, &receivers, &Shadowing { places: 8, rays: 2 }, &()).unwrap();
        let mut told = [0; 2];
        for e in 0..elements.len() as u32 {
            let (triangle, side) = elements.place(e);
            let is_beside = triangle >= 4;
            assert!(columns.is_exact(e as usize) || !is_beside, "{e}");
            if side == radiosity_scene::Side::Back
                || columns.mean(e as usize)[1] <= 0.0
                || !columns.is_exact(e as usize)
            {
                continue;
            }
            let at = |k: u32| {
                let uv = elements.sample(e, (f64::from(k % 80) + 0.5) / 80.0, (f64::from(k / 80) + 0.5) / 80.0);
                exact(&Place { point: mesh.point(triangle, uv), normal: DVec3::Z, triangle: u32::MAX }, (0.0, 0.2))
            };
            let (mean, found) = ((0..6400).map(at).sum::<f64>() / 6400.0, f64::from(columns.mean(e as usize)[1]));
            // Along the strip the lamp is seen at a grazing angle, and gives a thousandth of what it gives below it.
            let most = if is_beside { 6e-3 } else { 1e-4 };
            assert!((found - mean).abs() < most * mean, "{e}: {found} for {mean}");
            told[usize::from(is_beside)] += 1;
        }
        assert!(told[0] > lit && told[1] >= 2, "{told:?}");
    }
}

/// A normal that is not the triangle's: what lies below the triangle is hidden by it, and what is above both is exact.
#[test]
fn triangles_hide_what_lies_below_them() {
    let mut scene = lamps(1, false);
    // Its plane halves the lamp.
    let wall = [[0.1, -1.0, 0.0], [0.1, 1.0, 0.0], [0.1, 1.0, 1.5], [0.1, -1.0, 1.5]];
    scene.add_quad("wall", 1, wall.map(DVec3::from));
    let mesh = Mesh::new(&scene);
    assert_eq!(mesh.normal(0), DVec3::Z);
    let wall = (0..mesh.triangles.len()).find(|t| mesh.normal(*t) == DVec3::X).unwrap() as u32;
    let tilted = DVec3::new(0.5, 0.0, 1.0).normalize();
    // In what of the lamp is seen, places a hair apart have independent rays.
    for (triangle, at, from) in [(0, DVec3::new(0.5, 0.1, 0.0), 0.0), (wall, DVec3::new(0.1, 0.1, 1.0), 0.1)] {
        let place = |k: u32| Place { point: at + 1e-7 * f64::from(k) * DVec3::Y, normal: tilted, triangle };
        let places: Vec<Place> = (0..2000).map(place).collect();
        let told = columns(&scene, &places, 64);
        let p = |x: f64, y: f64| DVec3::new(x, y, 2.0);
        let corners = [p(from, 0.0), p(from, 0.2), p(0.2, 0.2), p(0.2, 0.0)];
        let truth = 1000.0 * PI * crate::polygon::point_to_polygon(at, tilted, &corners);
        let e: Vec<f64> = (0..places.len()).map(|i| f64::from(told.mean(i)[1])).collect();
        let mean = e.iter().sum::<f64>() / e.len() as f64;
        let error = e.iter().map(|e| (e - mean).powi(2)).sum::<f64>().sqrt() / e.len() as f64;
        assert!((mean - truth).abs() < 5.0 * error + 1e-4 * truth, "{triangle}: {mean} for {truth} ± {error}");
        assert_eq!(told.is_exact(0), triangle == 0);
    }
}

/// Below a ceiling a strip lights a band a few centimetres wide: by how much light varies within elements is known for all the parts they
/// may be cut into, to a twentieth.
#[test]
fn how_light_varies_beside_a_lamp_is_known_at_each_quartering() {
    const FINEST: usize = 8;
    let lamp = Material { emissive: [1000.0; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
    let mut scene = Scene { materials: vec![Material::default(), lamp], ..Scene::default() };
    let square = |side: f64| [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]].map(|[x, y]| DVec3::new(x, y, 0.0));
    scene.add_quad("ceiling", 0, square(1.2));
    let strip = [[0.25, 0.6], [0.25, 0.602], [0.95, 0.602], [0.95, 0.6]].map(|[x, y]| DVec3::new(x, y, 0.01));
    scene.add_quad("strip", 1, strip);
    let (mesh, elements, area, luminaires) = prepared(&scene, 0.3);
    let (tracer, exposure) = (Tracer::new(&scene, &mesh), crate::Exposure::default());
    let receivers = crate::ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    let told = luminaires.variation(&tracer, &receivers, &Shadowing { places: 4, rays: 4 }, &()).unwrap();

    // Mean and mean square over a part, with what each of its own parts adds to the mean deviations.
    fn moments(e: &impl Fn(DVec3) -> f64, [a, b, c]: [DVec3; 3], level: usize, within: &mut [f64]) -> [f64; 2] {
        if level == FINEST {
            let e = e((a + b + c) / 3.0);
            return [e, e * e];
        }
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| 0.5 * (from + to));
        let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]];
        let all = quarters.map(|part| moments(e, part, level + 1, within));
        let [mean, square] = [0, 1].map(|k| all.iter().map(|part| part[k]).sum::<f64>() / 4.0);
        within[level] += (square - mean * mean).max(0.0).sqrt() * 0.25f64.powi(level as i32);
        [mean, square]
    }
    let e = |point: DVec3| 1000.0 * PI * crate::polygon::point_to_polygon(point, DVec3::Z, &strip);
    let (mut truth, mut found, mut beside) = ([0.0; QUARTERED + 1], [0.0; QUARTERED + 1], 0);
    for (i, told) in told.iter().enumerate() {
        let Some(within) = &told.within else { continue };
        let mut own = [0.0; FINEST];
        let [mean, _] = moments(&e, receivers.site(i).unwrap().part().unwrap(), 0, &mut own);
        assert!((f64::from(told.mean) - mean).abs() < 0.01 * mean, "{i}: {} for {mean}", told.mean);
        let levels = std::iter::once(told.deviation).chain(*within);
        for (level, deviation) in levels.enumerate() {
            truth[level] += area[i] * own[level];
            found[level] += area[i] * f64::from(deviation);
        }
        beside += 1;
    }
    assert!(beside > 10, "{beside}");
    for (level, (found, truth)) in found.iter().zip(&truth).enumerate() {
        assert!((found / truth - 1.0).abs() < 0.05, "{level}: {found} for {truth}");
    }
    assert!(found[QUARTERED] < 0.1 * found[0], "{found:?}");
}

/// Of a lamp that is seen through a hole alone, each place sees a hundredth or less: what lies inside a solid is no part of the mean all the same.
#[test]
fn buried_places_do_not_count_where_others_glimpse_light() {
    let quad = |low: DVec3, x: DVec3, y: DVec3| [low, low + x, low + x + y, low + y];
    let lamp = Material { emissive: [1000.0; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
    let lid = Material { double_sided: true, ..Material::default() };
    let mut scene = Scene { materials: vec![Material::default(), lid, lamp], ..Scene::default() };
    scene.add_quad("floor", 0, quad(DVec3::new(-0.5, -0.5, 0.0), DVec3::X, DVec3::Y));
    scene.add_quad("lamp", 2, quad(DVec3::new(-2.0, -2.0, 2.0), DVec3::Y * 4.0, DVec3::X * 4.0));
    for (low, [x, y]) in [
        ([-9.0, -9.0], [18.0, 8.98]),
        ([-9.0, 0.02], [18.0, 8.98]),
        ([-9.0, -0.02], [8.98, 0.04]),
        ([0.02, -0.02], [8.98, 0.04]),
    ] {
        scene.add_quad("lid", 1, quad(DVec3::new(low[0], low[1], 1.0), DVec3::X * x, DVec3::Y * y));
    }
    let mean = |scene: &Scene| {
        let (mesh, elements, area, luminaires) = prepared(scene, 2.0);
        let (tracer, exposure) = (Tracer::new(scene, &mesh), crate::Exposure::default());
        let receivers = crate::ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
        let columns = luminaires.columns(&tracer, &receivers, &Shadowing { places: 64, rays: 64 }, &()).unwrap();
        let floor = (0..elements.len()).filter(|e| elements.place(*e as u32) <= (1, radiosity_scene::Side::Front));
        let (sum, whole) =
            floor.fold((0.0, 0.0), |(sum, whole), e| (sum + area[e] * f64::from(columns.mean(e)[1]), whole + area[e]));
        sum / whole
    };
    let open = mean(&scene);
    // Half of the floor lies inside a box, whose height hides nothing of the hole.
    let (low, high) = (DVec3::new(-0.7, -0.7, -0.1), DVec3::new(0.0, 0.7, 0.001));
    let size = high - low;
    for axis in 0..3 {
        let [x, y] = [1, 2].map(|k| DVec3::AXES[(axis + k) % 3] * size[(axis + k) % 3]);
        scene.add_quad("box", 0, quad(low, y, x));
        scene.add_quad("box", 0, quad(low + DVec3::AXES[axis] * size[axis], x, y));
    }
    let with_box = mean(&scene);
    assert!(open > 0.0 && (with_box / open - 1.0).abs() < 0.1, "{with_box} for {open}");
}

/// Of 2,500 lamps the near ones are found and the far ones not forgotten: few rays scatter about the truth, and by
/// little; so does the single one of a gather.
#[test]
fn many_lamps_are_unbiased() {
    let mut scene = Scene::default();
    let lamp = Material { emissive: [1000.0; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
    scene.materials = vec![Material::default(), lamp];
    let quad = |low: DVec3, x: DVec3, y: DVec3| [low, low + x, low + x + y, low + y];
    scene.add_quad("floor", 0, quad(DVec3::ZERO, DVec3::X * 100.0, DVec3::Y * 100.0));
    let low = |i: u32, j: u32| DVec3::new(2.0 * f64::from(i) + 0.9, 2.0 * f64::from(j) + 0.9, 2.0);
    for (i, j) in (0..50).flat_map(|i| (0..50).map(move |j| (i, j))) {
        scene.add_quad("lamp", 1, quad(low(i, j), DVec3::Y * 0.2, DVec3::X * 0.2));
    }
    let (mesh, _, _, luminaires) = prepared(&scene, 10.0);
    let tracer = Tracer::new(&scene, &mesh);
    assert!(luminaires.many > crate::parts::FOR_A_RAY * 64);
    for [x, y] in [[21.0, 21.0], [20.0, 7.0], [0.1, 99.0]] {
        let at = on_the_floor(x, y);
        let of_lamp = |i: u32, j: u32| {
            let [a, b, c, d] = quad(low(i, j), DVec3::Y * 0.2, DVec3::X * 0.2);
            let factor = |corners| point_to_triangle(at.point, at.normal, corners);
            1000.0 * PI * (factor([a, b, c]) + factor([a, c, d]))
        };
        let truth: f64 = (0..50).flat_map(|i| (0..50).map(move |j| (i, j))).map(|(i, j)| of_lamp(i, j)).sum();
        let places: Vec<Place> = (0..2000).map(|k| on_the_floor(x, y + 1e-7 * f64::from(k))).collect();
        let e = illuminance(&scene, &places, 64);
        let mean = e.iter().sum::<f64>() / e.len() as f64;
        let spread = (e.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / e.len() as f64).sqrt();
        let error = spread / (e.len() as f64).sqrt();
        // Five standard errors: a false alarm once in two million.
        assert!((mean - truth).abs() < 5.0 * error, "({x}, {y}): {mean} for {truth} ± {error}");
        assert!(spread < 0.15 * truth, "({x}, {y}): {spread} about {truth}");
        let mut parts = Parts::default();
        let mut single = |seed: u32| luminaires.sample(0, &tracer, &at, hash(seed), &mut parts)[1];
        let single: Vec<f64> = (0..4000).map(&mut single).collect();
        let mean = single.iter().sum::<f64>() / 4000.0;
        let error = (single.iter().map(|e| (e - mean).powi(2)).sum::<f64>()).sqrt() / 4000.0;
        assert!((mean - truth).abs() < 5.0 * error, "({x}, {y}): {mean} for {truth} ± {error}");
    }
}
