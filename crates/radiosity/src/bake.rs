//! From a scene to a solution whose error is known: refine until the audit is content.

use crate::answer::Station;
use crate::lightmap::automatic_texels;
use crate::measure::{FIRST_PATHS, ROUND_GROWTH, Round, certify, is_stalled, most_paths, rays_for};
use crate::monitor::{Monitor, Stages, has_time, is_over};
use crate::pace::{self, After, Paced};
use crate::solution::Looking;
use crate::texels::usual_rays;
use crate::{Error, Indirect, Solution, SolveOptions, stations};
use radiosity_scene::Bands;
use radiosity_trace::Tracer;
use radiosity_transport::Shadowing;
use radiosity_view::{Audit, Auditor, Field};
use std::time::Instant;

/// Cells to aim for: 10,000 leave those of a room with a garden 0.4 m wide, and contacts blurred.
const CELLS: usize = 30_000;

/// Cells along the mean path of light where elements are only looked up. Nearer than its own width an element is not looked up
/// but followed on from, and a gather of wide ones is a path tracer: in a building of 64 furnished rooms one of 64 rays is
/// 38 % off with 25 cells in a room, 27 % with 125, 14 % with 500, 11 % with 1,500.
const CELLS_ON_PATH: f64 = 2.0;

/// Rays per cell at least. An error of 5 % would allow 64, but they leave walls blotchy: it is relative to the brightest light.
const FEWEST_RAYS: usize = 256;

/// Gathers, each with twice the rays of the one before, that are tried whatever they cost before all is made finer.
pub(crate) const GATHERS: usize = 3;

/// Rays of the gathers of a lightmap, of as many texels as it has where no error asks for more (a chart has two triangles or
/// more, most often), up to which more are tried, relative to those of the solution: to make all finer takes at least as
/// many again.
const SOLUTIONS: f64 = 2.0;

/// Shadow rays at a point for each of its gather rays, at least. In a furnished office 256 of either leave 1.3 % of noise each;
/// shadow rays cost a fifth, and texels pool what they gather alone.
const SHADOW_RAYS: u32 = 4;

/// Rays of the first gather.
pub(crate) fn gather_rays(error: f64) -> usize {
    rays_for(error, 256.0, 32, 2048)
}

/// How to bake.
#[derive(Clone, Copy, Debug)]
pub struct BakeOptions {
    /// Relative L2 error of irradiance to reach, e.g. 0.01.
    pub error: f64,
    /// How to solve; its cells and rays are the least that is used.
    pub solve: SolveOptions,
    /// Points of the audit.
    pub audit_points: usize,
    /// Rounds of refinement at most; one more where a time limit begins with fewer cells.
    pub rounds: usize,
    /// Seed of the audit.
    pub seed: u64,
    /// What is going to be made of the solution: a deadline leaves time for it.
    pub after: After,
}

impl Default for BakeOptions {
    fn default() -> Self {
        BakeOptions {
            error: 0.01,
            solve: SolveOptions::default(),
            audit_points: 1000,
            rounds: 5,
            seed: 1,
            after: After::default(),
        }
    }
}

/// A solution that the audit has seen.
pub struct Baked<'a> {
    /// The solution.
    pub solution: Solution<'a>,
    /// Its indirect light by element, by halves of its rays.
    pub(crate) received: Vec<[Bands; 2]>,
    /// The continuous field of it.
    pub field: Field,
    /// Rays that gather the indirect light at each point; 0 where the field is good enough.
    pub gather: usize,
    /// Shadow rays that points are lit with.
    pub shadowing: Shadowing,
    /// What the referee says of light that is read as `gather` tells.
    pub audit: Audit,
    /// Whether the audit's upper bound meets the asked error.
    pub achieved: bool,
    /// Whether it does not because time was over ([`Monitor::deadline`]).
    pub out_of_time: bool,
    /// The rounds.
    pub rounds: Vec<Round>,
    /// Time by stage, over all rounds and the audits of what was written.
    pub stages: Stages,
    /// The error asked.
    pub(crate) error: f64,
    pub(crate) seed: u32,
    pub(crate) auditor: Auditor<'a>,
    /// The places of the audit, and the solution's light there.
    pub(crate) watched: Vec<Station>,
    pub(crate) light: Vec<Bands>,
}

impl Baked<'_> {
    /// Seconds that the least audit takes.
    pub(crate) fn audit_seconds(&self) -> f64 {
        seconds_of_audit(&self.stages, &self.auditor)
    }
}

/// Seconds that the least audit takes, by all that an auditor has traced, and others since.
fn seconds_of_audit(stages: &Stages, auditor: &Auditor) -> f64 {
    stages.of("audit") * f64::from(FIRST_PATHS) / f64::from(auditor.paths().max(FIRST_PATHS))
}

/// Light at the places of the audit, and the rays that it was read with.
struct Reading {
    gather: usize,
    shadowing: Shadowing,
    light: Vec<Bands>,
}

/// How a scene is solved where there is time. Where it has more triangles than cells are wanted, most are parts of small things, which
/// take all the time if each has the rays of a cell: they get them by their area, and what is shown is gathered.
fn suited(tracer: &Tracer, options: &BakeOptions, monitor: &dyn Monitor) -> SolveOptions {
    let mut solve = options.solve;
    solve.looked_up = tracer.mesh.triangles.len() > CELLS && solve.form_factors.is_none();
    solve.cells = solve.cells.max(CELLS);
    if solve.looked_up {
        solve.cells_on_path(tracer, CELLS_ON_PATH);
    } else {
        solve.rays = solve.rays.max(rays_for(options.error, 512.0, FEWEST_RAYS, 2048));
    }
    // Places of texels and vertices are asked one by one whether they are buried, those between which pictures interpolate are not.
    let is_asked = solve.looked_up && monitor.deadline().is_some() && options.after.pixels == 0;
    solve.shown &= !is_asked;
    solve.suit_method();
    solve.fit(tracer, monitor);
    solve
}

/// How a scene is solved at first within a time limit, if it is not as usual: elements that are only looked up are as few as may
/// be. With as many as usual from the beginning, an office of 84,000 triangle sides is 29 % off after 6 s, and 14 % after 11 s; so
/// 18 % after 6 s, and 8 to 10 % after 10 s.
fn hurried(
    usual: &SolveOptions,
    tracer: &Tracer,
    options: &BakeOptions,
    monitor: &dyn Monitor,
) -> Option<SolveOptions> {
    monitor.deadline().filter(|_| usual.looked_up && usual.element_size.is_none())?;
    let mut solve = SolveOptions { cells: options.solve.cells, ..*usual };
    solve.cells_on_path(tracer, CELLS_ON_PATH);
    (solve.cells < usual.cells).then_some(solve)
}

/// Solves a scene to an asked error of the irradiance on its surfaces.
///
/// # Errors
/// As [`Solution::new`]. Not reaching the error asked is not an error: see [`Baked::achieved`].
pub fn bake<'a>(tracer: &'a Tracer<'a>, options: &BakeOptions, monitor: &dyn Monitor) -> Result<Baked<'a>, Error> {
    let start = Instant::now();
    let mut begun = start;
    let stages = Stages::default();
    let paced = Paced::new(monitor, &options.after);
    let monitor: &dyn Monitor = &paced.monitor;
    let usual = suited(tracer, options, monitor);
    let mut first = hurried(&usual, tracer, options, monitor);
    let most_rounds = options.rounds + 1 + usize::from(first.is_some());
    let mut shadowing = Shadowing { places: 1, rays: rays_for(options.error, 128.0, 32, 4096) as u32 };
    monitor.round(1, most_rounds);
    let begun_with = first.as_ref().unwrap_or(&usual);
    let mut solution = Solution::focused(tracer, begun_with, &Looking::Eyes(tracer.eyes()), (&stages, monitor))?;
    let most_paths = most_paths(options.error);
    let watched: Vec<Station> = stations::spread(&solution, options.audit_points, options.seed as u32);
    let places: Vec<_> = watched.iter().map(|s| s.place).collect();
    let expected = solution.irradiance_at(&places);
    let mut auditor = Auditor::new(tracer, places, &expected, options.seed);
    let mut rounds = Vec::new();
    loop {
        // Elements that are only looked up make no field: a picture gathers for those that it shows.
        let received = if usual.looked_up { solution.indirect_halves()? } else { solution.received(monitor)? };
        let field = solution.field_of(&received);
        let mut read = |gather: usize| {
            let indirect = if gather == 0 { Indirect::Field(&field) } else { Indirect::Gather { rays: gather } };
            let shadowing = Shadowing { rays: shadowing.rays.max(SHADOW_RAYS * gather as u32), ..shadowing };
            let before = ["direct light", "gather"].map(|name| solution.stages.of(name));
            let light = solution.at(&watched, indirect, &shadowing, monitor)?.irradiance;
            let [direct, gathered] = ["direct light", "gather"].map(|name| solution.stages.of(name));
            let judge = |auditor: &Auditor| auditor.judge(&light);
            let audit = certify(&mut auditor, &judge, options.error, most_paths, &stages, monitor)?;
            // What is made of the solution takes about as long at each place.
            let each = |seconds: f64, rays: f64| seconds / (rays * watched.len().max(1) as f64).max(1.0);
            let takes = pace::Reading {
                shadow_ray: each(direct - before[0], f64::from(shadowing.rays)),
                gather_ray: each(gathered - before[1], gather as f64),
                audit: seconds_of_audit(&stages, &auditor),
            };
            // Points that are written have as many rays by the error asked.
            let [gather_rays, shadow_rays] = usual_rays(options.error);
            let shadow_rays = shadow_rays.min(shadowing.rays as usize);
            paced.keep(options.after.full(&takes, shadow_rays as f64, gather.min(gather_rays) as f64));
            Ok::<_, Error>((audit, Reading { gather, shadowing, light }))
        };
        // The field does not know contacts below the size of its elements: gathering at each point does, and costs less
        // than elements that small.
        let mut rays = gather_rays(options.error);
        let least = if usual.looked_up { rays } else { 0 };
        let (mut seconds, first_read) = pace::timed(|| read(least));
        let (mut audit, mut reading) = first_read?;
        rays = rays.max(2 * least);
        let affordable = SOLUTIONS * solution.rays_in_all() / automatic_texels(tracer.mesh.triangles.len() / 2);
        for doublings in 0.. {
            let is_dear = doublings >= GATHERS && rays as f64 > affordable;
            if is_dear || audit.upper <= options.error || !has_time(monitor, ROUND_GROWTH * seconds) {
                break;
            }
            let (took, better) = pace::timed(|| read(rays));
            seconds = took;
            let better = better?;
            if better.0.upper >= audit.upper {
                break;
            }
            (audit, reading) = better;
            rays *= 2;
        }
        let Reading { gather, shadowing: lit, light } = reading;
        rounds.push(Round::new(&solution, [gather, lit.rays as usize], &audit, start));
        monitor.note(&rounds[rounds.len() - 1].to_string());
        let achieved = audit.upper <= options.error;
        // More rounds only while there is something to gain, and memory and leave to gain it with.
        let noisy = !usual.looked_up && solution.field_noise(&received) > 0.5 * options.error;
        let is_given = options.solve.element_size.is_some();
        let next = match first.take() {
            Some(_) => SolveOptions {
                cells: usual.cells.max(solution.options.cells),
                rays: usual.rays.max(solution.rays()),
                ..usual
            },
            None if noisy => SolveOptions { rays: 2 * solution.rays(), ..solution.options },
            None => SolveOptions { rays: solution.rays(), cells: 2 * solution.options.cells, ..usual },
        };
        let fits = solution.has_room_for(&next);
        let is_last = achieved || rounds.len() >= most_rounds || !fits || (is_given && !noisy) || is_stalled(&rounds);
        // Once begun a round is brought to its end, so that what it replaces may go.
        let out_of_time = !is_last && !has_time(monitor, ROUND_GROWTH * begun.elapsed().as_secs_f64());
        let mut ends = is_last || out_of_time;
        if !ends {
            monitor.round(rounds.len() + 1, most_rounds);
            begun = Instant::now();
            shadowing.rays *= 2;
            if noisy {
                match solution.refine(next.rays, monitor) {
                    Err(Error::File(error)) => {
                        monitor.warn(&format!("{error}; the answer is that of the rounds before"));
                        ends = true;
                    }
                    // As many rays do not fit beside the elements that there are: the answer is that of the rounds before.
                    Err(Error::Memory { .. }) => ends = true,
                    done => done?,
                }
            } else {
                stages.absorb(&solution.stages);
                let scales = std::mem::take(&mut solution.scales);
                drop(solution);
                solution = Solution::scaled(tracer, scales, &next, monitor)?;
            }
        }
        if ends {
            stages.absorb(&solution.stages);
            let is_cut = solution.is_cut;
            return Ok(Baked {
                solution,
                received,
                field,
                gather,
                shadowing: lit,
                audit,
                achieved,
                // A first round that was cut short may have ended it in other ways.
                out_of_time: !achieved && (out_of_time || is_cut || is_over(monitor)),
                rounds,
                stages,
                error: options.error,
                seed: options.seed as u32,
                auditor,
                watched,
                light,
            });
        }
    }
}
