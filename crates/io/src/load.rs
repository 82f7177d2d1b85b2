//! One call for every format, told apart by the file's extension.

use crate::source::read_plain_file;
use crate::{Document, Folder, LoadError, LoadOptions, gltf, obj};
use radiosity_scene::{Fault, Faults, Mesh, Scene, counted};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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
    /// The files beside the scene that it was read from, by their places.
    pub files: Vec<PathBuf>,
}

impl Loaded {
    /// The result of reading: an error where the faults say so, or where the scene breaks its promises.
    pub(crate) fn checked(
        file: &str,
        scene: Scene,
        mut faults: Faults,
        document: Option<Document>,
    ) -> Result<Loaded, LoadError> {
        if !faults.has_errors() {
            warn_of_small_triangles(file, &scene, &mut faults);
        }
        if faults.0.len() > MAX_FAULTS {
            // The worst first, so that no error is lost behind warnings.
            faults.0.sort_by_key(|fault| std::cmp::Reverse(fault.severity));
            let more = faults.0.split_off(MAX_FAULTS);
            let what = format!("and {} more", more.len());
            faults.0.push(Fault { severity: more[0].severity, place: file.to_owned(), what, hint: String::new() });
        }
        if faults.has_errors() {
            Err(LoadError::Faults(faults))
        } else {
            Ok(Loaded { scene, faults, document, files: Vec::new() })
        }
    }
}

/// Warns of triangles that will vanish when touching surfaces are sewn together.
fn warn_of_small_triangles(file: &str, scene: &Scene, faults: &mut Faults) {
    let (dropped, distance) = Mesh::would_drop(scene);
    let mut of_object: BTreeMap<u32, usize> = BTreeMap::new();
    for triangle in dropped {
        *of_object.entry(scene.triangle_object[triangle as usize]).or_default() += 1;
    }
    for (object, count) in of_object {
        let object = &scene.objects[object as usize];
        let what = format!(
            "{count} of {} {} smaller than the distance within which vertices are sewn together, \
             {distance:.1e} m (a millionth of the scene's extent), and left out",
            counted(object.triangles.len(), "triangle", "triangles"),
            if count == 1 { "is" } else { "are" }
        );
        let hint = "harmless where they are slivers; where they matter, remove what lies far away from them";
        faults.warning(format!("{file}: object '{}'", object.name), what, hint);
    }
}

/// Reads a scene from a .glb, .gltf or .obj and the files beside it.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let io = |error| LoadError::Io { path: path.to_owned(), error };
    let file = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let read = || Ok((read_plain_file(path).map_err(io)?, Folder::of(path).map_err(io)?));
    if path.is_dir() {
        return Err(LoadError::one(file, "is a folder", "name the .glb, .gltf or .obj in it"));
    }
    let mut loaded = match extension.as_str() {
        "glb" | "gltf" => {
            let (bytes, folder) = read()?;
            let loaded = gltf::load(&file, &bytes, &folder, options)?;
            Loaded { files: folder.into_files(), ..loaded }
        }
        "obj" => {
            let (bytes, folder) = read()?;
            let loaded = obj::load(&file, &bytes, &folder, options)?;
            Loaded { files: folder.into_files(), ..loaded }
        }
        "vs3" => {
            let hint = "it is read where factors are asked for; scenes are .glb, .gltf or .obj";
            return Err(LoadError::one(file, "a View3D file has surfaces for form factors and no light", hint));
        }
        _ => {
            let what = format!("'.{extension}' is no known kind of scene");
            return Err(LoadError::one(file, what, "scenes are .glb, .gltf or .obj"));
        }
    };
    loaded.scene.name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(loaded)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Memory;

    #[test]
    fn triangles_that_vanish_in_sewing_are_a_warning() {
        let text = "v 0 0 0\nv 1e5 0 0\nv 0 1e5 0\no ground\nf 1 2 3\n\
                    v 5 5 1\nv 5.05 5 1\nv 5 5.05 1\nv 9 9 1\no dot\nf 4 5 6\nf 4 5 7\n";
        let loaded = obj::load("t.obj", text.as_bytes(), &Memory::default(), &LoadOptions::default()).unwrap();
        let text = loaded.faults.to_string();
        assert!(text.contains("warning: t.obj: object 'dot': 2 of 2 triangles are smaller"), "{text}");
        assert!(text.contains("1.0e-1 m"), "{text}");
        assert!(!text.contains("ground"), "{text}");
    }
}
