//! Light that is written, in texels or at vertices: how points of it are lit, what the referee says of it as it is read
//! back, and what has to become finer for the error asked.
//!
//! The square of the error as read back is the solution's own, at the points that are lit, plus what is lost between them.
//! Finer texels lessen the second alone; so where the first leaves too little room, points are lit with more rays before, and places
//! where they are read back stand for what points make of their rays together.

use crate::answer::{Answer, Station};
use crate::bake::{Baked, GATHERS, gather_rays};
use crate::measure::{brought_nothing, certify, most_paths};
use crate::monitor::has_time;
use crate::pace::{self, Cost};
use crate::texels::usual_rays;
use crate::{Error, Indirect, Monitor, Solution, stations};
use radiosity_scene::{Bands, luminance};
use radiosity_trace::Place;
use radiosity_transport::Shadowing;
use radiosity_view::{Audit, Auditor};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Places at which written light is compared with the solution, for each place of the audit. At a tenth of the cost of a
/// lightmap they see edges that take up a thousandth of the area.
const MORE: usize = 20;

/// Part of the squared error asked that the solution may take up where light is written between its points.
const OWN_SHARE: f64 = 0.5;

/// Part of the squared error that is left to writing that a round aims at: the rest is for what the aim has wrong.
const AIM: f64 = 0.8;

/// What writing may add where the solution leaves nothing of the error asked, as part of its own squared error: an eighth is farther off in all.
const SPARE: f64 = 0.25;

/// Part of the squared error that writing adds that a round leaves at least: what a thin shadow looks like more closely is seen
/// step by step.
pub(crate) const STEP: f64 = 0.1;

/// How much more of it a round leaves if it would take too many points: with 3 it would light half as many as it may.
const STEP_BACK: f64 = 1.5;

/// Whether two rounds in a row brought next to nothing.
pub(crate) fn is_stalled(rounds: &[WrittenRound]) -> bool {
    brought_nothing(&rounds.iter().map(|round| round.error).collect::<Vec<_>>())
}

/// Fewest shadow rays, and gather rays, at a point that is one of many.
const LEAST_RAYS: u32 = 8;

/// As what light is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Written {
    /// Each vertex has the rays that places have at which light is read back.
    Vertices,
    /// Texels have rays by the error asked and their noise ([`crate::texels`]).
    Texels,
}

/// Part of the time left that is for the first points where finer ones may follow.
const FIRST: f64 = 0.5;

/// Least part of their rays that points are lit with, and how many times as many rays some are lit with, too, to see how long that takes.
const LEAST_PART: f64 = 0.125;
const TIMED: f64 = 4.0;

/// Gather rays that do where that is less, whatever error is asked: with fewer, points of small things, which pool with few, are more unlike each
/// other than what is around them; with more there is time for fewer points. An office of which 1 % was asked was 14 to 15 % off after
/// 11 s with twice as many, and 9 to 11 % so.
const FEW_RAYS: f64 = 16.0;

/// One attempt at writing light so that it is read back as well as was asked.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct WrittenRound {
    /// Texels or vertices.
    pub points: usize,
    /// Those of them that were lit; the others were known from the round before.
    pub lit: usize,
    /// Estimated error as read back.
    pub error: f64,
    /// Its upper bound.
    pub upper: f64,
}

impl std::fmt::Display for WrittenRound {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let WrittenRound { points, lit, error, upper } = self;
        write!(
            f,
            "as written {:.2} %, at most {:.2} %: {points} points, {lit} of them lit",
            100.0 * error,
            100.0 * upper
        )
    }
}

/// What there is to do for the error asked, or one near that of the solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Goal {
    /// Which part may be left of the squared error that writing adds.
    pub left: f64,
    /// Whether points are lit with more rays from now on, so that what was lit before is not to be kept.
    pub relight: bool,
    /// Whether the error asked can be met so.
    pub is_for_asked: bool,
}

impl Goal {
    /// Parts that rounds may leave, from the one that goes as far as a round may.
    pub fn steps(&self) -> impl Iterator<Item = f64> {
        std::iter::successors(Some(self.left.max(STEP)), |left| Some(STEP_BACK * left)).take_while(|left| *left < 1.0)
    }
}

/// What the referee says of light as it was written, attempt by attempt.
pub(crate) struct Judge<'b, 'a> {
    baked: &'b Baked<'a>,
    auditor: Auditor<'a>,
    gather: usize,
    shadowing: Shadowing,
    written: Written,
    /// The solution's light at the places of the audit.
    at: Vec<Bands>,
    /// Further places where written light is compared with the solution, and its illuminance there.
    more: Vec<Station>,
    light: Vec<f64>,
    /// Whether these are looked at, and whether points were lit with more rays if that helps.
    is_close: bool,
    is_relit: bool,
    /// The part of its rays that a point is lit with: all but where a deadline leaves less time.
    thinned: f64,
    /// Seconds that a place takes with all rays, and with that part of them, where that had to be known.
    each: f64,
    each_thinned: f64,
    /// When points as they are lit now are to be done, where there is a deadline and finer ones may follow.
    until: Option<Instant>,
    /// Whether a deadline left something undone.
    hurried: AtomicBool,
}

impl<'b, 'a> Judge<'b, 'a> {
    pub fn new(baked: &'b Baked<'a>, written: Written) -> Judge<'b, 'a> {
        Judge {
            written,
            baked,
            auditor: baked.auditor.clone(),
            gather: baked.gather,
            shadowing: baked.shadowing,
            at: baked.light.clone(),
            more: stations::spread(&baked.solution, MORE * baked.watched.len(), !baked.seed),
            light: Vec::new(),
            is_close: false,
            is_relit: false,
            thinned: 1.0,
            each: 0.0,
            each_thinned: 0.0,
            until: None,
            hurried: AtomicBool::new(false),
        }
    }

    /// The part of its rays that a point is lit with: less than all where a deadline leaves no time for them.
    pub fn thinned(&self) -> f64 {
        self.thinned
    }

    /// What is judged.
    pub fn baked(&self) -> &'b Baked<'a> {
        self.baked
    }

    /// Where there is a deadline, finds with which part of their rays so many points are lit by it, and which part of them there is
    /// time for where that is the least; time is kept for what comes `after`, relative to it. Where points may become finer
    /// [`FIRST`] of the time is for those first ones. Places where light is read back are timed: they are spread as points are.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn pace(&mut self, points: f64, after: f64, may_be_finer: bool, monitor: &dyn Monitor) -> Result<f64, Error> {
        if pace::left(monitor).is_none() || self.more.is_empty() {
            return Ok(1.0);
        }
        let (some, parts) = pace::sample(&self.more);
        let least = (FEW_RAYS / self.rays_of(1.0).0.max(1) as f64).min(LEAST_PART);
        let mut times = [(0.0, 0.0); 2];
        for (time, thinned) in times.iter_mut().zip([least, TIMED * least]) {
            self.thinned = thinned;
            let (seconds, lit) = pace::timed(|| self.light(&some, 1, monitor).map(drop));
            lit?;
            *time = (thinned, seconds);
        }
        let cost = Cost::new(times, parts * points / self.more.len() as f64);
        self.each = cost.seconds(1.0) / points.max(1.0);
        let left = (pace::left(monitor).unwrap_or(0.0) - self.baked.audit_seconds()).max(0.0) / (1.0 + after);
        let first = if may_be_finer { FIRST } else { 1.0 };
        self.thinned = cost.rays(first * left, [least, 1.0]);
        self.each_thinned = cost.seconds(self.thinned) / points.max(1.0);
        self.or_hurried(self.thinned >= 1.0);
        Ok(cost.part(left, self.thinned))
    }

    /// Points are lit from now on, after which finer ones may follow: where there is a deadline, [`FIRST`] of the time left is for them.
    pub fn begin(&mut self, monitor: &dyn Monitor) {
        self.until = pace::left(monitor).map(|left| Instant::now() + Duration::from_secs_f64(FIRST * left));
    }

    /// Whether there is time to light so many points once more, and for what comes with it.
    pub fn has_time(&self, points: f64, after: f64, monitor: &dyn Monitor) -> bool {
        let seconds = (1.0 + after) * points * self.each_thinned + 2.0 * self.baked.audit_seconds();
        self.or_hurried(has_time(monitor, seconds))
    }

    /// Whether a deadline left something undone.
    pub fn is_hurried(&self) -> bool {
        self.hurried.load(Ordering::Relaxed)
    }

    /// Remembers it if there was no time.
    fn or_hurried(&self, has_time: bool) -> bool {
        self.hurried.fetch_or(!has_time, Ordering::Relaxed);
        has_time
    }

    /// Whether there is time for so many of the points that share a texel, and for `after` texels after them, all with the rays
    /// that they have. What edges lack is seen less than what texels of further pages would.
    pub fn has_time_for_edges(&self, points: usize, of: u32, after: usize, monitor: &dyn Monitor) -> bool {
        // Few rays are not for nothing: a point takes an eighth of what it takes alone, at least.
        let share = (1.0 / f64::from(of)).max(0.125);
        let seconds = self.each * (points as f64 * share + after as f64 * self.thinned.max(0.125));
        let end = Instant::now() + Duration::from_secs_f64(seconds);
        let is_in_time = self.until.is_none_or(|until| end <= until);
        self.or_hurried(is_in_time && has_time(monitor, seconds + self.baked.audit_seconds()))
    }

    /// Every place at which light will be read back.
    pub fn places(&self) -> impl Iterator<Item = &Station> {
        self.baked.watched.iter().chain(&self.more)
    }

    /// The solution's light at stations that are written, of which `of` together make the mean that counts, and share their
    /// rays.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn light(&self, stations: &[Station], of: u32, monitor: &dyn Monitor) -> Result<Answer, Error> {
        let gather = if self.gathers() { (self.rays().0 / of as usize).max(LEAST_RAYS as usize) } else { 0 };
        self.lit(stations, gather, &self.shared(of), monitor)
    }

    /// The direct part of that light.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn direct(&self, stations: &[Station], of: u32, monitor: &dyn Monitor) -> Result<Vec<Bands>, Error> {
        let places: Vec<Place> = stations.iter().map(|s| s.place).collect();
        self.baked.solution.direct_at(&places, &self.shared(of), monitor)
    }

    /// Whether indirect light is gathered at each point, and so has noise of its own.
    pub fn gathers(&self) -> bool {
        self.gather > 0
    }

    fn lit(
        &self,
        stations: &[Station],
        gather: usize,
        shadowing: &Shadowing,
        monitor: &dyn Monitor,
    ) -> Result<Answer, Error> {
        let field = Indirect::Field(&self.baked.field);
        let indirect = if gather == 0 { field } else { Indirect::Gather { rays: gather } };
        self.baked.solution.at(stations, indirect, shadowing, monitor)
    }

    /// Light at places where what is written is read back.
    fn at_places(&self, places: &[Station], monitor: &dyn Monitor) -> Result<Vec<Bands>, Error> {
        Ok(self.lit(places, self.gather, &self.shadowing, monitor)?.irradiance)
    }

    /// Gather rays and shadow rays of a vertex, or of all further points of a texel.
    fn rays(&self) -> (usize, u32) {
        self.rays_of(self.thinned)
    }

    /// The same with such a part of them.
    fn rays_of(&self, part: f64) -> (usize, u32) {
        let [gather, shadow] = match self.written {
            Written::Vertices => [self.gather, self.shadowing.rays as usize],
            Written::Texels => usual_rays(self.baked.error),
        };
        (thinned(gather, part), thinned(shadow, part) as u32)
    }

    /// Shadow rays of each of so many points.
    fn shared(&self, of: u32) -> Shadowing {
        let rays = self.rays().1;
        let rays = if of > 1 { (rays / of).max(LEAST_RAYS) } else { rays };
        Shadowing { rays, ..self.shadowing }
    }

    /// Of light that is `read` back at places. Where that seems to be worse than what was asked, and than the solution,
    /// it is compared with the solution at many more places, and so is what comes after it.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn audit(&mut self, monitor: &dyn Monitor, read: impl Fn(&Station) -> Bands + Sync) -> Result<Audit, Error> {
        let Baked { error, stages, watched, .. } = self.baked;
        let read_back: Vec<Bands> = watched.par_iter().map(&read).collect();
        let paths = most_paths(*error);
        if !self.is_close {
            let plain = |auditor: &Auditor| auditor.judge(&read_back);
            let audit = certify(&mut self.auditor, &plain, *error, paths, stages, monitor)?;
            // Places do not share what they gather, and so have more rays.
            let takes = self.each * (self.more.len() * (self.gather / self.rays_of(1.0).0.max(1)).max(1)) as f64;
            if audit.upper <= self.reachable() || !self.or_hurried(has_time(monitor, takes)) {
                return Ok(audit);
            }
            // The edges that are left may be so narrow that no place of the audit meets one.
            self.is_close = true;
        }
        if self.light.is_empty() {
            let light = self.at_places(&self.more, monitor)?;
            self.light = light.iter().map(|e| f64::from(luminance(*e))).collect();
        }
        let apart = |(station, h): (&Station, &f64)| [(f64::from(luminance(read(station))) - h).powi(2), h * h];
        let squares: Vec<[f64; 2]> = self.more.par_iter().zip(&self.light).map(apart).collect();
        let closely = |auditor: &Auditor| auditor.judge_read(&self.at, &read_back, &squares);
        certify(&mut self.auditor, &closely, *error, paths, stages, monitor)
    }

    /// The error asked, or that of the solution where it missed this: light that is written is no better.
    pub fn reachable(&self) -> f64 {
        self.baked.error.max(self.baked.audit.upper)
    }

    /// What is to be done after an audit for the error asked, or one near that of the solution; nothing where it is met.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn goal(&mut self, audit: &Audit, monitor: &dyn Monitor) -> Result<Option<Goal>, Error> {
        let reachable = self.reachable();
        if audit.upper <= reachable {
            return Ok(None);
        }
        let square = |x: f64| x * x;
        let enough = OWN_SHARE.sqrt() * reachable;
        let at = std::mem::take(&mut self.at);
        // Where there is a deadline, points need the time more than what is known of the solution does.
        let before = match pace::left(monitor) {
            Some(_) => self.auditor.judge(&at),
            None => self.certify(&at, enough, monitor)?,
        };
        self.at = at;
        let relight = self.baked.achieved && self.look_closer(before.upper, enough, monitor)?;
        let solution = self.auditor.judge(&self.at);
        // Squared errors and what the bounds add to them: the first go with the part left, the second, which come from few
        // places with much of it, with its root q: x q² + y q = what is allowed beyond the solution's own bound.
        let x = (square(audit.error) - square(before.error)).max(0.0);
        let y = (square(audit.upper) - square(before.upper) - x).max(0.0);
        let (may_add, is_for_asked) = may_add(self.baked.error, solution.upper);
        if x + y <= if is_for_asked { 0.0 } else { may_add } {
            return Ok(None);
        }
        let allowed = AIM * may_add;
        let q = 2.0 * allowed / (y + (y * y + 4.0 * x * allowed).sqrt());
        Ok(Some(Goal { left: (q * q).min(AIM), relight, is_for_asked }))
    }

    /// Looks at places with more rays, once, if the solution's bound is more than `enough`. Answers whether points that are written
    /// get more of them, too.
    fn look_closer(&mut self, mut upper: f64, enough: f64, monitor: &dyn Monitor) -> Result<bool, Error> {
        if upper <= enough || std::mem::replace(&mut self.is_relit, true) {
            return Ok(false);
        }
        let written = |judge: &Judge| (judge.gathers(), judge.rays());
        let (mut is_better, before) = (false, written(self));
        let (mut gather, mut shadowing) = (self.gather, self.shadowing);
        for _ in 0..GATHERS {
            gather = (2 * gather).max(gather_rays(self.baked.error));
            shadowing.rays *= 2;
            let kept = (self.gather, self.shadowing);
            (self.gather, self.shadowing) = (gather, shadowing);
            let at = self.at_places(&self.baked.watched, monitor)?;
            let audit = self.certify(&at, enough, monitor)?;
            if audit.upper >= upper {
                (self.gather, self.shadowing) = kept;
                break;
            }
            (self.at, upper, is_better) = (at, audit.upper, true);
            if upper <= enough {
                break;
            }
        }
        if is_better {
            self.light.clear();
        }
        Ok(written(self) != before)
    }

    /// What the referee says of the solution's light `at` its places.
    fn certify(&mut self, at: &[Bands], target: f64, monitor: &dyn Monitor) -> Result<Audit, Error> {
        let Baked { error, stages, .. } = self.baked;
        certify(&mut self.auditor, &|auditor| auditor.judge(at), target, most_paths(*error), stages, monitor)
    }
}

/// Squared error that writing may add to such a `solution` for the error `asked`, and whether that can be met at all.
fn may_add(asked: f64, solution: f64) -> (f64, bool) {
    let is_for_asked = solution < asked;
    (if is_for_asked { asked * asked - solution * solution } else { SPARE * solution * solution }, is_for_asked)
}

/// A part of some rays; no fewer than [`LEAST_RAYS`], unless there were fewer.
pub(crate) fn thinned(rays: usize, part: f64) -> usize {
    ((rays as f64 * part) as usize).max(rays.min(LEAST_RAYS as usize))
}

/// Root mean square illuminance over the exposed surfaces as they count, lx: what relative errors are relative to.
pub(crate) fn root_mean_square(solution: &Solution) -> f64 {
    let weight = solution.counted_area();
    let square = |(h, w): (&Bands, &f64)| w * f64::from(luminance(*h)).powi(2);
    let sum: f64 = solution.irradiance().iter().zip(&weight).map(square).sum();
    (sum / weight.iter().sum::<f64>().max(f64::MIN_POSITIVE)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writing may add what a solution leaves of the error asked, and where it leaves nothing so much that all is an eighth farther off.
    #[test]
    fn writing_may_add_to_solutions_that_miss_what_is_asked() {
        let (left, is_for_asked) = may_add(0.05, 0.03);
        assert!(is_for_asked && (left.sqrt() - 0.04).abs() < 1e-12, "{left}");
        let (spare, is_for_asked) = may_add(0.05, 0.0512);
        assert!(!is_for_asked && ((1.0 + spare / 0.0512f64.powi(2)).sqrt() - 1.118).abs() < 1e-3, "{spare}");
        let goal = Goal { left: 0.001, relight: false, is_for_asked };
        assert!(goal.steps().next() == Some(STEP) && goal.steps().all(|left| left < 1.0));
    }
}
