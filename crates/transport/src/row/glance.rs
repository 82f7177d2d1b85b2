//! One glance: all faces of a surface drawn from one eye point, and what each facet took of them.

use super::buffer::ItemBuffer;
use super::face::Face;
use super::scan::{Outline, Scans};
use super::surface::{Fill, Level};
use super::view::{Polygon, View};
use super::warnock::{Block, LookUps, Windows};
use glam::DVec3;

/// Polygons seen more obliquely than this are lines.
const EDGE_ON: f64 = 1e-12;

/// From where a surface is looked at, and how it stands there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye {
    pub place: DVec3,
    /// Share of the facet that it stands for.
    pub share: f64,
    /// Axes of the surface in the world; the last is the facet's normal, unless the surface keeps to the world.
    pub axes: [DVec3; 3],
}

/// Sees each face as it was drawn: its number, the items of its cells, their weights, the share of the eye point.
pub(super) type Observer<'a> = &'a mut dyn FnMut(usize, &[u32], &[f64], f64);

/// Working memory of one thread.
#[derive(Default)]
pub(super) struct Scratch {
    buffer: ItemBuffer,
    vertices: Vec<DVec3>,
    /// Planes of the face's pyramid that each vertex lies outside of.
    outside: Vec<u8>,
    outline: Vec<DVec3>,
    /// Whether facets outside of all faces are asked for.
    pub watches_rim: bool,
    /// Per facet, and last what shows nothing.
    pub tallies: Vec<Tally>,
    /// Polygons of the face between all cell centres: owner, cell and reciprocal depth of the middle.
    between: Vec<(u32, usize, f64)>,
    /// The face's polygons, which of them each cell shows, and its windows, where cells are not filled one polygon at a time.
    scans: Scans,
    shown: Vec<u32>,
    windows: Windows,
    /// What it took to find what cells show, so far.
    pub look_ups: LookUps,
}

/// What one eye point sees of a facet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    pub value: f64,
    pub doubt: f64,
    /// Cells that its image covers, and those of them that show it.
    pub drawn: u32,
    pub seen: u32,
    /// Some of it may lie inside the surface, some outside; its middle lies between cell centres in front of all else.
    pub inside: bool,
    pub outside: bool,
    pub glimpsed: bool,
}

impl Scratch {
    /// Draws all faces from one eye point and counts. Polygons `ahead` are drawn in this order.
    pub fn glance(
        &mut self,
        (view, ahead): (&View, &[u32]),
        (level, weights, fill): (&Level, &[Vec<f64>], Fill),
        eye: &Eye,
        observe: Observer,
    ) {
        let nothing = view.nothing();
        self.tallies.clear();
        self.tallies.resize(nothing as usize + 1, Tally::default());
        for (number, (face, weights)) in level.faces.iter().zip(weights).enumerate() {
            if weights.iter().all(|weight| *weight == 0.0) {
                continue;
            }
            let axes = face.frame.map(|a| eye.axes[0] * a.x + eye.axes[1] * a.y + eye.axes[2] * a.z);
            self.project(view, face, eye.place, &axes);
            self.buffer.clear(face, nothing);
            self.between.clear();
            self.scans.clear();
            for polygon in ahead.iter().map(|p| &view.polygons[*p as usize]) {
                self.draw((view, polygon), (face, fill), eye.place, &axes);
            }
            self.fill(face, fill, nothing);
            for (owner, cell, nearness) in self.between.drain(..) {
                let depth = match fill {
                    Fill::Cells => self.buffer.depths[cell],
                    _ => self.scans.depth(self.shown[cell], face, cell),
                };
                self.tallies[owner as usize].glimpsed |= nearness >= depth;
            }
            let items = &self.buffer.items;
            match fill {
                Fill::Windows => {
                    tally_blocks((face, &self.windows.blocks), items, weights, eye.share, &mut self.tallies)
                }
                _ => tally(face, items, weights, eye.share, &mut self.tallies),
            }
            observe(number, items, weights, eye.share);
        }
    }

    /// Finds what each cell shows, where polygons were only gathered so far.
    fn fill(&mut self, face: &Face, fill: Fill, nothing: u32) {
        match fill {
            Fill::Cells => {
                self.look_ups.places += self.buffer.items.len() as u64;
                return;
            }
            Fill::Windows => {
                self.windows.divide(face, &self.scans, &mut self.look_ups);
                self.windows.show(face, &mut self.shown);
            }
            Fill::By(raster) => raster.fill(face, &self.scans, &mut self.shown),
        }
        for (item, scan) in self.buffer.items.iter_mut().zip(&self.shown) {
            *item = self.scans.item(*scan, nothing);
        }
    }

    /// Takes all vertices to the frame of a face.
    fn project(&mut self, view: &View, face: &Face, eye: DVec3, axes: &[DVec3; 3]) {
        let [left, right, low, high] = face.window;
        self.vertices.clear();
        self.outside.clear();
        for vertex in &view.vertices {
            let to = *vertex - eye;
            let p = DVec3::new(axes[0].dot(to), axes[1].dot(to), axes[2].dot(to));
            self.vertices.push(p);
            let outside = [p.x < left * p.z, p.x > right * p.z, p.y < low * p.z, p.y > high * p.z, p.z <= 0.0];
            self.outside.push(outside.iter().fold(0, |code, o| 2 * code + u8::from(*o)));
        }
    }

    fn draw(&mut self, (view, polygon): (&View, &Polygon), (face, fill): (&Face, Fill), eye: DVec3, axes: &[DVec3; 3]) {
        let (corners, owner, normal) = (view.corners(polygon), polygon.owner, polygon.normal);
        let codes = || corners.iter().map(|c| self.outside[*c as usize]);
        let (all, any) = (codes().fold(u8::MAX, |a, b| a & b), codes().fold(0, |a, b| a | b));
        if all != 0 && !self.watches_rim {
            return;
        }
        let to = view.vertices[corners[0] as usize] - eye;
        let offset = normal.dot(to);
        let item = if offset < 0.0 { owner } else { view.nothing() };
        let tally = &mut self.tallies[item as usize];
        tally.outside |= any != 0;
        if all != 0 || offset.abs() <= EDGE_ON * to.length() {
            return;
        }
        tally.inside = true;
        self.outline.clear();
        self.outline.extend(corners.iter().map(|c| self.vertices[*c as usize]));
        let normal = DVec3::from_array(axes.map(|axis| axis.dot(normal)));
        let outline = Outline { corners: &self.outline, normal, offset };
        let covered = match fill {
            Fill::Cells => {
                let covered = self.buffer.draw(face, &outline, item);
                self.look_ups.tests += u64::from(covered);
                covered
            }
            _ => self.scans.push(face, &outline, item),
        };
        tally.drawn += covered;
        if covered == 0 && item != view.nothing() {
            let middle = self.outline.iter().sum::<DVec3>() / self.outline.len() as f64;
            if let Some(cell) = face.cell(middle) {
                self.between.push((owner, cell, 1.0 / middle.z));
            }
        }
    }
}

/// Adds up the cells of a face: values, cells seen, and half of each pair of neighbours that show different things. Sums
/// of multiples of 2⁻⁵² up to one are exact, so these come out alike in whatever order and groups they are taken.
fn tally(face: &Face, items: &[u32], weights: &[f64], share: f64, tallies: &mut [Tally]) {
    let columns = face.cells[0];
    let rows = items.chunks_exact(columns).zip(weights.chunks_exact(columns));
    for (row, (here, weigh)) in rows.enumerate() {
        for (item, weight) in here.iter().zip(weigh) {
            let tally = &mut tallies[*item as usize];
            tally.value += quantised(share * weight);
            tally.seen += 1;
        }
        let mut differ = |[a, b]: [u32; 2], weight: f64| {
            if a != b {
                tallies[a as usize].doubt += 0.25 * share * weight;
                tallies[b as usize].doubt += 0.25 * share * weight;
            }
        };
        for (pair, weight) in here.windows(2).zip(weigh.windows(2)) {
            differ([pair[0], pair[1]], weight[0] + weight[1]);
        }
        let next = (row + 1) * columns;
        for (column, (item, weight)) in here.iter().zip(weigh).enumerate().take(items.len().saturating_sub(next)) {
            differ([*item, items[next + column]], weight + weights[next + column]);
        }
    }
}

/// The same of a face in blocks that show one polygon each, by their weights in closed form: only cells at their borders
/// have neighbours that may show something else. Differs from [`tally`] by rounding.
fn tally_blocks((face, blocks): (&Face, &[Block]), items: &[u32], weights: &[f64], share: f64, tallies: &mut [Tally]) {
    let [columns, rows] = face.cells;
    for Block { columns: across, rows: up, .. } in blocks {
        let at = |column: usize, row: usize| row * columns + column;
        let tally = &mut tallies[items[at(across.start, up.start)] as usize];
        tally.value += quantised(share * face.weight_of_block([across, up], DVec3::Z));
        tally.seen += (across.len() * up.len()) as u32;
        let mut differ = |a: usize, b: usize| {
            if items[a] != items[b] {
                let doubt = 0.25 * share * (weights[a] + weights[b]);
                tallies[items[a] as usize].doubt += doubt;
                tallies[items[b] as usize].doubt += doubt;
            }
        };
        if across.end < columns {
            up.clone().for_each(|row| differ(at(across.end - 1, row), at(across.end, row)));
        }
        if up.end < rows {
            across.clone().for_each(|column| differ(at(column, up.end - 1), at(column, up.end)));
        }
    }
}

/// The nearest multiple of 2⁻⁵² to a number below one.
pub(super) fn quantised(x: f64) -> f64 {
    (x + 1.0) - 1.0
}
