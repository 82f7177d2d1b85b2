//! A contender at a setting, let run: its factors and what they cost, or how long they would take.

use super::allowance::{Allowance, processor_seconds};
use super::contender::{Contender, Setting};
use super::problem::{Problem, Whole};
use crate::{Error, Monitor};
use radiosity_scene::{Bands, SkyPatches};
use radiosity_transport::pair::blockers::Blockers;
use radiosity_transport::{
    Exposure, FormFactorMethod, FormFactors, HitTable, IdSpace, Light, Luminaires, Occlusion, PairMethod, Progress,
    Shadowing,
};
use std::time::Instant;

/// Runs shorter than this are repeated, seconds: other work of the machine would show.
const SHORT: f64 = 0.1;

/// How often a short run is made; the least time counts.
const REPEATS: usize = 3;

/// Pairs that tell how long all pairs will take.
const PROBED_PAIRS: usize = 96;

/// Seconds after which fewer pairs must do.
const PROBE: f64 = 0.6;

/// Light that a contender carries apart from its factors: P, the radiosity that goes directly, and the irradiance it makes.
pub(super) struct Apart {
    pub carried: Vec<f64>,
    pub direct: Vec<f64>,
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
        if i.faces(j) {
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
    progress: &dyn Progress,
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

/// Places and shadow rays of the engine's direct light by element, for its default number of rays; they go with these.
const SHADOWING: Shadowing = Shadowing { places: 8, rays: 2 };
const DEFAULT_RAYS: usize = 64;

/// The engine's table, the factors that its hits say (how many of the rays of row i met j), and its direct light.
fn by_rays(
    rays: usize,
    problem: &Problem,
    progress: &dyn Progress,
) -> Result<(FormFactors, Option<Apart>, usize), Error> {
    let Problem { tracer, elements, area, .. } = problem;
    let (scene, mesh) = (tracer.scene, tracer.mesh);
    let ids = IdSpace { elements, sky: SkyPatches::new(&scene.sky, scene.up.direction()) };
    let mut table = HitTable::new(area.clone(), &ids);
    let exposure = Exposure::default();
    let receivers = Whole::new(mesh, elements, &exposure);
    table.extend(tracer, (&ids, &[]), &receivers, rays, progress)?;

    // Lamps without area are known to all contenders; here it is about surfaces.
    let mut luminaires = Luminaires::new(tracer, elements, area, &problem.exitance);
    luminaires.lights.retain(|light| matches!(light, Light::Area { .. }));
    let places = (SHADOWING.places as usize * rays / DEFAULT_RAYS).max(2) as u32;
    let columns = luminaires.columns(tracer, &receivers, &Shadowing { places, ..SHADOWING }, &())?;
    let carried = luminaires.promoted.iter().flat_map(|p| p[..3].iter().map(|x| f64::from(*x))).collect();
    let direct = (0..elements.len()).flat_map(|i| columns.mean(i).map(f64::from)).collect();
    let bytes = HitTable::bytes(elements.cells(), rays) + elements.len() * size_of::<Bands>();

    let mut factors = FormFactors { areas: area.clone(), starts: vec![0], ..FormFactors::default() };
    for mut hits in table.map_rows(|row| row.ids().collect::<Vec<u32>>())? {
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
