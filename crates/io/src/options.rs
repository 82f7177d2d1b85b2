//! What the caller knows about a file that the file does not say.

use radiosity_scene::Up;

/// How to read a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// Length of one unit of an OBJ or View3D file in metres (these have no unit). glTF is in metres always.
    pub metres_per_unit: f64,
    /// Zenith direction; by default +Y for every format, as glTF has it.
    pub up: Option<Up>,
    /// Whether the faces of an OBJ reflect on both sides. OBJ does not say; by default only the counter-clockwise side
    /// does, as closed rooms and closed furniture need.
    pub obj_double_sided: bool,
    /// Most triangles of a scene, all instances counted. A small file can ask for more than any memory holds by placing
    /// one mesh again and again; 16 million triangles take some 4 GB while they are read.
    pub max_triangles: usize,
}

impl Default for LoadOptions {
    fn default() -> Self {
        LoadOptions { metres_per_unit: 1.0, up: None, obj_double_sided: false, max_triangles: 16_000_000 }
    }
}
