//! From parts as files carry them to a [`Scene`] that keeps its promises: finite, bounded, no empty or doubled faces.
//!
//! Faces that cannot reflect are dropped and counted in a warning per part. Of identical faces only the first stays,
//! since two would answer the same light twice. A one-sided face and its reversed twin are a wall without thickness:
//! both stay. Where a twin is double-sided it covers both sides by itself, and the one-sided one goes.

use crate::options::LoadOptions;
use glam::{DVec3, Vec2, Vec3};
use radiosity_scene::{Faults, Object, Scene, Source, counted};
use rustc_hash::FxHashMap;

/// Largest coordinate, metres. Areas are kept in single precision, which ends at 3.4e38; products of two areas of
/// (1e7 m)² stay below it by a factor of 1e10. It is also the diameter of the Earth: a scene beyond it has the wrong unit.
const MAX_COORDINATE: f64 = 1e7;

/// One primitive, placed in the world.
#[derive(Default)]
pub(crate) struct Part {
    pub name: String,
    pub material: usize,
    pub source: Source,
    pub positions: Vec<DVec3>,
    /// Unit or zero; empty or one per position.
    pub normals: Vec<Vec3>,
    /// Empty or one per position.
    pub uvs: [Vec<Vec2>; 2],
    /// Empty or one per position.
    pub colors: Vec<[f32; 4]>,
    /// As the file has them, not yet checked.
    pub triangles: Vec<[u32; 3]>,
}

/// A scene in the making.
pub(crate) struct Assembly<'a> {
    pub scene: Scene,
    options: &'a LoadOptions,
    /// Parts, vertices and triangles asked for so far, those that were dropped included: work is bounded with memory.
    asked: [usize; 3],
    /// Set once the scene grew beyond the options' limit; further parts are ignored.
    full: bool,
}

impl<'a> Assembly<'a> {
    pub fn new(options: &'a LoadOptions) -> Assembly<'a> {
        Assembly { scene: Scene::default(), options, asked: [0; 3], full: false }
    }

    /// Counts `parts` of `vertices` and `triangles` each that are about to be read and says whether they still fit;
    /// reports once where not. Ask before taking memory for them.
    pub fn has_room(
        &mut self,
        place: &str,
        parts: usize,
        [vertices, triangles]: [usize; 2],
        faults: &mut Faults,
    ) -> bool {
        let limit = self.options.max_triangles;
        let more = [parts, parts.saturating_mul(vertices), parts.saturating_mul(triangles)];
        for (sum, more) in self.asked.iter_mut().zip(more) {
            *sum = sum.saturating_add(more);
        }
        // A part costs as much memory as some eight triangles. Every triangle has three corners, so more vertices
        // than three each are never all used.
        let most = [limit / 8, limit.saturating_mul(3).min(u32::MAX as usize), limit];
        if !self.full && self.asked.iter().zip(most).any(|(asked, most)| *asked > most.max(1)) {
            self.full = true;
            let what = format!("the scene is larger than {limit} triangles once its instances are placed");
            faults.error(place, what, "split it, or raise the limit if the memory is there");
        }
        !self.full
    }

    /// Adds a part that [`Assembly::has_room`] was asked for; `place` names it in messages. Nothing is added where no
    /// triangle is left.
    pub fn add(&mut self, place: &str, mut part: Part, faults: &mut Faults) {
        let scene = &mut self.scene;
        let count = part.positions.len();
        let (first_vertex, first_triangle, object) =
            (scene.positions.len(), scene.triangles.len(), scene.objects.len());

        // Keep the triangles that have an area.
        let (mut bad_index, mut not_finite, mut flat) = (0_usize, 0_usize, 0_usize);
        let mut largest = 0.0_f64;
        let mut used = vec![false; count];
        for (source, triangle) in part.triangles.iter().enumerate() {
            let [Some(a), Some(b), Some(c)] = triangle.map(|i| part.positions.get(i as usize).copied()) else {
                bad_index += 1;
                continue;
            };
            if ![a, b, c].iter().all(|p| p.is_finite()) {
                not_finite += 1;
                continue;
            }
            largest = [a, b, c].iter().fold(largest, |m, p| m.max(p.abs().max_element()));
            if is_flat(a, b, c) {
                flat += 1;
                continue;
            }
            for &corner in triangle {
                used[corner as usize] = true;
            }
            scene.triangles.push(triangle.map(|i| i + first_vertex as u32));
            scene.triangle_object.push(object as u32);
            scene.triangle_source.push(source as u32);
        }
        let place = format!("{place}: object '{}'", part.name);
        for (number, [one, many], what, hint) in [
            (bad_index, ["names", "name"], "vertices that do not exist", "export the model again"),
            (not_finite, ["has", "have"], "corners that are not finite", "export the model again"),
            (flat, ["has", "have"], "no area", "remove them in the modeller"),
        ] {
            if number > 0 {
                let of = counted(part.triangles.len(), "triangle", "triangles");
                let what = format!("{number} of {of} {} {what}; dropped", if number == 1 { one } else { many });
                faults.warning(&place, what, hint);
            }
        }
        if largest > MAX_COORDINATE {
            let what = format!("a coordinate of {largest:e} m; at most {MAX_COORDINATE:e} m can be computed with");
            faults.error(&place, what, "check the unit of length");
        }
        if scene.triangles.len() == first_triangle {
            return;
        }

        // Vertices that no triangle is left of keep their number but must not set bounds, and with them the distance
        // within which vertices are welded: they move onto a used one.
        let anchor = used.iter().zip(&part.positions).find(|(used, _)| **used).map_or(DVec3::ZERO, |(_, p)| *p);
        for (position, _) in part.positions.iter_mut().zip(&used).filter(|(_, used)| !**used) {
            *position = anchor;
        }
        scene.positions.append(&mut part.positions);
        part.normals.resize(count, Vec3::ZERO);
        scene.normals.extend(part.normals.iter().map(|n| if n.is_finite() { *n } else { Vec3::ZERO }));
        for (all, own) in scene.uvs.iter_mut().zip(&part.uvs) {
            if !own.is_empty() || !all.is_empty() {
                all.resize(first_vertex, Vec2::ZERO);
                all.extend(own.iter().map(|uv| if uv.is_finite() { *uv } else { Vec2::ZERO }));
                all.resize(first_vertex + count, Vec2::ZERO);
            }
        }
        if !part.colors.is_empty() || !scene.colors.is_empty() {
            scene.colors.resize(first_vertex, [1.0; 4]);
            scene.colors.extend(
                part.colors.iter().map(|color| color.map(|c| if c.is_finite() { c.clamp(0.0, 1.0) } else { 1.0 })),
            );
            scene.colors.resize(first_vertex + count, [1.0; 4]);
        }
        scene.objects.push(Object {
            name: part.name,
            material: part.material,
            triangles: first_triangle..scene.triangles.len(),
            vertices: first_vertex..first_vertex + count,
            source: part.source,
        });
    }

    /// Drops doubled faces, checks the whole and hands it over.
    pub fn finish(mut self, file: &str, faults: &mut Faults) -> Scene {
        drop_doubled_faces(&mut self.scene, file, faults);
        if self.scene.triangles.is_empty() && !faults.has_errors() {
            faults.error(file, "no triangle with an area", "a scene needs at least one surface");
        }
        self.scene
    }
}

/// Whether a triangle has no area that arithmetic could rely on.
fn is_flat(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let twice_area = (b - a).cross(c - a).length();
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared()).sqrt();
    // Height above the longest side, against the rounding of the coordinates themselves (collinear points that were
    // rotated end up some 1e-16 apart); and areas are kept in single precision, where they must not vanish.
    let rounding = 4.0 * f64::EPSILON * [a, b, c].iter().fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
    twice_area <= rounding * longest || 0.5 * twice_area < f64::from(f32::MIN_POSITIVE) || twice_area.is_nan()
}

/// What was found of one set of three corners: the first face of each orientation.
type Twins = [Option<u32>; 2];

fn drop_doubled_faces(scene: &mut Scene, file: &str, faults: &mut Faults) {
    // Number the corners by position; −0 and +0 are the same place.
    let mut numbers: FxHashMap<[u64; 3], u32> = FxHashMap::default();
    numbers.reserve(scene.positions.len().min(3 * scene.triangles.len()));
    let mut number = |vertex: u32| {
        let key = scene.positions[vertex as usize].to_array().map(|x| (x + 0.0).to_bits());
        let next = numbers.len() as u32;
        *numbers.entry(key).or_insert(next)
    };

    let mut faces: FxHashMap<[u32; 3], Twins> = FxHashMap::default();
    faces.reserve(scene.triangles.len());
    let mut dropped = vec![false; scene.triangles.len()];
    let mut doubled: Vec<usize> = vec![0; scene.objects.len()];
    let (mut thin_walls, mut any) = (0_usize, false);
    for (triangle, corners) in scene.triangles.iter().enumerate() {
        let [a, b, c] = corners.map(&mut number);
        // Begin with the smallest; what follows then tells the orientation.
        let [a, b, c] = if a < b && a < c {
            [a, b, c]
        } else if b < c {
            [b, c, a]
        } else {
            [c, a, b]
        };
        let (key, side) = if b < c { ([a, b, c], 0) } else { ([a, c, b], 1) };
        let twins = faces.entry(key).or_default();

        let double_sided = |t: usize| scene.material(t).has_two_sides();
        let mut drop = |t: usize| {
            dropped[t] = true;
            doubled[scene.triangle_object[t] as usize] += 1;
            any = true;
        };
        if let Some(same) = twins[side] {
            if !double_sided(triangle) || double_sided(same as usize) {
                drop(triangle);
                continue;
            }
            // The later one also covers the back: it replaces the first.
            drop(same as usize);
            twins[side] = None;
        }
        match twins[1 - side] {
            Some(twin) if double_sided(twin as usize) => {
                drop(triangle);
                continue;
            }
            Some(twin) if double_sided(triangle) => {
                drop(twin as usize);
                twins[1 - side] = None;
            }
            Some(_) => thin_walls += 1,
            None => {}
        }
        twins[side] = Some(triangle as u32);
    }
    if thin_walls > 0 {
        let faces = counted(thin_walls, "face has", "faces have");
        let what = format!("{faces} a reversed twin on the same three points; both are kept");
        faults.note(file, what, "fine where a wall without thickness is meant");
    }
    if !any {
        return;
    }
    for (object, &count) in scene.objects.iter().zip(&doubled) {
        if count > 0 {
            faults.warning(
                format!("{file}: object '{}'", object.name),
                format!(
                    "{count} of {} {} exactly on another; dropped",
                    counted(object.triangles.len(), "triangle", "triangles"),
                    if count == 1 { "lies" } else { "lie" }
                ),
                "remove the doubled faces in the modeller",
            );
        }
    }

    // Close the gaps; objects that lost all triangles go too, their vertices stay as the unused ones that they are.
    let mut kept = 0;
    let mut new_index = vec![0_u32; scene.objects.len()];
    let mut objects = Vec::with_capacity(scene.objects.len());
    for (old, mut object) in std::mem::take(&mut scene.objects).into_iter().enumerate() {
        let first = kept;
        for triangle in object.triangles.clone().filter(|&t| !dropped[t]) {
            scene.triangles[kept] = scene.triangles[triangle];
            scene.triangle_source[kept] = scene.triangle_source[triangle];
            kept += 1;
        }
        object.triangles = first..kept;
        new_index[old] = objects.len() as u32;
        if first < kept {
            objects.push(object);
        }
    }
    scene.triangles.truncate(kept);
    scene.triangle_source.truncate(kept);
    scene.triangle_object = objects
        .iter()
        .enumerate()
        .flat_map(|(index, object): (usize, &Object)| object.triangles.clone().map(move |_| index as u32))
        .collect();
    scene.objects = objects;
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::{Material, Severity};

    fn part(name: &str, material: usize, positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Part {
        Part {
            name: name.to_owned(),
            material,
            positions: positions.iter().map(|&p| p.into()).collect(),
            triangles: triangles.to_vec(),
            ..Part::default()
        }
    }

    fn assemble(parts: Vec<Part>) -> (Scene, Faults) {
        let (options, mut faults) = (LoadOptions::default(), Faults::default());
        let mut assembly = Assembly::new(&options);
        assembly.scene.materials = vec![Material::default(), Material { double_sided: true, ..Material::default() }];
        for part in parts {
            assembly.add("t", part, &mut faults);
        }
        (assembly.finish("t", &mut faults), faults)
    }

    const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f64::NAN, 0.0, 0.0]];

    #[test]
    fn bad_triangles_are_dropped_and_counted_by_cause() {
        let (scene, faults) =
            assemble(vec![part("a", 0, &CORNERS, &[[0, 1, 9], [0, 1, 2], [0, 1, 1], [0, 1, 3], [7, 8, 9]])]);
        assert_eq!(scene.triangles, [[0, 1, 2]]);
        assert_eq!(scene.triangle_source, [1]);
        assert_eq!(scene.positions.len(), 4);
        assert!(scene.positions.iter().all(|p| p.is_finite()));
        let text = faults.to_string();
        for expected in ["2 of 5 triangles name", "1 of 5 triangles has corners", "1 of 5 triangles has no area"] {
            assert!(text.contains(expected), "{text}");
        }
    }

    /// One stray vertex a thousand kilometres away made the welding distance a metre.
    #[test]
    fn vertices_without_a_face_do_not_set_the_bounds() {
        let far = [[1e6, 0.0, 0.0], [2e6, 0.0, 0.0], [3e6, 0.0, 0.0]];
        let corners: Vec<[f64; 3]> = far[..1].iter().chain(&CORNERS[..3]).chain(&far).copied().collect();
        // The second triangle has no area.
        let (scene, faults) = assemble(vec![part("a", 0, &corners, &[[1, 2, 3], [4, 5, 6]])]);
        assert_eq!(scene.triangles, [[1, 2, 3]]);
        assert_eq!(scene.positions.len(), 7);
        assert_eq!(scene.bounding_box(), Some([DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)]), "{faults}");
    }

    #[test]
    fn of_doubled_faces_the_first_stays_and_walls_without_thickness_stay() {
        let faces = [[0, 1, 2], [1, 2, 0], [2, 1, 0]];
        let (scene, faults) = assemble(vec![part("a", 0, &CORNERS[..3], &faces)]);
        assert_eq!(scene.triangles, [[0, 1, 2], [2, 1, 0]]);
        assert_eq!(scene.triangle_source, [0, 2]);
        let severities: Vec<_> = faults.0.iter().map(|fault| fault.severity).collect();
        assert_eq!(severities, [Severity::Note, Severity::Warning], "{faults}");
    }

    #[test]
    fn a_double_sided_twin_stands_for_both_sides() {
        let a = || part("a", 0, &CORNERS[..3], &[[0, 1, 2]]);
        let b = || part("b", 1, &CORNERS[..3], &[[2, 1, 0]]);
        for parts in [vec![a(), b()], vec![b(), a()]] {
            let (scene, _) = assemble(parts);
            assert_eq!(scene.objects.len(), 1);
            assert_eq!(scene.objects[0].name, "b");
            assert_eq!(scene.triangles.len(), 1);
            assert_eq!(scene.triangle_object, [0]);
        }
    }

    #[test]
    fn a_part_without_colours_beside_one_with_them_is_white() {
        let mut second = part("b", 0, &[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]], &[[0, 1, 2]]);
        second.colors = vec![[0.5; 4]; 3];
        second.uvs[1] = vec![Vec2::ONE; 3];
        let third = part("c", 0, &[[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]], &[[0, 1, 2]]);
        let (scene, _) = assemble(vec![part("a", 0, &CORNERS[..3], &[[0, 1, 2]]), second, third]);
        assert_eq!([scene.colors[0], scene.colors[3], scene.colors[6]], [[1.0; 4], [0.5; 4], [1.0; 4]]);
        assert_eq!((scene.colors.len(), scene.uvs[0].len(), scene.uvs[1].len()), (9, 0, 9));
        assert_eq!([scene.uvs[1][0], scene.uvs[1][3]], [Vec2::ZERO, Vec2::ONE]);
    }

    #[test]
    fn collinear_points_have_no_area_after_a_rotation_either() {
        let turn = glam::DQuat::from_rotation_x(0.3) * glam::DQuat::from_rotation_z(1.1);
        let corners = [0.0, 0.1, 0.7].map(|x| (turn * DVec3::new(x, 0.2, 5.0)).to_array());
        let (scene, faults) = assemble(vec![part("a", 0, &corners, &[[0, 1, 2]])]);
        assert!(scene.triangles.is_empty() && faults.has_errors());
    }

    #[test]
    fn a_coordinate_beyond_the_earth_is_an_error() {
        let (_, faults) = assemble(vec![part("a", 0, &[[0.0; 3], [1e8, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]])]);
        assert!(faults.has_errors() && faults.to_string().contains("1e8 m"), "{faults}");
    }
}
