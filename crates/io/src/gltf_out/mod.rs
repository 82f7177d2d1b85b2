//! The lit model: a GLB that is the source's own glTF plus light.
//!
//! From a glTF source its JSON is kept, so that names, materials, pictures, cameras, animations, extras and unknown
//! extensions survive; external buffers and pictures move into the file; what was compressed is written plain. Every
//! placed primitive gets vertices of its own, since two instances never share their light: the first node of a mesh
//! keeps its index, further ones get appended copies, EXT_mesh_gpu_instancing becomes child nodes. Lamps of
//! KHR_lights_punctual, whose light is now in the surfaces, move into the extras of their nodes. From any other source the JSON is built from the [`Scene`].
//!
//! What a value means: irradiance E in lx per band. In a lightmap E = texel (decoded) × `intensity` of MOZ_lightmap;
//! three.js adds `texel · intensity · albedo/π` to the reflected light, so it shows the luminance B = albedo · E/π
//! in cd/m², times [`Style`]'s exposure. Vertex light is the float attribute `_IRRADIANCE` in lx; the author's
//! COLOR_0 stays. Unlit vertices carry COLOR_0 = author's colour × E/π × exposure through the curve that pictures are
//! shown with, and any viewer shows them.

mod glb;
mod lamps;
mod materials;
mod mixture;
mod plain;
mod rewrite;
mod skin;
mod vertices;

use crate::gltf::{AccessorError, Document};
use radiosity_scene::{Bands, Scene};
use std::path::{Path, PathBuf};

/// A vertex to write: a weighted mean of three vertices of its source primitive, in every attribute.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitVertex {
    /// Vertices of the source primitive (of the object: its first vertex is 0).
    pub corners: [u32; 3],
    /// Their weights; `[1, 0, 0]` copies the first exactly.
    pub weights: [f32; 3],
}

/// Triangles of one object with their light.
#[derive(Clone, Debug, PartialEq)]
pub struct LitPrimitive {
    /// Index into [`Scene::objects`]; several primitives may share an object (one for each lightmap page or side).
    pub object: usize,
    /// Vertices.
    pub vertices: Vec<LitVertex>,
    /// Indices into `vertices`, counter-clockwise in the world seen from the side that is lit here.
    pub triangles: Vec<[u32; 3]>,
    /// This is the back of a double-sided surface: normals and tangents are turned round. An object with such a
    /// primitive is written single-sided, both layers.
    pub flipped: bool,
    /// The light.
    pub light: Light,
}

/// Light on a primitive.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// From a page of the lightmap.
    Lightmap {
        /// Index into the pages of [`Style::Lightmap`].
        page: usize,
        /// Texture coordinates by vertex, 0..1, v down.
        uv: Vec<[f32; 2]>,
    },
    /// At the vertices.
    Vertex {
        /// Irradiance by vertex, lx per band.
        irradiance: Vec<Bands>,
    },
    /// None is known: the geometry and material are written as they are.
    None,
}

/// How texels of a page are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// sRGB transfer curve, what readers expect of colour pictures.
    #[default]
    Srgb,
    /// Proportional to irradiance, for older readers.
    Linear,
}

/// A page of the lightmap.
#[derive(Clone, Debug, PartialEq)]
pub struct PageImage {
    /// The picture, PNG.
    pub png: Vec<u8>,
    /// Irradiance, lx, where the decoded texel is 1.
    pub intensity: f32,
}

/// How light is written.
#[derive(Clone, Debug, PartialEq)]
pub enum Style {
    /// MOZ_lightmap on the materials.
    Lightmap {
        /// The pages.
        pages: Vec<PageImage>,
        /// How their texels are stored.
        encoding: Encoding,
        /// Factor from cd/m² to the viewer's brightness; 1 keeps physical units.
        exposure: f32,
    },
    /// The attribute `_IRRADIANCE`.
    Vertices,
    /// KHR_materials_unlit with the light in COLOR_0.
    Unlit {
        /// Factor from cd/m² to the viewer's brightness; 1 is a little below white, which 8 reaches.
        exposure: f32,
    },
}

/// Why nothing was written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file could not be written.
    #[error("{}: cannot be written: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        #[source]
        error: std::io::Error,
    },
    /// The folder of the file does not exist.
    #[error("{}: there is no such folder", .0.display())]
    NoFolder(PathBuf),
    /// The source's data cannot be read a second time.
    #[error("source: {0}")]
    Source(#[from] AccessorError),
    /// A primitive contradicts the scene, the source or itself.
    #[error("primitive {primitive}: {what}")]
    Primitive {
        /// Index into the list of primitives.
        primitive: usize,
        /// What is wrong.
        what: String,
    },
    /// A GLB cannot hold more than 4 GiB.
    #[error("{0} bytes do not fit into a GLB; write fewer texels or vertices")]
    TooLarge(u64),
    /// A material is none that glTF can say.
    #[error("material '{name}': {what}")]
    Material {
        /// Its name.
        name: String,
        /// What is wrong.
        what: String,
    },
    /// A picture could not be encoded.
    #[error("picture '{name}': {what}")]
    Picture {
        /// Its name.
        name: String,
        /// What is wrong.
        what: String,
    },
}

/// Writes the lit model, whole or not at all. Objects without a primitive are written as the source has them.
pub fn write_lit(
    scene: &Scene,
    document: Option<&Document>,
    primitives: &[LitPrimitive],
    style: &Style,
    out: &Path,
) -> Result<(), WriteError> {
    glb::save(&lit_glb(scene, document, primitives, style)?, out)
}

/// The bytes that [`write_lit`] writes.
pub fn lit_glb(
    scene: &Scene,
    document: Option<&Document>,
    primitives: &[LitPrimitive],
    style: &Style,
) -> Result<Vec<u8>, WriteError> {
    for (index, primitive) in primitives.iter().enumerate() {
        check(scene, primitive, style).map_err(|what| WriteError::Primitive { primitive: index, what })?;
    }
    match document {
        Some(document) => rewrite::rewrite(scene, document, primitives, style),
        None => plain::lit(scene, primitives, style),
    }
}

/// The bytes of a GLB of a scene that is yet to be lit, such as one that was made or edited in code: surfaces, materials,
/// lamps and cameras. glTF has no skies, so there is none.
pub fn scene_glb(scene: &Scene) -> Result<Vec<u8>, WriteError> {
    plain::dark(scene)
}

fn check(scene: &Scene, primitive: &LitPrimitive, style: &Style) -> Result<(), String> {
    let Some(object) = scene.objects.get(primitive.object) else {
        return Err(format!("object {} of {}", primitive.object, scene.objects.len()));
    };
    let count = primitive.vertices.len();
    let (vertices, name) = (object.vertices.len(), &object.name);
    if primitive.triangles.is_empty() {
        return Err(format!("no triangles for object '{name}'"));
    }
    if let Some(i) = primitive.triangles.iter().flatten().find(|&&i| i as usize >= count) {
        return Err(format!("a triangle names vertex {i} of {count}"));
    }
    if let Some(c) = primitive.vertices.iter().flat_map(|v| v.corners).find(|&c| c as usize >= vertices) {
        return Err(format!("a vertex names corner {c}, but object '{name}' has {vertices}"));
    }
    if primitive.vertices.iter().flat_map(|v| v.weights).any(|w| !w.is_finite()) {
        return Err("a weight is not finite".to_owned());
    }
    match (&primitive.light, style) {
        (Light::Lightmap { page, uv }, Style::Lightmap { pages, .. }) => {
            if *page >= pages.len() {
                return Err(format!("lightmap page {page} of {}", pages.len()));
            }
            if uv.len() != count {
                return Err(format!("{} lightmap coordinates for {count} vertices", uv.len()));
            }
        }
        (Light::Vertex { irradiance }, Style::Vertices | Style::Unlit { .. }) => {
            if irradiance.len() != count {
                return Err(format!("{} irradiances for {count} vertices", irradiance.len()));
            }
        }
        (Light::None, _) => {}
        (Light::Lightmap { .. }, _) => return Err("has a lightmap, but light is to be written at vertices".to_owned()),
        (Light::Vertex { .. }, _) => return Err("has light at vertices, but a lightmap is to be written".to_owned()),
    }
    Ok(())
}

#[cfg(test)]
mod tests;
