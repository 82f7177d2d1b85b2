//! Surfaces of different objects in one plane, facing the same way: rays meet now the one, now the other.
//!
//! What a third surface covers that lies in the same plane and looks at them is no fault: the undersides of a rug and
//! of the table on it, both on the floor.
//!
//! Triangles are sorted by plane, and those of a plane into a grid of about as many cells as triangles; triangles of
//! one cell are compared. That is linear for the triangles of any sane model and bounded for all others.

use radiosity::{Mesh, Scene};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// Steps of normals and of distances (in extents of the scene) by which triangles are sorted into planes. Triangles of
/// one plane whose normals differ by rounding share a step of normals but for few on its border, which are missed;
/// coarser steps compare more triangles that are not in one plane.
const STEPS: [f64; 2] = [1.0 / 32.0, 1e-3];

/// Normals of triangles of one plane agree up to this, or up to this and the sign (cosine of 0.8°).
const SAME_WAY: f64 = 0.9999;

/// Comparisons per triangle after which the search ends, some ten times what ordinary scenes take.
const EFFORT: usize = 300;

/// Objects that overlap an earlier one.
#[derive(Debug, Default, PartialEq)]
pub struct Overlaps {
    /// By object: how many of its triangles do, and the first object they lie on.
    pub objects: BTreeMap<usize, (usize, usize)>,
    /// Whether the search ended early, so that there may be more.
    pub more: bool,
}

/// Searches the whole scene.
pub fn search(scene: &Scene, mesh: &Mesh) -> Overlaps {
    let Some([low, high]) = scene.bounding_box() else { return Overlaps::default() };
    let (centre, step) = (0.5 * (low + high), STEPS[1] * (high - low).max_element());
    let object = |t: usize| scene.triangle_object[mesh.source[t] as usize] as usize;

    // Sort by plane. Each triangle goes into two neighbouring steps of distance, so that no border parts a plane.
    let plane = |t: usize| {
        // Both sides of a plane under one key.
        let (normal, [a, ..]) = (mesh.normal(t), mesh.corners(t));
        let rounded = (normal / STEPS[0]).round().as_i64vec3().to_array();
        let sign = rounded.iter().map(|x| x.signum()).find(|sign| *sign != 0).unwrap_or(1);
        let distance = (sign as f64 * normal.dot(a - centre) / step).floor() as i64;
        (rounded.map(|x| (sign * x) as i8), distance as i16)
    };
    let mut planes: Vec<([i8; 3], i16, u32)> = (0..mesh.triangles.len())
        .into_par_iter()
        .flat_map_iter(|t| {
            let (normal, distance) = plane(t);
            [distance, distance + 1].map(|distance| (normal, distance, t as u32))
        })
        .collect();
    planes.par_sort_unstable();

    let mut lies_on: Vec<Option<usize>> = vec![None; mesh.triangles.len()];
    let mut covered = vec![false; mesh.triangles.len()];
    let mut effort = EFFORT.saturating_mul(mesh.triangles.len()).max(1_000_000);
    for plane in planes.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let triangles: Vec<usize> = plane.iter().map(|(_, _, t)| *t as usize).collect();
        let objects: Vec<usize> = triangles.iter().map(|&t| object(t)).collect();
        if objects.iter().all(|&object| object == objects[0]) {
            continue;
        }
        // Two axes across the plane, the boxes of the triangles along them, and cells as wide as the mean box or more.
        let across = mesh.normal(triangles[0]).abs().to_array();
        let steepest = (0..3).max_by(|&i, &j| across[i].total_cmp(&across[j])).unwrap_or(0);
        let axes = [(steepest + 1) % 3, (steepest + 2) % 3];
        let boxes: Vec<[[f64; 2]; 2]> = triangles
            .iter()
            .map(|&t| {
                let [a, b, c] = mesh.corners(t);
                let (low, high) = (a.min(b).min(c).to_array(), a.max(b).max(c).to_array());
                [axes.map(|axis| low[axis]), axes.map(|axis| high[axis])]
            })
            .collect();
        let bound = |i: usize, axis: usize, f: fn(f64, f64) -> f64| boxes.iter().map(|b| b[i][axis]).reduce(f);
        let spread = [0, 1]
            .map(|axis| bound(1, axis, f64::max).unwrap_or_default() - bound(0, axis, f64::min).unwrap_or_default());
        let width = |[low, high]: &[[f64; 2]; 2]| (high[0] - low[0]).max(high[1] - low[1]);
        let mean = boxes.iter().map(width).sum::<f64>() / boxes.len() as f64;
        let even = (spread[0] * spread[1] / boxes.len() as f64).sqrt();
        let cell = mean.max(even).max(mesh.tolerance);

        let mut grid: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        for (i, [low, high]) in boxes.iter().enumerate() {
            let at = |corner: &[f64; 2], axis: usize| (corner[axis] / cell).floor() as i64;
            for x in at(low, 0)..=at(high, 0) {
                for y in at(low, 1)..=at(high, 1) {
                    let others = grid.entry([x, y]).or_default();
                    for &j in others.iter() {
                        let Some(left) = effort.checked_sub(1) else {
                            return summed(scene, mesh, &lies_on, &covered, true);
                        };
                        effort = left;
                        let meet = (0..2).all(|axis| low[axis] <= boxes[j][1][axis] && boxes[j][0][axis] <= high[axis]);
                        let (s, t) = (triangles[j], triangles[i]);
                        if objects[j] == objects[i] || !meet || !overlap(mesh, s, t) {
                            continue;
                        }
                        if mesh.normal(s).dot(mesh.normal(t)) < 0.0 {
                            covered[s] |= holds_middle(mesh, t, s);
                            covered[t] |= holds_middle(mesh, s, t);
                        } else {
                            let (first, later) =
                                if objects[j] < objects[i] { (objects[j], t) } else { (objects[i], s) };
                            let known = lies_on[later].unwrap_or(usize::MAX);
                            lies_on[later] = Some(known.min(first));
                        }
                    }
                    others.push(i);
                }
            }
        }
    }
    summed(scene, mesh, &lies_on, &covered, false)
}

fn summed(scene: &Scene, mesh: &Mesh, lies_on: &[Option<usize>], covered: &[bool], more: bool) -> Overlaps {
    let mut objects: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
    let mut last = None;
    for (t, on) in lies_on.iter().enumerate() {
        if let Some(on) = on.filter(|_| !covered[t]) {
            let source = mesh.source[t];
            let (count, first) = objects.entry(scene.triangle_object[source as usize] as usize).or_insert((0, on));
            // The pieces of a triangle follow each other, and count once.
            *count += usize::from(last.replace(source) != Some(source));
            *first = on.min(*first);
        }
    }
    Overlaps { objects, more }
}

/// Whether the middle of triangle `t` lies in triangle `s` of the same plane.
fn holds_middle(mesh: &Mesh, s: usize, t: usize) -> bool {
    let [a, b, c] = mesh.corners(t);
    let at = mesh.barycentric(s, (a + b + c) / 3.0);
    // A middle on the border of two must be in one of them in spite of rounding.
    at.min_element() >= -1e-9 && at.x + at.y <= 1.0 + 1e-9
}

/// Whether two triangles lie in one plane, on either side, and share more than an edge.
fn overlap(mesh: &Mesh, s: usize, t: usize) -> bool {
    let (large, small) = if mesh.area(s) < mesh.area(t) { (t, s) } else { (s, t) };
    let (p, q, normal) = (mesh.corners(large), mesh.corners(small), mesh.normal(large));
    if normal.dot(mesh.normal(small)).abs() < SAME_WAY || q.iter().any(|q| normal.dot(*q - p[0]).abs() > mesh.tolerance)
    {
        return false;
    }
    // Convex shapes are apart where they are along the normal of one of their edges.
    [p, q].iter().all(|shape| {
        (0..3).all(|i| {
            let outwards = (shape[(i + 1) % 3] - shape[i]).cross(normal).normalize_or_zero();
            let most = |of: &[_; 3]| of.iter().map(|c| outwards.dot(*c - shape[i])).fold(f64::NEG_INFINITY, f64::max);
            let least = |of: &[_; 3]| of.iter().map(|c| outwards.dot(*c - shape[i])).fold(f64::INFINITY, f64::min);
            most(&p).min(most(&q)) - least(&p).max(least(&q)) > 4.0 * mesh.tolerance
        })
    })
}
