//! Live editing: light after any series of edits is that of a fresh start, and that of batch work within noise.

#[path = "common/room.rs"]
mod room;

use radiosity::session::{Applied, Edit, EditError, Layer, LightId, ObjectId, Session, SessionOptions};
use radiosity::{Bands, Mesh, Scene, Side, Solution, SolveOptions, Tracer, cornell_box, luminance};
use radiosity_trace::sampling::Random;
use room::{Furnishing, room};
use std::time::Duration;

fn small() -> SessionOptions {
    SessionOptions { elements: 900, rays: 128, shadow_rays: Some(16), ..SessionOptions::default() }
}

fn furnished() -> Scene {
    let mut scene = room(&Furnishing { tables: 1, lamps: 2, books: 6 });
    scene.sky = radiosity::Sky::Uniform([300.0, 400.0, 500.0]);
    // Without this wall the sky looks in.
    scene.objects[3].name = "window".to_owned();
    let window = scene.objects[3].triangles.clone();
    for triangle in window {
        let corners = scene.triangles[triangle];
        for v in corners {
            let p = &mut scene.positions[v as usize];
            p.y = p.y.min(1.5);
        }
    }
    scene
}

fn finish(session: &mut Session) {
    for _ in 0..100_000 {
        if session.step(Duration::from_millis(3)).is_done {
            return;
        }
    }
    panic!("{:?}", session.status());
}

/// All light of a session, as bits.
fn bits(session: &Session) -> Vec<u32> {
    let objects = session.model().objects.len() as u32;
    let of =
        |object| session.light(ObjectId(object), Layer::Total).into_iter().chain(session.irradiance(ObjectId(object)));
    (0..objects).flat_map(of).flatten().map(f32::to_bits).collect()
}

struct Dice(Random);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        (self.0.next_unit() * n as f64) as usize
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.next_unit()
    }

    fn matrix(&mut self, reach: f64) -> [f64; 16] {
        let shift =
            glam::DVec3::new(self.between(-reach, reach), self.between(0.0, 0.2 * reach), self.between(-reach, reach));
        let turn = glam::DMat4::from_rotation_y(if self.below(3) == 0 { self.between(-0.5, 0.5) } else { 0.0 });
        (glam::DMat4::from_translation(shift) * turn).to_cols_array()
    }

    fn edit(&mut self, session: &Session, reach: f64) -> Edit {
        let model = session.model();
        let object = ObjectId(self.below(model.objects.len()) as u32);
        let light = LightId(self.below(model.lights.len()) as u32);
        match self.below(9) {
            0 | 1 => Edit::Light {
                light,
                dimming: if self.below(4) == 0 { 0.0 } else { self.between(0.0, 2.0) as f32 },
                colour: [1.0, self.between(0.0, 1.0) as f32, 0.7],
            },
            2 => Edit::Reflectance { object, reflectance: [0.1, self.between(0.0, 0.99) as f32, 0.5] },
            3..=5 => Edit::Move { object, matrix: self.matrix(reach) },
            6 => Edit::MoveLight { light, matrix: self.matrix(reach) },
            7 => Edit::Copy { object, matrix: self.matrix(reach) },
            _ => match model.objects.iter().find(|object| object.deleted) {
                Some(deleted) if self.below(2) == 0 => Edit::Restore { object: deleted.id },
                _ => Edit::Delete { object },
            },
        }
    }
}

/// Random edits, some taken back, with random work in between, against a fresh session that gets them all at once.
fn random_edits(scene: &Scene, options: &SessionOptions, reach: f64, seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut dice = Dice(Random::new(seed));
        let mut session = Session::new(scene.clone(), options).unwrap();
        if dice.below(3) > 0 {
            finish(&mut session);
        }
        let (mut edits, mut inverse): (Vec<Edit>, Vec<Edit>) = (Vec::new(), Vec::new());
        for _ in 0..4 + dice.below(6) {
            let edit = match inverse.pop() {
                Some(inverse) if dice.below(4) == 0 => inverse,
                _ if dice.below(6) == 0 => Edit::Several(vec![dice.edit(&session, reach), dice.edit(&session, reach)]),
                _ => dice.edit(&session, reach),
            };
            if let Ok(Applied { inverse: back, .. }) = session.apply(&edit) {
                edits.push(edit);
                inverse.push(back);
            }
            for _ in 0..dice.below(12) {
                session.step(Duration::from_micros(dice.below(4000) as u64));
            }
            if dice.below(4) == 0 {
                finish(&mut session);
            }
        }
        finish(&mut session);
        let mut fresh = Session::new(scene.clone(), options).unwrap();
        edits.iter().for_each(|edit| drop(fresh.apply(edit).unwrap()));
        finish(&mut fresh);
        let (edited, fresh) = (bits(&session), bits(&fresh));
        let differ = edited.iter().zip(&fresh).filter(|(a, b)| a != b).count();
        assert!(edited == fresh, "seed {seed}: {differ} of {} numbers differ after {edits:?}", fresh.len());
        assert!(fresh.iter().any(|bits| f32::from_bits(*bits) > 0.0) || seed > 0, "{edits:?}");
    }
}

#[test]
fn catalogue_77_random_edits_of_the_cornell_box() {
    random_edits(&cornell_box(), &small(), 0.2, 0..10);
}

#[test]
fn catalogue_77_random_edits_of_a_furnished_room() {
    random_edits(&furnished(), &small(), 1.0, 100..108);
}

#[test]
fn threads_change_nothing() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut session = Session::new(furnished(), &small()).unwrap();
            finish(&mut session);
            let mut dice = Dice(Random::new(7));
            for _ in 0..6 {
                let _ = session.apply(&dice.edit(&session, 0.5));
                session.step(Duration::from_millis(dice.below(10) as u64));
            }
            finish(&mut session);
            bits(&session)
        })
    };
    assert_eq!(run(1), run(2));
}

/// An edit before there are rays enough for a quick picture: every layer can be read, and a step is complete only when
/// the light is that of the edit.
#[test]
fn an_early_edit_leaves_whole_rows() {
    let mut session = Session::new(cornell_box(), &small()).unwrap();
    while session.status().rays < 4 {
        session.step(Duration::ZERO);
    }
    let before = session.light(ObjectId(0), Layer::Total);
    session.apply(&Edit::Light { light: LightId(0), dimming: 0.5, colour: [1.0; 3] }).unwrap();
    for _ in 0..100_000 {
        let step = session.step(Duration::ZERO);
        for layer in [Layer::Direct, Layer::Indirect, Layer::Bounce(1), Layer::Light(LightId(0))] {
            assert!(!session.light(ObjectId(0), layer).is_empty());
        }
        if step.is_complete {
            break;
        }
    }
    let of = |light: &[Bands]| light.iter().map(|e| luminance(*e)).sum::<f32>();
    let after = of(&session.light(ObjectId(0), Layer::Total)) / of(&before);
    assert!((after - 0.5).abs() < 0.15, "{after}");
}

#[test]
fn undo_restores_every_bit() {
    let mut session = Session::new(furnished(), &small()).unwrap();
    finish(&mut session);
    let before = bits(&session);
    let mut dice = Dice(Random::new(3));
    let mut inverse = Vec::new();
    for _ in 0..8 {
        if let Ok(applied) = session.apply(&dice.edit(&session, 0.6)) {
            inverse.push(applied.inverse);
        }
        session.step(Duration::from_millis(2));
    }
    finish(&mut session);
    for back in inverse.into_iter().rev() {
        session.apply(&back).unwrap();
    }
    finish(&mut session);
    assert!(bits(&session)[..before.len()] == before[..]);
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
    let probe = session.probe(ObjectId(0), 3, [0.3, 0.3]).unwrap();
    assert!(probe.lux > 0.0 && !probe.lights.is_empty() && !probe.objects.is_empty(), "{probe:?}");
    let parts: f32 = probe.objects.iter().map(|(_, light)| light[1]).sum::<f32>() + probe.direct[1];
    assert!(parts <= 1.01 * probe.irradiance[1] && parts > 0.9 * probe.irradiance[1], "{probe:?}");
    assert_eq!(session.rays(ObjectId(0), 3).len(), 128);
}

/// A furnace: in a closed box of reflectance ρ whose walls all shine alike, H = E/(1 − ρ) everywhere.
#[test]
fn a_furnace_is_uniform() {
    let mut scene = room(&Furnishing { tables: 1, lamps: 0, books: 0 });
    scene.lights.clear();
    for material in &mut scene.materials {
        material.base_color = [0.5, 0.5, 0.5, 1.0];
        material.emissive = [100.0 / std::f32::consts::PI; 3];
    }
    let mut session = Session::new(scene, &small()).unwrap();
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

#[test]
fn bad_edits_are_refused_by_name() {
    let mut session = Session::new(cornell_box(), &small()).unwrap();
    let before = session.edited_scene();
    let (object, light) = (ObjectId(1), LightId(0));
    let identity = glam::DMat4::IDENTITY.to_cols_array();
    let with = |k: usize, x: f64| {
        let mut matrix = identity;
        matrix[k] = x;
        matrix
    };
    let mut refused = |edit: Edit| session.apply(&edit).unwrap_err();
    let place = |matrix| Edit::Move { object, matrix };
    assert_eq!(refused(place(with(12, f64::NAN))), EditError::NotFinite);
    assert_eq!(refused(place(with(3, 0.5))), EditError::NotAffine([0.5, 0.0, 0.0, 1.0]));
    assert_eq!(refused(place(with(0, -1.0))), EditError::Determinant(-1.0));
    assert_eq!(refused(place(with(5, 0.0))), EditError::Determinant(0.0));
    assert!(matches!(refused(place(with(12, 1e9))), EditError::TooFar { .. }));
    assert_eq!(refused(Edit::Move { object: ObjectId(99), matrix: identity }), EditError::UnknownObject(ObjectId(99)));
    assert_eq!(refused(Edit::Restore { object }), EditError::NotDeleted(object));
    assert_eq!(refused(Edit::MoveLight { light, matrix: identity }), EditError::NotPlaceable(light));
    let painted = |rho: f32| Edit::Reflectance { object, reflectance: [0.5, rho, 0.5] };
    for rho in [-0.1, 0.995, f32::NAN] {
        assert!(matches!(refused(painted(rho)), EditError::Reflectance { .. }));
    }
    let dimmed = |dimming: f32| Edit::Light { light, dimming, colour: [1.0; 3] };
    for dimming in [-1.0, 101.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(refused(dimmed(dimming)), EditError::Light { .. }));
    }
    let unknown = Edit::Light { light: LightId(7), dimming: 1.0, colour: [1.0; 3] };
    assert_eq!(refused(unknown), EditError::UnknownLight(LightId(7)));
    // All or nothing.
    let several = Edit::Several(vec![Edit::Delete { object }, place(identity)]);
    assert_eq!(refused(several), EditError::Deleted(object));
    assert_eq!(session.edited_scene(), before);

    let options = SessionOptions { memory: 1 << 20, ..small() };
    assert!(matches!(Session::new(cornell_box(), &options), Err(radiosity::Error::Memory { .. })));
}

/// Edits and what they answer go over the wire.
#[test]
fn edits_are_json() {
    let edit = Edit::Several(vec![
        Edit::Light { light: LightId(2), dimming: 0.5, colour: [1.0, 0.5, 0.25] },
        Edit::Delete { object: ObjectId(3) },
    ]);
    let text = serde_json::to_string(&edit).unwrap();
    assert_eq!(
        text,
        r#"{"several":[{"light":{"light":2,"dimming":0.5,"colour":[1.0,0.5,0.25]}},{"delete":{"object":3}}]}"#
    );
    assert_eq!(serde_json::from_str::<Edit>(&text).unwrap(), edit);
}
