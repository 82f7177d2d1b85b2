//! An enclosure from any file that has surfaces: View3D's as it is, scenes by their materials, objects or triangles.

use crate::source::read_plain_file;
use crate::{LoadError, LoadOptions, Vs3, load, vs3};
use radiosity_scene::{AlphaMode, Enclosure, EnclosureSurface, Facet, Faults, Scene, counted};
use rustc_hash::FxHashMap;
use std::collections::BTreeSet;
use std::path::Path;
use std::str::FromStr;

/// Which triangles of a scene are one surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Grouping {
    /// Those of one material.
    Material,
    /// Those of one object: a placed primitive of a glTF, a group and material of an OBJ.
    #[default]
    Object,
    /// Each is its own, and each side of a double-sided one.
    Triangle,
}

impl FromStr for Grouping {
    type Err = String;

    fn from_str(name: &str) -> Result<Grouping, String> {
        match name {
            "material" => Ok(Grouping::Material),
            "object" => Ok(Grouping::Object),
            "triangle" => Ok(Grouping::Triangle),
            _ => Err(format!("'{name}' is none of material, object, triangle")),
        }
    }
}

/// An enclosure that was read.
#[derive(Clone, Debug)]
pub struct LoadedEnclosure {
    /// The enclosure. Of scenes it is not known whether it is closed.
    pub enclosure: Enclosure,
    /// What else a View3D file says; its own `enclosure` and `warnings` are empty, being here.
    pub vs3: Option<Vs3>,
    /// Warnings and notes; no errors.
    pub faults: Faults,
}

/// Reads an enclosure from a .vs3, .glb, .gltf or .obj. Surfaces of a .vs3 are the file's own, whatever the grouping.
///
/// # Errors
/// [`LoadError`] with every fault found.
pub fn load_enclosure(path: &Path, options: &LoadOptions, grouping: Grouping) -> Result<LoadedEnclosure, LoadError> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("vs3")) && !path.is_dir() {
        let bytes = read_plain_file(path).map_err(|error| LoadError::Io { path: path.to_owned(), error })?;
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let mut vs3 = vs3::read(&file, &bytes, options.metres_per_unit)?;
        let enclosure = std::mem::take(&mut vs3.enclosure);
        let faults = std::mem::take(&mut vs3.warnings);
        return Ok(LoadedEnclosure { enclosure, vs3: Some(vs3), faults });
    }
    let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    if path.is_dir() {
        return Err(LoadError::one(file, "is a folder", "name the .vs3, .glb, .gltf or .obj in it"));
    }
    let loaded = load(path, options)?;
    let mut faults = loaded.faults;
    let enclosure = enclosure_of(&loaded.scene, grouping, &file, &mut faults);
    if enclosure.facets.is_empty() {
        faults.error(file, "no triangle has an area", "check the unit and the export of the model");
        return Err(LoadError::Faults(faults));
    }
    Ok(LoadedEnclosure { enclosure, vs3: None, faults })
}

/// The enclosure that a scene's triangles make, all opaque: one facet for each, two where it is double-sided.
pub fn enclosure_of(scene: &Scene, grouping: Grouping, file: &str, faults: &mut Faults) -> Enclosure {
    let mut enclosure = Enclosure { title: scene.name.clone(), ..Enclosure::default() };
    let mut surface_of: FxHashMap<usize, u32> = FxHashMap::default();
    let mut without_area = 0_usize;
    for triangle in 0..scene.triangles.len() {
        let object = scene.triangle_object[triangle] as usize;
        let Ok(facet) = Facet::new(scene.corners(triangle).to_vec()) else {
            without_area += 1;
            continue;
        };
        let material = scene.objects[object].material;
        let back = scene.materials[material].has_two_sides().then(|| facet.flipped());
        for (facet, side) in std::iter::once((facet, "")).chain(back.map(|back| (back, " back"))) {
            let group = match grouping {
                Grouping::Material => material,
                Grouping::Object => object,
                // A new surface each time.
                Grouping::Triangle => enclosure.facets.len(),
            };
            let surfaces = &mut enclosure.surfaces;
            let surface = *surface_of.entry(group).or_insert_with(|| {
                let name = match grouping {
                    Grouping::Material => scene.materials[material].name.clone(),
                    Grouping::Object => scene.objects[object].name.clone(),
                    Grouping::Triangle => {
                        format!("{}:{}{side}", scene.objects[object].name, scene.triangle_source[triangle] + 1)
                    }
                };
                surfaces.push(EnclosureSurface { name, emittance: None });
                (surfaces.len() - 1) as u32
            });
            enclosure.facets.push(facet);
            enclosure.surface_of.push(surface);
        }
    }
    if without_area > 0 {
        let what = format!("{} no area; left out", counted(without_area, "triangle has", "triangles have"));
        faults.warning(file, what, "harmless where they are slivers");
    }
    let used: BTreeSet<usize> = scene.objects.iter().filter(|o| !o.triangles.is_empty()).map(|o| o.material).collect();
    for material in used.into_iter().map(|index| &scene.materials[index]) {
        if material.alpha_mode != AlphaMode::Opaque {
            let what = format!("material '{}' lets light through", material.name);
            faults.warning(file, what, "between facets all surfaces are opaque; leave out what is not");
        }
    }
    enclosure
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use radiosity_scene::Material;

    fn scene() -> Scene {
        let square = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let mut scene = Scene { name: "s".to_owned(), ..Scene::default() };
        for (name, double_sided) in [("wood", false), ("paper", true)] {
            scene.materials.push(Material { name: name.to_owned(), double_sided, ..Material::default() });
        }
        scene.materials[1].alpha_mode = AlphaMode::Blend;
        scene.add_quad("floor", 0, square);
        scene.add_quad("screen", 1, square.map(|corner| corner + DVec3::Z));
        scene.add_quad("table", 0, square.map(|corner| 0.5 * corner + 0.5 * DVec3::Z));
        scene
    }

    #[test]
    fn triangles_are_grouped_and_double_sided_ones_count_twice() {
        let of = |grouping| {
            let mut faults = Faults::default();
            let enclosure = enclosure_of(&scene(), grouping, "s.glb", &mut faults);
            assert!(faults.to_string().starts_with("warning: s.glb: material 'paper' lets light through"), "{faults}");
            assert_eq!(enclosure.facets.len(), 8);
            let names: Vec<String> = enclosure.surfaces.iter().map(|s| s.name.clone()).collect();
            (names, enclosure.surface_areas(), enclosure.title)
        };
        let (names, areas, title) = of(Grouping::Material);
        assert_eq!(
            (names.as_slice(), areas.as_slice()),
            (&["wood".to_owned(), "paper".to_owned()][..], &[1.25, 2.0][..])
        );
        assert_eq!(title, "s");
        let (names, areas, _) = of(Grouping::Object);
        assert_eq!((names.join(" "), areas), ("floor screen table".to_owned(), vec![1.0, 2.0, 0.25]));
        let (names, areas, _) = of(Grouping::Triangle);
        let expected = "floor:1,floor:2,screen:1,screen:1 back,screen:2,screen:2 back,table:1,table:2";
        assert_eq!((names.join(","), areas[0], areas[7]), (expected.to_owned(), 0.5, 0.125));
        let normals: Vec<f64> = {
            let enclosure = enclosure_of(&scene(), Grouping::Triangle, "s", &mut Faults::default());
            enclosure.facets.iter().map(|f| f.normal().z).collect()
        };
        assert_eq!(normals, [1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0]);
    }

    #[test]
    fn groupings_have_names() {
        assert_eq!("material".parse(), Ok(Grouping::Material));
        assert!("mesh".parse::<Grouping>().unwrap_err().contains("object"));
    }
}
