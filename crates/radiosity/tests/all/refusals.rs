//! Edits that cannot be are refused by name, with nothing changed.

use crate::small::small;
use radiosity::cornell_box;
use radiosity::session::{Edit, EditError, Form, LightId, MOST_EDITS, NewObject, ObjectId, Session, SessionOptions};

/// What no object can be is refused, with nothing changed.
#[test]
fn what_cannot_be_added_is_refused() {
    let mut session = Session::new(cornell_box(), &small()).unwrap();
    let sound = NewObject {
        name: String::new(),
        form: Form::Box { size: [0.1; 3] },
        reflectance: [0.5; 3],
        emission: [0.0; 3],
        matrix: glam::DMat4::IDENTITY.to_cols_array(),
    };
    let far = glam::DMat4::from_translation(glam::DVec3::X * 1e3).to_cols_array();
    for (wrong, why) in [
        (NewObject { form: Form::Box { size: [0.1, 0.0, 0.1] }, ..sound.clone() }, "a length"),
        (NewObject { form: Form::Rectangle { size: [0.1, f64::NAN] }, ..sound.clone() }, "a length"),
        (NewObject { form: Form::Rectangle { size: [0.1, f64::INFINITY] }, ..sound.clone() }, "a length"),
        (NewObject { form: Form::Rectangle { size: [0.1, 1e3] }, ..sound.clone() }, "a length"),
        (NewObject { form: Form::Rectangle { size: [0.1, 2.2] }, ..sound.clone() }, "from the middle"),
        (NewObject { matrix: far, ..sound.clone() }, "from the middle"),
        (NewObject { matrix: [0.0; 16], ..sound.clone() }, "no placement"),
        (NewObject { reflectance: [0.5, 1.0, 0.5], ..sound.clone() }, "reflectance"),
        (NewObject { emission: [0.5, -1.0, 0.5], ..sound.clone() }, "emission"),
        (NewObject { emission: [f32::NAN; 3], ..sound.clone() }, "emission"),
        (NewObject { emission: [1e-45, 0.0, 0.0], ..sound.clone() }, "emission"),
        (
            NewObject { matrix: glam::DMat4::from_scale(glam::DVec3::splat(1.01)).to_cols_array(), ..sound.clone() },
            "lengths",
        ),
        (NewObject { name: "x".repeat(201), ..sound.clone() }, "name"),
    ] {
        let error = session.apply(&Edit::Add { object: Box::new(wrong.clone()) }).unwrap_err().to_string();
        assert!(error.contains(why), "{error}: {wrong:?}");
    }
    let many = Edit::Several(vec![Edit::Add { object: Box::new(sound) }, Edit::Delete { object: ObjectId(99) }]);
    let objects = session.model().objects.len();
    assert_eq!(session.apply(&many), Err(EditError::UnknownObject(ObjectId(99))));
    assert_eq!((session.model().objects.len(), session.scene().objects.len()), (objects, objects));
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
    let one = dimmed(0.5);
    assert_eq!(session.apply(&Edit::Several(Vec::new())), Err(EditError::NoEdits));
    let nested = Edit::Several(vec![one.clone(), Edit::Several(Vec::new())]);
    assert_eq!(session.apply(&nested), Err(EditError::NoEdits));
    let many = Edit::Several(vec![Edit::Several(vec![one; MOST_EDITS / 2]); 3]);
    assert_eq!(session.apply(&many), Err(EditError::TooManyEdits(MOST_EDITS / 2 * 3)));
    assert_eq!(session.edited_scene(), before);

    let options = SessionOptions { memory: 1 << 20, ..small() };
    assert!(matches!(Session::new(cornell_box(), &options), Err(radiosity::Error::Memory { .. })));
}
