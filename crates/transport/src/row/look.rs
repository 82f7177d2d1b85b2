//! Looking out from a facet: what all methods that project on faces have in common.
//!
//! Through eye points x_k with shares a_k of the facet, F_ij = Σ_k a_k Σ_{cells that show j} ΔF (Cohen and Greenberg
//! 1985; Baum, Rushmeier and Winget 1989 name the three assumptions that it rests on). It is off in three ways, and says
//! by how much:
//!
//! - *Aliasing*: a boundary may run anywhere between the cell centres on its two sides, so each pair of neighbouring
//!   cells that show different things leaves half a cell's weight in doubt; a facet that falls between all centres leaves
//!   all that it could take, 1/π ∫cos cos/r².
//! - *Proximity*: a few points stand for the whole facet. One point is compared with 2 × 2 others at half the
//!   resolution, which costs as many cells again; k × k with half as many each way, which is off by at least twice as
//!   much, as errors fall with h² and beside edges of shadows with h. Facets nearer than the points are to each other
//!   may escape both, so Lambert's integral is asked about them at more points, as if nothing hid them.
//! - *Truncation*: where the surface does not go down to the horizon.
//!
//! All of these watch what is seen: an obstacle that shows in no cell from any eye point stays unknown.

use super::buffer::{ItemBuffer, Outline};
use super::face::{Face, Weights};
use super::points::eye_points;
use super::view::View;
use super::{Row, RowFactors, RowMatrix};
use crate::pair::Factor;
use crate::{Progress, Stopped};
use glam::DVec3;
use radiosity_scene::Enclosure;
use radiosity_trace::sampling::{frame, hash, unit};
use std::sync::OnceLock;

/// How a row is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Cells along a whole side of the projection surface. Errors of small facets fall as its inverse.
    pub resolution: usize,
    /// Eye points along each side of the facet. One is the classic centre point.
    pub points: usize,
    /// Turns the surface about the normal by a random angle at each eye point, so that boundaries along the cells of one
    /// do not lie along those of the next. The global cube cannot turn.
    pub spin: Option<u32>,
    /// What is done about the errors that show.
    pub repair: Repair,
}

/// 256 is where time per cell and per polygon balance for some 1e5 polygons, and leaves 1e-3 of a factor of 0.1.
impl Default for Look {
    fn default() -> Look {
        Look { resolution: 256, points: 1, spin: None, repair: Repair::None }
    }
}

/// What is done about errors that a method predicts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Repair {
    /// Nothing: they are reported.
    #[default]
    None,
    /// Facets that nothing hides from an eye point get their exact factor from there, by Lambert's integral over their
    /// outline, and so do those that no cell shows but that stand in front where they should be: no aliasing is left.
    Analytic,
    /// That, and surfaces that spin, and eye points or cells doubled, whichever matters more, until no entry of the row is
    /// predicted to be off by more; until 32 × 32 points and 1024 cells if that does not come. Truncation stays.
    UntilError(f64),
}

/// Points along a side and cells beyond which [`Repair::UntilError`] gives up: a row then takes some seconds.
const MOST_POINTS: usize = 32;
const MOST_CELLS: usize = 1024;

/// Polygons seen more obliquely than this are lines.
const EDGE_ON: f64 = 1e-12;

/// How much more of a facet that was missed other points than the eye point may see: a facet as near as that is not missed.
const ELSEWHERE: f64 = 0.1;

/// Cells below which a facet's image may be narrower than they are, so that its boundary is not where they differ.
const FEW: u32 = 32;

/// How small facets are, against their distance, that their centre stands for in values and in doubts.
const FINE: f64 = 1e-3;
const ROUGH: f64 = 0.03;

/// A method that projects what is around on faces.
pub(super) trait Projection: Sync {
    fn look(&self) -> Look;
    /// Faces of the surface; forward along z is the facet's normal.
    fn faces(&self, resolution: usize) -> Vec<Face>;
    fn weights(&self) -> Weights {
        Weights::Exact
    }
    /// Faces keep to the world's axes, whatever the facet's normal.
    fn is_world_aligned(&self) -> bool {
        false
    }
    /// Share of the hemisphere that the faces take in.
    fn captured(&self) -> f64 {
        1.0
    }
    fn renormalises(&self) -> bool {
        false
    }
}

/// The faces of a surface at one resolution.
pub(super) struct Level {
    pub faces: Vec<Face>,
    vectors: Vec<Vec<DVec3>>,
    /// What cells weigh, where that is the same for all facets.
    fixed: Option<Vec<Vec<f64>>>,
}

/// The faces of a surface at half its resolution, the whole, twice, ….
pub(super) struct Atlas<'a> {
    projection: &'a dyn Projection,
    levels: Vec<OnceLock<Level>>,
}

impl Atlas<'_> {
    pub fn new(projection: &dyn Projection) -> Atlas<'_> {
        let resolution = resolution_of(projection);
        let finer = (1..).take_while(|level| resolution << level <= MOST_CELLS).count();
        Atlas { projection, levels: (0..2 + finer).map(|_| OnceLock::new()).collect() }
    }

    pub fn level(&self, level: usize) -> &Level {
        self.levels[level].get_or_init(|| {
            let resolution = (resolution_of(self.projection) << level) / 2;
            let faces = self.projection.faces(resolution.next_multiple_of(2));
            let vectors: Vec<_> = faces.iter().map(|face| face.vectors(self.projection.weights())).collect();
            let level = Level { faces, vectors, fixed: None };
            if self.projection.is_world_aligned() {
                return level;
            }
            let fixed = Some(level.weights(self.projection, DVec3::Z));
            Level { vectors: Vec::new(), fixed, ..level }
        })
    }
}

/// An even number of at least four cells, and no more than memory allows.
fn resolution_of(projection: &dyn Projection) -> usize {
    projection.look().resolution.clamp(4, 4 * MOST_CELLS).next_multiple_of(2)
}

impl Level {
    /// What each cell weighs for a facet of normal `normal`. Exact weights of a surface that takes in the whole
    /// hemisphere sum to one: where the horizon cuts through cells, that takes n⁻² of correction.
    pub fn weights(&self, projection: &dyn Projection, normal: DVec3) -> Vec<Vec<f64>> {
        let faces = self.faces.iter().zip(&self.vectors);
        let mut weights: Vec<_> = faces.map(|(face, vectors)| face.weights(vectors, normal)).collect();
        if projection.weights() == Weights::Exact && projection.captured() >= 1.0 {
            let sum: f64 = weights.iter().flatten().sum();
            weights.iter_mut().flatten().for_each(|weight| *weight /= sum);
        }
        weights
    }
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
    /// Whether what lies outside of the faces is missed.
    is_truncated: bool,
    /// Per facet, and last what shows nothing.
    tallies: Vec<Tally>,
    /// Polygons of the face between all cell centres: owner, cell and reciprocal depth of the middle.
    between: Vec<(u32, usize, f64)>,
}

/// What one eye point sees of a facet.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    value: f64,
    doubt: f64,
    /// Cells that its image covers, and those of them that show it.
    drawn: u32,
    seen: u32,
    /// Some of it may lie inside the surface, some outside; its middle lies between cell centres in front of all else.
    inside: bool,
    outside: bool,
    glimpsed: bool,
}

/// What the eye points of a facet see, on average.
#[derive(Clone, Debug, Default)]
pub(super) struct Average {
    pub values: Vec<f64>,
    pub lost: f64,
    aliasing: Vec<f64>,
    truncation: Vec<f64>,
    captured: f64,
}

/// A row in the making.
pub(super) struct Gaze<'a> {
    pub atlas: &'a Atlas<'a>,
    pub view: &'a View<'a>,
    pub from: usize,
    /// Polygons that rise above the facet's plane.
    pub ahead: Vec<u32>,
    pub scratch: &'a mut Scratch,
}

impl<'a> Gaze<'a> {
    pub fn new(atlas: &'a Atlas<'a>, view: &'a View<'a>, from: usize, scratch: &'a mut Scratch) -> Gaze<'a> {
        Gaze { atlas, view, from, ahead: view.ahead_of(from), scratch }
    }

    /// The row with its predicted errors, repaired if asked for.
    pub fn row(&mut self) -> RowFactors {
        let look = self.atlas.projection.look();
        let (mut k, mut level) = (look.points.clamp(1, MOST_POINTS), 1);
        let mut known: Vec<((usize, usize), Average)> = Vec::new();
        loop {
            for wanted in [(k, level), if k == 1 { (2, 0) } else { (k / 2, level) }] {
                if !known.iter().any(|(key, _)| *key == wanted) {
                    let average = self.average(wanted.0, wanted.1, &mut |_, _, _, _| ());
                    known.push((wanted, average));
                }
            }
            let find = |k: usize, level: usize| &known.iter().find(|(key, _)| *key == (k, level)).expect("just made").1;
            let average = find(k, level);
            let (other, scale) = if k == 1 { (find(2, 0), 1.5) } else { (find(k / 2, level), 0.5) };
            let gap = |(j, (a, b)): (usize, (&f64, &f64))| (scale * (a - b).abs()).max(self.nearness(j, k, *a));
            let proximity: Vec<f64> = average.values.iter().zip(&other.values).enumerate().map(gap).collect();
            if let Repair::UntilError(tolerance) = look.repair {
                let errors = proximity.iter().zip(&average.aliasing).map(|(p, a)| [p + a, *p, *a]);
                let [worst, near, coarse] = errors.fold([0.0; 3], |worst, e| if e[0] > worst[0] { e } else { worst });
                let (may_refine, may_add) = (level + 1 < self.atlas.levels.len(), k < MOST_POINTS);
                if worst > tolerance && (may_refine || may_add) {
                    if may_refine && (coarse > near || !may_add) {
                        level += 1
                    } else {
                        k *= 2
                    }
                    continue;
                }
            }
            return self.finish(average, &proximity);
        }
    }

    /// How far k × k eye points are off for a facet that is nearer than they are to each other and not hidden from all of
    /// them, as if nothing hid it: by more points, four times as many each way while k is small.
    fn nearness(&self, j: usize, k: usize, value: f64) -> f64 {
        let facets = &self.view.enclosure.facets;
        let (own, other) = (&facets[self.from], &facets[j]);
        let spacing = 2.0 * own.radius() / k as f64;
        let distance = own.centroid().distance(other.centroid()) - own.radius() - other.radius();
        if value == 0.0 || distance > spacing {
            return 0.0;
        }
        let mean = |k: usize| -> f64 {
            let points = eye_points(own, k).into_iter();
            points.map(|(eye, share)| share * self.view.potential(eye, own.normal(), j, ROUGH)).sum()
        };
        // What remains at the finer points, falling with the spacing at least.
        let finer = (4 * k).min(16).max(2 * k);
        (mean(k) - mean(finer)).abs() * finer as f64 / (finer - k) as f64
    }

    fn finish(&self, average: &Average, proximity: &[f64]) -> RowFactors {
        let projection = self.atlas.projection;
        let captured = projection.captured();
        let scale = if projection.renormalises() { captured } else { 1.0 };
        let factor = |j: usize| {
            let value = average.values[j] / scale;
            // Below the rim may lie more than the scaling adds, or nothing.
            let truncation = average.truncation[j].max(value - average.values[j]);
            Factor { value, error: (average.aliasing[j] + proximity[j]) / scale + truncation }
        };
        let factors = (0..average.values.len()).map(factor).collect();
        RowFactors {
            factors,
            lost: average.lost / scale,
            captured: if captured < 1.0 { captured } else { average.captured },
        }
    }

    /// What k × k eye points see at a level of resolution.
    pub fn average(&mut self, k: usize, level: usize, observe: Observer) -> Average {
        let projection = self.atlas.projection;
        let look = projection.look();
        let facet = &self.view.enclosure.facets[self.from];
        let level_of_faces = self.atlas.level(level);
        let own;
        let weights = match &level_of_faces.fixed {
            Some(fixed) => fixed,
            None => {
                own = level_of_faces.weights(projection, facet.normal());
                &own
            }
        };
        let n = self.view.nothing() as usize;
        let captured = weights.iter().flatten().sum();
        let mut average =
            Average { values: vec![0.0; n], aliasing: vec![0.0; n], truncation: vec![0.0; n], lost: 0.0, captured };
        // The second look of a centre point is turned in any case, or it would have the same boundaries along cells.
        let is_repaired = matches!(look.repair, Repair::UntilError(_));
        let spin = look.spin.or((level == 0 || is_repaired).then_some(0)).filter(|_| !projection.is_world_aligned());
        let points = eye_points(facet, k);
        for (index, (eye, share)) in points.iter().enumerate() {
            let base = match (projection.is_world_aligned(), spin) {
                (true, _) => [DVec3::X, DVec3::Y, DVec3::Z],
                (false, None) => frame(facet.normal()),
                (false, Some(seed)) => {
                    let [u, v, normal] = frame(facet.normal());
                    let turn = unit(hash(hash(hash(seed) ^ self.from as u32) ^ index as u32));
                    let (sine, cosine) = (std::f64::consts::TAU * f64::from(turn)).sin_cos();
                    [cosine * u + sine * v, cosine * v - sine * u, normal]
                }
            };
            self.glance(level_of_faces, weights, (*eye, *share), &base, observe);
            self.settle((*eye, *share), captured, look.repair != Repair::None, &mut average);
        }
        // Doubts of turned surfaces are independent: three standard deviations of as many uniform ones.
        if spin.is_some() && points.len() > 3 {
            let scale = (3.0 / points.len() as f64).sqrt();
            average.aliasing.iter_mut().for_each(|a| *a *= scale);
        }
        average
    }

    /// Draws all faces from one eye point and counts.
    fn glance(
        &mut self,
        level: &Level,
        weights: &[Vec<f64>],
        (eye, share): (DVec3, f64),
        base: &[DVec3; 3],
        observe: Observer,
    ) {
        let (view, scratch) = (self.view, &mut *self.scratch);
        let nothing = view.nothing();
        scratch.is_truncated = self.atlas.projection.captured() < 1.0;
        scratch.tallies.clear();
        scratch.tallies.resize(nothing as usize + 1, Tally::default());
        for (number, (face, weights)) in level.faces.iter().zip(weights).enumerate() {
            if weights.iter().all(|weight| *weight == 0.0) {
                continue;
            }
            let axes = face.frame.map(|axis| base[0] * axis.x + base[1] * axis.y + base[2] * axis.z);
            scratch.project(view, face, eye, &axes);
            scratch.buffer.clear(face, nothing);
            scratch.between.clear();
            for polygon in self.ahead.iter().map(|p| &view.polygons[*p as usize]) {
                scratch.draw(view, face, (polygon.owner, polygon.normal), view.corners(polygon), eye, &axes);
            }
            for (owner, cell, nearness) in scratch.between.drain(..) {
                scratch.tallies[owner as usize].glimpsed |= nearness >= scratch.buffer.depths[cell];
            }
            tally(face, &scratch.buffer.items, weights, share, &mut scratch.tallies);
            observe(number, &scratch.buffer.items, weights, share);
        }
    }

    /// Adds what one eye point saw to the average.
    fn settle(&self, (eye, share): (DVec3, f64), captured: f64, is_analytic: bool, average: &mut Average) {
        let tallies = &self.scratch.tallies;
        let normal = self.view.enclosure.facets[self.from].normal();
        let (is_whole, n) = (self.atlas.projection.captured() >= 1.0, self.view.nothing() as usize);
        let is_hidden = |t: &Tally| t.seen < t.drawn;
        let hides = tallies[..n].iter().any(is_hidden);
        average.lost += tallies[n].value;
        for (j, tally) in tallies[..n].iter().enumerate() {
            let Tally { mut value, mut doubt, .. } = *tally;
            let is_missed = tally.inside && tally.drawn == 0;
            let is_thin = tally.inside && tally.drawn < FEW && tally.seen > 0;
            let is_exact = is_analytic && is_whole && (is_missed || (tally.drawn > 0 && !is_hidden(tally)));
            let is_cut = !is_whole && tally.outside;
            if is_missed || is_thin || is_exact || is_cut {
                let potential = share * self.view.potential(eye, normal, j, if is_exact { FINE } else { ROUGH });
                if is_cut {
                    average.truncation[j] += (potential - value).clamp(0.0, share * (1.0 - captured));
                }
                if is_missed {
                    doubt = (1.0 + ELSEWHERE) * potential;
                } else if is_thin && !is_cut {
                    let visible = f64::from(tally.seen) / f64::from(tally.drawn);
                    doubt = doubt.max((visible * potential - value).abs());
                }
                if is_exact && (tally.glimpsed || !is_missed) {
                    value = potential;
                    doubt = if hides { doubt } else { 0.0 };
                }
            }
            average.values[j] += value;
            average.aliasing[j] += doubt;
        }
    }
}

impl Scratch {
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

    fn draw(
        &mut self,
        view: &View,
        face: &Face,
        (owner, normal): (u32, DVec3),
        corners: &[u32],
        eye: DVec3,
        axes: &[DVec3; 3],
    ) {
        let codes = || corners.iter().map(|c| self.outside[*c as usize]);
        let (all, any) = (codes().fold(u8::MAX, |a, b| a & b), codes().fold(0, |a, b| a | b));
        if all != 0 && !self.is_truncated {
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
        let covered = self.buffer.draw(face, &outline, item);
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

/// The nearest multiple of 2⁻⁵² to a number below one.
pub(super) fn quantised(x: f64) -> f64 {
    (x + 1.0) - 1.0
}

impl<P: Projection> Row for P {
    fn row(&self, from: usize, enclosure: &Enclosure) -> RowFactors {
        let (atlas, view) = (Atlas::new(self), View::new(enclosure));
        Gaze::new(&atlas, &view, from, &mut Scratch::default()).row()
    }

    fn rows(&self, enclosure: &Enclosure, progress: &dyn Progress) -> Result<RowMatrix, Stopped> {
        let (atlas, view) = (Atlas::new(self), View::new(enclosure));
        RowMatrix::collect(enclosure, progress, Scratch::default, |scratch, from| {
            Gaze::new(&atlas, &view, from, scratch).row()
        })
    }
}
