//! Methods side by side on one scene: every form-factor method, every solver, what each costs and what it gets wrong.
//!
//! All work on one discrete problem (`problem`), and are judged against its exact answer (`reference`); what the mesh itself
//! costs is the referee's to say (`truth`). Contenders run at several settings, the coarse ones of all before the fine
//! ones of any, within a budget of time; who would take too long is named with the time that he would take. Numbers
//! do not depend on the run, times do, and with them who is let run.

mod allowance;
mod attempt;
mod causes;
mod contender;
mod difference;
mod growth;
mod look;
mod march;
mod problem;
mod reference;
#[cfg(test)]
mod tests;
mod trial;
mod truth;

pub use causes::{Causes, Corner, Wrong};
pub use contender::{Contender, Family, Kind, Setting, UnknownContender};
pub use growth::{Growth, Size};
pub use look::DifferenceView;
pub use march::{Crossing, Lead, March, Mark, RANKED_AT};
pub use reference::ReferenceAccount;
pub use trial::{Skipped, Trial};
pub use truth::Truth;

use crate::{Error, Monitor};
use attempt::Attempt;
use look::Look;
use problem::Problem;
use radiosity_scene::Elements;
use radiosity_solve::Solver;
use radiosity_trace::Tracer;
use radiosity_view::Picture;
use reference::Reference;
use serde::Serialize;
use std::time::Instant;

/// What to compare.
#[derive(Clone, Debug)]
pub struct CompareOptions {
    /// About how many elements. A thousand take a classic method some seconds, as its work grows with the square.
    pub elements: usize,
    /// Form-factor methods.
    pub methods: Vec<Contender>,
    /// Solvers.
    pub solvers: Vec<Solver>,
    /// The tightest accuracy that the reference is asked for, if there is time.
    pub accuracy: f64,
    /// Wall-clock seconds for all; what has begun is finished.
    pub seconds: f64,
    /// Bytes that factors may take.
    pub memory: usize,
    /// Places at which the referee looks, and its paths at each.
    pub audit: (usize, u32),
    /// Seed of the referee.
    pub seed: u64,
    /// Longer side of the pictures, pixels.
    pub side: u32,
}

impl Default for CompareOptions {
    fn default() -> Self {
        CompareOptions {
            elements: 1000,
            methods: Contender::all().collect(),
            solvers: Solver::ALL.to_vec(),
            accuracy: 1e-6,
            seconds: 60.0,
            memory: 4 << 30,
            audit: (2000, 256),
            seed: 1,
            side: 288,
        }
    }
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Elements that all worked on.
    pub elements: usize,
    /// Their width, metres.
    pub element_size: f64,
    /// Area of the surfaces, m².
    pub area: f64,
    /// Whether lamps without area or the sky take part, by direct irradiance that is the same for all.
    pub has_direct_light: bool,
    /// How exact the reference is.
    pub reference: ReferenceAccount,
    /// What the mesh costs.
    pub truth: Truth,
    /// Contenders at their settings, by contender.
    pub trials: Vec<Trial>,
    /// Those that would have taken too long.
    pub skipped: Vec<Skipped>,
    /// How they grow with the mesh.
    pub growth: Vec<Growth>,
    /// The solver of all trials.
    pub trial_solver: &'static str,
    /// Solvers.
    pub marches: Vec<March>,
    /// Who is ahead after 0.1, 1 and 10 applications of F.
    pub leads: Vec<Lead>,
    /// Where those that start slower pass those that shoot.
    pub crossings: Vec<Crossing>,
    /// Wall-clock seconds of the comparison.
    pub seconds: f64,
    /// Wall-clock seconds allowed.
    pub budget: f64,
    /// Size of the pictures, pixels.
    pub size: [u32; 2],
    /// log2 of the factor from cd/m² to display.
    pub exposure: f64,
    /// The exact light as the camera sees it, an element in one colour.
    #[serde(skip)]
    pub picture: Option<Picture>,
    /// What trials got wrong as the camera sees it: the coarsest and the finest of each.
    pub views: Vec<DifferenceView>,
}

/// Shares of the budget: the reference may take the first before it is asked less exactly, solvers the second in all; the
/// third is kept for growth.
const REFERENCE: f64 = 0.25;
const SOLVERS: f64 = 0.15;
const GROWTH: f64 = 0.15;

/// How much of the time that is left for methods one run may take, at most: a third leaves room for the others.
const ONE_RUN: f64 = 0.35;

/// The same for pairs that run before second settings of others: with a tenth, formulas of some seconds were left out in a
/// minute; three of a quarter leave four tenths for what follows.
const QUICK_RUN: f64 = 0.25;

/// What a first setting may take of the whole time, even if none is left: all of them together exceed it by a tenth or so.
const MOMENT: f64 = 0.01;

/// The pass in which other pairs run: after two settings of rows.
const PAIRS_TURN: usize = 2;

/// Meshes for growth, against the one of all, beside it.
const MESHES: [f64; 3] = [0.25, 0.5, 2.0];

/// Largest part of the time for growth that one run on a mesh may take.
const ONE_SIZE: f64 = 0.25;

/// Compares.
///
/// # Errors
/// [`Error::Empty`] where nothing gives light or nothing is compared, [`Error::Matrix`] before anything large is
/// allocated, [`Error::Element`], [`Error::Solve`], [`Error::Stopped`].
pub fn compare(tracer: &Tracer, options: &CompareOptions, monitor: &dyn Monitor) -> Result<Comparison, Error> {
    let begun = Instant::now();
    if options.methods.is_empty() && options.solvers.is_empty() {
        return Err(Error::Empty("nothing is to be compared: name a method or a solver"));
    }
    if tracer.mesh.triangles.is_empty() {
        return Err(Error::Empty("the scene has no surface"));
    }
    refuse_too_many(tracer, options)?;
    monitor.stage("elements");
    let problem = Problem::new(tracer, options.elements, options.memory, monitor)?;
    monitor.stage("reference");
    let reference = Reference::new(&problem, (options.accuracy, REFERENCE * options.seconds), monitor)?;
    monitor.stage("engine");
    let (points, paths) = options.audit;
    let asked = (points, paths, options.seed, options.memory);
    let (witness, truth) = truth::truth(&problem, &reference, asked, monitor)?;
    let look = Look::new(&problem, &reference.radiosity, &reference.irradiance, options.side);

    let mut marches = Vec::new();
    let share = SOLVERS * options.seconds / options.solvers.len().max(1) as f64;
    for solver in &options.solvers {
        monitor.stage(solver.name());
        marches.push(march::march(*solver, &problem, &reference, &look, share, monitor)?);
    }

    let until = (1.0 - GROWTH) * options.seconds;
    let left = || (until - begun.elapsed().as_secs_f64()).max(0.0);
    let from_truth = |irradiance: &[[f64; 3]]| witness.error(irradiance);
    let (trials, skipped) = run(options, &problem, &reference, &from_truth, &left, monitor)?;
    let left = || (options.seconds - begun.elapsed().as_secs_f64()).max(0.0);
    let growth = grow(options, &problem, &trials, &left, monitor)?;

    let views = views(&trials, &look);
    Ok(Comparison {
        elements: problem.len(),
        element_size: problem.size,
        area: problem.area.iter().sum(),
        has_direct_light: problem.direct.iter().any(|d| *d != [0.0; 3]),
        picture: Some(look.picture(&reference.irradiance)),
        reference: reference.account,
        truth,
        trials,
        skipped,
        growth,
        trial_solver: trial::SOLVER.name(),
        leads: march::leads(&marches),
        crossings: march::crossings(&marches),
        marches,
        seconds: begun.elapsed().as_secs_f64(),
        budget: options.seconds,
        size: look.size(),
        exposure: look.exposure(),
        views,
    })
}

/// Bytes of a pair while its factors are found: half a matrix of exchange areas and a whole one of factors; values and
/// errors of a full matrix, and of what is not zero of it.
const REFERENCE_BYTES: usize = 44 / 2 + 16;
const CONTENDER_BYTES: usize = 16 + 20;

/// Refuses more elements than the memory holds the factors of, if all see each other.
fn refuse_too_many(tracer: &Tracer, options: &CompareOptions) -> Result<(), Error> {
    let (scene, mesh) = (tracer.scene, tracer.mesh);
    let elements = Elements::count(scene, mesh, problem::element_size(tracer, options.elements));
    // The reference stays beside the contender.
    let is_rays = |contender: &Contender| *contender == Contender::Rays;
    let both = if options.methods.iter().all(is_rays) { REFERENCE_BYTES } else { REFERENCE_BYTES + CONTENDER_BYTES };
    let needed = elements.saturating_mul(elements).saturating_mul(both);
    if needed > options.memory {
        return Err(Error::Matrix { elements, asked: options.elements, needed, allowed: options.memory });
    }
    Ok(())
}

/// A contender's turn to run at a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turn {
    /// Its place among the contenders.
    place: usize,
    setting: Setting,
    /// Its first setting.
    is_first: bool,
    /// How much of the time that is left it may take.
    share: f64,
    /// If it would take more it has another turn.
    comes_again: bool,
}

/// Who runs when: one setting of all before the second of any. Pairs have one setting, and of these some are over in a
/// moment and others never; those that are not quick get their turn after two settings of rows.
fn turns(methods: &[Contender]) -> Vec<Turn> {
    let is_pair = |contender: &Contender| contender.kind() == Kind::Pair;
    let passes = methods.iter().map(|contender| contender.settings().len()).max().unwrap_or(0);
    let mut turns = Vec::new();
    for pass in 0..passes.max(PAIRS_TURN + 1) {
        let mut add = |place: usize, contender: &Contender, pairs: bool| {
            if is_pair(contender) != pairs {
                return;
            }
            let (number, share, comes_again) = match pairs {
                true if pass == 0 => (0, QUICK_RUN, true),
                true if pass == PAIRS_TURN => (0, ONE_RUN, false),
                true => return,
                false => (pass, ONE_RUN, false),
            };
            if let Some(setting) = contender.settings().get(number) {
                turns.push(Turn { place, setting: *setting, is_first: number == 0, share, comes_again });
            }
        };
        for pairs in [false, true] {
            methods.iter().enumerate().for_each(|(place, contender)| add(place, contender, pairs));
        }
    }
    turns
}

/// All contenders, one setting of each first.
fn run(
    options: &CompareOptions,
    problem: &Problem,
    reference: &Reference,
    from_truth: &dyn Fn(&[[f64; 3]]) -> f64,
    left: &dyn Fn() -> f64,
    monitor: &dyn Monitor,
) -> Result<(Vec<Trial>, Vec<Skipped>), Error> {
    let mut trials: Vec<(usize, Trial)> = Vec::new();
    let mut skipped = Vec::new();
    let mut is_out = vec![false; options.methods.len()];
    // Seconds that a pair method is known to take.
    let mut known: Vec<Option<f64>> = vec![None; options.methods.len()];
    for Turn { place, setting, is_first, share, comes_again } in turns(&options.methods) {
        // As exact as the reference, it would be compared with itself.
        let is_reference = matches!(setting, Setting::Accuracy(bound) if bound <= reference.account.accuracy);
        if is_out[place] || is_reference {
            continue;
        }
        let contender = options.methods[place];
        let mut allowed = share * left();
        if is_first {
            allowed = allowed.max(MOMENT * options.seconds);
        }
        let too_slow = match known[place].filter(|seconds| *seconds > allowed) {
            Some(seconds) => seconds,
            None => {
                monitor.stage(format!("{contender} {setting}").trim_end());
                match attempt::attempt(contender, setting, problem, allowed, monitor)? {
                    Attempt::Done(made) => {
                        let trial = trial::judge((contender, setting), *made, problem, reference, from_truth, monitor)?;
                        trials.push((place, trial));
                        is_out[place] = setting == Setting::Only;
                        continue;
                    }
                    Attempt::TooSlow(seconds) => seconds,
                }
            }
        };
        known[place] = comes_again.then_some(too_slow);
        if !comes_again {
            // Finer ones would be slower still, unless it was for its many eye points.
            is_out[place] = !matches!(setting, Setting::Cells { points: 2.., .. });
            let (method, label) = (contender.name(), setting.to_string());
            skipped.push(Skipped { method, label, estimated_seconds: too_slow });
        }
    }
    // Several eye points make a curve of their own.
    trials.sort_by_key(|(place, trial)| (*place, is_spread(trial)));
    Ok((trials.into_iter().map(|(_, trial)| trial).collect(), skipped))
}

/// Contenders that ran on other meshes as well.
fn grow(
    options: &CompareOptions,
    problem: &Problem,
    trials: &[Trial],
    left: &dyn Fn() -> f64,
    monitor: &dyn Monitor,
) -> Result<Vec<Growth>, Error> {
    let usual = |contender: &Contender| {
        let setting = contender.usual();
        let own = trials.iter().find(|t| t.method == contender.name() && t.setting == setting)?;
        Some((*contender, setting, Size { elements: problem.len(), seconds: own.seconds, bytes: own.bytes }))
    };
    let mut all: Vec<(Contender, Setting, Vec<Size>)> =
        options.methods.iter().filter_map(usual).map(|(c, s, size)| (c, s, vec![size])).collect();
    for part in MESHES {
        let wanted = (part * options.elements as f64) as usize;
        let finer = CompareOptions { elements: wanted, ..options.clone() };
        if wanted < 4 || refuse_too_many(problem.tracer, &finer).is_err() {
            continue;
        }
        monitor.stage("growth with the mesh");
        let other = Problem::new(problem.tracer, wanted, options.memory, monitor)?;
        // A scene of many triangles has the same elements again.
        if other.len().abs_diff(problem.len()) * 10 < problem.len() {
            continue;
        }
        let allowed = ONE_SIZE * left();
        for (contender, setting, sizes) in &mut all {
            // Work grows with the square at most.
            let expected = sizes[0].seconds * (other.len() as f64 / sizes[0].elements as f64).powi(2);
            if expected <= allowed.min(left()) {
                sizes.extend(growth::size(*contender, *setting, &other, 2.0 * allowed, monitor)?);
            }
        }
    }
    Ok(all.into_iter().map(|(c, s, sizes)| Growth::new(c.name(), s.to_string(), sizes)).collect())
}

/// Whether a trial looks out from several points of a facet where its method has one.
fn is_spread(trial: &Trial) -> bool {
    matches!(trial.setting, Setting::Cells { points: 2.., .. })
}

/// The coarsest and the finest trial of each contender, and those with more eye points than one.
fn views(trials: &[Trial], look: &Look) -> Vec<DifferenceView> {
    let is_end = |k: usize| {
        let same = |other: Option<&Trial>| other.is_some_and(|other| other.method == trials[k].method);
        let after = trials.get(k + 1);
        let before = k.checked_sub(1).and_then(|k| trials.get(k));
        !same(before) || !same(after) || is_spread(&trials[k]) || after.is_some_and(|t| same(Some(t)) && is_spread(t))
    };
    let view = |k: usize| DifferenceView { trial: k, pixels: look.difference(&trials[k].irradiance) };
    (0..trials.len()).filter(|k| is_end(*k)).map(view).collect()
}
