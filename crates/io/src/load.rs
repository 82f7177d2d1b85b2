//! One call for every format, told apart by the file's extension.

use crate::source::read_plain_file;
use crate::{Document, Folder, LoadError, LoadOptions, gltf, obj};
use radiosity_scene::{Faults, Scene};
use std::path::Path;

/// Most faults that are kept of one file; a damaged one can have millions, and nobody reads past the first hundreds.
const MAX_FAULTS: usize = 1000;

/// A scene that was read.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Warnings and notes; no errors.
    pub faults: Faults,
    /// The glTF as it stood, for writing it back lit; `None` for other formats.
    pub document: Option<Document>,
}

impl Loaded {
    /// The result of reading: an error where the faults say so, or where the scene breaks its promises.
    pub(crate) fn checked(scene: Scene, mut faults: Faults, document: Option<Document>) -> Result<Loaded, LoadError> {
        if faults.0.len() > MAX_FAULTS {
            let (more, errors) = (faults.0.len() - MAX_FAULTS, faults.has_errors());
            // The worst first, so that no error is lost behind warnings.
            faults.0.sort_by_key(|fault| std::cmp::Reverse(fault.severity));
            faults.0.truncate(MAX_FAULTS);
            debug_assert_eq!(errors, faults.has_errors());
            faults.note("", format!("and {more} more"), "");
        }
        if faults.has_errors() { Err(LoadError::Faults(faults)) } else { Ok(Loaded { scene, faults, document }) }
    }
}

/// Reads a scene from a .glb, .gltf or .obj and the files beside it.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let io = |error| LoadError::Io { path: path.to_owned(), error };
    let file = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let read = || Ok((read_plain_file(path).map_err(io)?, Folder::of(path).map_err(io)?));
    let mut loaded = match extension.as_str() {
        "glb" | "gltf" => {
            let (bytes, folder) = read()?;
            gltf::load(&file, &bytes, &folder, options)?
        }
        "obj" => {
            let (bytes, folder) = read()?;
            obj::load(&file, &bytes, &folder, options)?
        }
        _ => {
            let what = format!("'.{extension}' is no known kind of scene");
            return Err(LoadError::one(file, what, "scenes are .glb, .gltf or .obj"));
        }
    };
    loaded.scene.name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(loaded)
}
