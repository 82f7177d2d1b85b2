//! Illuminance at points, to an asked error.
//!
//! A coarse solution supplies the radiosities that a final gather at each point looks up; errors of single elements
//! average out over its rays. The referee watches a part of the points; rays are doubled until its upper bound meets
//! the target, or until the budget ends, and the report says which.

use crate::monitor::{Monitor, Stages, has_time, is_over};
use crate::{Error, Solution, SolveOptions, stations};
use glam::DVec3;
use radiosity_scene::{Bands, Side, luminance};
use radiosity_trace::{Place, Tracer};
use radiosity_transport::Shadowing;
use radiosity_view::{Audit, Auditor, FLAT, Finding, Planes};
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
    /// Rounds of refinement, each with twice the rays of the one before.
    pub rounds: usize,
    /// Seed of the audit.
    pub seed: u64,
}

impl Default for MeasureOptions {
    fn default() -> Self {
        let solve = SolveOptions { looked_up: true, cells: 1000, rays: 16, ..SolveOptions::default() };
        MeasureOptions { error: 0.01, solve, audit_points: 1000, rounds: 5, seed: 1 }
    }
}

/// Cells that a gather at each point looks up, at most, and how many at an error of 1 %: what each has wrong averages out
/// over its rays.
const LOOKED_UP_CELLS: [f64; 2] = [50_000.0, 5_000.0];

/// Cells along the mean path of light at least, however many rooms there are: a gather over wider ones is a path tracer. With 1.5
/// points in a furnished office are −0.55 % off at 2 % and 4 %, by finer cells in which direct light may vary as much.
const CELLS_ON_PATH: f64 = 1.0;

/// Variation of direct light within an element that is looked up, by the error asked.
const VARIATION: f64 = 5.0;

/// Part of the error asked that a round aims at: its bound has to meet that, too.
const AIM: f64 = 0.6;

/// Part of the error asked that an answer has for certain when more rays are a better use of time than a closer look.
const HOPELESS: f64 = 0.8;

/// Doublings of the rays that a place gets by its light, from the darkest to the brightest. In a furnished office at 1 %
/// one place in a hundred is off by 14 % or more so, in 13.6 s; with a quarter of the rays in the dark by 16.5 %, in 12.3 s.
const DOUBLINGS: [i32; 2] = [-1, 2];

/// Most that the rays grow by from one round to the next.
const MOST_GROWTH: f64 = 8.0;

/// Fewest pairs of estimates that an audit judges by.
const LEAST_WATCHED: usize = 64;

/// Up to how many times as many paths go to each point where points are few.
const CLOSER: usize = 16;

/// How much longer a round takes than the one before, about: twice the rays, and more of them find something.
pub(crate) const ROUND_GROWTH: f64 = 2.5;

/// Fewest gather rays that an answer is given with.
const FEWEST_GATHERED: usize = 32;

/// One round of refinement.
#[derive(Clone, Debug, Serialize)]
pub struct Round {
    /// Elements.
    pub elements: usize,
    /// Rays per cell; the elements of a divided cell share them.
    pub rays: usize,
    /// Gather rays per point; zero where the field was interpolated.
    pub gather: usize,
    /// Shadow rays at each point, over all lights.
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
    pub(crate) fn new(
        solution: &Solution,
        gather: usize,
        shadowing: &Shadowing,
        audit: &Audit,
        start: Instant,
    ) -> Round {
        Round {
            elements: solution.elements.len(),
            rays: solution.rays(),
            gather,
            shadow_rays: shadowing.rays,
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
    /// What the referee says.
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
    let mut solve = options.solve;
    // The elements are only looked up, and the noise of many averages out: few rays each.
    solve.rays = solve.rays.max(rays_for(options.error, 32.0, 16, 1024));
    let [most, at_one_percent] = LOOKED_UP_CELLS;
    solve.cells = solve.cells.max((at_one_percent * 0.01 / options.error).min(most) as usize);
    solve.cells_on_path(tracer, CELLS_ON_PATH);
    solve.variation = solve.variation.min(VARIATION * options.error);
    solve.suit_method();
    solve.fit(tracer);
    let wanted = rays_for(options.error, 512.0, FEWEST_GATHERED, 16384);
    // Within a time limit one comes to them step by step.
    let mut gather = if monitor.deadline().is_some() { FEWEST_GATHERED } else { wanted };
    let shadow_rays = rays_for(options.error, 512.0, 32, 8192);
    let mut shadowing = Shadowing { places: 1, rays: (shadow_rays * gather / wanted).max(16) as u32 };
    monitor.round(1, options.rounds + 1);
    let mut solution = Solution::new(tracer, &solve, monitor)?;

    // The referee looks at every n-th point.
    let stride = places.len().div_ceil(options.audit_points.max(1)).max(1);
    let mut watched: Vec<usize> = (0..places.len()).step_by(stride).collect();
    // Few points are looked at several times, each time by independent paths, so that the audit knows its own noise.
    while !watched.is_empty() && watched.len() < LEAST_WATCHED {
        watched.extend_from_within(..);
    }
    let watched_places: Vec<Place> = watched.iter().map(|&i| places[i]).collect();
    let expected = solution.irradiance_at(&watched_places);
    let mut auditor = Auditor::new(tracer, watched_places, &expected, options.seed);
    // Few points can be looked at more closely for the same work.
    let closer = (options.audit_points / watched.len().max(1)).clamp(1, CLOSER) as u32;
    let most_paths = most_paths(options.error).saturating_mul(closer);
    let mut rounds = Vec::new();
    // Nothing is shared in the open: planes of a million triangles would take 360 MB and four seconds.
    let is_on_surface = |place: &Place| (place.triangle as usize) < tracer.mesh.triangles.len();
    let planes = places.iter().any(is_on_surface).then(|| Planes::new(tracer.mesh, &solution.elements));
    loop {
        let mut begun = Instant::now();
        let mut irradiance = gathered((&solution, planes.as_ref()), &places, gather, &shadowing, monitor)?;
        while gather < wanted && has_time(monitor, ROUND_GROWTH * begun.elapsed().as_secs_f64()) {
            gather *= 2;
            shadowing.rays = (shadow_rays * gather / wanted).max(16) as u32;
            begun = Instant::now();
            irradiance = gathered((&solution, planes.as_ref()), &places, gather, &shadowing, monitor)?;
        }
        let watched: Vec<Bands> = watched.iter().map(|&i| irradiance[i]).collect();
        // Where no better answer follows, this one is looked at as closely as it takes.
        let is_final = rounds.len() >= options.rounds;
        let target = (options.error, if is_final { Audit::is_above } else { is_hopeless as fn(&Audit, f64) -> bool });
        let judge = |auditor: &Auditor| auditor.judge(&watched);
        let audit = certify_unless(&mut auditor, judge, target, most_paths, &stages, monitor)?;
        rounds.push(Round::new(&solution, gather, &shadowing, &audit, start));
        monitor.note(&rounds[rounds.len() - 1].to_string());
        let achieved = audit.upper <= options.error;
        // Rays alone did not do twice: smaller elements as well.
        let smaller = (rounds.len() % 2 == 0 && options.solve.element_size.is_none())
            .then_some(solution.element_size / std::f64::consts::SQRT_2);
        let size = Some(smaller.unwrap_or(solution.element_size));
        let next = SolveOptions { element_size: size, rays: 2 * solution.rays(), ..solve };
        let fits = Solution::fits(tracer, &next);
        let is_last = achieved || rounds.len() > options.rounds || places.is_empty() || !fits || is_stalled(&rounds);
        let growth = growth(audit.error / options.error);
        let takes = 0.5 * growth as f64 * ROUND_GROWTH * begun.elapsed().as_secs_f64();
        let out_of_time = !is_last && !has_time(monitor, takes);
        if is_last || out_of_time {
            stages.absorb(&solution.stages);
            return Ok(Measurement {
                irradiance,
                audit,
                achieved,
                out_of_time: !achieved && (out_of_time || is_over(monitor)),
                rounds,
                stages,
                residual: solution.info.residual.clone(),
                bound: solution.info.bound.clone(),
            });
        }
        monitor.round(rounds.len() + 1, options.rounds + 1);
        gather *= growth;
        shadowing.rays *= growth as u32;
        if smaller.is_some() {
            stages.absorb(&solution.stages);
            drop(solution);
            solution = Solution::new(tracer, &next, monitor)?;
        } else {
            solution.refine(next.rays, monitor)?;
        }
    }
}

/// Irradiance at places by a gather: bright ones get more rays than dark ones ([`DOUBLINGS`]), as noise is in proportion
/// to light and the error is that of all places together. What is bright the solution knows; the rays that
/// are to be judged have no say in their number. Places of one plane share what they gather, as far as it is smooth.
fn gathered(
    (solution, planes): (&Solution, Option<&Planes>),
    places: &[Place],
    gather: usize,
    shadowing: &Shadowing,
    monitor: &dyn Monitor,
) -> Result<Vec<Bands>, Error> {
    let known = |place| solution.element_at(place).map(|e| luminance(solution.irradiance()[e as usize]));
    let light: Vec<Option<f32>> = places.iter().map(known).collect();
    let (sum, count) = light.iter().flatten().fold((0.0, 0), |(sum, count), e| (sum + f64::from(*e), count + 1));
    let [least, most] = DOUBLINGS;
    let doublings = |light: &Option<f32>| match light {
        Some(e) if sum > 0.0 => {
            let relative = f64::from(*e) * f64::from(count) / sum;
            relative.log2().round().clamp(f64::from(least), f64::from(most)) as i32
        }
        _ => 0,
    };
    let classes: Vec<i32> = light.iter().map(doublings).collect();
    let mut irradiance = vec![[0.0; 3]; places.len()];
    let (mut on_planes, mut found) = (Vec::new(), Vec::new());
    for class in least..=most {
        let own: Vec<usize> = (0..places.len()).filter(|&i| classes[i] == class).collect();
        if own.is_empty() {
            continue;
        }
        let scaled = |rays: usize, least: usize| (rays as f64 * 2f64.powi(class)).max(least as f64) as usize;
        let shadowing = Shadowing { rays: scaled(shadowing.rays as usize, 16) as u32, ..*shadowing };
        let own_places: Vec<Place> = own.iter().map(|&i| places[i]).collect();
        let answer = solution.gathered(&own_places, scaled(gather, FEWEST_GATHERED), &shadowing, monitor)?;
        for (k, &i) in own.iter().enumerate() {
            let (all, direct) = (answer.irradiance[k], answer.direct[k]);
            irradiance[i] = all;
            if let Some(side) = side_of(solution, &places[i]) {
                let Place { point, triangle, .. } = places[i];
                let light = std::array::from_fn(|band| all[band] - direct[band]);
                let noise = luminance(answer.standard_error[k]);
                let weight = 2f64.powi(class);
                found.push(Finding { point, triangle: triangle as usize, side, light, noise, weight });
                on_planes.push((i, direct));
            }
        }
    }
    let pooled = planes.map_or_else(Vec::new, |planes| planes.pooled(&found));
    for ((i, direct), pooled) in on_planes.into_iter().zip(pooled) {
        irradiance[i] = std::array::from_fn(|band| direct[band] + pooled.light[band]);
    }
    // What paths find beyond what they look up may be less than nothing.
    irradiance.iter_mut().for_each(|e| *e = e.map(|e| e.max(0.0)));
    Ok(irradiance)
}

/// The side of a triangle that a place lies on and receives like; none in the open, and where it has a normal of its own.
fn side_of(solution: &Solution, place: &Place) -> Option<Side> {
    let mesh = solution.tracer().mesh;
    let triangle = place.triangle as usize;
    let cosine = (triangle < mesh.triangles.len()).then(|| mesh.normal(triangle).dot(place.normal))?;
    (cosine.abs() > FLAT).then_some(if cosine > 0.0 { Side::Front } else { Side::Back })
}

/// Times as many rays for the next round after one that ended at an error, relative to that asked.
fn growth(error: f64) -> usize {
    // Error ∝ M^−0.7, as that of stratified samples is.
    let wanted = (error / AIM).powf(1.0 / 0.7).clamp(2.0, MOST_GROWTH);
    wanted.ceil() as usize
}

/// Two rounds that leave more than this part of the error before them are the last: what remains is not noise. One
/// alone may have had bad luck.
const STALLED: f64 = 0.9;

/// Whether the last two rounds brought next to nothing.
pub(crate) fn is_stalled(rounds: &[Round]) -> bool {
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

/// Paths per estimate that every audit begins with.
pub(crate) const FIRST_PATHS: u32 = 64;

/// Paths of the referee, over all places, before a miss is believed: a few thousand, and what one bright path in them
/// says of a few places may be wrong by more than its own scatter tells.
const SURE: u32 = 1 << 16;

/// Whether an answer is not worth a closer look: it may be within the target, but to know that for certain would take
/// more paths than better answers take rays.
fn is_hopeless(audit: &Audit, target: f64) -> bool {
    audit.lower > HOPELESS * target
}

/// Has the auditor `judge` an answer, spending the referee's paths until the answer meets the target or misses it for certain:
/// taking an estimate for the truth would refine for the noise of the referee.
pub(crate) fn certify(
    auditor: &mut Auditor,
    judge: impl Fn(&Auditor) -> Audit,
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
    judge: impl Fn(&Auditor) -> Audit,
    (target, is_given_up): (f64, fn(&Audit, f64) -> bool),
    most_paths: u32,
    stages: &Stages,
    monitor: &dyn Monitor,
) -> Result<Audit, Error> {
    let start = Instant::now();
    stages.time(monitor, "audit", || {
        let total = auditor.places().len();
        if auditor.paths() == 0 && !auditor.trace(FIRST_PATHS, |done| monitor.step(done, total)) {
            return Err(Error::Stopped);
        }
        let least = SURE.div_ceil(total.max(1) as u32);
        loop {
            let audit = judge(auditor);
            let unsure = !is_given_up(&audit, target) || auditor.paths() < least;
            // As many paths again take about as long as all so far, of which those of this call are known.
            let again = stages.of("audit") + start.elapsed().as_secs_f64();
            let open = unsure && target < audit.upper && 2 * auditor.paths() <= most_paths && has_time(monitor, again);
            if !open {
                return Ok(audit);
            }
            if !auditor.trace(2 * auditor.paths(), |done| monitor.step(done, total)) {
                return Err(Error::Stopped);
            }
        }
    })
}
