//! Wavefront OBJ with MTL.
//!
//! One object per group (`o`, `g`) and material; the same pair met again goes on with its object. Faces show their
//! counter-clockwise side; smoothing groups, curves, points and lines are passed over. Face indices that do not exist
//! cost their face, with a warning. The reader is our own because `tobj` triangulates concave polygons as fans, opens
//! files itself and stops at the first fault.

mod mtl;
mod polygon;

use crate::assemble::{Assembly, Part};
use crate::{LoadError, LoadOptions, Loaded, Source};
use glam::{DVec3, Vec2, Vec3};
use mtl::Library;
use radiosity_scene::{Faults, Source as Origin, counted};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// Most lines that are named in one message.
const MAX_LINES_NAMED: usize = 5;

/// Reads an OBJ from memory; `file` is its name for messages, `source` gives its libraries and pictures.
pub fn load(file: &str, bytes: &[u8], source: &dyn Source, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut faults = Faults::default();
    if !(options.metres_per_unit.is_finite() && options.metres_per_unit > 0.0) {
        let what = format!("{} metres per unit", options.metres_per_unit);
        return Err(LoadError::one(file, what, "the length of a unit must be above 0"));
    }
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(LoadError::one(file, "the file is empty", "export or copy it again"));
    }
    let text = String::from_utf8_lossy(bytes);
    let lines = || lines(&text);

    let lists = Lists::read(lines(), options.metres_per_unit, file, &mut faults);
    let mut library = Library::new(source);
    let mut reader = Faces::new(file, &lists);
    for (number, line) in lines() {
        let (keyword, rest) = split(&line);
        match keyword {
            "mtllib" => {
                // Several libraries may stand in one line, and one may have blanks in its name: the line ending in
                // .mtl only once is one name.
                let place = format!("{file}:{number}");
                if rest.to_ascii_lowercase().matches(".mtl").count() > 1 {
                    rest.split_whitespace().for_each(|name| library.read(name, &place, &mut faults));
                } else {
                    library.read(rest, &place, &mut faults);
                }
            }
            _ => reader.line(number, keyword, rest, &mut library),
        }
    }
    reader.report(library.is_missing, &mut faults);

    let mut assembly = Assembly::new(options);
    assembly.scene.up = options.up.unwrap_or_default();
    for material in &mut library.materials {
        material.double_sided = options.obj_double_sided;
    }
    assembly.scene.materials = std::mem::take(&mut library.materials);
    assembly.scene.textures = std::mem::take(&mut library.textures);
    for (index, mut part) in reader.parts.into_iter().enumerate() {
        part.source = Origin { node: index, mesh: index, ..Origin::default() };
        if assembly.has_room(file, 1, [part.positions.len(), part.triangles.len()], &mut faults) {
            assembly.add(file, part, &mut faults);
        }
    }
    let scene = assembly.finish(file, &mut faults);
    Loaded::checked(file, scene, faults, None)
}

/// Lines by number from 1, comments removed, those that end in a backslash joined with the next.
fn lines(text: &str) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    let mut numbered = bare(text).lines().enumerate();
    std::iter::from_fn(move || {
        let clean = |line: &'_ str| line.split('#').next().unwrap_or_default().trim().len();
        let (number, line) = numbered.next()?;
        let start = line.trim_start();
        let line = &start[..clean(start).min(start.len())];
        let Some(head) = line.strip_suffix('\\') else { return Some((number + 1, line.into())) };
        let mut joined = head.to_owned();
        for (_, next) in numbered.by_ref() {
            let next = next.split('#').next().unwrap_or_default().trim();
            joined.push(' ');
            match next.strip_suffix('\\') {
                Some(next) => joined.push_str(next),
                None => {
                    joined.push_str(next);
                    break;
                }
            }
        }
        Some((number + 1, joined.into()))
    })
}

/// Text without the mark of its encoding that some editors put before it.
fn bare(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

fn split(line: &str) -> (&str, &str) {
    let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (keyword, rest.trim())
}

/// Everything that faces refer to.
#[derive(Default)]
struct Lists {
    positions: Vec<DVec3>,
    colors: Vec<[f32; 4]>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
}

impl Lists {
    fn read<'a>(
        lines: impl Iterator<Item = (usize, std::borrow::Cow<'a, str>)>,
        scale: f64,
        file: &str,
        faults: &mut Faults,
    ) -> Lists {
        let mut lists = Lists::default();
        let mut unreadable = Lines::default();
        for (number, line) in lines {
            let (keyword, rest) = split(&line);
            let least = match keyword {
                "v" | "vn" => 3,
                "vt" => 1,
                _ => continue,
            };
            let mut values = [0.0_f64; 7];
            let mut count = 0;
            for (slot, word) in values.iter_mut().zip(rest.split_whitespace()) {
                *slot = word.parse().unwrap_or(f64::NAN);
                count += 1;
            }
            // The line keeps its number in the list, so that later indices stay right; faces that use it are dropped.
            if count < least || values.iter().any(|v| v.is_nan()) {
                unreadable.push(number);
                values = [f64::NAN; 7];
            }
            let [a, b, c, ..] = values;
            match keyword {
                "v" => {
                    if count >= 6 && !values.iter().any(|v| v.is_nan()) {
                        lists.colors.resize(lists.positions.len(), [1.0; 4]);
                        lists.colors.push([values[3] as f32, values[4] as f32, values[5] as f32, 1.0]);
                    }
                    lists.positions.push(DVec3::new(a, b, c) * scale);
                }
                // v points up in OBJ and down in a Scene.
                "vt" => lists.uvs.push(Vec2::new(a as f32, (1.0 - b) as f32)),
                _ => lists.normals.push(DVec3::new(a, b, c).try_normalize().unwrap_or(DVec3::ZERO).as_vec3()),
            }
        }
        if !lists.colors.is_empty() {
            lists.colors.resize(lists.positions.len(), [1.0; 4]);
        }
        unreadable.warn(file, "with something else than numbers; what uses them is dropped", faults);
        lists
    }
}

/// Lines with the same fault: how many, and the first few by number.
#[derive(Default)]
struct Lines {
    count: usize,
    first: Vec<String>,
}

impl Lines {
    fn push(&mut self, number: usize) {
        self.count += 1;
        if self.first.len() < MAX_LINES_NAMED {
            self.first.push(number.to_string());
        }
    }

    fn warn(&self, file: &str, what: &str, faults: &mut Faults) {
        if let Some(first) = self.first.first() {
            let more = if self.count > self.first.len() { ", …" } else { "" };
            let what = format!(
                "{} {what} ({} {}{more})",
                counted(self.count, "line", "lines"),
                if self.count == 1 { "line" } else { "lines" },
                self.first.join(", ")
            );
            faults.warning(format!("{file}:{first}"), what, "correct them, or export the model again");
        }
    }
}

/// Position, texture coordinate and normal of a corner, from 0.
type Corner = (u32, Option<u32>, Option<u32>);

/// Faces on their way into parts.
struct Faces<'a> {
    file: &'a str,
    lists: &'a Lists,
    /// Lines of each list met so far, for indices that count backwards: v, vt, vn.
    met: [usize; 3],
    object: String,
    group: String,
    material: Option<usize>,
    part_of: BTreeMap<(String, usize), usize>,
    current: Option<usize>,
    parts: Vec<Part>,
    vertex_of: Vec<FxHashMap<Corner, u32>>,
    unknown_materials: BTreeMap<String, usize>,
    bad_indices: Lines,
    too_short: Lines,
    too_long: Lines,
    without_area: Lines,
}

impl<'a> Faces<'a> {
    fn new(file: &'a str, lists: &'a Lists) -> Faces<'a> {
        Faces {
            file,
            lists,
            met: [0; 3],
            object: String::new(),
            group: String::new(),
            material: None,
            part_of: BTreeMap::new(),
            current: None,
            parts: Vec::new(),
            vertex_of: Vec::new(),
            unknown_materials: BTreeMap::new(),
            bad_indices: Lines::default(),
            too_short: Lines::default(),
            too_long: Lines::default(),
            without_area: Lines::default(),
        }
    }

    fn line(&mut self, number: usize, keyword: &str, rest: &str, library: &mut Library<'_>) {
        match keyword {
            "v" => self.met[0] += 1,
            "vt" => self.met[1] += 1,
            "vn" => self.met[2] += 1,
            "o" => {
                (self.object, self.group) = (rest.to_owned(), String::new());
                self.current = None;
            }
            "g" => {
                rest.clone_into(&mut self.group);
                self.current = None;
            }
            "usemtl" => {
                self.material = library.by_name.get(rest).copied();
                if self.material.is_none() {
                    self.unknown_materials.entry(rest.to_owned()).or_insert(number);
                }
                self.current = None;
            }
            "f" | "fo" => self.face(number, rest, library),
            "l" | "p" => self.without_area.push(number),
            _ => {}
        }
    }

    fn face(&mut self, number: usize, rest: &str, library: &mut Library<'_>) {
        let mut corners: Vec<Corner> = Vec::with_capacity(4);
        for word in rest.split_whitespace() {
            if corners.len() >= polygon::MAX_CORNERS {
                self.too_long.push(number);
                return;
            }
            match self.corner(word) {
                Some(corner) => corners.push(corner),
                None => {
                    self.bad_indices.push(number);
                    return;
                }
            }
        }
        if corners.len() < 3 {
            self.too_short.push(number);
            return;
        }
        let lists = self.lists;
        let position = |corner: &Corner| lists.positions.get(corner.0 as usize).copied().unwrap_or(DVec3::NAN);
        let points: Vec<DVec3> = corners.iter().map(position).collect();
        let triangles = polygon::triangulate(&points);

        let index = self.part(library);
        let (Some(part), Some(vertex_of)) = (self.parts.get_mut(index), self.vertex_of.get_mut(index)) else { return };
        let vertices: Vec<u32> = corners
            .iter()
            .zip(points)
            .map(|(corner, point)| {
                *vertex_of.entry(*corner).or_insert_with(|| {
                    let uv = corner.1.and_then(|i| lists.uvs.get(i as usize)).copied();
                    let normal = corner.2.and_then(|i| lists.normals.get(i as usize)).copied();
                    part.positions.push(point);
                    part.normals.push(normal.unwrap_or_default());
                    if !lists.uvs.is_empty() {
                        part.uvs[0].push(uv.unwrap_or_default());
                    }
                    if !lists.colors.is_empty() {
                        part.colors.push(lists.colors.get(corner.0 as usize).copied().unwrap_or([1.0; 4]));
                    }
                    (part.positions.len() - 1) as u32
                })
            })
            .collect();
        let at = |i: u32| vertices.get(i as usize).copied().unwrap_or(u32::MAX);
        part.triangles.extend(triangles.into_iter().map(|triangle| triangle.map(at)));
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`, from 1 or backwards from −1. A texture coordinate or normal that does not
    /// exist is left out; without its position the corner is `None`.
    fn corner(&self, word: &str) -> Option<Corner> {
        let mut parts = word.split('/');
        let mut index = |list: usize, length: usize| {
            let given: i64 = parts.next()?.parse().ok()?;
            let met = i64::try_from(*self.met.get(list)?).ok()?;
            let at = if given > 0 { given - 1 } else { met.checked_add(given).filter(|_| given < 0)? };
            u32::try_from(at).ok().filter(|at| (*at as usize) < length)
        };
        let position = index(0, self.lists.positions.len())?;
        let uv = index(1, self.lists.uvs.len());
        let normal = index(2, self.lists.normals.len());
        Some((position, uv, normal))
    }

    /// The part for the current group and material.
    fn part(&mut self, library: &mut Library<'_>) -> usize {
        if let Some(current) = self.current {
            return current;
        }
        let material = self.material.unwrap_or_else(|| library.grey());
        let name = match (self.object.as_str(), self.group.as_str()) {
            // Where nothing has a name of its own, each material is an object.
            ("", "") if self.material.is_some() => library.materials[material].name.clone(),
            ("", "") => "object".to_owned(),
            (name, "") | ("", name) => name.to_owned(),
            (object, group) => format!("{object} {group}"),
        };
        let (parts, vertex_of) = (&mut self.parts, &mut self.vertex_of);
        let index = *self.part_of.entry((name.clone(), material)).or_insert_with(|| {
            parts.push(Part { name, material, ..Part::default() });
            vertex_of.push(FxHashMap::default());
            parts.len() - 1
        });
        self.current = Some(index);
        index
    }

    /// Tells what was left out. Where a library is missing, which is told, so are all of its materials.
    fn report(&self, is_library_missing: bool, faults: &mut Faults) {
        let mut unknown: Vec<(&String, &usize)> = self.unknown_materials.iter().collect();
        unknown.sort_by_key(|(_, line)| **line);
        let grey = format!("grey of reflectance {}", mtl::GREY);
        match unknown[..] {
            [(_, line), _, ..] if is_library_missing => {
                let some: Vec<String> = unknown.iter().take(5).map(|(name, _)| format!("'{name}'")).collect();
                let more = if unknown.len() > some.len() { ", ..." } else { "" };
                let (count, some) = (unknown.len(), some.join(", "));
                let what = format!(
                    "{count} materials are in no library that could be read: {some}{more}; their faces are {grey}"
                );
                faults.warning(format!("{}:{line}", self.file), what, "mend the material library");
            }
            _ => {
                for (name, line) in unknown.into_iter().take(20) {
                    let what = format!("material '{name}' is in no library; its faces are {grey}");
                    faults.warning(format!("{}:{line}", self.file), what, "add it to the material library");
                }
            }
        }
        self.bad_indices.warn(self.file, "with a corner that does not exist; faces dropped", faults);
        self.too_short.warn(self.file, "with a face of fewer than 3 corners; dropped", faults);
        let most = polygon::MAX_CORNERS;
        self.too_long.warn(self.file, &format!("with a face of more than {most} corners; dropped"), faults);
        if self.without_area.count > 0 {
            let what = format!(
                "{} no area; left out",
                counted(self.without_area.count, "point or line has", "points or lines have")
            );
            faults.note(self.file, what, "");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Memory;

    fn read(text: &str) -> Loaded {
        let memory = Memory([("a b.mtl".to_owned(), b"newmtl red\nKd 1 0 0\n".to_vec())].into());
        load("t.obj", text.as_bytes(), &memory, &LoadOptions::default()).unwrap()
    }

    const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n";

    #[test]
    fn indices_count_forwards_and_backwards_and_lines_go_on() {
        let forwards = read(&format!("{QUAD}f 1/1/1 2/2/1 3/3/1 4/4/1\n"));
        let backwards = read(&format!("{QUAD}f -4/-4/-1 -3/-3/-1 \\\n  -2/-2/-1 -1/-1/-1 # quad\n"));
        assert_eq!(forwards.scene, backwards.scene);
        let scene = forwards.scene;
        assert_eq!((scene.triangles.len(), scene.positions.len()), (2, 4));
        assert_eq!((scene.normals[0], scene.uvs[0][0]), (Vec3::Z, Vec2::new(0.0, 1.0)));
        assert!(forwards.faults.0.is_empty(), "{}", forwards.faults);
    }

    /// Some editors put a mark of the encoding before text; nothing of the first line is lost to it, in models and libraries.
    #[test]
    fn marks_of_the_encoding_are_no_text() {
        let plain = read(&format!("{QUAD}f 1 2 3\n"));
        assert_eq!(read(&format!("\u{feff}{QUAD}f 1 2 3\n")).scene, plain.scene);
        let library = "\u{feff}newmtl red\nKd 1 0 0\n".as_bytes().to_vec();
        let memory = Memory([("red.mtl".to_owned(), library)].into());
        let text = format!("\u{feff}mtllib red.mtl\n{QUAD}usemtl red\nf 1 2 3\n");
        let loaded = load("t.obj", text.as_bytes(), &memory, &LoadOptions::default()).unwrap();
        assert!(loaded.faults.0.is_empty(), "{}", loaded.faults);
        assert_eq!(loaded.scene.material(0).base_color, [1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn groups_times_materials_are_objects() {
        let loaded = read(&format!(
            "mtllib a b.mtl\n{QUAD}o x\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\no y\ng z\nusemtl red\nf 1 2 4\no x\nf 2 3 4\n"
        ));
        let objects: Vec<(&str, &str, usize)> = loaded
            .scene
            .objects
            .iter()
            .map(|o| (o.name.as_str(), loaded.scene.materials[o.material].name.as_str(), o.triangles.len()))
            .collect();
        assert_eq!(objects, [("x", "red", 2), ("x", "no material", 1), ("y z", "red", 1)]);
        assert!(loaded.faults.to_string().contains("t.obj:14: material 'blue' is in no library"), "{}", loaded.faults);
    }

    /// Of a library that is missing all materials are, which is told once.
    #[test]
    fn materials_of_a_missing_library_are_told_together() {
        let loaded = read(&format!("mtllib none.mtl\n{QUAD}usemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\n"));
        let told = loaded.faults.to_string();
        let together =
            "t.obj:11: 2 materials are in no library that could be read: 'red', 'blue'; their faces are grey";
        assert!(told.contains(together) && !told.contains("material 'blue' is in no library"), "{told}");
    }

    #[test]
    fn without_names_objects_have_those_of_their_materials() {
        let loaded = read(&format!("mtllib a b.mtl\n{QUAD}f 1 2 3\nusemtl red\nf 1 3 4\n"));
        let names: Vec<&str> = loaded.scene.objects.iter().map(|object| object.name.as_str()).collect();
        assert_eq!(names, ["object", "red"]);
    }

    #[test]
    fn units_and_vertex_colours_are_kept() {
        let options = LoadOptions { metres_per_unit: 0.001, ..LoadOptions::default() };
        let text = "v 0 0 0 1 0 0\nv 1000 0 0 0 1 0\nv 0 1000 0\nf 1 2 3\n";
        let scene = load("t", text.as_bytes(), &Memory::default(), &options).unwrap().scene;
        assert_eq!(scene.positions[1], DVec3::X);
        assert_eq!(scene.colors, [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [1.0; 4]]);
    }
}
