//! Light measured at places on surfaces: against closed forms, and what it says of the picture.

use crate::finish::finish;
use crate::furnace::furnace;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use radiosity::session::{
    Edit, Layer, LightId, NewLight, ObjectId, Session, SessionOptions, SurfacePlace, Survey, Surveyed,
};
use radiosity::{Material, PointLight, PointLightKind, Scene};
use rayon::prelude::*;
use std::time::Duration;

/// Measured in as many slices as it takes.
fn read(session: &Session, places: Vec<SurfacePlace>) -> Surveyed {
    let mut survey = Survey::new(places);
    (0..100_000).find_map(|_| session.survey(&mut survey, Duration::ZERO)).expect("an end")
}

/// A black floor of 4 m × 4 m under a lamp of 1000 cd 2 m above its middle, with a sheet of 1 m × 1 m half way over a quarter of it.
fn shaded() -> Scene {
    let mut scene = Scene::default();
    scene.materials.push(Material { base_color: [0.0, 0.0, 0.0, 1.0], double_sided: true, ..Material::default() });
    let square = |half: f64, at: DVec3| {
        [[-1., 1.], [1., 1.], [1., -1.], [-1., -1.]].map(|[x, z]| at + DVec3::new(half * x, 0.0, half * z))
    };
    scene.add_quad("floor", 0, square(2.0, DVec3::ZERO));
    scene.add_quad("sheet", 0, square(0.5, DVec3::new(0.5, 1.0, 0.5)));
    scene.lights.push(PointLight {
        name: "lamp".to_owned(),
        kind: PointLightKind::Point,
        position: DVec3::new(0.0, 2.0, 0.0),
        direction: DVec3::NEG_Y,
        intensity: [1000.0; 3],
        range: None,
    });
    scene
}

/// A place reads E = I h/d³, or nothing in the shadow, however wide the elements are, and the picture is off by just the difference.
#[test]
fn places_read_their_own_light() {
    let options = SessionOptions { element_size: Some(0.5), rays: 64, ..SessionOptions::default() };
    let mut session = Session::new(shaded(), &options).unwrap();
    let floor = ObjectId(0);
    let elements = session.irradiance(floor).len().max(1) as u32;
    assert_eq!(session.survey(&mut Survey::new(Vec::new()), Duration::ZERO), None, "it is dark");
    finish(&mut session);
    let model = session.model();
    let elements = elements.max(model.objects[0].indices.len() as u32 / 3);
    let uvs = [[0.1, 0.1], [0.8, 0.1], [0.1, 0.8], [0.3, 0.3]];
    let at = |triangle| uvs.map(|uv| SurfacePlace { object: floor, triangle, uv });
    let surveyed = read(&session, (0..elements).flat_map(at).collect());
    let (mut square, mut count, mut dark) = (0.0, 0, 0);
    for reading in surveyed.readings.iter().map(|reading| reading.unwrap()) {
        let p = DVec3::from(reading.position);
        if reading.normal[1] < 0.0 {
            // The underside gets none.
            assert_eq!(reading.lux, 0.0);
            continue;
        }
        assert_eq!(reading.normal, [0.0, 1.0, 0.0]);
        // The sheet's shadow is twice as wide: 0 to 2 m.
        let is_dark = p.x > 0.0 && p.z > 0.0;
        let wanted = if is_dark { 0.0 } else { 2000.0 / (p - DVec3::new(0.0, 2.0, 0.0)).length().powi(3) };
        assert!((f64::from(reading.lux) - wanted).abs() <= 1e-4 * wanted, "{} lx at {p}, {wanted} lx", reading.lux);
        assert_eq!(reading.error, 0.0, "one lamp without area has no noise");
        let most = reading.lux.max(reading.shown);
        if most > 0.0 {
            square += f64::from((reading.shown - reading.lux) / most).powi(2);
            count += 1;
        }
        dark += usize::from(is_dark && reading.shown > 1.0);
    }
    assert!(dark > 10, "the picture's shadow has a wide edge: {dark}");
    let off = surveyed.off.unwrap();
    assert!((off - (square / f64::from(count)).sqrt()).abs() < 1e-6 && off > 0.2, "{off}");

    session.apply(&Edit::Delete { object: floor }).unwrap();
    let mut waiting = Survey::new(at(0).to_vec());
    assert_eq!(session.survey(&mut waiting, Duration::ZERO), None, "the edit is not seen");
    finish(&mut session);
    assert_eq!(session.survey(&mut waiting, Duration::ZERO).unwrap().readings, vec![None; 4]);
}

/// Shadows of lamps with area are soft, and are shown so; at corners of elements that are not cut the light is that of these.
#[test]
fn elements_are_cut_where_shadows_are_soft() {
    let mut scene = shaded();
    scene.lights.clear();
    scene.materials.push(Material { emissive: [1000.0; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() });
    let square = [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]];
    scene.add_quad("lamp", 1, square.map(|[x, z]| DVec3::new(0.2 * x, 2.0, 0.2 * z)));
    let options = |places| SessionOptions { element_size: Some(0.4), rays: 64, places, ..SessionOptions::default() };
    let [whole, session] = [0, 30_000].map(|places| {
        let mut session = Session::new(scene.clone(), &options(places)).unwrap();
        finish(&mut session);
        session
    });
    let floor = ObjectId(0);
    let cuts = session.cuts(floor);
    let elements = session.irradiance(floor).len() as u32;
    assert!(whole.cuts(floor).is_empty() && !cuts.is_empty() && 2 * cuts.len() < elements as usize, "{}", cuts.len());

    let mut dice = radiosity_trace::sampling::Random::new(7);
    let mut anywhere = || SurfacePlace {
        object: floor,
        triangle: (dice.next_unit() * f64::from(elements)) as u32,
        uv: [0.0, 1.0].map(|_| 0.5 * dice.next_unit() as f32),
    };
    let places: Vec<SurfacePlace> = (0..1000).map(|_| anywhere()).collect();
    let [before, after] = [&whole, &session].map(|session| read(session, places.clone()).off.unwrap());
    assert!(before > 0.1 && after < 0.5 * before, "{after} instead of {before}");

    let model = session.model();
    let indices = &model.objects[0].indices;
    let is_cut = |element: u32| cuts.iter().any(|cut| cut.element == element);
    let is_joined = |vertex: u32| {
        (0..elements).filter(|e| indices[3 * *e as usize..][..3].contains(&vertex)).any(|element| !is_cut(element))
    };
    let light = session.light(floor, Layer::Total);
    let places = session.light_of_cuts(floor, Layer::Total, &light);
    let (mut first, mut joined) = (0, 0);
    for cut in &cuts {
        let (element, n, count) = (cut.element, cut.parts as usize, cut.places().len());
        assert!(cut.edge.is_none(), "shadows of lamps with area are soft");
        for (k, place) in [0, n, count - 1].into_iter().enumerate() {
            let vertex = indices[3 * element as usize + k];
            if is_joined(vertex) {
                joined += 1;
                assert!((places[first + place][1] - light[vertex as usize][1]).abs() < 1e-3, "corner {k} of {element}");
            }
        }
        first += count;
    }
    assert!(joined > 20, "{joined}");
}

/// Lamps of sixty rooms are one object, and a room sees two spots of it or none: elements keep the light that their own rays found.
#[test]
fn lamps_of_many_rooms_keep_their_light() {
    const ROOMS: usize = 60;
    const WIDTH: f64 = 6.0;
    let mut scene = Scene::default();
    scene.materials.push(Material { base_color: [0.0, 0.0, 0.0, 1.0], double_sided: true, ..Material::default() });
    scene.materials.push(Material { emissive: [1000.0; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() });
    let upright = [[-1., 0.], [-1., 4.], [1., 4.], [1., 0.]];
    let (mut walls, mut lamps) = (Vec::new(), Vec::new());
    for room in 0..ROOMS {
        let at = |x: f64, y: f64, z: f64| DVec3::new(WIDTH * room as f64 + x, y, z);
        let level =
            |half: f64, y: f64| [[-1., 1.], [1., 1.], [1., -1.], [-1., -1.]].map(|[x, z]| at(half * x, y, half * z));
        scene.add_quad("floor", 0, level(2.0, 0.0));
        scene.add_quad("sheet", 0, level(0.5, 1.0));
        let [a, b, c, d] = upright.map(|[z, y]| at(0.5 * WIDTH, y, 4.0 * z));
        walls.extend([[a, b, c], [a, c, d]]);
        let [d, c, b, a] = level(0.2, 2.0);
        lamps.extend([[a, b, c], [a, c, d]]);
    }
    scene.add_triangles("walls", 0, &walls);
    scene.add_triangles("lamps", 1, &lamps);
    let options = SessionOptions { element_size: Some(0.8), rays: 4, places: 1_000_000, ..SessionOptions::default() };
    let mut session = Session::new(scene, &options).unwrap();
    finish(&mut session);
    let model = session.model();
    let mut lit = 0;
    for floor in model.objects.iter().filter(|object| object.name == "floor") {
        let light = session.light(floor.id, Layer::Total);
        let places = session.light_of_cuts(floor.id, Layer::Total, &light);
        let own = session.irradiance(floor.id);
        let mut first = 0;
        for cut in session.cuts(floor.id) {
            let (element, parts) = (cut.element, cut.parts);
            let places = &places[first..first + cut.places().len()];
            first += places.len();
            // Of those whose own rays found nothing, spots tell more.
            if own[element as usize][1] > 0.0 {
                let corners = &floor.indices[3 * element as usize..][..3];
                assert!(places.iter().eq(corners.iter().map(|vertex| &light[*vertex as usize])), "{element}: {parts}");
                lit += 1;
            }
        }
    }
    assert!(lit > 2000, "{lit}");
}

/// Edges of sharp shadows are shown where they are; after an edit the picture is that of a session which began so.
#[test]
fn elements_are_cut_where_light_has_an_edge() {
    let options = |places| SessionOptions { element_size: Some(0.5), rays: 64, places, ..SessionOptions::default() };
    let mut session = Session::new(shaded(), &options(30_000)).unwrap();
    finish(&mut session);
    let floor = ObjectId(0);
    let light = |session: &Session, layer| session.light_of_cuts(floor, layer, &session.light(floor, layer));
    let cuts = session.cuts(floor);
    let elements = session.irradiance(floor).len();
    assert!(!cuts.is_empty() && cuts.len() < elements / 2, "{} of {elements} elements are cut", cuts.len());
    assert_eq!(light(&session, Layer::Total), light(&session, Layer::Direct));
    assert_eq!(light(&session, Layer::Bounce(0)), light(&session, Layer::Direct));
    for layer in [Layer::Indirect, Layer::Bounce(1), Layer::Bounce(3)] {
        assert!(light(&session, layer).iter().all(|light| light[1].abs() < 1e-3), "{layer:?}");
    }

    let mut dice = radiosity_trace::sampling::Random::new(7);
    let mut anywhere = || SurfacePlace {
        object: floor,
        triangle: (dice.next_unit() * elements as f64) as u32,
        uv: [0.0, 1.0].map(|_| 0.5 * dice.next_unit() as f32),
    };
    let places: Vec<SurfacePlace> = (0..2000).map(|_| anywhere()).collect();
    let off = |session: &Session| read(session, places.clone()).off.unwrap();
    let mut whole = Session::new(shaded(), &options(0)).unwrap();
    finish(&mut whole);
    assert!(whole.cuts(floor).is_empty());
    let (before, after) = (off(&whole), off(&session));
    assert!(before > 0.1 && after < 0.1 * before, "{after} instead of {before}");
    // The edge is where it is: half a centimetre from it there is nothing of the shadow, and in it no light, but at its corner, which is as
    // wide as two parts, of which an element has sixteen.
    let is_away = |p: [f64; 3]| p[0].hypot(p[2]) > 0.0625 && p[0].min(p[2]).abs() > 0.005;
    let away: Vec<_> =
        read(&session, places.clone()).readings.into_iter().flatten().filter(|r| is_away(r.position)).collect();
    assert!(away.len() > 1500, "{}", away.len());
    for reading in away {
        let apart = (reading.shown - reading.lux).abs();
        assert!(apart <= (0.1 * reading.lux).max(1e-4), "{reading:?}");
    }

    let matrix = glam::DMat4::from_translation(DVec3::new(-0.4, 0.1, 0.2)).to_cols_array();
    let edit = Edit::Move { object: ObjectId(1), matrix };
    session.apply(&edit).unwrap();
    while !session.step(Duration::ZERO).is_complete {}
    // Far from the shadow nothing changes; what is cut there stays so, and the picture is better for it.
    let kept = session.cuts(floor).len();
    assert!((1..cuts.len()).contains(&kept), "{kept} of {}", cuts.len());
    whole.apply(&edit).unwrap();
    finish(&mut whole);
    let (without, with) = (off(&whole), off(&session));
    assert!(with < without, "{with} instead of {without}");
    let nothing = ObjectId(99);
    assert!(session.cuts(nothing).is_empty() && session.light_of_cuts(nothing, Layer::Total, &[]).is_empty());
    finish(&mut session);
    let mut fresh = Session::new(shaded(), &options(30_000)).unwrap();
    fresh.apply(&edit).unwrap();
    finish(&mut fresh);
    assert!(session.cuts(floor) == fresh.cuts(floor) && session.cuts(floor) != cuts);
    assert_eq!(light(&session, Layer::Total), light(&fresh, Layer::Total));
    // Half the light has half the edge.
    session.apply(&Edit::Light { light: LightId(0), dimming: 0.5, colour: [1.0; 3] }).unwrap();
    while !session.step(Duration::ZERO).is_complete {}
    let halves = light(&session, Layer::Total);
    assert!(!halves.is_empty());
    for (half, whole) in halves.iter().zip(light(&fresh, Layer::Total)) {
        assert!((half[1] - 0.5 * whole[1]).abs() <= 1e-4 * whole[1].max(1.0), "{half:?} of {whole:?}");
    }
}

/// Layers that take the work of all threads are read by many at once.
#[test]
fn layers_of_many_objects_are_read_together() {
    let mut scene = shaded();
    (0..40).for_each(|k| {
        let at = DVec3::new(0.1 * f64::from(k) - 2.0, 0.2, -1.0);
        let corners = [[0., 0.], [0.05, 0.], [0.05, 0.3], [0., 0.3]].map(|[x, y]| at + DVec3::new(x, y, 0.0));
        scene.add_quad(&format!("slat {k}"), 0, corners);
    });
    let options = SessionOptions { elements: 3000, rays: 64, ..SessionOptions::default() };
    let mut session = Session::new(scene, &options).unwrap();
    finish(&mut session);
    let objects: Vec<ObjectId> = session.model().objects.iter().map(|object| object.id).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
    for round in 0..60 {
        // Every change makes the layers anew.
        let dimming = 1.0 / f64::from(round + 1);
        session.apply(&Edit::Light { light: LightId(0), dimming: dimming as f32, colour: [1.0; 3] }).unwrap();
        finish(&mut session);
        let layer = [Layer::Error, Layer::Bounce(3), Layer::RelativeError][round as usize % 3];
        let light: Vec<_> = pool.install(|| objects.par_iter().map(|object| session.light(*object, layer)).collect());
        assert!(light.iter().all(|light| !light.is_empty()));
    }
}

/// Where light is even, the picture is off by next to nothing though single readings are noisy; where nothing is seen there is
/// nothing to tell.
#[test]
fn the_error_in_sight_is_without_the_noise_of_its_readings() {
    let options = SessionOptions { elements: 3000, rays: 1024, ..SessionOptions::default() };
    let mut session = Session::new(furnace(0), &options).unwrap();
    finish(&mut session);
    let model = session.model();
    let [low, high] = model.bounds.map(DVec3::from);
    let camera = |eye: DVec3, way: DVec3, up: DVec3| {
        let back = -way.normalize();
        let right = up.cross(back).normalize();
        DMat4::from(DAffine3::from_mat3_translation(DMat3::from_cols(right, back.cross(right), back), eye))
            .to_cols_array()
    };
    let middle = 0.5 * (low + high);
    let ceiling = camera(middle, DVec3::Y, DVec3::X);
    let places = session.places_in_sight(&ceiling, 1.0, 1.0);
    assert_eq!(places.len(), 160, "all of it is ceiling");
    let surveyed = read(&session, places);
    for reading in surveyed.readings.iter().map(|reading| reading.unwrap()) {
        let p = DVec3::from(reading.position);
        // On the line of sight, within 0.5 rad of the axis.
        assert!((p.y - high.y).abs() < 1e-6 && (p - middle).x.abs() <= 0.547 * (p - middle).y + 1e-6, "{p}");
        assert!((reading.lux - 200.0).abs() < 12.0, "{} lx at {p}", reading.lux);
    }
    assert!(surveyed.off.unwrap() < 0.02, "{:?}", surveyed.off);
    let away = camera(high + DVec3::ONE, high - low, DVec3::X);
    assert!(session.places_in_sight(&away, 0.5, 1.0).is_empty(), "there is nothing");
    assert!(session.places_in_sight(&[f64::NAN; 16], 0.5, 1.0).is_empty(), "that is no camera");
    assert_eq!(read(&session, Vec::new()).off, None);
}

/// Lamps that were added and taken away again, and one that is off, take no rays: readings are those of a scene without them.
#[test]
fn what_is_gone_leaves_no_trace_in_readings() {
    let options = SessionOptions { elements: 300, rays: 16, ..SessionOptions::default() };
    let mut session = Session::new(radiosity::cornell_box(), &options).unwrap();
    finish(&mut session);
    let place = |triangle| SurfacePlace { object: ObjectId(0), triangle, uv: [0.3, 0.3] };
    let places: Vec<SurfacePlace> = (0..2).map(place).collect();
    let before = read(&session, places.clone()).readings;
    for k in 0..12 {
        let light = NewLight {
            name: format!("lamp {k}"),
            kind: PointLightKind::Point,
            position: [0.2 + 0.01 * f64::from(k), 0.3, 0.3],
            direction: [0.0, -1.0, 0.0],
            intensity: [10.0; 3],
        };
        let added = session.apply(&Edit::AddLight { light }).unwrap().added_lights[0];
        let gone = if k == 0 {
            Edit::Light { light: added, dimming: 0.0, colour: [1.0; 3] }
        } else {
            Edit::DeleteLight { light: added }
        };
        session.apply(&gone).unwrap();
    }
    finish(&mut session);
    assert_eq!(read(&session, places).readings, before);
}
