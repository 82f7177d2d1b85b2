//! Lamps without area come and go, are turned, and become others: their light is, to the last bit, that of a session in which they were
//! always so.

use crate::bits::bits;
use crate::finish::finish;
use crate::full::full;
use crate::small::small;
use radiosity::session::{Edit, EditError, LightId, LightKind, NewLight, Session, SessionOptions};
use radiosity::{Bands, PointLight, PointLightKind, Scene, cornell_box};
use std::time::Duration;

/// The scene of a lamp of a kind, straight from a file: what [`Edit::ChangeLight`] is to lead to.
fn with_lamps(kinds: &[(PointLightKind, Bands)]) -> Scene {
    let mut scene = cornell_box();
    scene.lights.extend(kinds.iter().enumerate().map(|(k, (kind, intensity))| PointLight {
        name: format!("lamp {k}"),
        kind: *kind,
        position: glam::DVec3::new(0.15 + 0.1 * k as f64, 0.4, 0.2),
        direction: glam::DVec3::new(0.3, -1.0, -0.2).normalize(),
        intensity: *intensity,
        range: None,
    }));
    scene
}

/// Lamps of each kind become each other kind, brighter or darker: their light is, to the last bit, that of a session which
/// opens the edited scene, and it is taken back to the last bit.
#[test]
fn catalogue_77_a_changed_lamp_is_one_that_was_always_so() {
    let spot = PointLightKind::Spot { inner: 0.2, outer: 0.6 };
    let narrow = PointLightKind::Spot { inner: 0.0, outer: 0.25 };
    let from = [
        (PointLightKind::Point, [5.0, 4.0, 3.0]),
        (spot, [9.0; 3]),
        (PointLightKind::Directional, [40.0, 40.0, 60.0]),
        (spot, [2.0, 3.0, 4.0]),
    ];
    let to = [
        (spot, [9.0, 0.0, 3.0]),
        (PointLightKind::Directional, [70.0, 60.0, 50.0]),
        (PointLightKind::Point, [3.0; 3]),
        (narrow, [6.0, 3.0, 4.0]),
    ];
    let mut session = Session::new(with_lamps(&from), &small()).unwrap();
    finish(&mut session);
    let before = bits(&session);
    // The Cornell box's own lamp is light 0.
    let change = |k: usize, (kind, intensity): (PointLightKind, Bands)| Edit::ChangeLight {
        light: LightId(k as u32 + 1),
        kind,
        intensity,
    };
    let edits: Vec<Edit> = to.iter().enumerate().map(|(k, to)| change(k, *to)).collect();
    let mut inverse = Vec::new();
    for edit in &edits {
        let applied = session.apply(edit).unwrap();
        assert!(applied.added_lights.is_empty() && applied.objects.is_empty());
        inverse.push(applied.inverse);
        session.step(Duration::from_millis(1));
    }
    assert_eq!(inverse, from.iter().enumerate().map(|(k, from)| change(k, *from)).collect::<Vec<_>>());
    let lights = session.model().lights;
    assert_eq!(
        lights.iter().map(|light| light.kind).collect::<Vec<_>>(),
        [LightKind::Object, LightKind::Spot, LightKind::Directional, LightKind::Point, LightKind::Spot]
    );
    assert_eq!((lights[4].cone, lights[4].intensity), (Some([0.0, 0.25]), Some([6.0, 3.0, 4.0])));
    assert_eq!((lights[0].cone, lights[0].intensity), (None, None));
    finish(&mut session);
    let changed = bits(&session);
    assert_eq!(session.edited_scene().lights, with_lamps(&to).lights);
    for scene in [with_lamps(&to), session.edited_scene()] {
        let mut fresh = Session::new(scene, &small()).unwrap();
        finish(&mut fresh);
        let fresh = bits(&fresh);
        let differ = changed.iter().zip(&fresh).filter(|(a, b)| a != b).count();
        assert!(changed == fresh, "{differ} of {} numbers differ", fresh.len());
    }
    assert!(changed != before);
    for edit in inverse.iter().rev() {
        session.apply(edit).unwrap();
    }
    finish(&mut session);
    assert!(bits(&session) == before);

    // What no light can be is refused, and what has an area.
    let lamp = |kind, intensity| Edit::ChangeLight { light: LightId(1), kind, intensity };
    for wrong in [
        lamp(PointLightKind::Point, [-1.0, 0.0, 0.0]),
        lamp(PointLightKind::Point, [f32::NAN; 3]),
        lamp(PointLightKind::Point, [1e13; 3]),
        lamp(PointLightKind::Spot { inner: 0.7, outer: 0.6 }, [1.0; 3]),
        lamp(PointLightKind::Spot { inner: 0.0, outer: 2.0 }, [1.0; 3]),
        lamp(PointLightKind::Spot { inner: f64::NAN, outer: 0.5 }, [1.0; 3]),
    ] {
        assert!(matches!(session.apply(&wrong), Err(EditError::ChangeLight { light: LightId(1), .. })), "{wrong:?}");
    }
    // Parallel light may be anywhere; a point may not, be it made one there, moved or copied there. What a file has far away stays.
    let far = glam::DMat4::from_translation(glam::DVec3::new(1e6, 0.0, 0.0)).to_cols_array();
    let [sun, point] = [LightId(3), LightId(1)];
    let too_far = |light| EditError::ChangeLight { light, why: "it would be too far from the middle of the scene" };
    let into = |light, kind| Edit::ChangeLight { light, kind, intensity: [1.0; 3] };
    let moved = |light| Edit::MoveLight { light, matrix: far };
    assert_eq!(session.apply(&moved(point)), Err(too_far(point)));
    let copied = Edit::CopyLight { light: point, matrix: far };
    assert!(matches!(session.apply(&copied), Err(EditError::NewLight(_))));
    let both = Edit::Several(vec![moved(sun), into(sun, spot)]);
    assert_eq!(session.apply(&both), Err(too_far(sun)), "by where it is by then");
    let there = session.apply(&moved(sun)).unwrap();
    assert_eq!(session.apply(&into(sun, PointLightKind::Point)), Err(too_far(sun)));
    session.apply(&there.inverse).unwrap();
    session.apply(&into(sun, PointLightKind::Point)).unwrap();
    let mut distant = with_lamps(&from);
    distant.lights[0].position.x = 100.0;
    let mut session_of_distant = Session::new(distant, &small()).unwrap();
    let parallel = session_of_distant.apply(&into(point, PointLightKind::Directional)).unwrap();
    session_of_distant.apply(&parallel.inverse).unwrap();

    let of = |light| Edit::ChangeLight { light, kind: PointLightKind::Point, intensity: [1.0; 3] };
    assert_eq!(session.apply(&of(LightId(0))), Err(EditError::NotPlaceable(LightId(0))), "an object that shines");
    assert_eq!(session.apply(&of(LightId(9))), Err(EditError::UnknownLight(LightId(9))));
    session.apply(&Edit::DeleteLight { light: LightId(1) }).unwrap();
    assert_eq!(session.apply(&of(LightId(1))), Err(EditError::DeletedLight(LightId(1))));
}

/// Of two lamps that share a column the bright one is taken away: all shadow rays go to the other, whose light is as even
/// as if it had always been alone.
#[test]
fn a_lamp_that_is_gone_takes_no_rays_of_a_shared_column() {
    let options = SessionOptions { elements: 900, rays: 32, ..SessionOptions::default() };
    let mut scene = full();
    let mut bright = scene.lights[32].clone();
    (bright.name, bright.intensity) = ("bright".to_owned(), [1e4; 3]);
    let mut alone = Session::new(scene.clone(), &options).unwrap();
    scene.lights.push(bright);
    let mut session = Session::new(scene, &options).unwrap();
    let light = session.model().lights.iter().find(|light| light.name == "bright").unwrap().id;
    finish(&mut session);
    let both = bits(&session);
    let applied = session.apply(&Edit::DeleteLight { light }).unwrap();
    assert!(applied.traces);
    finish(&mut session);
    finish(&mut alone);
    assert!(bits(&session) == bits(&alone));
    session.apply(&applied.inverse).unwrap();
    finish(&mut session);
    assert!(bits(&session) == both);
}

/// A point of a file becomes a spot that shines down, unless its node is turned; so does parallel light. A spot shines as it is turned.
#[test]
fn a_point_made_a_spot_shines_down() {
    let spot = PointLightKind::Spot { inner: 0.2, outer: 0.6 };
    let mut scene =
        with_lamps(&[(PointLightKind::Point, [5.0; 3]), (PointLightKind::Point, [5.0; 3]), (spot, [5.0; 3])]);
    scene.lights[0].direction = glam::DVec3::NEG_Z;
    scene.lights[2].direction = glam::DVec3::NEG_Z;
    let turned = scene.lights[1].direction;
    let mut session = Session::new(scene, &small()).unwrap();
    for kind in [spot, PointLightKind::Directional] {
        for (light, direction) in [(1, glam::DVec3::NEG_Y), (2, turned), (3, glam::DVec3::NEG_Z)] {
            let light = LightId(light);
            session.apply(&Edit::ChangeLight { light, kind, intensity: [5.0; 3] }).unwrap();
            let own = session.model().lights[light.0 as usize].direction.unwrap();
            assert_eq!(own, direction.to_array(), "{light:?} as {kind:?}");
        }
    }
}

/// A spot that a file has far away, far beyond where things may be put, is turned where it stands by any angle about any axis;
/// rounding does not make it too far. Farther it goes not.
#[test]
fn a_far_spot_is_turned_where_it_stands() {
    let spot = PointLightKind::Spot { inner: 0.2, outer: 0.6 };
    let mut scene = with_lamps(&[(spot, [1e4; 3])]);
    let at = glam::DVec3::new(-731.3, 947.1, 222.2);
    scene.lights[0].position = at;
    let mut session = Session::new(scene, &small()).unwrap();
    let light = LightId(1);
    for k in 0..60 {
        let axis = glam::DVec3::new(f64::from(k % 3) - 0.7, 1.0, f64::from(k % 5) - 1.9).normalize();
        let turn = glam::DMat4::from_axis_angle(axis, 0.1 * f64::from(k));
        let about = glam::DMat4::from_translation(at) * turn * glam::DMat4::from_translation(-at);
        let edit = Edit::MoveLight { light, matrix: about.to_cols_array() };
        assert!(session.apply(&edit).is_ok(), "{k}");
    }
    let farther = glam::DMat4::from_translation(glam::DVec3::new(0.0, 0.01, 0.0)).to_cols_array();
    assert!(session.apply(&Edit::MoveLight { light, matrix: farther }).is_err());
}

/// Lights without area come and go like objects; one that is gone gives nothing and traces nothing.
#[test]
fn lights_without_area_come_and_go() {
    let mut session = Session::new(cornell_box(), &small()).unwrap();
    finish(&mut session);
    let before = bits(&session);
    let light = |session: &Session, id: LightId| session.model().lights[id.0 as usize].clone();
    let spot = NewLight {
        name: "spot".to_owned(),
        kind: PointLightKind::Spot { inner: 0.3, outer: 0.6 },
        position: [0.25, 0.4, 0.25],
        direction: [0.0, -3.0, 0.0],
        intensity: [5.0; 3],
    };
    let added = session.apply(&Edit::AddLight { light: spot.clone() }).unwrap();
    let id = added.added_lights[0];
    assert_eq!(added.inverse, Edit::DeleteLight { light: id });
    assert_eq!((light(&session, id).kind, light(&session, id).direction), (LightKind::Spot, Some([0.0, -1.0, 0.0])));
    finish(&mut session);
    let lit = bits(&session);
    assert!(lit != before);
    assert_eq!(session.edited_scene().lights.len(), 1);

    let rays = session.status().rays_traced;
    let deleted = session.apply(&added.inverse).unwrap();
    finish(&mut session);
    assert!(light(&session, id).deleted && session.edited_scene().lights.is_empty());
    assert!(bits(&session) == before && session.status().rays_traced == rays);
    assert_eq!(session.apply(&added.inverse), Err(EditError::DeletedLight(id)));
    session.apply(&deleted.inverse).unwrap();
    finish(&mut session);
    assert!(bits(&session) == lit && session.status().rays_traced == rays);
    assert_eq!(session.apply(&deleted.inverse), Err(EditError::LightNotDeleted(id)));

    let place = glam::DMat4::from_translation(glam::DVec3::new(0.1, 0.0, 0.0)).to_cols_array();
    let copy = session.apply(&Edit::CopyLight { light: id, matrix: place }).unwrap();
    let at = light(&session, copy.added_lights[0]).position.unwrap();
    assert!((at[0] - 0.35).abs() < 1e-12 && at[1] == 0.4);
    session.apply(&copy.inverse).unwrap();
    finish(&mut session);
    assert!(bits(&session) == lit);

    let mut refused = |change: &dyn Fn(&mut NewLight)| {
        let mut light = spot.clone();
        change(&mut light);
        assert!(matches!(session.apply(&Edit::AddLight { light }), Err(EditError::NewLight(_))));
    };
    refused(&|light| light.position[1] = f64::NAN);
    refused(&|light| light.position[1] = 1e6);
    refused(&|light| light.direction[0] = f64::INFINITY);
    refused(&|light| light.intensity[2] = -1.0);
    refused(&|light| light.intensity[2] = 1e13);
    refused(&|light| light.kind = PointLightKind::Spot { inner: 0.7, outer: 0.6 });
    refused(&|light| light.kind = PointLightKind::Spot { inner: 0.0, outer: 2.0 });
    refused(&|light| light.name = "x".repeat(201));
    for edit in [
        Edit::DeleteLight { light: LightId(0) },
        Edit::RestoreLight { light: LightId(0) },
        Edit::CopyLight { light: LightId(0), matrix: place },
    ] {
        assert_eq!(session.apply(&edit), Err(EditError::NotPlaceable(LightId(0))), "an object that shines");
    }
}
