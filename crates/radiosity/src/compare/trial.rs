//! One contender at one setting: what it cost and how far off it is.
//!
//! Errors are against the exact discrete answer: of F by ‖F − F*‖/‖F*‖ over all entries, of light by area-weighted
//! relative L2 of illuminance (the errors of the audit) and of reflected radiosity. One solver, at one tolerance far below
//! anything else, solves for all.

use super::allowance::{Allowance, processor_seconds};
use super::contender::{Contender, Kind, Setting};
use super::problem::{Problem, Whole, bright};
use super::reference::Reference;
use crate::{Error, Monitor};
use radiosity_scene::{Bands, SkyPatches};
use radiosity_solve::{Go, Params, SolveError, Solver, Transport, solve};
use radiosity_transport::pair::blockers::Blockers;
use radiosity_transport::view_factors::Closure;
use radiosity_transport::{
    Exposure, FormFactorMethod, FormFactors, HitTable, IdSpace, Light, Luminaires, Occlusion, PairMethod, Progress,
    Shadowing,
};
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// The solver of all trials: it needs no more of F than to be applied, and is quick in white rooms too.
pub(super) const SOLVER: Solver = Solver::DeflatedJacobi;

/// Its tolerance: a hundredth of the best contender's error.
const TOLERANCE: f64 = 1e-10;

/// Runs shorter than this are repeated, seconds: other work of the machine would show.
const SHORT: f64 = 0.1;

/// How often a short run is made; the least time counts.
const REPEATS: usize = 3;

/// Pairs that tell how long all pairs will take.
const PROBED_PAIRS: usize = 96;

/// Seconds after which fewer pairs must do.
const PROBE: f64 = 0.6;

/// What came of a contender at a setting.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Its name.
    pub method: &'static str,
    /// How it works.
    pub kind: Kind,
    /// Its setting.
    pub setting: Setting,
    /// Its setting in words.
    pub label: String,
    /// Wall-clock seconds for all factors.
    pub seconds: f64,
    /// Processor seconds, where the system tells and there were enough to tell.
    pub processor_seconds: Option<f64>,
    /// Seconds to solve the equation with them.
    pub solve_seconds: f64,
    /// Share of the factors in the time of both.
    pub factor_share: f64,
    /// Bytes of what is kept.
    pub bytes: usize,
    /// Factors that are not zero, or numbers of rays' hits.
    pub entries: usize,
    /// Rays or cells of a row.
    pub samples: Option<usize>,
    /// Row sums against one, as found. In an open scene they are less by right.
    pub closure: Closure,
    /// Root mean square of the row sums' differences from the exact ones.
    pub row_sum_error: f64,
    /// Largest |A_i F_ij − A_j F_ji| over the smaller area.
    pub reciprocity: f64,
    /// ‖F − F*‖/‖F*‖.
    pub factor_error: f64,
    /// Largest |F − F*|.
    pub largest_factor_error: f64,
    /// Share of the pairs of which the stated error, with the reference's own, covers the true one; for methods that
    /// state errors.
    pub covered: Option<f64>,
    /// Relative L2 error of illuminance by area.
    pub light_error: f64,
    /// ‖B − B*‖/‖B* − E‖ by area and luminance.
    pub radiosity_error: f64,
    /// Mean difference of illuminance over its mean, by area.
    pub bias: f64,
    /// Error from the truth by the referee, mesh included, constant on elements.
    pub error_from_truth: f64,
    /// What it got wrong.
    pub wrong: super::causes::Wrong,
    /// Illuminance by element, lux per band.
    #[serde(skip)]
    pub irradiance: Vec<[f64; 3]>,
}

/// A contender that was not let finish.
#[derive(Clone, Debug, Serialize)]
pub struct Skipped {
    /// Its name.
    pub method: &'static str,
    /// Its setting in words.
    pub label: String,
    /// Wall-clock seconds that it would take on this mesh.
    pub estimated_seconds: f64,
}

/// Light that a contender carries apart from its factors: P, the radiosity that goes directly, and the irradiance it makes.
pub(super) struct Apart {
    carried: Vec<f64>,
    direct: Vec<f64>,
}

/// Factors and what is kept of them.
pub(super) struct Made {
    pub factors: FormFactors,
    pub apart: Option<Apart>,
    pub bytes: usize,
    pub seconds: f64,
    pub processor_seconds: Option<f64>,
}

/// Factors, or how long they would take.
pub(super) enum Attempt {
    Done(Box<Made>),
    TooSlow(f64),
}

/// Makes the factors of all elements within `seconds`, or tells why not.
///
/// # Errors
/// [`Error::Stopped`].
pub(super) fn attempt(
    contender: Contender,
    setting: Setting,
    problem: &Problem,
    seconds: f64,
    monitor: &dyn Monitor,
) -> Result<Attempt, Error> {
    // Rows of pairs may take minutes each, so that some pairs are asked before.
    if let Contender::Method(FormFactorMethod::Pair(method)) = contender {
        let estimate = probe(method, problem);
        if estimate > seconds {
            return Ok(Attempt::TooSlow(estimate));
        }
    }
    let mut best: Option<Made> = None;
    for _ in 0..REPEATS {
        let allowance = Allowance::new(monitor, seconds);
        let (begun, before) = (Instant::now(), processor_seconds());
        let made = make(contender, setting, problem, &allowance);
        let (taken, after) = (begun.elapsed().as_secs_f64(), processor_seconds());
        let (factors, apart, bytes) = match (made, allowance.exceeded()) {
            (Ok(made), _) => made,
            (Err(Error::Stopped), Some(estimate)) => return Ok(Attempt::TooSlow(estimate)),
            (Err(other), _) => return Err(other),
        };
        if best.as_ref().is_none_or(|best| taken < best.seconds) {
            let processor = before.zip(after).map(|(a, b)| b - a).filter(|_| taken >= SHORT);
            best = Some(Made { factors, apart, bytes, seconds: taken, processor_seconds: processor });
        }
        if taken >= SHORT {
            break;
        }
    }
    best.map(|made| Attempt::Done(Box::new(made))).ok_or(Error::Stopped)
}

/// Seconds for all pairs by those for some, drawn evenly from all.
fn probe(method: PairMethod, problem: &Problem) -> f64 {
    let facets = &problem.enclosure.facets;
    let blockers = Blockers::new(facets);
    let (pair, n) = (method.build(), facets.len() as u64);
    let begun = Instant::now();
    let mut asked = 0;
    // Steps of the golden ratio visit all pairs evenly.
    const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
    for k in 1..=PROBED_PAIRS as u64 {
        let place = ((u128::from(k.wrapping_mul(STEP)) * u128::from(n * n)) >> 64) as u64;
        let (i, j) = (&facets[(place / n) as usize], &facets[(place % n) as usize]);
        let faces =
            |a: &radiosity_scene::Facet, b: &radiosity_scene::Facet| b.corners().iter().any(|c| a.height(*c) > 0.0);
        if faces(i, j) && faces(j, i) {
            std::hint::black_box(pair.factor(i, j, &blockers as &dyn Occlusion));
        }
        asked += 1;
        if begun.elapsed().as_secs_f64() > PROBE {
            break;
        }
    }
    let each = begun.elapsed().as_secs_f64() / f64::from(asked);
    each * (n * n) as f64 / rayon::current_num_threads() as f64
}

fn make(
    contender: Contender,
    setting: Setting,
    problem: &Problem,
    progress: &impl Progress,
) -> Result<(FormFactors, Option<Apart>, usize), Error> {
    match contender {
        Contender::Rays => {
            let Setting::Rays(rays) = setting else { return Err(Error::Empty("rays are counted")) };
            by_rays(rays, problem, progress)
        }
        Contender::Method(method) => {
            let factors =
                FormFactors::new(method, &problem.enclosure, &Contender::options(setting, problem.memory), progress)?;
            let bytes = factors.starts.len() * size_of::<usize>()
                + factors.values.len() * (size_of::<f64>() + size_of::<u32>() + size_of::<f32>());
            Ok((factors, None, bytes))
        }
    }
}

/// Factors that are not zero.
fn seen(factors: &FormFactors) -> usize {
    factors.values.iter().filter(|value| **value != 0.0).count()
}

/// Places and shadow rays of the engine's direct light by element, for its default number of rays; they go with these.
const SHADOWING: Shadowing = Shadowing { places: 8, rays: 2 };
const DEFAULT_RAYS: usize = 64;

/// The engine's table, the factors that its hits say (how many of the rays of row i met j), and its direct light.
fn by_rays(
    rays: usize,
    problem: &Problem,
    progress: &impl Progress,
) -> Result<(FormFactors, Option<Apart>, usize), Error> {
    let Problem { tracer, elements, area, .. } = problem;
    let (scene, mesh) = (tracer.scene, tracer.mesh);
    let ids = IdSpace { elements, sky: SkyPatches::new(&scene.sky, scene.up.direction()) };
    let mut table = HitTable::new(area.clone(), &ids);
    let exposure = Exposure::default();
    let receivers = Whole::new(mesh, elements, &exposure);
    table.extend(tracer, (&ids, &[]), &receivers, rays, progress)?;

    // Lamps without area are known to all contenders; here it is about surfaces.
    let mut luminaires = Luminaires::new(scene, mesh, elements, area, &problem.exitance);
    luminaires.lights.retain(|light| matches!(light, Light::Area { .. }));
    let places = (SHADOWING.places as usize * rays / DEFAULT_RAYS).max(2) as u32;
    let columns = luminaires.columns(tracer, &receivers, &Shadowing { places, ..SHADOWING }, &())?;
    let carried = luminaires.promoted.iter().flat_map(|p| p[..3].iter().map(|x| f64::from(*x))).collect();
    let direct = (0..elements.len()).flat_map(|i| columns.mean(i).map(f64::from)).collect();
    let bytes = HitTable::bytes(elements.cells(), rays) + elements.len() * size_of::<Bands>();

    let mut factors = FormFactors { areas: area.clone(), starts: vec![0], ..FormFactors::default() };
    for i in 0..elements.len() {
        let mut hits: Vec<u32> = table.row_ids(i).collect();
        let share = 1.0 / hits.len() as f64;
        hits.sort_unstable();
        for same in hits.chunk_by(|a, b| a == b).filter(|same| (same[0] as usize) < elements.len()) {
            factors.columns.push(same[0]);
            factors.values.push(share * same.len() as f64);
            factors.errors.push(0.0);
        }
        factors.starts.push(factors.columns.len());
    }
    Ok((factors, Some(Apart { carried, direct }), bytes))
}

/// Judges what was made. `from_truth` tells the error from the truth of an illuminance by element.
///
/// # Errors
/// [`Error::Solve`], [`Error::Stopped`].
pub(super) fn judge(
    (contender, setting): (Contender, Setting),
    made: Made,
    problem: &Problem,
    reference: &Reference,
    from_truth: &dyn Fn(&[[f64; 3]]) -> f64,
    monitor: &dyn Monitor,
) -> Result<Trial, Error> {
    let Made { factors, apart, bytes, seconds, processor_seconds } = made;
    let begun = Instant::now();
    let (radiosity, gathered) = solved(&factors, apart.as_ref(), problem, monitor)?;
    let solve_seconds = begun.elapsed().as_secs_f64();
    let irradiance = problem.irradiance(&gathered);
    let states_errors = contender != Contender::Rays;
    let difference = Difference::new(&factors, &reference.factors);
    let light = light_error(&irradiance, &reference.irradiance, &problem.area);
    let samples = contender.samples(setting);
    Ok(Trial {
        method: contender.name(),
        kind: contender.kind(),
        setting,
        label: setting.to_string(),
        seconds,
        processor_seconds,
        solve_seconds,
        factor_share: seconds / (seconds + solve_seconds),
        bytes,
        entries: seen(&factors),
        samples,
        closure: factors.closure(),
        row_sum_error: difference.row_sums,
        reciprocity: factors.reciprocity(),
        factor_error: difference.relative,
        largest_factor_error: difference.largest,
        covered: states_errors.then_some(difference.covered),
        light_error: light.relative,
        radiosity_error: reference.radiosity_error(&radiosity, problem),
        bias: light.bias,
        error_from_truth: from_truth(&irradiance),
        wrong: super::causes::wrong(&factors, &irradiance, samples, problem, reference),
        irradiance,
    })
}

/// B and F B. What is carried apart, P, leaves the unknown: X = (E − P) + R (D_P + F X), B = X + P, F B = D_P + F X.
fn solved(
    factors: &FormFactors,
    apart: Option<&Apart>,
    problem: &Problem,
    monitor: &dyn Monitor,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let transport = factors.transport()?;
    let response = problem.response(false);
    let params = Params { tolerance: TOLERANCE, max_steps: 10_000, ..Params::default() };
    let mut e = problem.emission.clone();
    if let Some(Apart { carried, direct }) = apart {
        for k in 0..e.len() {
            e[k] += problem.reflectance[k] * direct[k] - carried[k];
        }
    }
    let mut b = e.clone();
    let step = |_: &[f64], info: &radiosity_solve::Info| {
        if monitor.step(info.steps, info.steps + 1) { Go::On } else { Go::Stop }
    };
    match solve(SOLVER, &transport, &response, &e, &mut b, &params, step) {
        // Rows that sum to more than one may keep light from coming to rest; what was reached shows it.
        Ok(_) | Err(SolveError::NotConverged { .. }) => {}
        Err(SolveError::Stopped) => return Err(Error::Stopped),
        Err(other) => return Err(Error::Solve(other)),
    }
    let mut h = vec![0.0; b.len()];
    transport.apply(&b, &mut h, 3);
    if let Some(Apart { carried, direct }) = apart {
        for k in 0..b.len() {
            b[k] += carried[k];
            h[k] += direct[k];
        }
    }
    Ok((b, h))
}

/// How illuminances differ.
pub(super) struct LightError {
    pub relative: f64,
    pub bias: f64,
}

/// Relative L2 and bias of `h` against `exact`, by area and luminance.
pub(super) fn light_error(h: &[[f64; 3]], exact: &[[f64; 3]], area: &[f64]) -> LightError {
    let (mut square, mut norm, mut shift, mut level) = (0.0, 0.0, 0.0, 0.0);
    for ((h, exact), area) in h.iter().zip(exact).zip(area) {
        let (h, exact) = (bright(*h), bright(*exact));
        square += area * (h - exact) * (h - exact);
        norm += area * exact * exact;
        shift += area * (h - exact);
        level += area * exact;
    }
    LightError { relative: (square / norm.max(f64::MIN_POSITIVE)).sqrt(), bias: shift / level.max(f64::MIN_POSITIVE) }
}

/// How factors differ from exact ones.
struct Difference {
    relative: f64,
    largest: f64,
    covered: f64,
    row_sums: f64,
}

/// What rounding leaves of a factor.
const ROUNDING: f64 = 1e-12;

impl Difference {
    fn new(factors: &FormFactors, exact: &FormFactors) -> Difference {
        // By row: squared difference, squared exact factor, largest difference, pairs, those covered, the row sum's.
        let row = |i: usize| {
            let mut sums = [0f64; 6];
            each_pair(factors, exact, i, |_, [value, stated], [truth, own]| {
                let off = value - truth;
                sums[0] += off * off;
                sums[1] += truth * truth;
                sums[2] = sums[2].max(off.abs());
                sums[3] += 1.0;
                sums[4] += f64::from(u8::from(off.abs() <= stated + own + ROUNDING));
                sums[5] += off;
            });
            sums
        };
        let rows: Vec<[f64; 6]> = (0..factors.len()).into_par_iter().map(row).collect();
        let sum = |k: usize| rows.iter().map(|row| row[k]).sum::<f64>();
        let row_sums = rows.iter().map(|row| row[5] * row[5]).sum::<f64>() / rows.len().max(1) as f64;
        Difference {
            relative: (sum(0) / sum(1).max(f64::MIN_POSITIVE)).sqrt(),
            largest: rows.iter().map(|row| row[2]).fold(0.0, f64::max),
            covered: sum(4) / sum(3).max(1.0),
            row_sums: row_sums.sqrt(),
        }
    }
}

/// Calls back with j, value and error of F_ij by both, for all j that either sees in row i.
pub(super) fn each_pair(a: &FormFactors, b: &FormFactors, i: usize, mut visit: impl FnMut(usize, [f64; 2], [f64; 2])) {
    let (mut left, mut right) = (a.row(i).peekable(), b.row(i).peekable());
    loop {
        let column = match (left.peek(), right.peek()) {
            (None, None) => return,
            (Some(x), None) => x.0,
            (None, Some(y)) => y.0,
            (Some(x), Some(y)) => x.0.min(y.0),
        };
        let own = left.next_if(|x| x.0 == column).map_or([0.0; 2], |(_, value, error)| [value, error]);
        let other = right.next_if(|y| y.0 == column).map_or([0.0; 2], |(_, value, error)| [value, error]);
        if own[0] != 0.0 || other[0] != 0.0 {
            visit(column, own, other);
        }
    }
}
