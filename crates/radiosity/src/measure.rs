//! Illuminance at points, to an asked error.
//!
//! A coarse solution supplies the radiosities that a final gather at each point looks up; errors of single elements
//! average out over its rays. The referee watches a part of the points; what is wrong beyond the noise of the
//! points, which they tell by themselves, is the solution's. Either is mended until the upper bound meets the target, or until the
//! budget ends, and the report says which.

use crate::monitor::{Monitor, Stages, has_time, is_over};
use crate::points::{Asked, Light, Rays};
use crate::solution::Looking;
use crate::{Error, Solution, SolveOptions, stations};
use glam::DVec3;
use radiosity_scene::{Bands, Curve, luminance};
use radiosity_trace::{Place, Tracer};
use radiosity_view::{Audit, Auditor};
use serde::Serialize;
use std::time::Instant;

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct MeasureOptions {
    /// Relative L2 error to reach, e.g. 0.01.
    pub error: f64,
    /// How to solve; its rays and shadow rays are the least that is used.
    pub solve: SolveOptions,
    /// Points that the referee examines.
    pub audit_points: usize,
    /// Rounds of refinement at most; as many more as come to a finer error than the first one within a time limit is made for.
    pub rounds: usize,
    /// Seed of the audit.
    pub seed: u64,
}

impl Default for MeasureOptions {
    fn default() -> Self {
        let solve = SolveOptions { looked_up: true, cells: 1000, rays: 8, ..SolveOptions::default() };
        MeasureOptions { error: 0.01, solve, audit_points: 1000, rounds: 5, seed: 1 }
    }
}

/// Cells that a gather at each point looks up, at most, and how many at an error of 1 %: what each has wrong averages out
/// over its rays. Of many points there are more ([`Crowd`]).
const LOOKED_UP_CELLS: [f64; 2] = [50_000.0, 5_000.0];

/// The least error that a solution is made for at first within a time limit: where 0.01 % was asked of the Cornell box, one for that left
/// the points 2.0 % off after 4 s, and one for 1 % 0.2 %.
const BEGUN_FOR: f64 = 0.01;

/// Cells along the mean path of light at least, however many rooms there are: a gather over wider ones is a path tracer. With 1.5
/// points in a furnished office are −0.55 % off at 2 % and 4 %, by finer cells in which direct light may vary as much.
const CELLS_ON_PATH: f64 = 1.0;

/// Variation of direct light within an element that is looked up, by the error asked.
const VARIATION: f64 = 5.0;

/// Part of the error asked that a round aims at: its bound has to meet that, too.
const AIM: f64 = 0.7;

/// Part of the error asked that an answer has for certain when more rays are a better use of time than a closer look.
const HOPELESS: f64 = 0.8;

/// Noise of the points that is left, relative to the error asked: the less there is, the fewer paths an audit needs to see that what is asked
/// is met. With 0.55 the office at 1 % took two rounds and 25 s instead of one and 13 s.
const NOISE: f64 = 0.45;

/// Noise of the next round over that of this one, at most.
const LESS: f64 = 0.7;

/// Noise and all the rest of the error may have at least this part each of what a round aims at.
const LEAST_PART: f64 = 0.5;

/// Fewest estimates that an audit judges by.
const LEAST_ESTIMATES: usize = 128;

/// Up to how many times as many paths go to each point where points are few.
const CLOSER: usize = 16;

/// How much longer a round takes than the one before, about: with twice the rays, more of them find something.
pub(crate) const ROUND_GROWTH: f64 = 2.5;

/// First gather rays and shadow rays of each point at 1 %: a quarter and a seventh of what they have in a furnished office in the end. The others are sent by what
/// these tell: with half as many the office takes 2 to 5 % longer, and the Cornell box a seventh for as much noise, where most points need about as many.
const FIRST_RAYS: [f64; 2] = [512.0, 256.0];

/// Most first rays: whoever is noisy asks for more.
const MOST_FIRST: usize = 4096;

/// Points for which the solution takes about as long in a furnished office as what each gathers.
const BALANCED: f64 = 2000.0;

/// From so many times as many points on, each begins with a few rays: what it gathers is shared with many others.
const SHARED: f64 = 4.0;

/// Part of the first gather rays that each of them begins with; what is noisy asks for more.
const FIRST_PART: f64 = 0.125;

/// Exponent by which their cells grow with the points: with one half the solution would keep its part of the time if both took it alike.
const CELLS_GROW: f64 = 0.4;

/// Exponent by which the noise that is left grows with the points, whose solution is better.
const NOISE_GROWS: f64 = 0.125;

/// Noise that is left of many points, relative to the error asked, at most: with 0.7 what a camera sees of a furnished office took two rounds at
/// 2 %, and twice as long.
const MOST_NOISE: f64 = 0.55;

/// What is done otherwise where points are many. All look up one solution, which may take longer, and what is left of the error is mostly their noise;
/// and in an empty room a few rays each will do. By the square root of their number the one would take as long as the other if both grew alike, but
/// elements that are twice as many leave less than half of what they have wrong. For 100,000 points in a furnished office 1 % takes 123
/// instead of 165 s, in the Cornell box 5 instead of 14 s.
#[derive(Clone, Copy, Debug)]
struct Crowd {
    /// How many times as many cells.
    cells: f64,
    /// Noise that is left, relative to the error asked.
    noise: f64,
    /// Part of the first gather rays that each begins with.
    first: f64,
}

impl Crowd {
    fn of(points: usize) -> Crowd {
        let crowd = (points as f64 / BALANCED).max(1.0);
        Crowd {
            cells: crowd.powf(CELLS_GROW),
            noise: (NOISE * crowd.powf(NOISE_GROWS)).min(MOST_NOISE),
            first: if crowd < SHARED { 1.0 } else { FIRST_PART },
        }
    }

    /// The first rays of each, where others have so many.
    fn first(&self, [gather, shadow]: Rays) -> Rays {
        [((self.first * gather as f64) as usize).max(FEWEST[0]), shadow]
    }
}

/// Fewest gather rays and shadow rays that an answer is given with.
const FEWEST: Rays = [32, 32];

/// Noise within this of what it is to be is not worth another step.
pub(crate) const ENOUGH: f64 = 1.1;

/// One round of refinement.
#[derive(Clone, Debug, Serialize)]
pub struct Round {
    /// Elements.
    pub elements: usize,
    /// Rays per cell; the elements of a divided cell share them.
    pub rays: usize,
    /// Gather rays per point, on average; zero where the field was interpolated.
    pub gather: usize,
    /// Shadow rays at each point, over all lights, on average.
    pub shadow_rays: u32,
    /// Estimated error.
    pub error: f64,
    /// Its upper bound.
    pub upper: f64,
    /// Seconds since the start.
    pub seconds: f64,
}

impl Round {
    /// What has been done since `start`, and what came of it.
    pub(crate) fn new(solution: &Solution, [gather, shadow_rays]: Rays, audit: &Audit, start: Instant) -> Round {
        Round {
            elements: solution.elements.len(),
            rays: solution.rays(),
            gather,
            shadow_rays: shadow_rays as u32,
            error: audit.error,
            upper: audit.upper,
            seconds: start.elapsed().as_secs_f64(),
        }
    }
}

impl std::fmt::Display for Round {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "error {:.2} %, at most {:.2} %", 100.0 * self.error, 100.0 * self.upper)
    }
}

/// Irradiance at points, and how far to trust it.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Irradiance, lux per band.
    pub irradiance: Vec<Bands>,
    /// What the referee says of it. Where no round met what is asked this is the one with the lowest upper bound, which need not be the last of
    /// [`Measurement::rounds`].
    pub audit: Audit,
    /// Whether the audit's upper bound meets the asked error.
    pub achieved: bool,
    /// Whether it does not because time was over ([`Monitor::deadline`]).
    pub out_of_time: bool,
    /// The rounds.
    pub rounds: Vec<Round>,
    /// Time by stage.
    pub stages: Stages,
    /// Solver's residual by band.
    pub residual: Vec<f64>,
    /// Guaranteed bound of the solver's error by band, lm/m².
    pub bound: Vec<f64>,
}

impl Measurement {
    /// The answer of an earlier round, where that has the lower bound.
    fn or_better(self, before: Option<Measurement>) -> Measurement {
        before.filter(|before| before.audit.upper < self.audit.upper).unwrap_or(self)
    }
}

/// `base` at 1 %, growing with the accuracy asked as stratified sampling needs (error ∝ M^−0.7), as a power of two.
pub(crate) fn rays_for(error: f64, base: f64, least: usize, most: usize) -> usize {
    let wanted = (base * (0.01 / error).powf(1.4)).clamp(least as f64, most as f64) as usize;
    wanted.next_power_of_two().min(most)
}

/// Measures irradiance at points with unit normals.
///
/// # Errors
/// As [`Solution::new`]. Not reaching the error asked is not an error: see [`Measurement::achieved`].
pub fn measure(
    tracer: &Tracer,
    points: &[(DVec3, DVec3)],
    options: &MeasureOptions,
    monitor: &dyn Monitor,
) -> Result<Measurement, Error> {
    let start = Instant::now();
    let stages = Stages::default();
    let places: Vec<Place> = points.iter().map(|(p, n)| stations::snap(tracer, *p, *n)).collect();
    // Rays of neighbours one after another find the same boxes in the caches. Of 94,000 points strewn over a furnished office, 2 % asked, rays
    // took 58 s in the order they were given, and 47 s so.
    let order = Curve::order(&places.iter().map(|place| place.point).collect::<Vec<_>>());
    let visited: Vec<Place> = order.iter().map(|&i| places[i]).collect();
    let mut solve = options.solve;
    solve.shown = false;
    // Within a time limit one comes to what is needed step by step.
    let begun_for = if monitor.deadline().is_some() { options.error.max(BEGUN_FOR) } else { options.error };
    // The elements are only looked up, and the noise of many averages out: few rays each.
    solve.rays = solve.rays.max(rays_for(begun_for, 16.0, 8, 1024));
    let crowd = Crowd::of(if monitor.deadline().is_some() { 0 } else { places.len() });
    let [most, at_one_percent] = LOOKED_UP_CELLS;
    solve.cells = solve.cells.max((crowd.cells * (at_one_percent * 0.01 / begun_for).min(most)) as usize);
    solve.cells_on_path(tracer, CELLS_ON_PATH);
    let least_variation = VARIATION * options.error / crowd.cells.sqrt();
    let most_rounds = options.rounds + 1 + (begun_for / options.error).log2().ceil() as usize;
    solve.variation = solve.variation.min(VARIATION * begun_for / crowd.cells.sqrt());
    solve.suit_method();
    solve.fit(tracer, monitor);
    let usual_first = std::array::from_fn(|k| rays_for(options.error, FIRST_RAYS[k], FEWEST[k], MOST_FIRST));
    let mut first = if monitor.deadline().is_some() { FEWEST } else { usual_first };
    monitor.round(1, most_rounds);
    let mut solving = Instant::now();
    let mut solution = Solution::focused(tracer, &solve, &Looking::Places(&places), (&stages, monitor))?;
    let least_rays = std::mem::replace(&mut solve, solution.options).rays;
    let mut solution_takes = solving.elapsed().as_secs_f64();

    // The referee looks at every n-th point.
    let stride = places.len().div_ceil(options.audit_points.max(1)).max(1);
    let watched: Vec<usize> = (0..places.len()).step_by(stride).collect();
    // Few points are looked at several times, each time by independent paths, so that the audit knows its own noise.
    let looks = LEAST_ESTIMATES.div_ceil(watched.len().max(1)).max(2);
    let watched_places: Vec<Place> = watched.iter().map(|&i| places[i]).collect();
    let expected = solution.irradiance_at(&watched_places);
    let mut auditor = Auditor::closer(tracer, watched_places, &expected, looks, options.seed);
    // Few points can be looked at more closely for the same work.
    let closer = (2 * options.audit_points / auditor.estimates().max(1)).clamp(1, CLOSER) as u32;
    let most_paths = most_paths(options.error).saturating_mul(closer);
    let (mut rounds, mut solved) = (Vec::new(), 0);
    let mut light = Light::new(&solution, &visited[..], crowd.first(first), monitor)?;
    let mut noise_asked = crowd.noise * options.error;
    let mut best: Option<Measurement> = None;
    loop {
        let begun = Instant::now();
        // Where the first rays found no light they tell no noise either.
        let size = root_mean_square(&light.irradiance()).max(f64::from(f32::MIN_POSITIVE));
        let noise = noise_asked * size;
        let mut lacks_time = !quieten(&mut light, &solution, (first[0], noise), monitor)?;
        // Few rays that missed what is bright tell no noise. Where a limit leaves time, points have as many as they begin with where there is none.
        let more = crowd.first(usual_first)[0].saturating_sub(light.fewest());
        let takes = light.seconds * more as f64 / light.rays()[0].max(1) as f64;
        if !lacks_time && more > 0 && has_time(monitor, 1.5 * takes) {
            light.add(&solution, more, monitor)?;
            lacks_time = !quieten(&mut light, &solution, (first[0], noise), monitor)?;
        }
        let mut irradiance = vec![[0.0; 3]; places.len()];
        order.iter().zip(light.irradiance()).for_each(|(&i, light)| irradiance[i] = light);
        let watched: Vec<Bands> = watched.iter().map(|&i| irradiance[i]).collect();
        // Where no better answer follows, this one is looked at as closely as it takes.
        let is_final = rounds.len() + 1 >= most_rounds;
        let target = (options.error, if is_final { Audit::is_above } else { is_hopeless as fn(&Audit, f64) -> bool });
        let judge = |auditor: &Auditor| auditor.judge(&watched);
        let audit = certify_unless(&mut auditor, &judge, target, most_paths, &stages, monitor)?;
        rounds.push(Round::new(&solution, light.rays(), &audit, start));
        monitor.note(&rounds[rounds.len() - 1].to_string());

        let plan = Plan::after(audit.error, light.noise() / size, options.error);
        let answer = Measurement {
            irradiance,
            achieved: audit.upper <= options.error,
            audit,
            out_of_time: false,
            rounds: Vec::new(),
            stages: Stages::default(),
            residual: solution.info.residual.clone(),
            bound: solution.info.bound.clone(),
        };
        // A finer solution need not be a better one, and a time limit may have left too little for its points.
        let answer = answer.or_better(best.take());
        let alone = options.solve.element_size.is_some() || solved % 2 == 1;
        // Rays alone, where there are as many as may be, would be the same again.
        let alone = alone && solution.most_rays(solve.cells) > solution.rays();
        let mut next = if plan.solves_again { finer(&solve, solution.rays(), alone, least_variation) } else { solve };
        next.rays = next.rays.min(solution.most_rays(next.cells)).max(least_rays);
        let is_last = answer.achieved
            || rounds.len() >= most_rounds
            || places.is_empty()
            || is_stalled(&rounds)
            || !solution.has_room_for(&next);
        let takes = match plan.solves_again {
            true => ROUND_GROWTH * (solution_takes + light.seconds),
            false => light.seconds.max(begun.elapsed().as_secs_f64()),
        };
        let out_of_time = !is_last && (lacks_time || !has_time(monitor, takes));
        if is_last || out_of_time {
            stages.absorb(&solution.stages);
            let out_of_time = !answer.achieved && (out_of_time || solution.is_cut || is_over(monitor));
            return Ok(Measurement { out_of_time, rounds, stages, ..answer });
        }
        monitor.round(rounds.len() + 1, most_rounds);
        noise_asked = plan.noise;
        if plan.solves_again {
            solving = Instant::now();
            stages.absorb(&solution.stages);
            solution.stages = Stages::default();
            let Some(again) = solved_again(solution, (&solve, &next), tracer, monitor)? else {
                return Ok(Measurement { rounds, stages, ..answer });
            };
            solution = again;
            solution_takes = solving.elapsed().as_secs_f64();
            (solve, solved) = (next, solved + 1);
            // What few rays found may have missed much, and they may tell little noise: twice as many to begin with.
            first = first.map(|rays| (2 * rays).min(MOST_FIRST));
            light.begin(&solution, crowd.first(first), monitor)?;
        }
        best = Some(answer);
    }
}

/// Sends rays until no more `noise` is left, lx, after so many first gather rays where points began with fewer. Whether there was time.
fn quieten<A: Asked>(
    light: &mut Light<A>,
    solution: &Solution,
    (first, noise): (usize, f64),
    monitor: &dyn Monitor,
) -> Result<bool, Error> {
    if light.rays()[0] < first {
        light.raise(solution, noise, first, monitor)?;
    }
    // What is shared is less noisy than its rays, and the less so the more there are: one step does not do. Within a time limit steps
    // are short.
    let most = monitor.deadline().map(|_| 2.0);
    while light.noise() > ENOUGH * noise {
        if !has_time(monitor, 1.5 * light.seconds) {
            return Ok(false);
        }
        if !light.grow(solution, noise, most, monitor)? {
            break;
        }
    }
    Ok(true)
}

/// A solution from one by `before`; none where there is no room for it, of which a file's is told.
fn solved_again<'t>(
    mut solution: Solution<'t>,
    (before, next): (&SolveOptions, &SolveOptions),
    tracer: &'t Tracer<'t>,
    monitor: &dyn Monitor,
) -> Result<Option<Solution<'t>>, Error> {
    let again = if next.cells == before.cells {
        solution.refine(next.rays, monitor).map(|()| solution)
    } else {
        let scales = std::mem::take(&mut solution.scales);
        drop(solution);
        Solution::scaled(tracer, scales, next, monitor)
    };
    match again {
        // How much room elements take is known once they are made.
        Err(Error::Memory { .. }) => Ok(None),
        Err(Error::File(error)) => {
            monitor.warn(&format!("{error}; the answer is that of the rounds before"));
            Ok(None)
        }
        again => again.map(Some),
    }
}

/// What the next round mends.
#[derive(Clone, Copy, Debug)]
struct Plan {
    /// Noise of the points that is left, relative to their light.
    noise: f64,
    /// Whether what is not noise of the points is too much, which only another solution mends.
    solves_again: bool,
}

impl Plan {
    /// After a round with so much error and noise of the points, both relative to their light, where so much is asked.
    fn after(error: f64, noise: f64, asked: f64) -> Plan {
        let aim = AIM * asked;
        let rest = (error.powi(2) - noise.powi(2)).max(0.0).sqrt();
        let solves_again = rest > aim * (1.0 - LEAST_PART.powi(2)).sqrt();
        // Another solution may halve the square of what it has wrong; without one, noise falls in any case.
        let (rest, most) =
            if solves_again { (std::f64::consts::FRAC_1_SQRT_2 * rest, NOISE * asked) } else { (rest, LESS * noise) };
        let noise = (aim.powi(2) - rest.powi(2)).max(0.0).sqrt().max(LEAST_PART * aim).min(most);
        Plan { noise, solves_again }
    }
}

/// How to solve for less error than a solution with so many rays has: with twice as many, and with smaller elements and more places on
/// each that look at lights, where light varies less if it may, unless with rays `alone`.
fn finer(solve: &SolveOptions, rays: usize, alone: bool, least_variation: f64) -> SolveOptions {
    let mut next = SolveOptions { rays: 2 * rays, ..*solve };
    if !alone {
        next.cells *= 2;
        next.shadowing.places *= 2;
        next.variation = solve.variation.min((0.5 * solve.variation).max(least_variation));
    }
    next
}

/// Root mean square illuminance, lx.
fn root_mean_square(irradiance: &[Bands]) -> f64 {
    let square = |e: &Bands| f64::from(luminance(*e)).powi(2);
    (irradiance.iter().map(square).sum::<f64>() / irradiance.len().max(1) as f64).sqrt()
}

/// Two rounds that leave more than this part of the error before them are the last: what remains is not noise. One
/// alone may have had bad luck.
const STALLED: f64 = 0.9;

/// Whether the last two rounds brought next to nothing.
pub fn is_stalled(rounds: &[Round]) -> bool {
    brought_nothing(&rounds.iter().map(|round| round.error).collect::<Vec<_>>())
}

/// The same by their errors.
pub(crate) fn brought_nothing(errors: &[f64]) -> bool {
    matches!(errors, [.., before, _, last] if *last > STALLED * before)
}

/// Paths per estimate that an audit spends at most.
pub(crate) fn most_paths(error: f64) -> u32 {
    rays_for(error, 4096.0, 64, 1 << 16) as u32
}

/// Paths per estimate that every audit begins with: about as sure as 64 before paths began at lamps, too. With 40 the box at 1 % takes a tenth less time than
/// with 64, the office as long.
pub(crate) const FIRST_PATHS: u32 = 48;

/// Paths of the referee, over all estimates, before a miss is believed: a few thousand, and what one bright path in them
/// says of a few places may be wrong by more than its own scatter tells.
const SURE: u32 = 1 << 17;

/// Whether an answer is not worth a closer look: it may be within the target, but to know that for certain would take
/// more paths than better answers take rays.
fn is_hopeless(audit: &Audit, target: f64) -> bool {
    audit.lower > HOPELESS * target
}

/// Has the auditor `judge` an answer, spending the referee's paths until the answer meets the target, misses it for certain, or more of them would tell nothing:
/// taking an estimate for the truth would refine for the noise of the referee.
pub(crate) fn certify(
    auditor: &mut Auditor,
    judge: &dyn Fn(&Auditor) -> Audit,
    target: f64,
    most_paths: u32,
    stages: &Stages,
    monitor: &dyn Monitor,
) -> Result<Audit, Error> {
    certify_unless(auditor, judge, (target, Audit::is_above), most_paths, stages, monitor)
}

/// The same, until the answer meets the target or is given up.
fn certify_unless(
    auditor: &mut Auditor,
    judge: &dyn Fn(&Auditor) -> Audit,
    (target, is_given_up): (f64, fn(&Audit, f64) -> bool),
    most_paths: u32,
    stages: &Stages,
    monitor: &dyn Monitor,
) -> Result<Audit, Error> {
    let start = Instant::now();
    stages.time(monitor, "audit", || {
        let total = auditor.estimates();
        if auditor.paths() == 0 && !auditor.trace(FIRST_PATHS, &|done| monitor.step(done, total)) {
            return Err(Error::Stopped);
        }
        let least = SURE.div_ceil(total.max(1) as u32);
        loop {
            let audit = judge(auditor);
            let unsure = !is_given_up(&audit, target) || auditor.paths() < least;
            // As many paths again take about as long as all so far, of which those of this call are known.
            let again = stages.of("audit") + start.elapsed().as_secs_f64();
            let before = f64::from(auditor.paths());
            let paths = ((audit.growth(target) * before).ceil() as u32).min(most_paths);
            let is_in_vain = !audit.is_of_paths() && auditor.paths() >= least;
            let is_enough = target >= audit.upper || is_in_vain || paths <= auditor.paths();
            if is_enough || !unsure || !has_time(monitor, (f64::from(paths) / before - 1.0) * again) {
                return Ok(audit);
            }
            if !auditor.trace(paths, &|done| monitor.step(done, total)) {
                return Err(Error::Stopped);
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_mends_what_is_wrong() {
        // Mostly noise: as much less as leaves room for the rest, and less in any case.
        let plan = Plan::after(0.02, 0.0197, 0.01);
        assert!(!plan.solves_again && plan.noise < 0.0065 && plan.noise > 0.005, "{plan:?}");
        let plan = Plan::after(0.006, 0.005, 0.01);
        assert!(!plan.solves_again && (plan.noise / (LESS * 0.005) - 1.0).abs() < 1e-9, "{plan:?}");
        // Mostly the solution: another one, and what noise is left is what every first round has, or less.
        let plan = Plan::after(0.02, 0.005, 0.01);
        assert!(plan.solves_again && plan.noise <= NOISE * 0.01 && plan.noise >= LEAST_PART * AIM * 0.01, "{plan:?}");
        // An estimate below the noise is no error of the solution.
        assert!(!Plan::after(0.0, 0.005, 0.01).solves_again);
    }

    #[test]
    fn of_rounds_the_one_with_the_lowest_bound_answers() {
        let with = |upper: f64| Measurement {
            irradiance: vec![[upper as f32; 3]],
            audit: Audit { upper, ..Audit::default() },
            achieved: false,
            out_of_time: false,
            rounds: Vec::new(),
            stages: Stages::default(),
            residual: Vec::new(),
            bound: Vec::new(),
        };
        let answer = [0.015, 0.0032, 0.0065].map(with).into_iter().fold(None, |best, next| Some(next.or_better(best)));
        let answer = answer.unwrap();
        assert!(answer.audit.upper == 0.0032 && answer.irradiance == [[0.0032; 3]], "{answer:?}");
    }
}
