//! Live editing: light after any series of edits is that of a fresh start, and that of batch work within noise.

use crate::bits::bits;
use crate::finish::finish;
use crate::full::full;
use crate::furnished::furnished;
use crate::small::small;
use radiosity::session::{
    Applied, Edit, EditError, Form, Layer, LightId, NewLight, NewObject, ObjectId, Session, SessionOptions,
};
use radiosity::{Bands, PointLightKind, Scene, cornell_box, luminance};
use radiosity_trace::sampling::Random;
use std::time::Duration;

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

    fn kind(&mut self) -> PointLightKind {
        match self.below(3) {
            0 => PointLightKind::Point,
            1 => PointLightKind::Spot { inner: self.between(0.0, 0.5), outer: 0.7 },
            _ => PointLightKind::Directional,
        }
    }

    fn light(&mut self, reach: f64) -> NewLight {
        let kind = self.kind();
        let at = [(); 3].map(|()| self.between(0.0, reach));
        let direction = [self.between(-1.0, 1.0), -1.0, self.between(-1.0, 1.0)];
        NewLight { name: "added".to_owned(), kind, position: at, direction, intensity: [50.0, 40.0, 30.0] }
    }

    /// A box or a lamp.
    fn object(&mut self, reach: f64) -> NewObject {
        let mut length = || self.between(0.1, 0.6) * reach;
        let (size, emission) = ([length(), length(), length()], [[0.0; 3], [900.0, 800.0, 0.0]][self.below(2)]);
        let form = if self.below(2) == 0 { Form::Box { size } } else { Form::Rectangle { size: [size[0], size[1]] } };
        NewObject {
            name: "added".to_owned(),
            form,
            reflectance: [0.2, 0.5, 0.8],
            emission,
            matrix: (glam::DMat4::from_cols_array(&self.matrix(reach)) * glam::DMat4::from_rotation_x(1.3))
                .to_cols_array(),
        }
    }

    fn edit(&mut self, session: &Session, reach: f64) -> Edit {
        let model = session.model();
        let object = ObjectId(self.below(model.objects.len()) as u32);
        let light = LightId(self.below(model.lights.len()) as u32);
        // Of lights without area, as most are refused to others.
        let lamp = model.lights.iter().rfind(|light| light.intensity.is_some()).map_or(light, |light| light.id);
        match self.below(17) {
            0 | 1 => Edit::Light {
                light,
                dimming: if self.below(4) == 0 { 0.0 } else { self.between(0.0, 2.0) as f32 },
                colour: [1.0, self.between(0.0, 1.0) as f32, 0.7],
            },
            2 => Edit::Reflectance { object, reflectance: [0.1, self.between(0.0, 0.99) as f32, 0.5] },
            3..=5 => Edit::Move { object, matrix: self.matrix(reach) },
            6 => Edit::MoveLight { light, matrix: self.matrix(reach) },
            7 => Edit::Copy { object, matrix: self.matrix(reach) },
            8 => Edit::AddLight { light: self.light(reach) },
            9 => Edit::CopyLight { light, matrix: self.matrix(reach) },
            10 => match model.lights.iter().find(|light| light.deleted && light.object.is_none()) {
                Some(deleted) if self.below(2) == 0 => Edit::RestoreLight { light: deleted.id },
                _ => Edit::DeleteLight { light },
            },
            11 => {
                let intensity = [self.between(0.0, 100.0) as f32, 40.0, 0.0];
                Edit::ChangeLight { light: lamp, kind: self.kind(), intensity }
            }
            12 | 13 => match model.objects.iter().rfind(|object| object.form.is_some()) {
                Some(added) => {
                    let NewObject { form, matrix, .. } = self.object(reach);
                    Edit::Reshape { object: added.id, form, matrix }
                }
                None => Edit::Delete { object },
            },
            14 | 15 => Edit::Add { object: Box::new(self.object(reach)) },
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
    random_edits(&cornell_box(), &small(), 0.2, 0..6);
}

#[test]
fn catalogue_77_random_edits_of_a_furnished_room() {
    random_edits(&furnished(), &small(), 1.0, 100..105);
}

/// A box and a lamp are added, and then copied, moved, made anew: the light is, to the last bit, that of a session which opens the
/// edited scene, where both were from the beginning.
#[test]
fn catalogue_77_what_is_added_is_as_if_it_had_always_been_there() {
    let size = glam::DVec3::new(0.2, 0.05, 0.1);
    let at = |x: f64, y: f64, z: f64| glam::DMat4::from_translation(glam::DVec3::new(x, y, z));
    let object = NewObject {
        name: "crate".to_owned(),
        form: Form::Box { size: size.to_array() },
        reflectance: [0.8, 0.4, 0.2],
        emission: [0.0; 3],
        matrix: at(0.12, 0.4, 0.1).to_cols_array(),
    };
    let down = glam::DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let panel = NewObject {
        name: "panel".to_owned(),
        form: Form::Rectangle { size: [0.2, 0.1] },
        emission: [30.0, 40.0, 50.0],
        matrix: (at(0.4, 0.5, 0.2) * down).to_cols_array(),
        ..object.clone()
    };
    let options = SessionOptions { element_size: Some(0.06), ..small() };
    let mut session = Session::new(cornell_box(), &options).unwrap();
    finish(&mut session);
    let before = bits(&session);
    let first = session.model().objects.len() as u32;

    let mut inverse = Vec::new();
    let mut apply = |session: &mut Session, edit: Edit| {
        let applied = session.apply(&edit).unwrap();
        session.step(Duration::from_millis(1));
        inverse.push(applied.inverse.clone());
        applied
    };
    let added = apply(&mut session, Edit::Add { object: Box::new(object.clone()) });
    assert_eq!((&added.added[..], &added.added_lights[..]), (&[ObjectId(first)][..], &[][..]));
    let added = apply(&mut session, Edit::Add { object: Box::new(panel.clone()) });
    assert_eq!((&added.added[..], &added.added_lights[..]), (&[ObjectId(first + 1)][..], &[LightId(1)][..]));
    let model = session.model();
    let light = &model.lights[1];
    for (flux, exitance) in light.flux.unwrap().into_iter().zip(panel.emission) {
        assert!((flux - 0.02 * exitance).abs() < 1e-5 * exitance, "{flux} lm");
    }
    assert!(model.objects[first as usize].movable && model.objects[first as usize].form == Some(object.form));
    finish(&mut session);
    let lit = bits(&session);
    assert_ne!(lit[..before.len()], before[..]);
    // In one series: an object of it may be moved and copied in it.
    let copies = Edit::Several(vec![
        Edit::Add { object: Box::new(object.clone()) },
        Edit::Move { object: ObjectId(first + 2), matrix: at(0.3, 0.3, 0.4).to_cols_array() },
        Edit::Copy { object: ObjectId(first + 2), matrix: at(0.3, 0.1, 0.5).to_cols_array() },
        Edit::Copy { object: ObjectId(first + 1), matrix: (at(0.1, 0.3, 0.4) * down).to_cols_array() },
        Edit::Light { light: LightId(2), dimming: 0.5, colour: [1.0; 3] },
        Edit::Delete { object: ObjectId(first) },
    ]);
    apply(&mut session, copies);
    finish(&mut session);

    // The edited scene, and the same edits before the first ray.
    let (edited, now) = (session.edited_scene(), bits(&session));
    let mut opened = Session::new(edited.clone(), &options).unwrap();
    finish(&mut opened);
    let of = |session: &Session, name: &str| -> Vec<Vec<Bands>> {
        let model = session.model();
        let named = model.objects.iter().filter(|object| object.name == name && !object.deleted);
        named.map(|object| session.irradiance(object.id)).collect()
    };
    let sum = |lights: &[Vec<Bands>]| lights.iter().flatten().map(|e| f64::from(luminance(*e))).sum::<f64>();
    for name in ["crate", "panel", "floor", "ceiling"] {
        let (a, b) = (of(&session, name), of(&opened, name));
        assert_eq!(a.iter().map(Vec::len).collect::<Vec<_>>(), b.iter().map(Vec::len).collect::<Vec<_>>());
        assert!((sum(&a) / sum(&b) - 1.0).abs() < 0.03, "{name}: {} instead of {}", sum(&a), sum(&b));
    }
    // Nothing was taken away: every number is the same.
    let mut whole = Session::new(cornell_box(), &options).unwrap();
    for object in [&object, &panel] {
        whole.apply(&Edit::Add { object: Box::new(object.clone()) }).unwrap();
    }
    let mut opened = Session::new(whole.edited_scene(), &options).unwrap();
    finish(&mut opened);
    assert!(bits(&opened) == lit);

    for edit in inverse.iter().rev() {
        session.apply(edit).unwrap();
    }
    finish(&mut session);
    assert!(bits(&session)[..before.len()] == before[..]);
    assert_ne!(now[..before.len()], before[..]);
}

/// A lamp gets another form twice, each time by the id that it had at first: it is the same lamp with as many lumens, and that is taken
/// back to the last bit. Within a series its copies are counted with their lights.
#[test]
fn catalogue_77_what_gets_another_form_stays_what_it_is() {
    let down = glam::DMat4::from_translation(glam::DVec3::new(0.3, 0.45, 0.25))
        * glam::DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let panel = NewObject {
        name: "panel".to_owned(),
        form: Form::Rectangle { size: [0.2, 0.1] },
        reflectance: [0.5; 3],
        emission: [30.0, 40.0, 50.0],
        matrix: down.to_cols_array(),
    };
    let mut session = Session::new(cornell_box(), &small()).unwrap();
    let added = session.apply(&Edit::Add { object: Box::new(panel.clone()) }).unwrap();
    let (id, lamp) = (added.added[0], added.added_lights[0]);
    session.apply(&Edit::Light { light: lamp, dimming: 0.5, colour: [1.0, 0.5, 1.0] }).unwrap();
    session.apply(&Edit::Reflectance { object: id, reflectance: [0.1, 0.2, 0.3] }).unwrap();
    finish(&mut session);
    let before = bits(&session);
    let lumens = |session: &Session| session.model().lights[lamp.0 as usize].flux.unwrap();
    let flux = lumens(&session);
    let reshape = |size: [f64; 2]| Edit::Reshape { object: id, form: Form::Rectangle { size }, matrix: panel.matrix };
    let inverse = [[0.3, 0.05], [0.15, 0.15]].map(|size| session.apply(&reshape(size)).unwrap().inverse);
    let model = session.model();
    let now = ObjectId(id.0 + 2);
    let own = &model.lights[lamp.0 as usize];
    assert_eq!((own.object, own.dimming, own.colour, own.deleted), (Some(now), 0.5, [1.0, 0.5, 1.0], false));
    let [old, middle, new] = [0, 1, 2].map(|k| &model.objects[(id.0 + k) as usize]);
    assert_eq!([old.deleted, middle.deleted, new.deleted], [true, true, false]);
    assert_eq!([old.successor, middle.successor, new.successor], [Some(ObjectId(id.0 + 1)), Some(now), None]);
    assert_eq!((new.reflectance, new.group, new.light), ([0.1, 0.2, 0.3], old.group, Some(lamp)));
    for (a, b) in lumens(&session).into_iter().zip(flux) {
        assert!((a / b - 1.0).abs() < 1e-5, "{a} lm instead of {b}");
    }
    // By its first id it is painted and moved.
    session.apply(&Edit::Reflectance { object: id, reflectance: [0.3; 3] }).unwrap();
    assert_eq!(session.model().objects[now.0 as usize].reflectance, [0.3; 3]);
    let back = session.apply(&Edit::Delete { object: id }).unwrap().inverse;
    assert_eq!(back, Edit::Restore { object: now });
    assert_eq!(session.apply(&reshape([0.1; 2])), Err(EditError::Deleted(id)));
    session.apply(&back).unwrap();
    session.apply(&Edit::Reflectance { object: id, reflectance: [0.1, 0.2, 0.3] }).unwrap();

    let [first, second] = &inverse;
    assert!(matches!(session.apply(first), Err(EditError::NotExchanged { .. })), "in their order only");
    let again = [second, first].map(|edit| session.apply(edit).unwrap().inverse);
    finish(&mut session);
    assert!(bits(&session)[..before.len()] == before[..]);
    let [second, first] = &again;
    [first, second].into_iter().for_each(|edit| drop(session.apply(edit).unwrap()));
    assert_eq!(session.model().lights[lamp.0 as usize].object, Some(now));
    let lights = session.model().lights.len() as u32;
    let dot = NewLight {
        name: String::new(),
        kind: PointLightKind::Point,
        position: [0.3, 0.3, 0.3],
        direction: [0.0; 3],
        intensity: [1.0; 3],
    };
    let change = |light| Edit::ChangeLight { light, kind: PointLightKind::Point, intensity: [1.0; 3] };
    let series = |last| {
        let copy = Edit::Copy { object: id, matrix: panel.matrix };
        Edit::Several(vec![reshape([0.1; 2]), copy, Edit::AddLight { light: dot.clone() }, change(LightId(last))])
    };
    assert_eq!(session.apply(&series(lights)), Err(EditError::NotPlaceable(LightId(lights))), "that is the copy");
    let done = session.apply(&series(lights + 1)).unwrap();
    assert_eq!(done.added_lights, [LightId(lights), LightId(lights + 1)]);
    session.apply(&done.inverse).unwrap();
    let of_file = Edit::Reshape { object: ObjectId(0), form: panel.form, matrix: panel.matrix };
    assert!(matches!(session.apply(&of_file), Err(EditError::Form { .. })));
    assert!(matches!(session.apply(&reshape([0.0, 1.0])), Err(EditError::Form { .. })));
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

/// An edit before there are rays enough for a quick picture: a layer waits or can be read, and a step is complete only
/// when the light is that of the edit.
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
            let is_told = session.has_layer(layer);
            assert_eq!(session.light(ObjectId(0), layer).len(), if is_told { before.len() } else { 0 });
            assert!(is_told || !step.is_complete);
        }
        if step.is_complete {
            break;
        }
    }
    let of = |light: &[Bands]| light.iter().map(|e| luminance(*e)).sum::<f32>();
    let after = of(&session.light(ObjectId(0), Layer::Total)) / of(&before);
    assert!((after - 0.5).abs() < 0.15, "{after}");
}

/// Shares of what is done grow to one, and are less where something is added.
#[test]
fn how_much_is_done_is_told() {
    let mut session = Session::new(cornell_box(), &SessionOptions { places: 4000, ..small() }).unwrap();
    let mut last = session.status();
    assert_eq!((last.share, last.sharpened), (0.0, 0.0));
    let mut shares = 0;
    while !session.step(Duration::from_millis(1)).is_done {
        let status = session.status();
        assert!(last.share <= status.share && status.share <= 1.0, "{status:?}");
        assert!((0.0..=1.0).contains(&status.sharpened) && (status.sharpened == 0.0 || status.is_solved), "{status:?}");
        shares += usize::from(last.share < status.share);
        last = status;
    }
    let status = session.status();
    assert!(shares > 3 && (status.share, status.sharpened) == (1.0, 1.0), "{shares} {status:?}");
    let object = session.model().objects.iter().find(|object| object.name == "short block").unwrap().id;
    session
        .apply(&Edit::Copy { object, matrix: glam::DMat4::from_translation(glam::DVec3::X).to_cols_array() })
        .unwrap();
    let status = session.status();
    assert!(status.share < 1.0 && status.sharpened == 0.0, "{status:?}");
    finish(&mut session);
    assert_eq!(session.status().share, 1.0);
}

/// Lights are dimmed and coloured by columns of light, walls are painted by rows: both are there.
#[test]
fn dimming_colouring_and_painting_trace_no_rays() {
    for scene in [cornell_box(), furnished(), full()] {
        let mut session = Session::new(scene, &small()).unwrap();
        finish(&mut session);
        let (rays, mut before) = (session.status().rays_traced, bits(&session));
        let wall =
            session.model().objects.iter().find(|object| object.reflectance.iter().all(|rho| *rho > 0.1)).unwrap().id;
        // With very many the last one shares its column.
        let (light, last) = (session.model().lights[0].id, session.model().lights.last().unwrap().id);
        for edit in [
            Edit::Light { light, dimming: 0.3, colour: [1.0; 3] },
            Edit::Light { light, dimming: 0.3, colour: [1.0, 0.5, 0.2] },
            Edit::Reflectance { object: wall, reflectance: [0.05, 0.4, 0.1] },
            Edit::Light { light: last, dimming: 0.0, colour: [1.0; 3] },
            Edit::Light { light: last, dimming: 1.0, colour: [1.0; 3] },
        ] {
            session.apply(&edit).unwrap();
            finish(&mut session);
            let after = bits(&session);
            assert!(after != before, "{edit:?}");
            assert_eq!(session.status().rays_traced, rays, "{edit:?}");
            before = after;
        }
    }
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

/// Lights without area come and go, some of them among those that share a column: what is undone leaves no trace. One that
/// was taken away still changed how long the others were solved, and kept its share of the rays of a shared column.
#[test]
fn lights_that_come_and_go_leave_no_trace() {
    let options = SessionOptions { elements: 900, rays: 32, ..SessionOptions::default() };
    for (scene, seeds, reach) in [(cornell_box(), 0..16, 0.5), (furnished(), 16..20, 2.0), (full(), 20..28, 0.5)] {
        let mut session = Session::new(scene, &options).unwrap();
        finish(&mut session);
        let before = bits(&session);
        for seed in seeds {
            let mut dice = Dice(Random::new(seed));
            let mut inverse = Vec::new();
            for _ in 0..1 + dice.below(4) {
                let lights = session.model().lights.len();
                let light = LightId(dice.below(lights) as u32);
                let edit = match dice.below(4) {
                    0 if seed % 2 == 0 => Edit::DeleteLight { light },
                    1 if seed % 2 == 0 => Edit::Light { light, dimming: 0.3, colour: [1.0, 0.5, 0.2] },
                    _ => Edit::AddLight { light: NewLight { intensity: [1e3, 1.0, 30.0], ..dice.light(reach) } },
                };
                if let Ok(applied) = session.apply(&edit) {
                    inverse.push(applied.inverse);
                }
                if dice.below(2) == 0 {
                    finish(&mut session);
                }
            }
            for back in inverse.into_iter().rev() {
                session.apply(&back).unwrap();
            }
            finish(&mut session);
            assert!(bits(&session) == before, "seed {seed}");
        }
    }
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

/// A triangle has a few thousand elements at most: of a house on 3 km of ground, all that the ground cannot have are in the house, which had one to a triangle.
#[test]
fn a_wide_ground_leaves_elements_to_what_stands_on_it() {
    let mut scene = cornell_box();
    let room = scene.triangles.len();
    let count = |scene: &Scene| {
        let options = SessionOptions { elements: 20_000, rays: 4, ..SessionOptions::default() };
        Session::new(scene.clone(), &options).unwrap().status().elements
    };
    let corner = |x: f64, z: f64| glam::DVec3::new(1500.0 * x, -1.0, 1500.0 * z);
    scene.add_quad("ground", 0, [corner(-1., -1.), corner(-1., 1.), corner(1., 1.), corner(1., -1.)]);
    let both = count(&scene);
    // Two triangles of 64 × 64.
    assert!(both <= 20_000 && both > 8192 + 50 * room, "{both}");
}
