//! Measuring grids in the air: against closed forms, a furnace and `measure`, and after edits.

use crate::finish::finish;
use crate::furnace::furnace;
use crate::room::{Furnishing, room};
use glam::{DMat4, DVec3};
use radiosity::session::{
    Edit, LightId, ObjectId, Plane, PlaneError, PlaneFigures, PlaneQuestion, PlaneReading, Session, SessionOptions,
};
use radiosity::{
    MeasureOptions, Mesh, PointLight, PointLightKind, Scene, Sky, Tracer, cornell_box, luminance, measure,
};
use std::time::Duration;

fn lit(scene: Scene, elements: usize) -> Session {
    let options = SessionOptions { elements, rays: 256, ..SessionOptions::default() };
    let mut session = Session::new(scene, &options).unwrap();
    finish(&mut session);
    session
}

/// Over the first triangle of an object.
fn over(object: u32, height: f64, border: f64) -> PlaneQuestion {
    PlaneQuestion { object: ObjectId(object), triangle: 0, uv: [0.3, 0.3], height, border }
}

/// Measured in as many slices as it takes.
fn read(session: &Session, question: PlaneQuestion) -> Result<PlaneReading, PlaneError> {
    carry_on(session, &mut Plane::new(question))
}

/// Measured to the end from where it is.
fn carry_on(session: &Session, plane: &mut Plane) -> Result<PlaneReading, PlaneError> {
    for _ in 0..100_000 {
        if let Some(reading) = session.measure_plane(plane, Duration::ZERO)? {
            return Ok(reading);
        }
    }
    panic!("{plane:?} does not come to an end");
}

/// A black room of 6 m × 4 m, 3 m high, under a lamp of 1000 cd.
fn black_room() -> Scene {
    let mut scene = room(&Furnishing { tables: 0, lamps: 0, books: 0 });
    for p in &mut scene.positions {
        *p = DVec3::new(0.75 * p.x, p.y, 4.0 / 6.0 * p.z);
    }
    scene.materials.iter_mut().for_each(|material| material.base_color = [0.0, 0.0, 0.0, 1.0]);
    scene.lights = vec![PointLight {
        name: "lamp".to_owned(),
        kind: PointLightKind::Point,
        position: DVec3::new(2.0, 2.75, 1.5),
        direction: DVec3::NEG_Y,
        intensity: [1000.0; 3],
        range: None,
    }];
    scene
}

/// A box that stands on the floor, without a bottom.
fn add_box(scene: &mut Scene, name: &str, low: DVec3, high: DVec3) {
    let v = |x: f64, y: f64, z: f64| low + DVec3::new(x, y, z) * (high - low);
    let (a, b, c, d) = (v(0., 0., 0.), v(1., 0., 0.), v(1., 0., 1.), v(0., 0., 1.));
    let (e, f, g, h) = (v(0., 1., 0.), v(1., 1., 0.), v(1., 1., 1.), v(0., 1., 1.));
    for corners in [[h, g, f, e], [b, a, e, f], [c, b, f, g], [d, c, g, h], [a, d, h, e]] {
        scene.add_quad(name, 0, corners);
    }
}

/// E = I h/d³ below a lamp: each point of the plane, where it is, and what they say together.
#[test]
fn a_lamp_over_a_black_floor_is_its_closed_form() {
    let session = lit(black_room(), 500);
    for (height, border) in [(0.75, 0.5), (0.0, 0.0), (1.2, 0.8)] {
        let reading = read(&session, over(0, height, border)).unwrap();
        let mut size = reading.figures.size;
        size.sort_by(f64::total_cmp);
        assert!((size[0] - (4.0 - 2.0 * border)).abs() < 1e-9 && (size[1] - (6.0 - 2.0 * border)).abs() < 1e-9);
        // EN 12464-1: p = 0.2 · 5^lg d.
        let p = 0.2 * 5f64.powf(size[1].log10());
        assert!(
            reading.figures.cell.iter().all(|cell| *cell <= p + 1e-9 && *cell > 0.8 * p),
            "{:?} at most {p}",
            reading.figures.cell
        );
        let cells =
            reading.figures.size[0] * reading.figures.size[1] / (reading.figures.cell[0] * reading.figures.cell[1]);
        assert_eq!(reading.points.len(), cells.round() as usize);
        let mut sum = 0.0;
        for point in &reading.points {
            let at = DVec3::from(point.position);
            assert!((at.y - height).abs() < 1e-9, "{at}");
            assert!(at.x.min(6.0 - at.x).min(at.z).min(4.0 - at.z) > border, "{at}");
            let way = DVec3::new(2.0, 2.75, 1.5) - at;
            let wanted = 1000.0 * way.y / way.length().powi(3);
            assert!(
                (f64::from(point.lux) / wanted - 1.0).abs() < 1e-5,
                "{} lx at {at}, {wanted} lx by the form",
                point.lux
            );
            assert_eq!(point.error, 0.0, "one lamp without area has no noise");
            sum += wanted;
        }
        let lux = |of: fn(f32, f32) -> f32| reading.points.iter().map(|point| point.lux).reduce(of).unwrap();
        assert!((f64::from(reading.figures.mean) / (sum / reading.points.len() as f64) - 1.0).abs() < 1e-5);
        assert_eq!((reading.figures.least, reading.figures.most), (lux(f32::min), lux(f32::max)));
        assert!(
            (reading.figures.uniformity - reading.figures.least / reading.figures.mean).abs() < 1e-6
                && !reading.figures.is_coarse
        );
    }
}

/// Between walls of a furnace light is the same everywhere in the air, too.
#[test]
fn a_furnace_is_uniform_in_the_air() {
    let session = lit(furnace(0), 500);
    for height in [0.0, 0.75, 2.9] {
        let reading = read(&session, over(0, height, 0.5)).unwrap();
        for point in &reading.points {
            assert!((point.lux - 200.0).abs() < 0.05, "{point:?}");
        }
        assert!(
            reading.figures.uniformity > 0.9997 && reading.figures.error < 1e-4,
            "{} {}",
            reading.figures.uniformity,
            reading.figures.error
        );
    }
}

/// Where a point may be: not inside things, not beside walls or behind them, not above the ceiling.
#[test]
fn points_keep_off_things_and_walls() {
    let v = DVec3::new;
    let mut scene = black_room();
    add_box(&mut scene, "chest", v(0.9, 0.0, 0.9), v(2.1, 0.9, 2.1));
    // Up to the ceiling, and as deep as the room but for a door of 0.9 m.
    add_box(&mut scene, "partition", v(4.0, 0.0, 0.9), v(4.1, 3.0, 4.0));
    let session = lit(scene, 500);
    let is_in_chest = |p: DVec3| p.x > 0.9 && p.x < 2.1 && p.z > 0.9 && p.z < 2.1;
    for (height, has_chest) in [(0.75, true), (0.0, true), (0.91, false)] {
        let reading = read(&session, over(0, height, 0.5)).unwrap();
        let at: Vec<DVec3> = reading.points.iter().map(|point| point.position.into()).collect();
        assert!(
            at.len() > 10 && at.iter().all(|p| p.x < 3.5),
            "on this side of the partition, half a metre off: {at:?}"
        );
        assert_eq!(at.iter().any(|p| is_in_chest(*p)), !has_chest, "{height}");
        assert_eq!(reading.figures.covered > 0, has_chest, "{height}");
        // Each cell of the floor is told of once; those of the other room lie behind a wall.
        let PlaneFigures { size, cell, covered, walled, beyond, .. } = reading.figures;
        let cells = (size[0] / cell[0] * size[1] / cell[1]).round() as usize;
        assert!(beyond > 3 && at.len() + covered + walled + beyond == cells, "{:?}", reading.figures);
        // The room goes on behind the chest.
        for corner in [v(0.7, height, 0.7), v(0.7, height, 3.3), v(3.2, height, 0.7), v(3.2, height, 3.3)] {
            assert!(at.iter().any(|p| p.distance(corner) < 0.5), "{corner}");
        }
    }
    // The other room: from a place in it.
    let floor = &session.model().objects[0];
    let is_there = |corners: &[u32]| corners.iter().all(|v| floor.positions[*v as usize][0] > 5.0);
    let triangle = floor.indices.chunks_exact(3).position(is_there).unwrap() as u32;
    let there = PlaneQuestion { triangle, ..over(0, 0.75, 0.5) };
    let other = read(&session, there).unwrap();
    assert!(other.points.iter().all(|point| point.position[0] > 4.6), "{:?}", other.points);
    // On the chest.
    let chest = session.model().objects.iter().find(|object| object.name == "chest").unwrap().id.0;
    let on_it = read(&session, over(chest, 0.0, 0.0)).unwrap();
    assert!(on_it.points.iter().all(|p| is_in_chest(p.position.into()) && (p.position[1] - 0.9).abs() < 1e-9));
    assert!((on_it.figures.size[0] - 1.2).abs() < 1e-9 && on_it.figures.least > 10.0, "{on_it:?}");

    let refused = |question| read(&session, question).unwrap_err();
    assert_eq!(refused(over(0, 5.0, 0.5)), PlaneError::NoPoint, "above the ceiling");
    assert_eq!(refused(over(1, 0.75, 0.5)), PlaneError::NotLevel, "the ceiling looks down");
    assert_eq!(refused(over(2, 0.75, 0.5)), PlaneError::NotLevel, "a wall");
    assert!(matches!(refused(over(0, 0.75, 2.0)), PlaneError::TooNarrow { border: 2.0, .. }));
    for length in [-0.1, 2000.0, f64::NAN] {
        assert_eq!(refused(over(0, length, 0.5)), PlaneError::NotALength);
        assert_eq!(refused(over(0, 0.75, length)), PlaneError::NotALength);
    }
    assert_eq!(refused(over(99, 0.75, 0.5)), PlaneError::NoSurface);
    assert_eq!(refused(PlaneQuestion { triangle: 1 << 20, ..over(0, 0.75, 0.5) }), PlaneError::NoSurface);
    assert_eq!(refused(PlaneQuestion { uv: [f32::NAN; 2], ..over(0, 0.75, 0.5) }), PlaneError::NoSurface);
}

/// A house around the room, whose outer walls are an object of their own and look outwards, and a garden around the house that
/// makes it small: the room is not inside of a thing.
#[test]
fn a_room_in_a_house_is_a_room() {
    let v = DVec3::new;
    let mut scene = black_room();
    add_box(&mut scene, "house", v(-0.3, -0.3, -0.3), v(6.3, 3.3, 4.3));
    add_box(&mut scene, "chest", v(0.9, 0.0, 0.9), v(2.1, 0.9, 2.1));
    scene.add_quad("garden", 0, [v(-40., -0.3, -40.), v(-40., -0.3, 40.), v(40., -0.3, 40.), v(40., -0.3, -40.)]);
    let reading = read(&lit(scene, 500), over(0, 0.75, 0.5)).unwrap();
    let alone = read(&lit(black_room(), 500), over(0, 0.75, 0.5)).unwrap();
    let is_in_chest = |p: [f64; 3]| p[0] > 0.9 && p[0] < 2.1 && p[2] > 0.9 && p[2] < 2.1;
    let expected: Vec<[f64; 3]> = alone.points.iter().map(|p| p.position).filter(|p| !is_in_chest(*p)).collect();
    assert_eq!(reading.points.len(), expected.len());
    for (point, place) in reading.points.iter().zip(expected) {
        assert!(DVec3::from(point.position).distance(place.into()) < 1e-6);
    }
}

/// A room that stands askew has its grid along its walls.
#[test]
fn a_grid_lies_along_the_walls() {
    let mut scene = black_room();
    let turn = DMat4::from_rotation_y(0.3);
    scene.positions.iter_mut().for_each(|p| *p = turn.transform_point3(*p));
    scene.lights[0].position = turn.transform_point3(scene.lights[0].position);
    let session = lit(scene, 500);
    let straight = lit(black_room(), 500);
    let [askew, straight] = [&session, &straight].map(|session| read(session, over(0, 0.75, 0.5)).unwrap());
    assert_eq!(askew.points.len(), straight.points.len());
    for (a, b) in askew.points.iter().zip(&straight.points) {
        assert!(DVec3::from(a.position).distance(turn.transform_point3(b.position.into())) < 1e-6);
        assert!((a.lux / b.lux - 1.0).abs() < 1e-5);
    }
}

/// Against `measure`, an independent solution with its own mesh: furniture, area lamps, a spot; and the Cornell box.
#[test]
fn agrees_with_measure() {
    let furnished = room(&Furnishing { tables: 1, lamps: 2, books: 0 });
    // A window two metres wide is all the light there is.
    let mut daylit = room(&Furnishing { tables: 1, lamps: 0, books: 0 });
    daylit.lights.clear();
    daylit.sky = Sky::Uniform([3000.0, 4000.0, 5000.0]);
    let wall = daylit.objects.iter().find(|object| object.name == "wall south").unwrap().vertices.clone();
    daylit.positions[wall].iter_mut().for_each(|p| p.x = p.x.min(6.0));
    for (name, scene, question) in [
        ("room", furnished, over(0, 0.75, 0.5)),
        ("daylight", daylit, over(0, 0.75, 0.5)),
        ("Cornell box", cornell_box(), over(0, 0.25, 0.05)),
    ] {
        let session = lit(scene, 12_000);
        let reading = read(&session, question).unwrap();
        let scene = session.edited_scene();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let points: Vec<(DVec3, DVec3)> =
            reading.points.iter().map(|point| (point.position.into(), DVec3::Y)).collect();
        let measured = measure(&tracer, &points, &MeasureOptions::default(), &()).unwrap();
        let (mut square, mut whole, mut sum) = (0.0, 0.0, 0.0);
        for (point, wanted) in reading.points.iter().zip(&measured.irradiance) {
            let wanted = f64::from(luminance(*wanted));
            square += (f64::from(point.lux) - wanted).powi(2);
            whole += wanted * wanted;
            sum += wanted;
        }
        let off = (square / whole).sqrt();
        let mean = f64::from(reading.figures.mean) * points.len() as f64 / sum - 1.0;
        assert!(measured.achieved && points.len() >= 10);
        // Measured: 0.0006 and 0.0003 under lamps, 0.011 and 0.0014 by the window, of which points tell 0.019.
        let told = f64::from(reading.figures.error);
        assert!(off < 0.02 && mean.abs() < 0.01, "{name}: {off} {mean}");
        assert!(told < 0.05 && off < 2.0 * told + 0.002, "{name}: {off} {mean}, told {told}");
    }
}

/// After edits a plane is that of a fresh session, to the last bit, and it waits while an edit is not seen.
#[test]
fn edits_are_followed() {
    let scene = room(&Furnishing { tables: 1, lamps: 2, books: 0 });
    let lamp = Edit::Light { light: LightId(0), dimming: 0.3, colour: [1.0, 0.9, 0.7] };
    let matrix = DMat4::from_translation(DVec3::new(2.0, 0.5, 1.0)).to_cols_array();
    let edits = [lamp, Edit::Move { object: ObjectId(8), matrix }];
    let question = over(0, 0.75, 0.5);
    let mut session = lit(scene.clone(), 1500);
    let before = read(&session, question).unwrap();
    let mut plane = Plane::new(question);
    session.measure_plane(&mut plane, Duration::ZERO).unwrap();
    for edit in &edits {
        session.apply(edit).unwrap();
        assert_eq!(session.measure_plane(&mut plane, Duration::from_secs(60)), Ok(None));
    }
    finish(&mut session);
    let after = carry_on(&session, &mut plane).unwrap();
    assert!(after.figures.mean < 0.9 * before.figures.mean, "{} {}", after.figures.mean, before.figures.mean);

    let mut fresh =
        Session::new(scene, &SessionOptions { elements: 1500, rays: 256, ..SessionOptions::default() }).unwrap();
    edits.iter().for_each(|edit| drop(fresh.apply(edit).unwrap()));
    assert_eq!(fresh.measure_plane(&mut Plane::new(question), Duration::from_secs(60)), Ok(None), "it is dark");
    finish(&mut fresh);
    assert_eq!(read(&fresh, question).unwrap(), after);
    session.apply(&Edit::Delete { object: ObjectId(0) }).unwrap();
    finish(&mut session);
    assert_eq!(read(&session, question), Err(PlaneError::NoSurface));
}

/// What people would move, by name.
fn movable(scene: Scene) -> Vec<String> {
    let session = Session::new(scene, &SessionOptions { elements: 500, ..SessionOptions::default() }).unwrap();
    let mut names: Vec<String> =
        session.model().objects.into_iter().filter(|object| object.movable).map(|object| object.name).collect();
    names.dedup();
    names
}

/// A chest, a rug of half the room's width, and a partition from floor to ceiling with a door beside it.
fn furnish(scene: &mut Scene) {
    let v = DVec3::new;
    add_box(scene, "chest", v(0.9, 0.0, 0.9), v(2.1, 0.9, 2.1));
    add_box(scene, "rug", v(2.4, 0.0, 0.5), v(3.6, 0.01, 3.0));
    add_box(scene, "partition", v(4.0, 0.0, 0.9), v(4.1, 3.0, 4.0));
    // What is bounded by furniture alone is furniture.
    add_box(scene, "shelf", v(4.6, 0.0, 3.6), v(4.7, 1.8, 3.9));
    add_box(scene, "shelf", v(5.8, 0.0, 3.6), v(5.9, 1.8, 3.9));
    add_box(scene, "shelf", v(4.6, 1.8, 3.6), v(5.9, 1.9, 3.9));
    add_box(scene, "box on the shelf", v(4.8, 0.0, 3.7), v(5.7, 1.79, 3.8));
}

#[test]
fn furniture_is_moved_and_buildings_are_not() {
    let v = DVec3::new;
    let furniture = ["chest", "rug", "shelf", "box on the shelf"];
    let mut alone = black_room();
    furnish(&mut alone);
    assert_eq!(movable(alone.clone()), furniture, "a room");

    let mut askew = alone.clone();
    let turn = DMat4::from_rotation_y(0.3);
    askew.positions.iter_mut().for_each(|p| *p = turn.transform_point3(*p));
    assert_eq!(movable(askew), furniture, "a room that stands askew");

    let mut small = alone.clone();
    small.positions.iter_mut().for_each(|p| *p *= 0.1);
    assert_eq!(movable(small), furniture, "a model of a room");

    let mut garden = alone.clone();
    add_box(&mut garden, "house", v(-0.3, -0.3, -0.3), v(6.3, 3.3, 4.3));
    garden.add_quad("garden", 0, [v(-40., -0.3, -40.), v(-40., -0.3, 40.), v(40., -0.3, 40.), v(40., -0.3, -40.)]);
    add_box(&mut garden, "bench", v(-9.0, -0.3, 2.0), v(-7.0, 0.2, 2.5));
    assert_eq!(movable(garden), ["chest", "rug", "shelf", "box on the shelf", "bench"], "a room in a garden");

    // Rooms side by side, each with walls and things of its own.
    let mut building = alone.clone();
    for k in 1..6 {
        let shift = v(6.2 * f64::from(k), 0.0, 0.0);
        for object in alone.objects.clone() {
            // Quadrilaterals of two triangles each.
            for pair in alone.triangles[object.triangles].chunks_exact(2) {
                let corners =
                    [pair[0][0], pair[0][1], pair[0][2], pair[1][2]].map(|p| alone.positions[p as usize] + shift);
                building.add_quad(&format!("{} {k}", object.name), 0, corners);
            }
        }
    }
    let names = movable(building);
    assert!(names.iter().all(|name| furniture.iter().any(|thing| name.starts_with(thing))), "{names:?}");
    assert_eq!(names.len(), 24, "{names:?}");

    // One thing is the scene; on a ground that is wider it is one that can be moved.
    let mut thing = Scene::default();
    thing.materials.push(radiosity::Material::default());
    add_box(&mut thing, "thing", v(0.0, 0.0, 0.0), v(2.0, 1.0, 1.0));
    assert_eq!(movable(thing.clone()), [""; 0]);
    thing.add_quad("ground", 0, [v(-4., 0., -4.), v(-4., 0., 4.), v(4., 0., 4.), v(4., 0., -4.)]);
    assert_eq!(movable(thing), ["thing"]);

    assert_eq!(movable(radiosity::cornell_box()), ["light", "short block", "tall block"]);
}
