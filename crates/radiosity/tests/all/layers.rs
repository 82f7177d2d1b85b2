//! What is read from a session: layers of light that add up and are of one state, its error, and places.

use crate::finish::finish;
use crate::furnace::furnace;
use crate::furnished::furnished;
use crate::room::{Furnishing, room};
use crate::small::small;
use radiosity::session::{
    Edit, Form, Layer, LightId, LightKind, NewObject, ObjectId, Session, SessionOptions, SurfacePlace,
};
use radiosity::{Bands, Mesh, Side, Solution, SolveOptions, Tracer, cornell_box, luminance};
use std::time::Duration;

fn at(object: ObjectId, triangle: u32) -> SurfacePlace {
    SurfacePlace { object, triangle, uv: [0.3, 0.3] }
}

/// The error that was told stayed that of the first light, whatever was dimmed.
#[test]
fn the_error_is_that_of_the_light_that_is_shown() {
    let mut session = Session::new(furnished(), &small()).unwrap();
    finish(&mut session);
    let first = session.status().error;
    let sky = session.model().lights.iter().find(|light| light.kind == LightKind::Sky).unwrap().id;
    let off = Edit::Light { light: sky, dimming: 0.0, colour: [1.0; 3] };
    let inverse = session.apply(&off).unwrap().inverse;
    assert_eq!(session.status().error, first, "the old light is shown");
    finish(&mut session);
    let mut fresh = Session::new(furnished(), &small()).unwrap();
    fresh.apply(&off).unwrap();
    finish(&mut fresh);
    assert_ne!(session.status().error, first);
    assert_eq!(session.status().error, fresh.status().error);
    session.apply(&inverse).unwrap();
    finish(&mut session);
    assert_eq!(session.status().error, first);

    // It is not known of the first picture after a change, only of the last one.
    let object = session.model().objects.last().unwrap().id;
    let matrix = glam::DMat4::from_translation(glam::DVec3::new(0.1, 0.0, 0.0)).to_cols_array();
    session.apply(&Edit::Move { object, matrix }).unwrap();
    while !session.step(Duration::from_millis(1)).is_complete {}
    assert!(session.status().error.is_infinite());
    finish(&mut session);
    assert!((0.5..2.0).contains(&(session.status().error / first)));
}

/// What is new, copied or elsewhere has its first rays alone when the first picture of it is there: every layer and every place
/// can be read then, and shares are those of the light.
#[test]
fn what_has_its_first_rays_alone_can_be_read() {
    let options = SessionOptions { elements: 2000, rays: 256, ..SessionOptions::default() };
    let mut session = Session::new(cornell_box(), &options).unwrap();
    finish(&mut session);
    let place = glam::DMat4::from_translation(glam::DVec3::new(0.4, 0.3, 0.1)).to_cols_array();
    let shift = glam::DMat4::from_translation(glam::DVec3::new(0.03, 0.0, -0.02)).to_cols_array();
    let block = session.model().objects.iter().find(|object| object.name.contains("block")).unwrap().id;
    let form = Form::Box { size: [0.05, 0.06, 0.07] };
    let object = NewObject { name: "new".to_owned(), form, reflectance: [0.5; 3], emission: [0.0; 3], matrix: place };
    let edits = [
        Edit::Add { object: Box::new(object) },
        Edit::Copy { object: block, matrix: shift },
        Edit::Move { object: block, matrix: shift },
    ];
    for edit in edits {
        let applied = session.apply(&edit).unwrap();
        let own = applied.added.first().copied().unwrap_or(block);
        while !session.step(Duration::ZERO).is_complete {}
        assert!(!session.status().is_done, "{edit:?}: more rays follow");
        let layers =
            [Layer::Direct, Layer::Indirect, Layer::Bounce(1), Layer::Bounce(3), Layer::Error, Layer::RelativeError];
        for layer in layers {
            let light = session.light(own, layer);
            assert!(!light.is_empty() && light.iter().flatten().all(|x| x.is_finite()), "{layer:?} after {edit:?}");
        }
        for triangle in 0..session.irradiance(own).len() as u32 {
            let probe = session.probe(&at(own, triangle)).unwrap();
            let told = luminance(probe.direct) + probe.objects.iter().map(|(_, light)| luminance(*light)).sum::<f32>();
            assert!((told - probe.lux).abs() <= 1e-3 * probe.lux, "{told} lx of {} lx after {edit:?}", probe.lux);
        }
        finish(&mut session);
    }
}

/// The first picture after an edit is near the light that follows: by less than a tenth of what paint changes, and by less
/// than a quarter for a lamp that is moved, whose light has the noise of four shadow rays.
#[test]
fn the_first_picture_is_near_the_last() {
    let shift = glam::DMat4::from_translation(glam::DVec3::new(0.5, 0.0, 0.4)).to_cols_array();
    let options = SessionOptions { elements: 4000, rays: 256, ..SessionOptions::default() };
    let scene = room(&Furnishing { tables: 1, lamps: 2, books: 6 });
    let named = |name: &str| ObjectId(scene.objects.iter().position(|object| object.name == name).unwrap() as u32);
    let edits = [
        (0.1, Edit::Reflectance { object: named("wall west"), reflectance: [0.9, 0.9, 0.9] }),
        (0.1, Edit::Reflectance { object: named("floor"), reflectance: [0.05, 0.1, 0.8] }),
        (0.25, Edit::Move { object: named("lamp 0"), matrix: shift }),
    ];
    let mut session = Session::new(scene.clone(), &options).unwrap();
    finish(&mut session);
    let all = |session: &Session| -> Vec<(Bands, f64)> {
        let objects = (0..session.model().objects.len() as u32).map(ObjectId);
        objects.flat_map(|id| session.irradiance(id).into_iter().zip(session.exposed_areas(id))).collect()
    };
    let distance = |a: &[(Bands, f64)], b: &[(Bands, f64)]| {
        let square = |(a, b): (&(Bands, f64), &(Bands, f64))| {
            b.1 * (0..3).map(|band| f64::from(a.0[band] - b.0[band]).powi(2)).sum::<f64>()
        };
        a.iter().zip(b).map(square).sum::<f64>().sqrt()
    };
    for (most, edit) in edits {
        let before = all(&session);
        session.apply(&edit).unwrap();
        while !session.step(Duration::ZERO).is_complete {}
        let first = all(&session);
        finish(&mut session);
        let last = all(&session);
        let (off, change) = (distance(&first, &last), distance(&before, &last));
        assert!(off < most * change, "{edit:?}: {off} of {change}");
    }
}

/// Light of a session against that of batch work on the scene as edited, at the centres of elements.
#[test]
fn agrees_with_batch_work() {
    let shift = |x: f64, y: f64, z: f64| glam::DMat4::from_translation(glam::DVec3::new(x, y, z)).to_cols_array();
    let edits = [
        Edit::Light { light: LightId(0), dimming: 0.5, colour: [1.0, 0.8, 0.6] },
        Edit::Move { object: ObjectId(1), matrix: shift(0.05, -0.05, 0.04) },
        Edit::Reflectance { object: ObjectId(0), reflectance: [0.2, 0.5, 0.8] },
        // The short block, lifted off the floor.
        Edit::Several((9..14).map(|k| Edit::Move { object: ObjectId(k), matrix: shift(0.03, 0.1, -0.02) }).collect()),
    ];
    let options = SessionOptions { elements: 6000, rays: 256, ..SessionOptions::default() };
    let mut session = Session::new(cornell_box(), &options).unwrap();
    for edit in &edits {
        session.apply(edit).unwrap();
    }
    finish(&mut session);

    let scene = session.edited_scene();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let solution = Solution::new(&tracer, &SolveOptions { rays: 256, ..SolveOptions::default() }, &()).unwrap();
    // Mean irradiance of each object, by luminance: elements of both differ.
    let objects = scene.objects.len();
    let (mut batch, mut area) = (vec![0f64; objects], vec![0f64; objects]);
    for element in 0..solution.elements.len() as u32 {
        let (triangle, side) = solution.elements.place(element);
        assert_eq!(side, Side::Front);
        let object = scene.triangle_object[mesh.source[triangle] as usize] as usize;
        let own = solution.area[element as usize] * solution.exposure.share(element);
        batch[object] += own * f64::from(luminance(solution.irradiance()[element as usize]));
        area[object] += own;
    }
    let (mut square, mut whole) = (0.0, 0.0);
    for object in 0..objects {
        let id = ObjectId(object as u32);
        let (light, areas) = (session.irradiance(id), session.exposed_areas(id));
        let own: f64 = light.iter().zip(&areas).map(|(h, a)| a * f64::from(luminance(*h))).sum::<f64>()
            / areas.iter().sum::<f64>();
        let expected = batch[object] / area[object];
        // Objects are large; the light of each is known to a percent by either way, that of faint undersides to a few.
        assert!((own - expected).abs() < 0.04 * expected + 2.0, "{}: {own} for {expected}", scene.objects[object].name);
        square += area[object] * (own - expected).powi(2);
        whole += area[object] * expected.powi(2);
    }
    assert!((square / whole).sqrt() < 0.01, "{}", (square / whole).sqrt());
}

/// Layers add up to the whole.
#[test]
fn layers_add_up() {
    let mut session = Session::new(furnished(), &small()).unwrap();
    finish(&mut session);
    let lights = session.model().lights.len() as u32;
    for object in (0..session.model().objects.len() as u32).map(ObjectId) {
        let total = session.light(object, Layer::Total);
        let sum = |layers: &[Layer]| {
            let mut sum = vec![[0f32; 3]; total.len()];
            for layer in layers {
                for (sum, own) in sum.iter_mut().zip(session.light(object, *layer)) {
                    (0..3).for_each(|band| sum[band] += own[band]);
                }
            }
            sum
        };
        let is_near = |found: Vec<Bands>, tolerance: f32| {
            for (a, b) in found.iter().flatten().zip(total.iter().flatten()) {
                assert!((a - b).abs() <= tolerance * b + 0.05, "{a} for {b}");
            }
        };
        is_near(sum(&[Layer::Direct, Layer::Indirect]), 1e-4);
        is_near(sum(&(0..40).map(Layer::Bounce).collect::<Vec<_>>()), 2e-3);
        is_near(sum(&(0..lights).map(|light| Layer::Light(LightId(light))).collect::<Vec<_>>()), 1e-4);
    }
    let probe = session.probe(&at(ObjectId(0), 3)).unwrap();
    assert!(probe.lux > 0.0 && !probe.lights.is_empty() && !probe.objects.is_empty(), "{probe:?}");
    let parts: f32 = probe.objects.iter().map(|(_, light)| light[1]).sum::<f32>() + probe.direct[1];
    assert!((parts / probe.irradiance[1] - 1.0).abs() < 1e-4, "{probe:?}");
    let brought: f32 = probe.lights.iter().map(|(_, light)| luminance(*light)).sum();
    assert!((brought / probe.lux - 1.0).abs() < 1e-3, "{brought} lx of {probe:?}");
    assert_eq!(session.rays(ObjectId(0), 3).len(), 128);
}

/// A lamp is made brighter while rays are few: layers that are asked for in between, for the first time, are those of the light that
/// is shown, or wait. They had the lamps of now with the whole light of before.
#[test]
fn layers_are_of_one_state_while_light_follows() {
    let mut session = Session::new(cornell_box(), &small()).unwrap();
    while session.status().rays < 8 {
        session.step(Duration::ZERO);
    }
    let (floor, lamp) = (ObjectId(0), LightId(0));
    session.apply(&Edit::Light { light: lamp, dimming: 8.0, colour: [1.0; 3] }).unwrap();
    let (mut waited, mut told) = (0, 0);
    for piece in 0..100_000 {
        if piece % 3 == 0 {
            let [all, direct] = [Layer::Total, Layer::Direct].map(|layer| session.light(floor, layer));
            let is_told = session.has_layer(Layer::Direct);
            assert!(session.has_layer(Layer::Total) && !all.is_empty() && direct.is_empty() != is_told);
            *(if is_told { &mut told } else { &mut waited }) += 1;
            for (direct, all) in direct.iter().zip(&all) {
                assert!(direct[1] <= 1.0001 * all[1], "piece {piece}: {} lx of {} lx are direct", direct[1], all[1]);
            }
            // What is told of a place is not more than what falls on it either.
            let probe = session.probe(&at(floor, 0));
            assert_eq!(probe.is_some(), is_told, "piece {piece}");
            if let Some(probe) = probe {
                let brought: f32 = probe.lights.iter().map(|(_, light)| luminance(*light)).sum();
                assert!(brought <= 1.001 * probe.lux, "piece {piece}: {brought} lx of {} lx", probe.lux);
            }
        }
        if session.step(Duration::ZERO).is_done {
            break;
        }
    }
    assert!(waited > 0 && told > 3, "{waited} {told}");
    // The whole light is that of before, whenever it is asked for.
    let early = |pieces: Option<u32>| {
        let mut session = Session::new(cornell_box(), &small()).unwrap();
        while session.status().rays < 8 {
            session.step(Duration::ZERO);
        }
        if let Some(pieces) = pieces {
            session.apply(&Edit::Light { light: lamp, dimming: 8.0, colour: [1.0; 3] }).unwrap();
            (0..pieces).for_each(|_| drop(session.step(Duration::ZERO)));
            assert!(!session.has_layer(Layer::Direct), "the edit is not seen after {pieces} pieces");
        }
        session.light(floor, Layer::Total)
    };
    let whole = early(None);
    (0..3).for_each(|pieces| assert!(early(Some(pieces)) == whole, "after {pieces} pieces"));
    // Nothing is told of a place until the edit is seen.
    let before = session.probe(&at(floor, 0)).unwrap();
    session.apply(&Edit::Light { light: lamp, dimming: 1.0, colour: [1.0; 3] }).unwrap();
    assert_eq!(session.probe(&at(floor, 0)), None);
    finish(&mut session);
    let after = session.probe(&at(floor, 0)).unwrap();
    assert!((luminance(after.lights[0].1) / luminance(before.lights[0].1) - 0.125).abs() < 1e-5);
}

/// A furnace: in a closed box of reflectance ρ whose walls all shine alike, H = E/(1 − ρ) everywhere.
#[test]
fn a_furnace_is_uniform() {
    // As many as by default: beside a solid a ray that seems to begin outside of it meets its black back.
    let options = SessionOptions { rays: 256, ..small() };
    let mut session = Session::new(furnace(1), &options).unwrap();
    finish(&mut session);
    let (mut defect, mut whole) = (0.0, 0.0);
    for object in (0..session.model().objects.len() as u32).map(ObjectId) {
        for (h, area) in session.irradiance(object).into_iter().zip(session.exposed_areas(object)) {
            // Within the chairs parts stand flush on each other and see each other's faces in there; nobody else does.
            assert!(area == 0.0 || object.0 > 6 || (h[1] - 200.0).abs() < 4.0, "{h:?} on {object:?}");
            defect += area * f64::from((h[1] - 200.0).abs());
            whole += area * 200.0;
        }
    }
    assert!(defect / whole < 3e-3, "{}", defect / whole);
}
