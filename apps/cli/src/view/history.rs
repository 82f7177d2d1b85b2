//! What can be undone, by whichever page it was done.

use radiosity::session::{Edit, EditError, LightId, Model, ObjectId};

/// Most changes that are remembered.
const LONGEST: usize = 1000;

/// A gesture of a page: edits of one are undone together.
pub type Gesture = (u64, u64);

/// A change that was made.
struct Change {
    /// What people call it.
    label: String,
    /// The edit that takes it back, or does it again.
    edit: Edit,
    gesture: Option<Gesture>,
}

/// Changes that can be undone, and those that can be done again.
#[derive(Default)]
pub struct History {
    done: Vec<Change>,
    undone: Vec<Change>,
}

impl History {
    /// A change was made; `inverse` takes it back.
    pub fn did(&mut self, label: String, inverse: Edit, gesture: Option<Gesture>) {
        self.undone.clear();
        // The first inverse leads back to before the gesture. Gestures of other pages may go on beside it.
        let mut going_on = self.done.iter().rev().take_while(|change| change.gesture.is_some());
        let is_known = |of: &Change| of.gesture == gesture && targets(&of.edit) == targets(&inverse);
        if gesture.is_some() && is_absolute(&inverse) && going_on.any(is_known) {
            return;
        }
        if self.done.len() == LONGEST {
            self.done.remove(0);
        }
        self.done.push(Change { label, edit: inverse, gesture });
    }

    /// The edit that takes the last change back.
    pub fn next_undo(&self) -> Option<&Edit> {
        self.done.last().map(|change| &change.edit)
    }

    /// The edit that makes the last undone change again.
    pub fn next_redo(&self) -> Option<&Edit> {
        self.undone.last().map(|change| &change.edit)
    }

    /// The last change was taken back; `inverse` makes it again.
    pub fn undid(&mut self, inverse: Edit) {
        if let Some(change) = self.done.pop() {
            self.undone.push(Change { edit: inverse, gesture: None, ..change });
        }
    }

    /// The last undone change was made again.
    pub fn redid(&mut self, inverse: Edit) {
        if let Some(change) = self.undone.pop() {
            self.done.push(Change { edit: inverse, gesture: None, ..change });
        }
    }

    /// What would be undone and done again.
    pub fn labels(&self) -> [Option<&str>; 2] {
        [&self.done, &self.undone].map(|changes| changes.last().map(|change| change.label.as_str()))
    }
}

/// What an edit acts on.
#[derive(Debug, PartialEq, Eq)]
pub enum Target {
    Paint(ObjectId),
    Place(ObjectId),
    Shape(ObjectId),
    Presence(ObjectId),
    Light(LightId),
    LightPlace(LightId),
    LightShape(LightId),
    LightPresence(LightId),
    NewObject,
    NewLight,
}

/// Whether an edit says how things shall be, whatever they are: then a later one of the same targets outdates it.
pub fn is_absolute(edit: &Edit) -> bool {
    match edit {
        Edit::Light { .. }
        | Edit::MoveLight { .. }
        | Edit::ChangeLight { .. }
        | Edit::Reflectance { .. }
        | Edit::Move { .. }
        | Edit::Reshape { .. } => true,
        Edit::Several(edits) => edits.iter().all(is_absolute),
        Edit::Add { .. }
        | Edit::AddLight { .. }
        | Edit::Copy { .. }
        | Edit::CopyLight { .. }
        | Edit::Delete { .. }
        | Edit::DeleteLight { .. }
        | Edit::Restore { .. }
        | Edit::RestoreLight { .. }
        | Edit::Exchange { .. } => false,
    }
}

/// Everything that an edit acts on, in order.
pub fn targets(edit: &Edit) -> Vec<Target> {
    match edit {
        Edit::Light { light, .. } => vec![Target::Light(*light)],
        Edit::MoveLight { light, .. } => vec![Target::LightPlace(*light)],
        Edit::ChangeLight { light, .. } => vec![Target::LightShape(*light)],
        Edit::Add { .. } => vec![Target::NewObject],
        Edit::AddLight { .. } => vec![Target::NewLight],
        Edit::CopyLight { light, .. } | Edit::DeleteLight { light } | Edit::RestoreLight { light } => {
            vec![Target::LightPresence(*light)]
        }
        Edit::Reflectance { object, .. } => vec![Target::Paint(*object)],
        Edit::Move { object, .. } => vec![Target::Place(*object)],
        Edit::Reshape { object, .. } | Edit::Exchange { gone: object, .. } => vec![Target::Shape(*object)],
        Edit::Copy { object, .. } | Edit::Delete { object } | Edit::Restore { object } => {
            vec![Target::Presence(*object)]
        }
        Edit::Several(edits) => edits.iter().flat_map(targets).collect(),
    }
}

/// What people call an edit of the model as it is before.
pub fn label(edit: &Edit, model: &Model) -> String {
    let object = |id: &ObjectId| object_name(*id, model);
    let light = |id: &LightId| light_name(*id, model);
    match edit {
        Edit::Light { light: id, colour, .. } => {
            let known = model.lights.iter().find(|light| light.id == *id);
            let is_coloured = known.is_some_and(|known| known.colour != *colour);
            format!("{} {}", if is_coloured { "colour" } else { "dim" }, light(id))
        }
        Edit::MoveLight { light: id, .. } => format!("move {}", light(id)),
        Edit::ChangeLight { light: id, .. } => format!("change {}", light(id)),
        Edit::Add { object } if object.name.is_empty() => "add an object".to_owned(),
        Edit::Add { object } => format!("add {}", object.name),
        Edit::AddLight { light } if light.name.is_empty() => "add a light".to_owned(),
        Edit::AddLight { light } => format!("add {}", light.name),
        Edit::CopyLight { light: id, .. } => format!("duplicate {}", light(id)),
        Edit::DeleteLight { light: id } => format!("delete {}", light(id)),
        Edit::RestoreLight { light: id } => format!("restore {}", light(id)),
        Edit::Reflectance { object: id, .. } => format!("paint {}", object(id)),
        Edit::Move { object: id, .. } => format!("move {}", object(id)),
        Edit::Reshape { object: id, .. } | Edit::Exchange { gone: id, .. } => format!("resize {}", object(id)),
        Edit::Copy { object: id, .. } => format!("duplicate {}", object(id)),
        Edit::Delete { object: id } => format!("delete {}", object(id)),
        Edit::Restore { object: id } => format!("restore {}", object(id)),
        Edit::Several(edits) => edits.first().map_or_else(String::new, |first| label(first, model)),
    }
}

/// Why an edit was refused, with names as the page has them in place of ids.
pub fn refusal(error: &EditError, model: &Model) -> String {
    let text = error.to_string();
    let (id, name) = match error {
        EditError::Light { light, .. }
        | EditError::ChangeLight { light, .. }
        | EditError::NotPlaceable(light)
        | EditError::DeletedLight(light)
        | EditError::LightNotDeleted(light) => (format!("light {}", light.0), light_name(*light, model)),
        EditError::Reflectance { object, .. }
        | EditError::TooFar { object, .. }
        | EditError::Form { object, .. }
        | EditError::Deleted(object)
        | EditError::NotDeleted(object) => (format!("object {}", object.0), object_name(*object, model)),
        _ => return text,
    };
    text.replacen(&id, &name, 1)
}

/// Copies have the name of the first that is there, and numbers.
fn light_name(id: LightId, model: &Model) -> String {
    let named = model.lights.iter().find(|light| light.id == id).map_or("", |light| light.name.as_str());
    let before = model.lights.iter().filter(|light| light.id < id && light.name == named && !light.deleted).count();
    match (named, before) {
        ("", _) => format!("Light {}", id.0 + 1),
        (name, 0) => name.to_owned(),
        (name, _) => format!("{name} ({})", before + 1),
    }
}

fn object_name(id: ObjectId, model: &Model) -> String {
    let named = model.objects.iter().find(|object| object.id == id).map_or("", |object| object.name.as_str());
    if named.is_empty() { format!("Object {}", id.0 + 1) } else { named.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dim(light: u32, dimming: f32) -> Edit {
        Edit::Light { light: LightId(light), dimming, colour: [1.0; 3] }
    }

    #[test]
    fn a_gesture_is_undone_at_once() {
        let mut history = History::default();
        history.did("dim a".into(), dim(0, 1.0), Some((1, 7)));
        history.did("dim a".into(), dim(0, 0.9), Some((1, 7)));
        history.did("dim a".into(), dim(0, 0.8), Some((2, 7)));
        assert_eq!(history.next_undo(), Some(&dim(0, 0.8)), "another page's gesture is another");
        history.undid(dim(0, 0.5));
        assert_eq!(history.next_undo(), Some(&dim(0, 1.0)));
        assert_eq!(history.labels(), [Some("dim a"), Some("dim a")]);
        history.redid(dim(0, 0.8));
        history.did("dim b".into(), dim(1, 1.0), None);
        assert_eq!(history.next_redo(), None, "what was undone is gone after a new change");
    }

    #[test]
    fn gestures_of_two_pages_at_once_are_a_change_each() {
        let mut history = History::default();
        for step in 0..10 {
            for page in 0..2 {
                let was = 1.0 - 0.1 * step as f32;
                history.did("dim".into(), dim(page, was), Some((page.into(), 7)));
            }
        }
        history.undid(dim(1, 0.0));
        assert_eq!(history.next_undo(), Some(&dim(0, 1.0)));
        history.undid(dim(0, 0.0));
        assert_eq!(history.next_undo(), None);
        // A change that is none of a gesture ends them.
        history.did("dim".into(), dim(0, 1.0), Some((0, 8)));
        history.did("dim".into(), dim(1, 1.0), None);
        history.did("dim".into(), dim(0, 0.5), Some((0, 8)));
        assert_eq!(history.next_undo(), Some(&dim(0, 0.5)));
    }

    #[test]
    fn what_is_taken_away_and_brought_back_in_one_gesture_is_undone_step_by_step() {
        let mut history = History::default();
        let object = ObjectId(3);
        history.did("delete".into(), Edit::Restore { object }, Some((1, 1)));
        history.did("restore".into(), Edit::Delete { object }, Some((1, 1)));
        assert_eq!(history.next_undo(), Some(&Edit::Delete { object }));
        history.undid(Edit::Restore { object });
        assert_eq!(history.next_undo(), Some(&Edit::Restore { object }));
    }

    #[test]
    fn what_is_refused_is_named_as_the_page_names_it() {
        use radiosity::session::{ModelLight, Session, SessionOptions};
        let options = SessionOptions { elements: 200, rays: 4, ..SessionOptions::default() };
        let mut model = Session::new(radiosity::cornell_box(), &options).unwrap().model();
        let lamp = ModelLight { name: "Lamp 1".to_owned(), ..model.lights[0].clone() };
        model.lights = (0..3).map(|id| ModelLight { id: LightId(id), ..lamp.clone() }).collect();
        model.lights[0].name.clear();
        let told = |light| refusal(&EditError::ChangeLight { light: LightId(light), why: "too far" }, &model);
        assert_eq!(
            [0, 1, 2].map(told),
            ["Light 1", "Lamp 1", "Lamp 1 (2)"].map(|n| format!("{n} cannot be changed: too far"))
        );
        let object = refusal(&EditError::Deleted(ObjectId(0)), &model);
        assert_eq!(object, format!("{} has been deleted (restore it first)", model.objects[0].name));
    }

    #[test]
    fn one_gesture_on_two_things_is_two_changes() {
        let mut history = History::default();
        history.did("dim a".into(), dim(0, 1.0), Some((1, 7)));
        history.did("dim b".into(), dim(1, 1.0), Some((1, 7)));
        assert_eq!(history.next_undo(), Some(&dim(1, 1.0)));
        history.undid(dim(1, 0.0));
        assert_eq!(history.next_undo(), Some(&dim(0, 1.0)));
    }
}
