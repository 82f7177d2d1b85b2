//! Cells of a plane share the light that their rays found ([`pooled`]), before corners take it.

use super::{edge_key, sides};
use crate::pool::{Sample, pooled};
use glam::{DVec2, DVec3};
use radiosity_scene::{Bands, Elements, Mesh, luminance};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Triangles lie on one plane where their normals differ by less than this cosine, of a degree.
pub(super) const FLAT: f64 = 0.9998;

/// The light of each cell, from the two halves of its elements' rays, and what it weighs: zero where all of it is buried.
#[derive(Clone, Copy)]
struct Own {
    cell: usize,
    halves: [Bands; 2],
    /// Area, m².
    area: f64,
    /// In proportion to its rays.
    rays: f64,
}

impl Own {
    fn new(mesh: &Mesh, elements: &Elements, cell: usize, halves: &[[Bands; 2]], weight: &[f64]) -> Option<Own> {
        let (mut sums, mut total, mut area, mut rays) = ([[0f64; 3]; 2], 0.0, 0.0, 0.0);
        for element in elements.of_cell(cell) {
            let w = weight[element as usize];
            total += w;
            area += elements.area(mesh, element);
            rays += elements.share(mesh, element);
            for (sum, half) in sums.iter_mut().zip(&halves[element as usize]) {
                (0..3).for_each(|band| sum[band] += w * f64::from(half[band]));
            }
        }
        let halves = sums.map(|sum| sum.map(|s| (s / total) as f32));
        (total > 0.0).then_some(Own { cell, halves, area, rays })
    }

    fn sample(&self, at: DVec2) -> Sample {
        let [a, b] = self.halves;
        let noise = 0.5 * (luminance(a) - luminance(b)).abs();
        let light = std::array::from_fn(|band| 0.5 * (a[band] + b[band]));
        Sample { at, light, noise, weight: self.rays as f32 }
    }
}

/// The light of all cells, shared with others of their plane as far as it is smooth; nothing where a cell weighs nothing. Planes
/// end where walls stand on them.
pub(super) fn shared(
    mesh: &Mesh,
    elements: &Elements,
    halves: &[[Bands; 2]],
    weight: &[f64],
) -> Vec<Option<[f64; 3]>> {
    let of_plane = |cells: &Vec<usize>| -> Vec<(usize, Bands)> {
        let own: Vec<Own> =
            cells.iter().filter_map(|&cell| Own::new(mesh, elements, cell, halves, weight)).collect();
        let area: f64 = own.iter().map(|own| own.area).sum();
        let [along, across] = axes(mesh, elements, cells).map(|axis| axis / (area / own.len() as f64).sqrt());
        let sample = |own: &Own| {
            let (t, _) = elements.place(elements.of_cell(own.cell).start);
            let [a, b, c] = elements.cell_corners(own.cell);
            let centre = mesh.point(t, (a + b + c) / 3.0);
            own.sample(DVec2::new(centre.dot(along), centre.dot(across)))
        };
        let samples: Vec<Sample> = own.iter().map(sample).collect();
        own.iter().zip(pooled(&samples)).map(|(own, pooled)| (own.cell, pooled.light)).collect()
    };
    let mut light = vec![None; elements.cells()];
    let found: Vec<Vec<(usize, Bands)>> = planes(mesh, elements).par_iter().map(of_plane).collect();
    found.into_iter().flatten().for_each(|(cell, of_cell)| light[cell] = Some(of_cell.map(f64::from)));
    light
}

/// The cells of each plane: of triangles that lie flat beside each other, where light is continuous from one to the next.
fn planes(mesh: &Mesh, elements: &Elements) -> Vec<Vec<usize>> {
    let n = mesh.triangles.len();
    let mut parent: Vec<usize> = (0..2 * n).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    let mut beside: FxHashMap<((u32, u32), usize), Vec<usize>> = FxHashMap::default();
    for (t, side) in sides(elements, n) {
        for edge in 0..3 {
            let others = beside.entry((edge_key(mesh, t, edge), side as usize)).or_default();
            for &other in others.iter().filter(|other| mesh.normal(t).dot(mesh.normal(**other)) > FLAT) {
                let (a, b) = (root(&mut parent, 2 * t + side as usize), root(&mut parent, 2 * other + side as usize));
                parent[a.max(b)] = a.min(b);
            }
            others.push(t);
        }
    }
    let mut number: FxHashMap<usize, usize> = FxHashMap::default();
    let mut planes: Vec<Vec<usize>> = Vec::new();
    for (t, side) in sides(elements, n) {
        let of = *number.entry(root(&mut parent, 2 * t + side as usize)).or_insert(planes.len());
        if of == planes.len() {
            planes.push(Vec::new());
        }
        planes[of].extend(elements.cells_of(t, side));
    }
    planes
}

/// Two unit vectors along a plane: the first along the longest edge of its triangles.
fn axes(mesh: &Mesh, elements: &Elements, cells: &[usize]) -> [DVec3; 2] {
    let mut longest = (0.0, DVec3::X, 0);
    let mut last = usize::MAX;
    for &cell in cells {
        let (t, _) = elements.place(elements.of_cell(cell).start);
        if t == last {
            continue;
        }
        last = t;
        let [a, b, c] = mesh.corners(t);
        for edge in [b - a, c - b, a - c] {
            if edge.length() > longest.0 {
                longest = (edge.length(), edge, t);
            }
        }
    }
    let (length, edge, t) = longest;
    let along = edge / f64::max(length, f64::MIN_POSITIVE);
    [along, mesh.normal(t).cross(along)]
}
