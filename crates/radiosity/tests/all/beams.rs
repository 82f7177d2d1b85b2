//! Narrow beams: a hall whose only light is what the sun or a lamp sends through a small opening in its roof.

use glam::DVec3;
use radiosity::{
    Material, MeasureOptions, Mesh, Place, PointLight, PointLightKind, Referee, Scene, Tracer, Transmission, Up,
    luminance, measure,
};
use std::f64::consts::PI;

/// Metres: the hall is as long as it is wide.
const WIDE: f64 = 20.0;
const HIGH: f64 = 10.0;

/// Of the floor; also of all else, if that is grey.
const RHO: f32 = 0.5;

/// A hall with an opening [x, end] × [y, top] in its roof, and a card on the floor a metre from the middle that faces it.
pub fn hall(
    [x, end]: [f64; 2],
    [y, top]: [f64; 2],
    is_grey: bool,
    light: impl IntoIterator<Item = PointLight>,
) -> Scene {
    let of = |rho: f32| Material { base_color: [rho, rho, rho, 1.0], ..Material::default() };
    let materials = vec![of(RHO), of(if is_grey { RHO } else { 0.0 })];
    let mut scene = Scene { materials, up: Up::Z, lights: light.into_iter().collect(), ..Scene::default() };
    let corner = |k: usize| DVec3::new([0.0, WIDE][k & 1], [0.0, WIDE][k >> 1 & 1], [0.0, HIGH][k >> 2]);
    scene.add_quad("floor", 0, [0, 1, 3, 2].map(corner));
    for face in [[0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
        scene.add_quad("wall", 1, face.map(corner));
    }
    let mut roof = |[x, end]: [f64; 2], [y, top]: [f64; 2]| {
        let corners = [[x, y], [x, top], [end, top], [end, y]].map(|[x, y]| DVec3::new(x, y, HIGH));
        scene.add_quad("roof", 1, corners);
    };
    roof([0.0, x], [0.0, WIDE]);
    roof([end, WIDE], [0.0, WIDE]);
    roof([x, end], [0.0, y]);
    roof([x, end], [top, WIDE]);
    let card = [[9.8, 0.0], [10.2, 0.0], [10.2, 0.5], [9.8, 0.5]].map(|[x, z]| DVec3::new(x, 11.0, z));
    scene.add_quad("card", 1, card);
    scene
}

fn light(kind: PointLightKind, intensity: f32) -> PointLight {
    let position = DVec3::new(10.0, 10.0, 1.1 * HIGH);
    PointLight {
        name: "light".to_owned(),
        kind,
        position,
        direction: -DVec3::Z,
        intensity: [intensity; 3],
        range: None,
    }
}

/// On the roof, a wall, the card, and the floor far from the middle.
fn places() -> [(DVec3, DVec3); 4] {
    [
        (DVec3::new(10.0, 12.0, HIGH), -DVec3::Z),
        (DVec3::new(0.0, 10.0, 5.0), DVec3::X),
        (DVec3::new(10.0, 11.0, 0.3), -DVec3::Y),
        (DVec3::new(3.0, 3.0, 0.0), DVec3::Z),
    ]
}

/// What the lit part of the floor gives to a place, lx, by a sum over small parts of it. Flux Φ falls there evenly.
fn from_floor(flux: f64, [x, end]: [f64; 2], [y, top]: [f64; 2], (point, normal): (DVec3, DVec3)) -> f64 {
    let parts = 64;
    let along = |[low, high]: [f64; 2], k: i32| low + (high - low) * (f64::from(k) + 0.5) / f64::from(parts);
    let of_part = |k: i32| {
        let to = DVec3::new(along([x, end], k % parts), along([y, top], k / parts), 0.0) - point;
        to.dot(normal).max(0.0) * (-to.z).abs() / (PI * to.length_squared().powi(2))
    };
    f64::from(RHO) * flux * (0..parts * parts).map(of_part).sum::<f64>() / f64::from(parts * parts)
}

/// A sun spot of a hand's breadth, one of 1 m, a slit of 2 mm, and a hole of a centimetre before a lamp: neither shadow rays from elements nor paths find the first
/// and the last two, which had no light at all, and nobody knew.
#[test]
fn what_comes_through_small_openings_lights_a_hall() {
    let sun = || light(PointLightKind::Directional, 1e6);
    let middle = |width: f64| [10.0 - 0.5 * width, 10.0 + 0.5 * width];
    let cases = [
        ("spot", middle(0.1), middle(0.1), sun(), 1e4, 1.0),
        ("wide", middle(1.0), middle(1.0), sun(), 1e6, 1.0),
        ("slit", middle(0.002), [8.0, 10.9], sun(), 5.8e3, 1.0),
        // From 1 m above the roof: the spot is eleven times as wide as the hole.
        ("lamp", middle(0.01), middle(0.01), light(PointLightKind::Point, 1e6), 100.0, 11.0),
    ];
    for (name, x, y, light, flux, times) in cases {
        let scene = hall(x, y, false, [light]);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = MeasureOptions { error: 0.02, ..MeasureOptions::default() };
        let measured = measure(&tracer, &places(), &options, &()).unwrap();
        let wider = |[low, high]: [f64; 2]| [low, high].map(|x| 10.0 + times * (x - 10.0));
        for (place, found) in places().into_iter().zip(&measured.irradiance) {
            let truth = from_floor(flux, wider(x), wider(y), place);
            let found = f64::from(luminance(*found));
            assert!((found - truth).abs() <= 0.025 * truth, "{name}, {place:?}: {found} lx, {truth} lx");
        }
    }
}

/// Light that goes on from wall to wall, too, as a path tracer has it that finds the spot.
#[test]
fn a_grey_hall_is_lit_by_a_spot_again_and_again() {
    let scene = hall([9.95, 10.05], [9.95, 10.05], true, [light(PointLightKind::Directional, 1e6)]);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let options = MeasureOptions { error: 0.01, ..MeasureOptions::default() };
    let measured = measure(&tracer, &places(), &options, &()).unwrap();
    let referee = Referee::new(&tracer);
    for ((point, normal), found) in places().into_iter().zip(&measured.irradiance) {
        let place = Place { point, normal, triangle: u32::MAX };
        let (truth, found) = (luminance(referee.irradiance(&place, 1 << 16, 3)), luminance(*found));
        assert!((found - truth).abs() <= 0.03 * truth, "{place:?}: {found} lx, {truth} lx");
    }
}

/// A beam that ends on an opal sheet: what the sheet gives back shines as a light, and what it lets through does not.
#[test]
fn a_sheet_lets_the_light_of_a_spot_through_once() {
    let mut scene = hall([9.85, 10.15], [9.85, 10.15], true, [light(PointLightKind::Directional, 1e6)]);
    let transmission = Transmission { transmittance: [0.4; 3], texture: None, replaced: 0.0, share_texture: None };
    scene.materials.push(Material {
        base_color: [0.4, 0.4, 0.4, 1.0],
        transmission: Some(transmission),
        double_sided: true,
        ..Material::default()
    });
    let sheet = [[8.0, 8.0], [12.0, 8.0], [12.0, 12.0], [8.0, 12.0]].map(|[x, y]| DVec3::new(x, y, 1.0));
    scene.add_quad("sheet", 2, sheet);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    assert!(
        tracer
            .beams()
            .all()
            .iter()
            .all(|beam| scene.objects[scene.triangle_object[mesh.source[beam.triangle as usize] as usize] as usize]
                .name
                == "sheet")
    );
    let referee = Referee::new(&tracer);
    let (point, normal) = (DVec3::new(10.05, 9.9, 0.9), DVec3::Z);
    let options = MeasureOptions { error: 0.02, ..MeasureOptions::default() };
    let measured = measure(&tracer, &[(point, normal)], &options, &()).unwrap();
    let truth = luminance(referee.irradiance(&Place { point, normal, triangle: u32::MAX }, 1 << 16, 3));
    let found = luminance(measured.irradiance[0]);
    assert!((found - truth).abs() <= 0.04 * truth, "{found} lx, {truth} lx");
}
