//! What is shown, and the work that brings it about, piece by piece.
//!
//! At first rows grow by doubling, and after each doubling the light of all lamps together is solved from where it
//! was. When all rays are there, the light of each lamp is solved for itself from nothing: that is the light which
//! a fresh session has, and dimming only adds it up anew.
//!
//! After an edit there is something to see before that: with F the first rays of each row as they were and F' as they are
//! now, H' = C + D' + F' Y', Y' = E' + R' H', where C = H − D − F Y is what the other rays brought besides. The noise of the
//! rows that stay cancels in the difference, so that a few rays will do (a delta solve: George, Sillion and Greenberg 1990
//! shoot the same difference). C does not change while edits follow one another, except that it is nothing on what moves.
//! The first sweep takes all of Y', those after it only by how much it still changes, with fewer rays each as that is less.

use super::Session;
use super::light::{Light, Strand, lamps};
use super::probe::luminance_of;
use super::solve::{Solve, tail};
use radiosity_scene::Bands;
use radiosity_transport::live::{Lanes, NEAR_RAYS, Part, Target};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::time::Instant;

/// Rays per element of the first picture.
const FIRST_RAYS: u32 = 4;

/// Sweeps from an edit to the first picture; the last one stands for those that would follow as well ([`tail`]). Of what
/// paint on a floor changes in a bright room, the picture misses 6 % then; 16 % with three sweeps, and as they were before, four
/// with all rays and without a last one of that kind, 24 %. The exact light follows.
const QUICK_SWEEPS: u32 = 4;

/// Each sweep takes half as many rays as the one before it: it moves about half as much light.
const LEAST_QUICK_RAYS: usize = 4;

/// Residual of pictures while rays are still traced, whose noise is far above it. Dim places may lack some times as much of theirs.
const ROUGH_TOLERANCE: f64 = 1e-3;

/// Residual of columns.
const TOLERANCE: f64 = 1e-4;

/// The first picture after an edit, on its way.
struct Quick {
    e: Vec<Lanes<4>>,
    d: Vec<Lanes<4>>,
    h: Vec<Lanes<4>>,
    /// What goes through the rows next: all of Y', then by how much that changes.
    y: Vec<Lanes<4>>,
    /// By how much H has changed at the last sweep, and room for the next.
    step: Vec<Lanes<4>>,
    gathered: Vec<Lanes<4>>,
    sweeps: u32,
}

/// Columns that are solved together.
enum Block {
    One(Solve<4>),
    Two(Solve<8>),
    Five(Solve<16>),
}

/// What is shown and what is on its way.
#[derive(Default)]
pub struct State {
    /// Counts what was shown.
    pub revision: u64,
    /// Irradiance by id.
    pub shown: Vec<Lanes<4>>,
    /// The direct light in it.
    pub direct: Vec<Lanes<4>>,
    /// What surfaces give off by it, but for what lamps carry directly.
    pub given: Vec<Lanes<4>>,
    /// By what the column of each strand is multiplied in it.
    pub factors: Vec<Bands>,
    /// Rays of the rows that it is of; none while dark.
    pub solved_rays: u32,
    /// Relative standard error of what is shown; infinite while it is dark, and where that is not known.
    pub error: f64,
    /// Half the differences between the halves of rows, lux per band by id: one standard error of each in what is shown. Empty
    /// where they were not looked for.
    pub errors: Vec<Lanes<4>>,
    /// Of the last solve.
    pub residual: f64,
    /// Objects whose light is another than last told.
    pub changed: BTreeSet<usize>,
    /// Irradiance by strand and id.
    pub columns: Vec<Vec<Bands>>,
    /// Whether `columns` are those of the scene as it is.
    pub has_columns: bool,
    /// Whether `shown` is the sum of the columns.
    pub is_summed: bool,
    /// Whether an edit waits for its first picture.
    pub is_edited: bool,
    /// Whether the light of all lamps together is to be solved again by the rays that there are.
    needs_total: bool,
    /// Objects that have come or moved: what was kept of their light is not theirs any more.
    pub movers: Vec<usize>,
    /// Work so far, seconds.
    pub seconds: f64,
    /// What rays beyond the first brought to what is shown, by id; none if it is not known.
    rest: Option<Vec<Lanes<4>>>,
    quick: Option<Quick>,
    total: Option<Solve<4>>,
    block: Option<(Vec<usize>, Block)>,
    next_strand: usize,
}

impl State {
    /// Of a scene whose light has not been looked for.
    pub fn dark() -> State {
        State { error: f64::INFINITY, ..State::default() }
    }

    /// The scene has changed; `keeps_columns` where only lights with columns of their own were dimmed.
    pub fn edited(&mut self, keeps_columns: bool) {
        self.is_summed = false;
        self.quick = None;
        self.total = None;
        if !keeps_columns {
            self.block = None;
            self.next_strand = 0;
            self.has_columns = false;
        }
        self.is_edited = true;
    }
}

impl Session {
    /// Whether the light is that of a fresh session.
    pub(super) fn is_solved(&self) -> bool {
        self.state.has_columns && self.state.is_summed && self.state.rest.is_some() && !self.state.errors.is_empty()
    }

    /// Whether nothing is left to do.
    pub(super) fn is_done(&self) -> bool {
        self.is_solved() && self.is_sharp()
    }

    /// One piece of work: as many rays as there is time for, or a sweep.
    pub(super) fn piece(&mut self, deadline: Instant) {
        let (target, most) = (self.live.target(), self.live.most());
        if self.state.has_columns {
            // The second so that the next edit need not do it, the third as each dimming makes another noise.
            return match &self.state {
                State { is_summed: false, .. } => self.sum_columns(),
                State { rest: None, .. } => self.find_rest(),
                State { errors, .. } if errors.is_empty() => self.judge(),
                _ => self.sharpen(deadline),
            };
        }
        if target.rays == 0 {
            return self.live.set_target(self.level(FIRST_RAYS));
        }
        if self.state.is_edited {
            if self.state.solved_rays >= most.rays.min(NEAR_RAYS) {
                return self.quick(deadline);
            }
            // So early that the next picture is as soon there as one of the edit would be.
            self.state.needs_total = true;
            self.state.rest = None;
        }
        if self.live.needs(Part::Far) {
            self.live.work(Part::Far, || Instant::now() < deadline);
        } else if self.state.solved_rays < target.rays || self.state.needs_total {
            self.solve_total();
        } else if target != most {
            self.live.set_target(self.level(2 * target.rays));
        } else {
            self.solve_columns();
        }
    }

    /// How many rays come together: an eighth as many shadow rays as rays of a row, and all of them in the end.
    fn level(&self, rays: u32) -> Target {
        let most = self.live.most();
        let rays = rays.min(most.rays);
        let shadows = if rays == most.rays { most.shadows } else { (rays / 8).clamp(1, most.shadows) };
        Target { rays, shadows }
    }

    /// What rays beyond the first brought to what is shown: H − D − F Y, with the first rays of each row as they were when it
    /// was found.
    fn find_rest(&mut self) {
        let (ids, near) = (self.live.ids(), self.live.target().near().rays as usize);
        let state = &mut self.state;
        for list in [&mut state.shown, &mut state.direct, &mut state.given] {
            list.resize(ids, Lanes::default());
        }
        let mut rest = vec![Lanes::default(); ids];
        self.live.gather(&state.given, near, &mut rest);
        rest.par_iter_mut().zip(&state.shown).zip(&state.direct).with_min_len(4096).for_each(|((rest, h), d)| {
            *rest = Lanes(std::array::from_fn(|k| h.0[k] - d.0[k] - rest.0[k]));
        });
        state.rest = Some(rest);
    }

    /// The first picture after an edit.
    fn quick(&mut self, deadline: Instant) {
        if self.state.rest.is_none() {
            // Rows are still those of what is shown: nothing is traced before this.
            self.find_rest();
        }
        let ids = self.live.ids();
        let state = &mut self.state;
        for list in [&mut state.shown, &mut state.direct, &mut state.given] {
            list.resize(ids, Lanes::default());
        }
        if let Some(rest) = &mut state.rest {
            rest.resize(ids, Lanes::default());
            for body in state.movers.drain(..) {
                let body = &self.live.world().bodies[body];
                rest[body.first as usize..=body.dark() as usize].fill(Lanes::default());
            }
        }
        if self.live.needs(Part::Near) {
            self.live.work(Part::Near, || Instant::now() < deadline);
            return;
        }
        let mut quick = match self.state.quick.take() {
            Some(quick) => quick,
            None => self.begin_quick(),
        };
        let rays = (self.live.target().near().rays as usize >> quick.sweeps).max(LEAST_QUICK_RAYS);
        self.live.gather(&quick.y, rays, &mut quick.gathered);
        let is_first = quick.sweeps == 0;
        quick.sweeps += 1;
        let is_last = quick.sweeps == QUICK_SWEEPS;
        // By how much the light changes now.
        match &self.state.rest {
            Some(rest) if is_first => {
                let all = quick.gathered.par_iter_mut().zip(&quick.h).zip(&quick.d).zip(rest);
                all.with_min_len(4096).for_each(|(((gathered, h), d), rest)| {
                    (0..3).for_each(|k| gathered.0[k] = rest.0[k] + d.0[k] + gathered.0[k] - h.0[k]);
                });
            }
            _ => {}
        }
        std::mem::swap(&mut quick.step, &mut quick.gathered);
        let factor = if is_last { tail(&self.answer, &quick.gathered, &quick.step) } else { [1.0; 3] };
        quick.h.par_iter_mut().zip(&mut quick.step).with_min_len(4096).for_each(|(h, step)| {
            for (k, factor) in factor.iter().enumerate() {
                let now = (h.0[k] + factor * step.0[k]).max(0.0);
                step.0[k] = now - std::mem::replace(&mut h.0[k], now);
            }
        });
        if !is_last {
            self.answer.reflect(&quick.step, &mut quick.y);
            self.state.quick = Some(quick);
            return;
        }
        self.mask_absent(&mut quick.h);
        let mut given = quick.y;
        self.answer.respond(&quick.e, &quick.h, &mut given);
        self.state.is_edited = false;
        (self.state.direct, self.state.given) = (quick.d, given);
        self.show(quick.h);
    }

    fn begin_quick(&self) -> Quick {
        let (e, d) = (self.emission(), self.direct_light());
        let nothing = || vec![Lanes::default(); self.live.ids()];
        let (mut h, mut y) = (nothing(), nothing());
        let lights = h.par_iter_mut().zip(&self.state.shown).zip(&d).zip(&self.state.direct);
        lights.with_min_len(4096).for_each(|(((h, old), d), old_d)| {
            *h = Lanes(std::array::from_fn(|k| (old.0[k] + (d.0[k] - old_d.0[k])).max(0.0)));
        });
        self.mask_absent(&mut h);
        self.answer.respond(&e, &h, &mut y);
        Quick { y, h, e, d, step: nothing(), gathered: nothing(), sweeps: 0 }
    }

    /// Sets light to nothing that is of no element that is there.
    fn mask_absent(&self, h: &mut [Lanes<4>]) {
        for body in &self.live.world().bodies {
            if body.is_present {
                h[body.dark() as usize] = Lanes::default();
            } else {
                h[body.first as usize..=body.dark() as usize].fill(Lanes::default());
            }
        }
        h[..self.live.world().sky.len()].fill(Lanes::default());
    }

    /// The light of all lamps together, from what is shown, a sweep at a time.
    fn solve_total(&mut self) {
        let rays = self.live.target().rays;
        let mut total = match self.state.total.take() {
            Some(total) => total,
            None => {
                let (e, d) = (self.emission(), self.direct_light());
                let mut start = None;
                if self.state.solved_rays > 0 {
                    // What is shown, with the lamps and the paint as they are now.
                    let mut y = vec![Lanes::default(); e.len()];
                    self.state.shown.resize(e.len(), Lanes::default());
                    self.answer.respond(&e, &self.state.shown, &mut y);
                    start = Some(y);
                }
                Solve::new(&self.answer, e, d, start)
            }
        };
        if total.sweep(&self.live, &self.answer, rays as usize, ROUGH_TOLERANCE) {
            self.state.solved_rays = rays;
            self.state.residual = total.residual();
            self.state.given = total.radiosity().to_vec();
            self.state.direct = total.direct().to_vec();
            let mut h = std::mem::take(&mut total.h);
            self.mask_absent(&mut h);
            self.state.rest = None;
            (self.state.needs_total, self.state.is_edited) = (false, false);
            self.state.movers.clear();
            self.show(h);
            self.judge();
        } else {
            self.state.total = Some(total);
        }
    }

    /// The light of lamps each for itself, from nothing, a sweep at a time.
    fn solve_columns(&mut self) {
        let (mut strands, mut block) = match self.state.block.take() {
            Some(block) => block,
            None => match self.begin_block() {
                Some(block) => block,
                None => {
                    self.state.has_columns = true;
                    return self.sum_columns();
                }
            },
        };
        let (live, answer, rays) = (&self.live, &self.answer, self.live.target().rays as usize);
        let (is_done, residual) = match &mut block {
            Block::One(solve) => (solve.sweep(live, answer, rays, TOLERANCE), solve.residual()),
            Block::Two(solve) => (solve.sweep(live, answer, rays, TOLERANCE), solve.residual()),
            Block::Five(solve) => (solve.sweep(live, answer, rays, TOLERANCE), solve.residual()),
        };
        self.state.residual = residual;
        if !is_done {
            self.state.block = Some((strands, block));
            return;
        }
        for (k, strand) in strands.drain(..).enumerate() {
            self.state.columns[strand] = match &block {
                Block::One(solve) => lane(&solve.h, k),
                Block::Two(solve) => lane(&solve.h, k),
                Block::Five(solve) => lane(&solve.h, k),
            };
        }
    }

    /// The next strands that have light, up to five; none if there are no more.
    fn begin_block(&mut self) -> Option<(Vec<usize>, Block)> {
        if self.state.next_strand == 0 {
            self.state.columns = vec![Vec::new(); self.strands.len()];
        }
        let mut strands = Vec::new();
        while strands.len() < 5 && self.state.next_strand < self.strands.len() {
            let strand = self.state.next_strand;
            self.state.next_strand += 1;
            if self.strands[strand].lights.iter().any(|light| self.is_there(&self.lights[*light])) {
                strands.push(strand);
            }
        }
        let block = match strands.len() {
            0 => return None,
            1 => Block::One(self.begin(&strands)),
            2 => Block::Two(self.begin(&strands)),
            _ => Block::Five(self.begin(&strands)),
        };
        Some((strands, block))
    }

    fn begin<const W: usize>(&self, strands: &[usize]) -> Solve<W> {
        let ids = self.live.ids();
        let (mut e, mut d) = (vec![Lanes::<W>::default(); ids], vec![Lanes::<W>::default(); ids]);
        for (k, strand) in strands.iter().enumerate() {
            let mut one = vec![Lanes::<4>::default(); ids];
            if let Some(column) = self.strands[*strand].column {
                self.live.add_direct(&[(column, [1.0; 3])], &mut one);
            }
            let own = self.emission_of(&self.strands[*strand], false);
            for id in 0..ids {
                for band in 0..3 {
                    d[id].0[3 * k + band] = one[id].0[band];
                    e[id].0[3 * k + band] = own[id].0[band];
                }
            }
        }
        Solve::new(&self.answer, e, d, None)
    }

    /// Adds the columns up as the lights are dimmed.
    fn sum_columns(&mut self) {
        let factors: Vec<(&[Bands], Bands)> = self
            .strands
            .iter()
            .enumerate()
            .filter(|(strand, _)| !self.state.columns[*strand].is_empty())
            .map(|(strand, own)| (self.state.columns[strand].as_slice(), self.factor(own)))
            .collect();
        let mut h = vec![Lanes::<4>::default(); self.live.ids()];
        h.par_iter_mut().with_min_len(4096).enumerate().for_each(|(id, h)| {
            for (column, factor) in &factors {
                for band in 0..3 {
                    h.0[band] += column[id][band] * factor[band];
                }
            }
        });
        self.mask_absent(&mut h);
        let e = self.emission();
        let mut y = vec![Lanes::default(); h.len()];
        self.answer.respond(&e, &h, &mut y);
        (self.state.direct, self.state.given) = (self.direct_light(), y);
        self.state.is_summed = true;
        self.state.is_edited = false;
        self.state.rest = None;
        self.state.movers.clear();
        self.state.solved_rays = self.live.target().rays;
        self.show(h);
    }

    /// By what a strand's column is multiplied.
    pub(super) fn factor(&self, strand: &Strand) -> Bands {
        if strand.is_shared { [1.0; 3] } else { self.lights[strand.lights[0]].factor() }
    }

    /// Whether a light has not gone with its object.
    pub(super) fn is_there(&self, light: &Light) -> bool {
        light.body.is_none_or(|body| self.live.world().bodies[body].is_present)
    }

    /// Direct light of all lamps that shadow rays go to, by id.
    pub(super) fn direct_light(&self) -> Vec<Lanes<4>> {
        let columns: Vec<(usize, Bands)> =
            self.strands.iter().filter_map(|strand| Some((strand.column?, self.factor(strand)))).collect();
        let mut light = vec![Lanes::default(); self.live.ids()];
        self.live.add_direct(&columns, &mut light);
        light
    }

    /// Emission of all lights that rows find, by id.
    pub(super) fn emission(&self) -> Vec<Lanes<4>> {
        let mut all = vec![Lanes::default(); self.live.ids()];
        for strand in &self.strands {
            self.add_emission(strand, true, &mut all);
        }
        all
    }

    /// Emission of the lights of a strand that rows find, by id; dimmed, or as far as the strand is dimmed before it is solved.
    pub(super) fn emission_of(&self, strand: &Strand, is_dimmed: bool) -> Vec<Lanes<4>> {
        let mut own = vec![Lanes::default(); self.live.ids()];
        self.add_emission(strand, is_dimmed, &mut own);
        own
    }

    fn add_emission(&self, strand: &Strand, is_dimmed: bool, to: &mut [Lanes<4>]) {
        for light in strand.lights.iter().map(|light| &self.lights[*light]) {
            if light.is_direct || !self.is_there(light) {
                continue;
            }
            let factor = if is_dimmed || strand.is_shared { light.factor() } else { [1.0; 3] };
            let mut add = |id: usize, given: Bands| {
                (0..3).for_each(|band| to[id].0[band] += given[band] * factor[band]);
            };
            match light.body {
                None => {
                    let sky = self.live.world().sky.radiosity(&self.scene().sky);
                    sky.into_iter().enumerate().for_each(|(id, given)| add(id, given));
                }
                Some(body) => {
                    let body = &self.live.world().bodies[body];
                    for element in 0..body.elements() {
                        let (t, _, _) = body.shape.place(element);
                        add((body.first + element) as usize, body.shape.exitance[t]);
                    }
                }
            }
        }
    }

    /// Lamps of a strand's column are elsewhere.
    pub(super) fn place_lamps(&mut self, strand: usize) {
        if let Some(column) = self.strands[strand].column {
            let (lamps, strength) = lamps(&self.strands[strand], &self.lights);
            self.live.set_column(column, strand as u32, &lamps, &strength);
        }
    }

    /// Shows irradiance by id, and notes whose light has changed.
    fn show(&mut self, h: Vec<Lanes<4>>) {
        let factors = self.strands.iter().map(|strand| self.factor(strand)).collect();
        let state = &mut self.state;
        for (index, body) in self.live.world().bodies.iter().enumerate() {
            let range = body.first as usize..body.dark() as usize;
            if state.shown.get(range.clone()) != h.get(range) {
                state.changed.insert(index);
            }
        }
        state.shown = h;
        state.factors = factors;
        state.revision += 1;
        // The noise of other light says nothing of this.
        state.error = f64::INFINITY;
        state.errors.clear();
    }

    /// Half the differences between the halves of rows of what is shown.
    pub(super) fn find_errors(&self) -> Vec<Lanes<4>> {
        let mut differences = vec![Lanes::default(); self.live.ids()];
        let rays = self.state.solved_rays as usize;
        if rays > 0 && self.state.given.len() == self.live.ids() {
            self.live.half_differences(&self.state.given, rays, &mut differences);
        }
        differences
    }

    /// Estimates the error of what is shown.
    fn judge(&mut self) {
        let differences = self.find_errors();
        let (mut square, mut whole) = (0f64, 0f64);
        for ((difference, h), area) in differences.iter().zip(&self.state.shown).zip(&self.answer.area) {
            let of = |lanes: &Lanes<4>| f64::from(luminance_of(lanes));
            square += f64::from(*area) * of(difference).powi(2);
            whole += f64::from(*area) * of(h).powi(2);
        }
        self.state.error = if whole > 0.0 { (square / whole).sqrt() } else { 0.0 };
        self.state.errors = differences;
    }
}

/// Column k of several that lie side by side.
fn lane<const W: usize>(h: &[Lanes<W>], k: usize) -> Vec<Bands> {
    h.iter().map(|h| std::array::from_fn(|band| h.0[3 * k + band])).collect()
}
