//! What a viewer draws: objects as meshes whose vertices carry light, lights, cameras.

use super::Form;
use radiosity_scene::Bands;
use serde::{Deserialize, Serialize};

/// An object of a session: one primitive of one mesh as the file placed it once, or a copy of one. Numbers are never
/// given anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ObjectId(pub u32);

/// A light of a session. Numbers are never given anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LightId(pub u32);

/// All that is drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Model {
    /// Name of the scene.
    pub name: String,
    /// Objects, by id.
    pub objects: Vec<ModelObject>,
    /// Lights, by id.
    pub lights: Vec<ModelLight>,
    /// Cameras of the file.
    pub cameras: Vec<ModelCamera>,
    /// Lower and upper corner of the box around all objects as they are placed now.
    pub bounds: [[f64; 3]; 2],
    /// Unit zenith direction.
    pub up: [f64; 3],
}

/// One object. Its vertices are in the coordinates of the file's world; the matrix carries them to where the object is.
/// Each triangle of [`ModelObject::indices`] is one element; the elements of backs that take part in the exchange of
/// light follow those of the fronts, with vertices of their own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelObject {
    /// Its id.
    pub id: ObjectId,
    /// Name for people.
    pub name: String,
    /// Objects with the same number belong together: primitives of one node of the file.
    pub group: u32,
    /// By columns, from the file's world to its place now.
    pub matrix: [f64; 16],
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, the author's where there are any.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates of the picture of the base colour; empty without one.
    pub uvs: Vec<[f32; 2]>,
    /// Three vertices for each element, counter-clockwise seen from its side.
    pub indices: Vec<u32>,
    /// For each element the triangle of the scene ([`Session::scene`](crate::session::Session::scene)).
    pub triangle_of: Vec<u32>,
    /// Mean reflectance.
    pub reflectance: Bands,
    /// Index of the picture of the base colour into [`Scene::textures`](radiosity_scene::Scene::textures).
    pub texture: Option<usize>,
    /// What the texture is multiplied by to give the reflectance.
    pub tint: Bands,
    /// Exitance, lm/m² per band, as dimmed and coloured now.
    pub emission: Bands,
    /// Whether it was taken away.
    pub deleted: bool,
    /// Whether people would move it, as is guessed from the scene as it was handed in: furniture, and not the building.
    pub movable: bool,
    /// What was added has one, in the coordinates that the matrix carries from; what was handed in has none.
    pub form: Option<Form>,
    /// What it became when it got another form: that has its light and its place from then on.
    pub successor: Option<ObjectId>,
    /// The light that it is, if it shines.
    pub light: Option<LightId>,
}

/// Kinds of lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LightKind {
    /// An object that shines.
    Object,
    /// A point that shines in all directions.
    Point,
    /// A point that shines in a cone.
    Spot,
    /// Parallel light.
    Directional,
    /// The sky.
    Sky,
}

/// One light.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelLight {
    /// Its id.
    pub id: LightId,
    /// Name for people.
    pub name: String,
    /// Its kind.
    pub kind: LightKind,
    /// 0 is off, 1 as in the file.
    pub dimming: f32,
    /// By what its light is multiplied in each band.
    pub colour: Bands,
    /// Of lights without area, before they are dimmed and coloured: candela per band, or lux per band of parallel light.
    pub intensity: Option<Bands>,
    /// Of objects, before they are dimmed and coloured: lumens per band.
    pub flux: Option<Bands>,
    /// Lux per band, before they are dimmed and coloured: of the sky on open level ground, of parallel light across its rays.
    pub illuminance: Option<Bands>,
    /// Of spots: the half angles inside which they are as bright as they get, and outside which there is no light, radians.
    pub cone: Option<[f64; 2]>,
    /// Where it is: the middle of an object; nothing for the sky and parallel light.
    pub position: Option<[f64; 3]>,
    /// Where it shines to: spots and parallel light.
    pub direction: Option<[f64; 3]>,
    /// By columns, from the file's world to its place now.
    pub matrix: [f64; 16],
    /// The object that it is.
    pub object: Option<ObjectId>,
    /// Whether it was taken away, or its object.
    pub deleted: bool,
    /// How many lights are there whose light is not told from its own, itself among them: 1, or more beyond the 31st.
    pub sharing: usize,
}

/// One camera, looking along −Z of its frame with +Y up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelCamera {
    /// Name for people.
    pub name: String,
    /// By columns, world from camera.
    pub matrix: [f64; 16],
    /// Full vertical angle of view, radians; `None` for parallel projection.
    pub vertical_fov: Option<f64>,
}

/// Which part of the light is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layer {
    /// All of it.
    #[default]
    Total,
    /// What comes from lights without being reflected.
    Direct,
    /// What was reflected.
    Indirect,
    /// What was reflected so many times; 0 is direct light.
    Bounce(u32),
    /// All that one light brings, reflected light too; before columns are solved, its direct light only.
    Light(LightId),
    /// One standard error of the total by the rays of rows, lux.
    Error,
    /// The same in percent of the light that is there, in all bands alike; at most 100.
    RelativeError,
}

/// Where the light of a place comes from, and what becomes of it. Lux per band.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Probe {
    /// The object.
    pub object: ObjectId,
    /// The triangle of the scene.
    pub triangle: u32,
    /// World position.
    pub position: [f64; 3],
    /// Unit normal of the side.
    pub normal: [f64; 3],
    /// Illuminance, lx.
    pub lux: f32,
    /// Irradiance, lux per band.
    pub irradiance: Bands,
    /// Reflectance.
    pub reflectance: Bands,
    /// Radiosity, lm/m² per band, emission included.
    pub radiosity: Bands,
    /// The part of the irradiance that comes from lights without being reflected.
    pub direct: Bands,
    /// One standard error of the illuminance by the rays of this place, lx.
    pub error: f32,
    /// What each light brings, reflected light too, brightest first; before lights are told apart, unreflected light only.
    pub lights: Vec<(LightId, Bands)>,
    /// What objects send here of what they reflect, brightest first.
    pub objects: Vec<(ObjectId, Bands)>,
}
