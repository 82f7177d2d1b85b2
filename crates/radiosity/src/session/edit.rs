//! What may be changed in a scene that is being watched, and why a change is refused.

use crate::session::{Form, LightId, NewObject, ObjectId};
use radiosity_scene::{Bands, PointLightKind};
use serde::{Deserialize, Serialize};

/// Most by which a light may be turned up.
pub const MOST_DIMMING: f32 = 100.0;

/// Most edits in one [`Edit::Several`], those within others counted.
pub const MOST_EDITS: usize = 4096;

/// Most lights of a session, those that were taken away counted: numbers are never given anew.
pub const MOST_LIGHTS: usize = 4096;

/// Most intensity of a light that is added or changed, cd or lx: what files may have, so that every change of a lamp of a file
/// can be taken back.
pub const MOST_INTENSITY: f32 = 1e12;

/// Largest half angle of a spot, radians: a right angle, with the rounding that files may have.
pub const MOST_CONE: f64 = std::f64::consts::FRAC_PI_2 + 1e-9;

/// A light without area that is to be added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NewLight {
    /// Name for people; may be empty.
    #[serde(default)]
    pub name: String,
    /// Its kind.
    pub kind: PointLightKind,
    /// Where it is, world coordinates, metres; of no account for parallel light.
    #[serde(default)]
    pub position: [f64; 3],
    /// Where it shines to, of any length; of no account for points. Zero is down.
    #[serde(default)]
    pub direction: [f64; 3],
    /// Candela per band, or lux per band of parallel light.
    pub intensity: Bands,
}

/// A change of the scene. Matrices are by columns and carry the object as the file places it, in world coordinates, to
/// where it shall be: the identity is its place in the file. What was added is carried from its own axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Edit {
    /// Turns a light up or down, or puts a coloured filter before it. Traces no ray.
    Light {
        /// The light.
        light: LightId,
        /// 0 is off, 1 is as in the file; up to [`MOST_DIMMING`].
        dimming: f32,
        /// By what its light is multiplied in each band, 0 to 1 where it is a filter; `[1, 1, 1]` is as in the file.
        colour: Bands,
    },
    /// Paints an object. Traces no ray. A picture on it keeps its pattern and gets this mean.
    Reflectance {
        /// The object.
        object: ObjectId,
        /// Diffuse reflectance per band, 0 to 0.99.
        reflectance: Bands,
    },
    /// Places an object anew; a lamp takes its light along.
    Move {
        /// The object.
        object: ObjectId,
        /// From its place in the file to the new one.
        matrix: [f64; 16],
    },
    /// Places a light without area anew.
    MoveLight {
        /// The light: point, spot or directional.
        light: LightId,
        /// From its place in the file to the new one.
        matrix: [f64; 16],
    },
    /// Adds a light without area, which gets the next free id ([`Applied::added_lights`]).
    AddLight {
        /// The light.
        light: NewLight,
    },
    /// Makes a light without area one of another kind, cone or intensity. It stays where it is, dimmed and coloured as it is.
    ChangeLight {
        /// The light: point, spot or directional.
        light: LightId,
        /// Its kind from now on.
        kind: PointLightKind,
        /// Candela per band, or lux per band of parallel light, before it is dimmed and coloured.
        intensity: Bands,
    },
    /// Adds a copy of a light without area, dimmed and coloured alike.
    CopyLight {
        /// The light that is copied.
        light: LightId,
        /// From the place in the file to that of the copy.
        matrix: [f64; 16],
    },
    /// Takes a light without area away. It keeps its id. Traces no ray, unless it shares its column with others.
    DeleteLight {
        /// The light.
        light: LightId,
    },
    /// Brings a light back that was taken away. Traces no ray, unless it shares its column with others.
    RestoreLight {
        /// The light.
        light: LightId,
    },
    /// Adds an object, which gets the next free id ([`Applied::added`]), and a light if it shines
    /// ([`Applied::added_lights`]). Its own axes are what matrices carry from.
    Add {
        /// The object.
        object: Box<NewObject>,
    },
    /// Gives an object that was added another form, and a lamp as many lumens as it had. It becomes another, which gets the
    /// next free id ([`Applied::added`]): edits of the old one are edits of it from now on, a move places the form that it has
    /// by then. The memory of the old form stays taken, for the way back.
    Reshape {
        /// The object.
        object: ObjectId,
        /// What it becomes.
        form: Form,
        /// From its own axes to the world: turned and moved, lengths as they are.
        matrix: [f64; 16],
    },
    /// Takes [`Edit::Reshape`] back, or makes it again.
    Exchange {
        /// The object that is there.
        gone: ObjectId,
        /// The one that became it, and takes its place.
        back: ObjectId,
    },
    /// Adds a copy of an object, which gets the next free id ([`Applied::added`]).
    Copy {
        /// The object that is copied, as it is now.
        object: ObjectId,
        /// From the place in the file to that of the copy.
        matrix: [f64; 16],
    },
    /// Takes an object away, with its light. It keeps its id.
    Delete {
        /// The object.
        object: ObjectId,
    },
    /// Brings an object back that was taken away.
    Restore {
        /// The object.
        object: ObjectId,
    },
    /// Several edits, one after the other; all or none of them. One at least and [`MOST_EDITS`] at most.
    Several(Vec<Edit>),
}

/// What an edit did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Applied {
    /// The edit that takes it back, to the last bit.
    pub inverse: Edit,
    /// Objects that were added.
    pub added: Vec<ObjectId>,
    /// Lights that were added.
    pub added_lights: Vec<LightId>,
    /// Objects whose place, paint or being there has changed.
    pub objects: Vec<ObjectId>,
    /// Whether rays have to be traced again.
    pub traces: bool,
}

/// A distance as people read it, however far.
fn far(metres: f64) -> String {
    if metres < 1e6 { format!("{metres:.1}") } else { format!("{metres:.1e}") }
}

/// Why an edit was refused. Nothing has changed then.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// There is no such object.
    #[error("there is no object {}", .0.0)]
    UnknownObject(ObjectId),
    /// There is no such light.
    #[error("there is no light {}", .0.0)]
    UnknownLight(LightId),
    /// The object was taken away before.
    #[error("object {} has been deleted (restore it first)", .0.0)]
    Deleted(ObjectId),
    /// The object is there.
    #[error("object {} has not been deleted", .0.0)]
    NotDeleted(ObjectId),
    /// A dimming or a colour that is no light.
    #[error("light {}: dimming {dimming} and colour {colour:?}; both are finite, 0 or more and at most 100", light.0)]
    Light {
        /// The light.
        light: LightId,
        /// What was asked for.
        dimming: f32,
        /// What was asked for.
        colour: Bands,
    },
    /// A reflectance that no surface has.
    #[error("object {}: reflectance {reflectance:?} is not within 0 and 0.99", object.0)]
    Reflectance {
        /// The object.
        object: ObjectId,
        /// What was asked for.
        reflectance: Bands,
    },
    /// A matrix with a number that is not finite.
    #[error("the matrix has a number that is not finite")]
    NotFinite,
    /// A matrix that is no placement.
    #[error("the matrix is no placement: its last row is {0:?}, not [0, 0, 0, 1]")]
    NotAffine([f64; 4]),
    /// A matrix that changes lengths, of what has lengths of its own.
    #[error("the matrix changes lengths or mirrors; the form has the lengths")]
    NotRigid,
    /// A matrix that mirrors, flattens, or scales by more than a thousand.
    #[error("the matrix has the determinant {0}: it mirrors the object, or makes it too small or too large")]
    Determinant(f64),
    /// The object would be too far away for single precision.
    #[error("object {} would be {} m from the middle of the scene; at most {most:.1} m", object.0, far(*distance))]
    TooFar {
        /// The object.
        object: ObjectId,
        /// Where it would reach.
        distance: f64,
        /// How far objects may reach.
        most: f64,
    },
    /// The light has no place of its own.
    #[error("light {} cannot be placed, changed, copied or deleted by itself: it is the sky, or an object that shines (do it to that)", .0.0)]
    NotPlaceable(LightId),
    /// The light was taken away before.
    #[error("light {} has been deleted (restore it first)", .0.0)]
    DeletedLight(LightId),
    /// The light is there.
    #[error("light {} has not been deleted", .0.0)]
    LightNotDeleted(LightId),
    /// An object that cannot get another form.
    #[error("object {} cannot have this form: {why}", object.0)]
    Form {
        /// The object.
        object: ObjectId,
        /// What is wrong.
        why: &'static str,
    },
    /// An object that is not what another became.
    #[error("object {} did not become object {}", back.0, gone.0)]
    NotExchanged {
        /// The object that is there.
        gone: ObjectId,
        /// The other.
        back: ObjectId,
    },
    /// An object that cannot be added.
    #[error("the object cannot be added: {0}")]
    NewObject(&'static str),
    /// A light that cannot be added.
    #[error("the light cannot be added: {0}")]
    NewLight(&'static str),
    /// What a light cannot be made.
    #[error("light {} cannot be changed: {why}", light.0)]
    ChangeLight {
        /// The light.
        light: LightId,
        /// What is wrong.
        why: &'static str,
    },
    /// There are lights enough.
    #[error("there are {MOST_LIGHTS} lights already, with those that were deleted; no more can be added")]
    TooManyLights,
    /// [`Edit::Several`] of nothing.
    #[error("there is no edit among the several")]
    NoEdits,
    /// [`Edit::Several`] of too many.
    #[error("{0} edits at once are too many; at most {MOST_EDITS}")]
    TooManyEdits(usize),
    /// The memory that was allowed does not hold another object.
    #[error("another object would need {} in all; {} allowed", radiosity_scene::size(*needed), radiosity_scene::size(*allowed))]
    Memory {
        /// Bytes needed.
        needed: usize,
        /// Bytes allowed.
        allowed: usize,
    },
}
