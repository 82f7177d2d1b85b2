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
//!   may escape both, so Lambert's integral is asked about them at more points, as if nothing hid them. Facets that show
//!   from no point may show from between them: half a spacing along a side of the facet, at most, if one straight edge of
//!   shadow is what hides them.
//! - *Truncation*: where the surface does not go down to the horizon.
//!
//! All of these watch what is seen: an obstacle that shows in no cell from any eye point stays unknown, and so does a gap
//! between two obstacles that is narrower than the eye points are apart.

use super::glance::{Eye, Observer, Scratch, Tally};
use super::points::eye_points;
use super::surface::{Atlas, Projection};
use super::view::View;
use super::{Row, RowFactors, RowMatrix};
use crate::pair::Factor;
use crate::pair::exact::exact;
use crate::{Progress, Stopped};
use glam::DVec3;
use radiosity_scene::Enclosure;
use radiosity_trace::sampling::{frame, hash, unit};

/// How a row is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Cells along a whole side of the projection surface: an even number from 4 to [`super::MOST_CELLS`], for which the
    /// nearest is taken. Errors of small facets fall as its inverse.
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
    /// outline, and so do those that no cell shows but that stand in front where they should be: no aliasing is left. What
    /// cells tell of the others stays, so rows sum to one only within their errors.
    Analytic,
    /// That, and surfaces that spin, and eye points or cells doubled, whichever matters more, until no entry of the row is
    /// predicted to be off by more, or a row would take more than seconds. Truncation stays.
    UntilError(f64),
}

/// Points along a side, and points times cells of the first face, beyond which [`Repair::UntilError`] gives up: a row then
/// takes some seconds.
const MOST_POINTS: usize = 32;
const MOST_WORK: usize = 1 << 26;

/// How much more of a facet that was missed other points than the eye point may see: a facet as near as that is not missed.
const ELSEWHERE: f64 = 0.1;

/// Cells below which a facet's image may be narrower than they are, so that its boundary is not where they differ.
const FEW: u32 = 32;

/// How small facets are, against their distance, that their centre stands for in values and in doubts.
const FINE: f64 = 1e-3;
const ROUGH: f64 = 0.03;

/// What the eye points of a facet see, on average.
#[derive(Clone, Debug, Default)]
pub(super) struct Average {
    pub values: Vec<f64>,
    pub lost: f64,
    aliasing: Vec<f64>,
    truncation: Vec<f64>,
    captured: f64,
}

/// The parts of a facet that lie between its eye points.
struct Between<'a> {
    view: &'a View<'a>,
    from: usize,
    /// Points in these parts.
    points: Vec<(DVec3, f64)>,
    /// Largest share of the facet that a straight edge of shadow can cut off without an eye point in it.
    strip: f64,
}

impl<'a> Between<'a> {
    /// Of k × k eye points: they are 1/k apart, and half as far from the rim, so that a strip along a side holds none that
    /// is narrower than 1/2k of the facet.
    fn new(view: &'a View<'a>, from: usize, k: usize) -> Between<'a> {
        let own = &view.enclosure.facets[from];
        Between { view, from, points: eye_points(own, 2 * k), strip: 0.5 / k as f64 }
    }

    /// The most that a facet may take which shows from no eye point: as much as from the points that would see most of it
    /// if nothing stood in the way, over the share of the strip. Where none would, its front looks past all of them at the
    /// rim, and all that it would take is as little.
    fn most(&self, j: usize) -> f64 {
        let (own, other) = (&self.view.enclosure.facets[self.from], &self.view.enclosure.facets[j]);
        if self.from == j || !own.faces(other) {
            return 0.0;
        }
        let seen = |(eye, share): &(DVec3, f64)| (self.view.potential(*eye, own.normal(), j, ROUGH), *share);
        let mut seen: Vec<(f64, f64)> = self.points.iter().map(seen).collect();
        seen.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        if seen.first().is_none_or(|(potential, _)| *potential == 0.0) {
            return exact(own, other) / own.area();
        }
        let mut left = self.strip;
        let take = |(potential, share): (f64, f64)| {
            let share = share.min(left);
            left -= share;
            share * potential
        };
        seen.into_iter().map(take).sum()
    }
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
            let between = Between::new(self.view, self.from, k.max(2));
            let gap = |(j, (a, b)): (usize, (&f64, &f64))| match (*a, *b) {
                (0.0, 0.0) => between.most(j),
                (a, b) => (scale * (a - b).abs()).max(self.nearness(j, k, a)),
            };
            let proximity: Vec<f64> = average.values.iter().zip(&other.values).enumerate().map(gap).collect();
            if let Repair::UntilError(tolerance) = look.repair {
                let errors = proximity.iter().zip(&average.aliasing).map(|(p, a)| [p + a, *p, *a]);
                let [worst, near, coarse] = errors.fold([0.0; 3], |worst, e| if e[0] > worst[0] { e } else { worst });
                let work = (k * self.atlas.level(level).faces[0].cells[0]).pow(2);
                let may_refine = level + 1 < self.atlas.len() && 4 * work <= MOST_WORK;
                let may_add = k < MOST_POINTS && 4 * work <= MOST_WORK;
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
        self.scratch.watches_rim = projection.captured() < 1.0;
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
        for (index, (place, share)) in points.iter().enumerate() {
            let axes = match (projection.is_world_aligned(), spin) {
                (true, _) => [DVec3::X, DVec3::Y, DVec3::Z],
                (false, None) => frame(facet.normal()),
                (false, Some(seed)) => {
                    let [u, v, normal] = frame(facet.normal());
                    let turn = unit(hash(hash(hash(seed) ^ self.from as u32) ^ index as u32));
                    let (sine, cosine) = (std::f64::consts::TAU * f64::from(turn)).sin_cos();
                    [cosine * u + sine * v, cosine * v - sine * u, normal]
                }
            };
            let eye = Eye { place: *place, share: *share, axes };
            let surface = (level_of_faces, weights.as_slice(), projection.fill());
            self.scratch.glance((self.view, &self.ahead), surface, &eye, observe);
            self.settle(&eye, captured, &mut average);
        }
        // Doubts of turned surfaces are independent: three standard deviations of as many uniform ones.
        if spin.is_some() && points.len() > 3 {
            let scale = (3.0 / points.len() as f64).sqrt();
            average.aliasing.iter_mut().for_each(|a| *a *= scale);
        }
        average
    }

    /// Adds what one eye point saw to the average.
    fn settle(&self, eye: &Eye, captured: f64, average: &mut Average) {
        let (tallies, share) = (&self.scratch.tallies, eye.share);
        let is_analytic = self.atlas.projection.look().repair != Repair::None;
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
                let potential = share * self.view.potential(eye.place, normal, j, if is_exact { FINE } else { ROUGH });
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
