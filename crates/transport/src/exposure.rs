//! What of each element is exposed, and what is buried: under a box that stands on the floor, inside a wall that
//! another wall runs into.
//!
//! A place is buried when (nearly) all it sees is backs of one-sided surfaces. A solid may touch another one, whose front then lies on its
//! back and counts before it; so do the two surfaces of a wall between rooms. Rays go on through both: in a pile they meet a back in the end,
//! and what else they meet says nothing. Radiosity of an element is meant as the
//! mean over its exposed part, since only that part is ever seen; averaging in the buried part would darken the seams
//! along every contact (the "shadow leaks" of lightmap bakers). A pilot finds elements with places that are buried; those are
//! examined on a grid, more finely along the border of what is buried, which keeps most samples out of the buried part;
//! [`is_buried`] decides the rest.

use radiosity_scene::{Elements, Mesh};
use radiosity_trace::sampling::{Sequence, cosine_direction, frame, hash};
use radiosity_trace::{Found, Place, Ray, Tracer};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::gather::near;
use crate::receivers::Site;
use crate::{Progress, Stopped};

/// Rays of the pilot per cell. A strip of an eighth of a cell may go unnoticed; places in it are then rejected one by
/// one, as their rays meet backs.
const PILOT: u32 = 8;

/// The stream of sample points that exposure uses.
const EXPOSURE: u32 = 0x0e59;

/// Places along a side of an element that are told apart; and those that are examined wherever they lie.
const FINE: u32 = 8;
const COARSE: u32 = 4;
const WIDE: u32 = FINE / COARSE;

/// Rays that examine one place.
const PROBE: u32 = 8;

/// A place is exposed when more than this many of its probe rays meet neither backs nor fronts on backs. One of eight may slip through a gap
/// between solids that touch.
const SLIPS: u32 = 1;

/// And when fewer than this many meet backs: in a room whose walls have two surfaces all else may say nothing, and there are backs of things that were
/// turned by mistake. In a crate in a corner of a room, walls say nothing, and six of ten rays meet backs.
const BACKS: u32 = 3;

/// Contacts that a ray goes through: of that many books in a row. With four, a twentieth of an office's area counts as seen that is not.
const CONTACTS: usize = 16;

/// How closely elements are examined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Care {
    /// As is enough for elements that are only looked up: what a coarse mask leaves is rejected place by place, and nothing is asked
    /// of contacts, which takes fifteen times as long in a furnished office.
    Glance,
    /// The same, but through contacts, where points of the elements are shown.
    Contacts,
    /// All there is.
    Full,
}

impl Care {
    /// Up to which distance fronts are examined for what they lie on, if they are at all.
    fn within(self, distance: f32) -> f32 {
        if self == Care::Glance { 0.0 } else { distance }
    }
}

/// Whether a place is buried in a solid. To be asked where there is reason to think so; exposed places answer after
/// two or three rays. To believe the first one that meets no back makes surfaces in a furnished office 0.1 % darker, as
/// rays slip through where solids touch.
pub fn is_buried(tracer: &Tracer, place: &Place, seed: u32) -> bool {
    is_buried_by(Care::Full, tracer, place, seed)
}

/// The same with more or less care.
fn is_buried_by(care: Care, tracer: &Tracer, place: &Place, seed: u32) -> bool {
    let frame = frame(place.normal);
    let sequence = Sequence::new(seed, 0x0b0b);
    let (mut backs, mut missed) = (0, 0);
    for i in 0..PROBE {
        let [u, v, _, _] = sequence.point(i);
        let direction = cosine_direction(&frame, f64::from(u), f64::from(v));
        match sight(tracer, tracer.ray(place, direction, f64::INFINITY), (care.within(f32::INFINITY), seed ^ i)) {
            Sight::Back => backs += 1,
            Sight::Silent => {}
            Sight::Seen => missed += 1,
        }
        if missed > SLIPS || backs + PROBE - 1 - i < BACKS {
            return false;
        }
    }
    true
}

/// What a ray tells of whether it begins inside a solid.
#[derive(Clone, Copy, PartialEq)]
enum Sight {
    /// A back: it does.
    Back,
    /// Fronts on backs, and then something else.
    Silent,
    /// Something else at once: it does not.
    Seen,
}

/// What a ray meets; fronts are examined for what they lie on if they are nearer than `within`.
fn sight(tracer: &Tracer, mut ray: Ray, (within, seed): (f32, u32)) -> Sight {
    let mut otherwise = Sight::Seen;
    for _ in 0..CONTACTS {
        match tracer.first(&ray, seed) {
            Found::Back => return Sight::Back,
            Found::Surface { triangle, distance, .. } if distance < within || otherwise == Sight::Silent => {
                let Some(beyond) = tracer.beyond_contact(&ray, triangle, distance) else { break };
                (ray, otherwise) = (beyond, Sight::Silent);
            }
            _ => break,
        }
    }
    otherwise
}

/// For each element, the exposed places among 8 × 8; whole elements need no entry.
#[derive(Clone, Debug, Default)]
pub struct Exposure {
    masks: FxHashMap<u32, u64>,
    /// Number of elements that are buried entirely.
    pub buried: usize,
    /// Number of elements that are buried in part.
    pub partial: usize,
    /// How closely they were examined, if at all.
    care: Option<Care>,
}

impl Exposure {
    /// Examines all elements.
    ///
    /// # Errors
    /// [`Stopped`] if `progress` says so.
    pub fn new(
        tracer: &Tracer,
        mesh: &Mesh,
        elements: &Elements,
        progress: &dyn Progress,
    ) -> Result<Exposure, Stopped> {
        Exposure::with_care(Care::Full, tracer, (mesh, elements), progress)
    }

    /// The same with more or less care.
    ///
    /// # Errors
    /// [`Stopped`] if `progress` says so.
    pub fn with_care(
        care: Care,
        tracer: &Tracer,
        (mesh, elements): (&Mesh, &Elements),
        progress: &dyn Progress,
    ) -> Result<Exposure, Stopped> {
        const CHUNK: usize = 1024;
        let done = std::sync::atomic::AtomicUsize::new(0);
        let n = elements.cells();
        let chunks: Vec<Vec<(u32, u64)>> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(n);
                let masks: Vec<_> =
                    range.clone().flat_map(|cell| examine_cell(tracer, (mesh, elements), care, cell)).collect();
                let so_far = done.fetch_add(range.len(), std::sync::atomic::Ordering::Relaxed) + range.len();
                progress.step(so_far, n).then_some(masks).ok_or(Stopped)
            })
            .collect::<Result<_, _>>()?;
        let masks: FxHashMap<u32, u64> = chunks.into_iter().flatten().collect();
        let buried = masks.values().filter(|m| **m == 0).count();
        Ok(Exposure { buried, partial: masks.len() - buried, masks, care: Some(care) })
    }

    /// Whether some of an element may be buried, of which places are to be asked one by one: those of all elements where contacts were
    /// not looked at.
    pub fn is_partial(&self, element: u32) -> bool {
        self.care.is_none_or(|care| care == Care::Glance) || self.masks.contains_key(&element)
    }

    /// Share of an element's area that is exposed.
    pub fn share(&self, element: u32) -> f64 {
        self.masks.get(&element).map_or(1.0, |mask| f64::from(mask.count_ones()) / 64.0)
    }

    /// Whether nothing of an element is exposed.
    pub fn is_buried(&self, element: u32) -> bool {
        self.masks.get(&element) == Some(&0)
    }

    /// The exposed places among the 8 × 8 of an element, one bit each.
    pub fn mask(&self, element: u32) -> u64 {
        self.masks.get(&element).copied().unwrap_or(u64::MAX)
    }
}

/// Moves a point of the unit square into the exposed places of a mask that has any.
#[inline]
pub fn open_place(mask: u64, x: f32, y: f32) -> (f64, f64) {
    if mask == u64::MAX {
        return (f64::from(x), f64::from(y));
    }
    // x picks one of the exposed cells and, stretched, the place within it.
    let open = mask.count_ones();
    let scaled = f64::from(x) * f64::from(open);
    let pick = (scaled as u32).min(open - 1);
    let cell = nth_bit(mask, pick);
    let within = (scaled - f64::from(pick)).clamp(0.0, 1.0);
    (f64::from(cell % 8) / 8.0 + within / 8.0, f64::from(cell / 8) / 8.0 + f64::from(y) / 8.0)
}

/// Number of the n-th set bit.
fn nth_bit(mut mask: u64, n: u32) -> u32 {
    for _ in 0..n {
        mask &= mask - 1;
    }
    mask.trailing_zeros()
}

/// Which of a few rays from all over a site meet backs, one bit each, or fronts on backs nearby.
fn backs(tracer: &Tracer, site: &Site, (sequence, care): (&Sequence, Care)) -> u32 {
    let (frame, within) = (frame(site.normal), care.within(near(site.area()) as f32));
    (0..PILOT).fold(0, |backs, i| {
        let [u, v, x, y] = sequence.point(i);
        let direction = cosine_direction(&frame, f64::from(u), f64::from(v));
        let ray = tracer.ray(&site.place(x, y), direction, f64::INFINITY);
        backs | u32::from(sight(tracer, ray, (within, i)) != Sight::Seen) << i
    })
}

/// Whether a site may be buried in part: whether any of the places is buried from which rays met backs, or contacts nearby. Others see
/// backs from afar only, and are not examined for that.
fn is_suspect(tracer: &Tracer, site: &Site, (sequence, care): (&Sequence, Care), element: u32, backs: u32) -> bool {
    (0..PILOT).filter(|i| backs >> i & 1 == 1).any(|i| {
        let [_, _, x, y] = sequence.point(i);
        is_buried_by(care, tracer, &site.place(x, y), hash(element ^ i << 24))
    })
}

/// The mask of a suspect element.
fn examine(tracer: &Tracer, site: &Site, sequence: &Sequence, element: u32, care: Care, backs: u32) -> u64 {
    // The first places are those of the coarse grid, the next ones those of the fine one.
    let is_open = |(column, row): (u32, u32), grid: u32, number: u32| {
        let [dx, dy, _, _] = sequence.point(PILOT + number);
        let place = site.place((column as f32 + dx) / grid as f32, (row as f32 + dy) / grid as f32);
        !is_buried_by(care, tracer, &place, element ^ number << 24)
    };
    let fine = |column: u32, row: u32| is_open((column, row), FINE, COARSE * COARSE + FINE * row + column);

    // What is buried as far as its corners, and wherever the pilot was, is so all over.
    let ends = [0, FINE - 1];
    if backs == (1 << PILOT) - 1 && ends.iter().all(|row| ends.iter().all(|column| !fine(*column, *row))) {
        return 0;
    }

    let coarse = (0..COARSE * COARSE).fold(0u32, |coarse, number| {
        coarse | u32::from(is_open((number % COARSE, number / COARSE), COARSE, number)) << number
    });
    let is_coarse_open = |column: u32, row: u32| coarse >> (COARSE * row + column) & 1 == 1;
    // A foot smaller than a block may lie where the pilot met backs.
    let suspects = (0..PILOT).filter(|i| backs >> i & 1 == 1).fold(0u32, |blocks, i| {
        let [_, _, x, y] = sequence.point(i);
        let [column, row] = [x, y].map(|x| ((x * COARSE as f32) as u32).min(COARSE - 1));
        blocks | 1 << (COARSE * row + column)
    });
    let is_at_border = |column: u32, row: u32| {
        if suspects >> (COARSE * row + column) & 1 == 1 {
            return true;
        }
        let around = |at: u32| at.saturating_sub(1)..(at + 2).min(COARSE);
        let own = is_coarse_open(column, row);
        around(row).any(|row| around(column).any(|column| is_coarse_open(column, row) != own))
    };
    (0..FINE * FINE).fold(0, |mask, number| {
        let (column, row) = (number % FINE, number / FINE);
        let block = (column / WIDE, row / WIDE);
        let is_open = match care == Care::Full && is_at_border(block.0, block.1) {
            true => fine(column, row),
            false => is_coarse_open(block.0, block.1),
        };
        mask | u64::from(is_open) << number
    })
}

/// Cells with a smaller share of the rays are not examined: places in them are rejected one by one.
const LEAST_SHARE: f64 = 0.125;

/// The masks of the elements of a cell that are not wholly exposed.
fn examine_cell(tracer: &Tracer, (mesh, elements): (&Mesh, &Elements), care: Care, cell: usize) -> Vec<(u32, u64)> {
    let ids = elements.of_cell(cell);
    if elements.share(mesh, ids.start) * (ids.len() as f64) < LEAST_SHARE {
        return Vec::new();
    }
    let whole = Site::new(mesh, elements, ids.start, elements.cell_corners(cell), u64::MAX);
    let sequence = Sequence::new(ids.start, EXPOSURE);
    let met = backs(tracer, &whole, (&sequence, care));
    if !is_suspect(tracer, &whole, (&sequence, care), ids.start, met) {
        return Vec::new();
    }
    let divided = ids.len() > 1;
    ids.filter_map(|element| {
        let site = Site::new(mesh, elements, element, elements.corners(element), u64::MAX);
        let sequence = Sequence::new(element, EXPOSURE);
        let met = if divided { backs(tracer, &site, (&sequence, care)) } else { met };
        if divided && !is_suspect(tracer, &site, (&sequence, care), element, met) {
            return None;
        }
        let mask = examine(tracer, &site, &sequence, element, care, met);
        (mask != u64::MAX).then_some((element, mask))
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use radiosity_scene::{Material, Scene};

    /// A floor of a square metre in two elements, and boxes that stand on it without a bottom, each from one corner to another: what of it is exposed.
    fn exposed(boxes: &[[f64; 4]]) -> f64 {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        let p = DVec3::new;
        scene.add_quad("floor", 0, [p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.)]);
        for &[x, y, u, v] in boxes {
            // A little into the floor: nothing is cut along it.
            let (low, high) = (-1e-4, 0.5);
            let corner = |x: f64, y: f64| [p(x, y, low), p(x, y, high)];
            let around = [corner(x, y), corner(u, y), corner(u, v), corner(x, v)];
            for k in 0..4 {
                let ([a, d], [b, c]) = (around[k], around[(k + 1) % 4]);
                scene.add_quad("side", 0, [a, b, c, d]);
            }
            scene.add_quad("top", 0, around.map(|[_, top]| top));
        }
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let elements = Elements::new(&scene, &mesh, 1.5);
        let exposure = Exposure::new(&tracer, &mesh, &elements, &()).unwrap();
        let is_floor = |e: &u32| scene.triangle_object[mesh.source[elements.place(*e).0] as usize] == 0;
        let floor: Vec<u32> = (0..elements.len() as u32).filter(is_floor).collect();
        let area = |e: u32| elements.area(&mesh, e);
        floor.iter().map(|e| area(*e) * exposure.share(*e)).sum::<f64>() / floor.iter().map(|e| area(*e)).sum::<f64>()
    }

    /// Half of a floor under a box, a gap of an eighth between two boxes, a foot, nothing, everything.
    #[test]
    fn what_boxes_cover_is_buried() {
        let gap = [[-0.1, -0.1, 0.44, 1.1], [0.56, -0.1, 1.1, 1.1]];
        let cases: [(&[[f64; 4]], f64, f64); 5] = [
            (&[[-0.1, -0.1, 0.5, 1.1]], 0.5, 0.06),
            (&gap, 0.12, 0.06),
            (&[[0.3, 0.2, 0.6, 0.5]], 0.91, 0.05),
            (&[], 1.0, 0.0),
            (&[[-0.1, -0.1, 1.1, 1.1]], 0.0, 0.0),
        ];
        for (boxes, share, tolerance) in cases {
            let found = exposed(boxes);
            assert!((found - share).abs() <= tolerance, "{boxes:?}: {found} for {share}");
        }
    }

    /// A closed box from one corner to another; turned inside out, a room.
    fn add_box(scene: &mut Scene, name: &str, [low, high]: [[f64; 3]; 2], is_room: bool) {
        let at = |corner: usize| DVec3::from_array(std::array::from_fn(|k| [low, high][corner >> k & 1][k]));
        for mut face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            if is_room {
                face.reverse();
            }
            scene.add_quad(name, 0, face.map(at));
        }
    }

    /// The exposed share of the area of an object that faces along a direction, examined with so much care.
    fn shares(scene: &Scene, care: Care) -> impl Fn(&str, DVec3) -> f64 {
        let mesh = Mesh::new(scene);
        let tracer = Tracer::new(scene, &mesh);
        let elements = Elements::new(scene, &mesh, 0.3);
        let exposure = Exposure::with_care(care, &tracer, (&mesh, &elements), &()).unwrap();
        let of = |e: u32| {
            let object = scene.triangle_object[mesh.source[elements.place(e).0] as usize] as usize;
            let area = elements.area(&mesh, e);
            (scene.objects[object].name.clone(), elements.normal(&mesh, e), area, area * exposure.share(e))
        };
        let all: Vec<_> = (0..elements.len() as u32).map(of).collect();
        move |name: &str, along: DVec3| {
            let own = all.iter().filter(|(of, normal, ..)| of == name && normal.dot(along) > 0.9);
            let [whole, open] = own.fold([0.0; 2], |sum, (.., whole, open)| [sum[0] + whole, sum[1] + open]);
            open / whole
        }
    }

    /// Where contacts were not looked at, every place is to be asked: texels beneath a pile were taken for seen, and black.
    #[test]
    fn who_did_not_look_at_contacts_has_all_places_asked() {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        add_box(&mut scene, "alone", [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]], false);
        let mesh = Mesh::new(&scene);
        let (tracer, elements) = (Tracer::new(&scene, &mesh), Elements::new(&scene, &mesh, 0.5));
        let partial = |exposure: &Exposure| (0..elements.len() as u32).filter(|e| exposure.is_partial(*e)).count();
        assert_eq!(partial(&Exposure::default()), elements.len());
        for (care, expected) in [(Care::Glance, elements.len()), (Care::Contacts, 0), (Care::Full, 0)] {
            let exposure = Exposure::with_care(care, &tracer, (&mesh, &elements), &()).unwrap();
            assert_eq!(partial(&exposure), expected, "{care:?}");
        }
    }

    /// Solids that touch each other show the places inside them each other's fronts, which say nothing.
    #[test]
    fn what_lies_inside_a_pile_or_a_row_is_buried() {
        // They touch, or sink into each other a little.
        [0.0, 2e-4].into_iter().for_each(are_piles_buried);
    }

    fn are_piles_buried(sunk: f64) {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        add_box(&mut scene, "floor", [[-1.5, -1.5, -0.2], [1.5, 1.5, 0.0]], false);
        for k in 0..4 {
            let (low, high) = (0.04 * f64::from(k) - sunk, 0.04 * f64::from(k + 1));
            add_box(&mut scene, &format!("lying {k}"), [[-0.5, -0.5, low], [-0.2, -0.2, high]], false);
            add_box(&mut scene, &format!("standing {k}"), [[low, 0.0, 0.0], [high, 0.2, 0.28]], false);
        }
        for care in [Care::Full, Care::Contacts] {
            let share = shares(&scene, care);
            for k in 0..4 {
                let (lying, standing) = (format!("lying {k}"), format!("standing {k}"));
                let faces = [
                    (&lying, DVec3::Z, k == 3),
                    (&lying, -DVec3::Z, false),
                    (&lying, DVec3::X, true),
                    (&standing, DVec3::X, k == 3),
                    (&standing, -DVec3::X, k == 0),
                    (&standing, DVec3::Z, true),
                    (&standing, -DVec3::Z, false),
                    (&standing, DVec3::Y, true),
                ];
                for (name, along, is_open) in faces {
                    let found = share(name, along);
                    assert!((found - f64::from(u8::from(is_open))).abs() < 0.01, "{name} {along} {care:?}: {found}");
                }
            }
            let floor = share("floor", DVec3::Z);
            assert!((floor - (1.0 - (0.09 + 0.032) / 9.0)).abs() < 0.004, "{floor}, {care:?}");
            assert_eq!([share("floor", -DVec3::Z), share("floor", DVec3::X)], [1.0; 2]);
        }
    }

    /// Walls with a surface for either side are no solids, whatever else stands there.
    #[test]
    fn rooms_back_to_back_are_not_buried() {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        for k in 0..3 {
            let x = 3.0 * f64::from(k);
            add_box(&mut scene, &format!("room {k}"), [[x, 0.0, 0.0], [x + 3.0, 3.0, 3.0]], true);
            add_box(&mut scene, "hull", [[x, 0.0, 0.0], [x + 3.0, 3.0, 3.0]], false);
        }
        // In a corner; alone; a foot, a little in the floor, and a screen of half a millimetre; a panel that faces the wall.
        add_box(&mut scene, "crate", [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]], false);
        add_box(&mut scene, "crate", [[4.0, 1.0, 0.0], [5.0, 2.0, 1.0]], false);
        add_box(&mut scene, "foot", [[7.0, 1.0, -1e-4], [7.1, 1.1, 0.03]], false);
        add_box(&mut scene, "screen", [[6.5, 1.0, 0.5], [6.5005, 2.0, 1.5]], false);
        scene.add_quad("panel", 0, [[8.9, 1., 1.], [8.9, 2., 1.], [8.9, 2., 2.], [8.9, 1., 2.]].map(DVec3::from));
        for care in [Care::Full, Care::Contacts] {
            let share = shares(&scene, care);
            let [x, y, z] = DVec3::AXES;
            for (name, along, expected) in [
                ("room 0", z, 8.0 / 9.0),
                ("room 0", x, 8.0 / 9.0),
                ("room 0", y, 8.0 / 9.0),
                ("room 0", -z, 1.0),
                ("room 1", z, 8.0 / 9.0),
                ("room 1", x, 1.0),
                ("room 2", z, 1.0),
                ("room 2", x, 1.0),
                ("room 2", -x, 1.0),
                ("room 2", y, 1.0),
                ("crate", z, 1.0),
                ("foot", z, 1.0),
                ("screen", x, 1.0),
                ("screen", -x, 1.0),
                ("panel", x, 1.0),
            ] {
                let found = share(name, along);
                assert!((found - expected).abs() < 0.03, "{name} {along} {care:?}: {found} for {expected}");
            }
            assert_eq!([share("room 2", x), share("room 2", y), share("room 2", -x)], [1.0; 3]);
            assert!(share("room 2", z) > 0.99);
        }
    }
}
