//! How much of the light that reaches an eye was on each surface: importance, by walks backwards along the light's ways (Smits, Arvo and
//! Salesin 1992, "An importance-driven radiosity algorithm", §3).
//!
//! Seen from within a flat on a site of four hundred metres nearly all of it is in the flat, on a thousandth of the area, and cells that
//! share the area evenly are wider than its rooms. Within one room all is about as important as it is large.

use crate::sampling::{Random, cosine_direction, frame};
use crate::{Found, Place, Tracer};
use glam::{DVec2, DVec3, Vec2};
use radiosity_scene::{Mesh, Side};
use rayon::prelude::*;

/// Walks from all eyes together, and the surfaces that each visits: enough to come to the room beside.
const WALKS: usize = 8192;
const VISITED: usize = 8;

/// The streams of numbers that they use.
const PATHS: u64 = 0x50bb << 32;

/// Visits by which importance is known. Triangles with fewer, and those of one wall, share those of their neighbours in the list.
const KNOWN: f64 = 32.0;

/// So many times as important for its area as the scene is on average a surface is in any room, where an eye is near it.
const USUAL: f64 = 4.0;

/// Cosine beyond which two triangles are parts of one wall.
const FLAT: f64 = 0.9999;

/// Standard errors by which visits of a piece of a wall may differ from what those of the rest tell, and the part of them, as a wall is
/// more important beside a window: else it is of another room.
const CHANCE: f64 = 3.0;
const UNLIKE: f64 = 0.75;

/// The narrowest scale.
const LEAST: f64 = 1.0 / 256.0;

/// For each triangle how wide its cells are to be, relative to those of most of the scene: such that their number is a quarter of what its
/// importance is of all cells, where that is more than its area tells. Empty where it is nowhere.
pub(crate) fn scales(tracer: &Tracer, eyes: &[DVec3]) -> Vec<f32> {
    let mesh = tracer.mesh;
    let eye = |walk: usize| eyes.get(walk * eyes.len() / WALKS).copied();
    let visited: Vec<u32> = (0..WALKS)
        .into_par_iter()
        .filter_map(|walk| eye(walk).map(|eye| visited(tracer, eye, walk as u64)))
        .flatten_iter()
        .collect();
    if visited.is_empty() {
        return Vec::new();
    }
    let mut visits = vec![0.0; mesh.triangles.len()];
    visited.iter().for_each(|&triangle| visits[triangle as usize] += 1.0);
    narrowed(mesh, &visits, &[])
}

/// For each triangle how wide its cells are to be where `visits`, all of chance, tell how important it is and cells are of other `scales` already: such that their
/// number is a quarter of what its importance is of all, where that is more than the number that it has. Empty where all are as wide.
pub fn narrowed(mesh: &Mesh, visits: &[f64], scales: &[f32]) -> Vec<f32> {
    let before = |t: usize| scales.get(t).map_or(1.0, |scale| f64::from(*scale));
    let cells = |t: usize| mesh.area(t) / before(t).powi(2);
    let per_area = visits.iter().sum::<f64>() / (0..visits.len()).map(cells).sum::<f64>();
    let mut narrower: Vec<f64> = Vec::with_capacity(visits.len());
    let (mut area, mut count) = (0.0, 0.0);
    for (t, own) in visits.iter().enumerate() {
        area += cells(t);
        count += own;
        // Cells of one wall are as wide on all its pieces, or light would break where they meet.
        let is_large = |t: usize| per_area * cells(t) >= KNOWN;
        let is_alike = |next: usize| {
            let (expected, found) = (count / area * cells(next), visits[next]);
            let most = found.max(expected);
            (found - expected).abs() <= (CHANCE * most.sqrt()).max(UNLIKE * most)
        };
        let goes_on = t + 1 < visits.len() && !is_large(t) && !is_large(t + 1) && is_flat(mesh, t) && is_alike(t + 1);
        if (count >= KNOWN || per_area * area >= KNOWN) && !goes_on {
            let usual = USUAL * per_area * area / count.max(1.0);
            narrower.resize(t + 1, usual.sqrt().min(1.0));
            (area, count) = (0.0, 0.0);
        }
    }
    // Too few at the end to be known share with those before.
    let last = narrower.last().copied().unwrap_or(1.0);
    narrower.resize(visits.len(), last);
    let scale = |(t, narrower): (usize, &f64)| (before(t) * narrower).max(LEAST) as f32;
    let all: Vec<f32> = narrower.iter().enumerate().map(scale).collect();
    if all.iter().all(|scale| *scale == 1.0) { Vec::new() } else { all }
}

/// Whether a triangle and the next one face the same way.
fn is_flat(mesh: &Mesh, triangle: usize) -> bool {
    mesh.normal(triangle).dot(mesh.normal(triangle + 1)) > FLAT
}

/// The triangles that a walk from an eye comes to.
fn visited(tracer: &Tracer, eye: DVec3, walk: u64) -> impl Iterator<Item = u32> {
    let mesh: &Mesh = tracer.mesh;
    let mut random = Random::new(PATHS ^ walk);
    let mut ray = tracer.free_ray(eye, random.next_direction());
    let mut triangles = Vec::with_capacity(VISITED);
    while let Found::Surface { triangle, uv, side, .. } = tracer.first(&ray, random.next_bits()) {
        triangles.push(triangle);
        if triangles.len() == VISITED {
            break;
        }
        let flat = mesh.normal(triangle as usize);
        let normal = if side == Side::Front { flat } else { -flat };
        let uv: DVec2 = Vec2::from(uv).as_dvec2();
        let place = Place { point: mesh.point(triangle as usize, uv), normal, triangle };
        let direction = cosine_direction(&frame(normal), random.next_unit(), random.next_unit());
        ray = tracer.ray(&place, direction, f64::INFINITY);
    }
    triangles.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::{Material, Scene};

    fn add_box(scene: &mut Scene, name: &str, low: DVec3, sides: DVec3) {
        for axis in 0..3 {
            let [x, y, z] = [axis, (axis + 1) % 3, (axis + 2) % 3].map(|k| DVec3::AXES[k] * sides[k]);
            scene.add_quad(name, 0, [low, low + x, low + x + y, low + y]);
            scene.add_quad(name, 0, [low + z, low + z + y, low + z + x + y, low + z + x]);
        }
    }

    fn scene() -> Scene {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        scene
    }

    /// Seen from a room on a wide site the room has a quarter of the cells, and from above the site no surface is another scale.
    #[test]
    fn a_room_on_a_wide_site_matters_to_who_is_in_it() {
        let mut scene = scene();
        add_box(&mut scene, "room", DVec3::new(0.0, 0.1, 0.0), DVec3::new(4.0, 2.5, 3.0));
        let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        let site = [corner(-300.0, 300.0), corner(300.0, 300.0), corner(300.0, -300.0), corner(-300.0, -300.0)];
        scene.add_quad("site", 0, site);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        assert!(tracer.scales().is_empty());
        let tracer = tracer.seen_from(&[DVec3::new(1.0, 1.5, 1.0)]);
        assert_eq!(tracer.scales().len(), mesh.triangles.len());
        // As much of the cells as a quarter of the whole area would have.
        let room = 2.0 * (4.0 * 2.5 + 4.0 * 3.0 + 2.5 * 3.0);
        let all = (4.0 * room / mesh.whole_area()).sqrt();
        for (t, scale) in tracer.scales().iter().enumerate() {
            let is_site = mesh.corners(t).iter().all(|p| p.y == 0.0);
            let ratio = f64::from(*scale) / all;
            assert!(if is_site { *scale == 1.0 } else { (0.7..1.4).contains(&ratio) }, "{t}: {scale} of {all}");
        }
        assert!(tracer.seen_from(&[DVec3::new(50.0, 40.0, 0.0)]).scales().is_empty());
    }

    /// Furniture in a room is no other scale, nor is anything where there is no eye or no surface.
    #[test]
    fn a_box_in_a_room_is_no_other_scale() {
        let mut scene = scene();
        add_box(&mut scene, "room", DVec3::ZERO, DVec3::new(4.0, 2.5, 3.0));
        let low = DVec3::new(1.0, 0.5, 1.0);
        for axis in 0..3 {
            let [x, y, z] = [axis, (axis + 1) % 3, (axis + 2) % 3].map(|k| 0.5 * DVec3::AXES[k]);
            scene.add_quad("box", 0, [low, low + y, low + x + y, low + x]);
            scene.add_quad("box", 0, [low + z, low + z + x, low + z + x + y, low + z + y]);
        }
        let mesh = Mesh::new(&scene);
        assert!(Tracer::new(&scene, &mesh).seen_from(&[DVec3::new(3.0, 1.5, 2.0)]).scales().is_empty());
        assert!(Tracer::new(&scene, &mesh).seen_from(&[]).scales().is_empty());
        let none = Scene::default();
        let mesh = Mesh::new(&none);
        assert!(Tracer::new(&none, &mesh).seen_from(&[DVec3::ZERO]).scales().is_empty());
    }
}
