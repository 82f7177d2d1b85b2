//! The account of a run, as data; [`crate::html`] makes a page of it.

use crate::illuminance::Illuminance;
use crate::progress::Progress;
use crate::{Failure, faults, figures, input, numbers};
use radiosity::measure::{Round, is_stalled};
use radiosity::{
    Audit, Baked, Balance, Dim, Faults, Lightmap, Material, Scene, Shown, Sky, View, WrittenRound, counted,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

/// What was asked, what came out, and how far to trust it.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Name of the program.
    pub program: String,
    /// Its version.
    pub version: String,
    /// The command line as it was given.
    pub command: Vec<String>,
    /// When the report was written, UTC.
    pub written: String,
    /// The scene.
    pub scene: SceneReport,
    /// What was asked and what the audit found.
    pub error: ErrorReport,
    /// Illuminance, lx.
    pub illuminance: Illuminance,
    /// Rounds of refinement.
    pub rounds: Vec<Round>,
    /// Attempts at writing the light, each with finer texels or vertices or with more rays than the one before.
    pub written_rounds: Vec<WrittenRound>,
    /// Where the light goes, lm per band.
    pub balance: Balance,
    /// How the equation was solved.
    pub solution: SolutionReport,
    /// Time.
    pub time: TimeReport,
    /// Peak memory of the process, MB; none where the system does not tell.
    pub peak_memory_mb: Option<f64>,
    /// The lightmap, if there is one.
    pub lightmap: Option<LightmapReport>,
    /// Faults of the input.
    pub faults: Faults,
    /// Files that were written.
    pub outputs: Vec<String>,
    /// What the figures mean.
    pub about: BTreeMap<&'static str, &'static str>,
}

/// What is said of a scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// Its file, or the name of the built-in one.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Materials.
    pub materials: usize,
    /// Lights, with and without area.
    pub lights: Vec<String>,
    /// What other light there is: luminous surfaces that are no lights of their own, the sky. Empty for none.
    pub other_light: Vec<String>,
    /// Area of all surfaces, m².
    pub area: f64,
}

/// What is said of an error.
#[derive(Clone, Debug, Serialize)]
pub struct ErrorReport {
    /// Relative error that was asked for.
    pub asked: f64,
    /// Whether the audit's upper bound meets it.
    pub achieved: bool,
    /// Whether it does not because --time was over.
    pub out_of_time: bool,
    /// Whether it does not, the last rounds brought next to nothing, and elements were as small as the program has them.
    pub stalled: bool,
    /// Whether the noise of the audit's own paths leaves open whether it is met, and would of any answer.
    pub left_open: bool,
    /// The audit's estimate.
    pub estimated: f64,
    /// One-sided 95 % bound from above; infinite (in JSON: null) where there is none.
    pub upper_95_one_sided: f64,
    /// One-sided 95 % bound from below.
    pub lower_95_one_sided: f64,
    /// Mean difference over mean illuminance.
    pub bias: f64,
    /// Its standard error.
    pub bias_standard_error: f64,
    /// Points that the audit looked at.
    pub points: usize,
    /// Paths per estimate where light is as bright as on average, two estimates per point, more where `measure` has few.
    pub paths_per_estimate: u32,
    /// Mean illuminance at the points by the referee, lx.
    pub mean_illuminance: f64,
    /// What is said of places that were answered to be dim, which hardly count in the error; null where they are few.
    pub dim: Option<Dim>,
    /// Seed of the audit.
    pub seed: u64,
    /// The audit's estimate for the solution itself, before it is written into texels or vertices.
    pub solution_estimated: f64,
    /// Its one-sided 95 % bound from above.
    pub solution_upper_95_one_sided: f64,
    /// What would help where the solution meets what is asked, and what is written or seen of it does not.
    pub finer: String,
}

impl ErrorReport {
    /// Of an audit of what is handed out, one of the solution that it was read from after some rounds, and what was asked; and whether
    /// time was over.
    pub fn new(
        (audit, solution): (&Audit, &Audit),
        rounds: &[Round],
        solve: &input::SolveArguments,
        is_over: bool,
    ) -> ErrorReport {
        ErrorReport {
            asked: solve.error,
            achieved: audit.upper <= solve.error,
            out_of_time: is_over && audit.upper > solve.error,
            stalled: audit.upper > solve.error && is_stalled(rounds) && solve.element_size.is_none(),
            left_open: audit.is_left_open(solve.error),
            estimated: audit.error,
            upper_95_one_sided: audit.upper,
            lower_95_one_sided: audit.lower,
            bias: audit.bias,
            bias_standard_error: audit.bias_error,
            points: audit.points,
            paths_per_estimate: audit.paths,
            mean_illuminance: audit.mean_illuminance,
            dim: audit.dim.clone(),
            seed: solve.seed,
            solution_estimated: solution.error,
            solution_upper_95_one_sided: solution.upper,
            finer: String::new(),
        }
    }

    /// What is said where lamps light nothing at all of what was audited in a scene that has some, beside the audit of the whole solution.
    pub fn unlit(&self, scene: &Scene, solution: &Audit) -> Option<&'static str> {
        let is_dark =
            self.points > 0 && self.mean_illuminance == 0.0 && self.estimated == 0.0 && !faults::is_dark(scene);
        is_dark.then_some(match solution.mean_illuminance > 0.0 {
            true => "warning: nothing that the picture shows receives light, though other surfaces do: does it show backs (which are black), or a room that is shut off?",
            false => "warning: the audit finds no light on any surface: do faces look the wrong way (their backs are black), or are lamps shut in?",
        })
    }

    /// Whether the solution is good enough and too little of it reached the texels, vertices or pixels.
    pub fn is_lost_in_writing(&self) -> bool {
        !self.achieved && self.solution_upper_95_one_sided <= self.asked
    }

    /// Whether a miss is told beside the solution's own error: writing lost what this had, or most of it.
    pub fn is_told_beside_the_solution(&self) -> bool {
        let is_worse = self.upper_95_one_sided > MUCH_WORSE * self.solution_upper_95_one_sided;
        self.is_lost_in_writing() || (!self.achieved && is_worse)
    }

    /// Says what was reached, and how far that goes.
    pub fn tell(&self, progress: &Progress) {
        progress.say(&self.line());
        self.dimly().iter().for_each(|note| progress.say(&format!("note: {note}")));
    }

    /// What is said of dim places where they are much of what there is.
    pub fn dimly(&self) -> Option<String> {
        let dim = self.dim.as_ref().filter(|dim| dim.share >= MUCH)?;
        let found = match dim.upper {
            upper if upper.is_finite() && dim.lower > 0.0 => {
                format!("there the audit says {}, at most {}", percent(dim.error), percent(upper))
            }
            upper if upper.is_finite() => {
                format!(
                    "there the audit knows no more than that it is at most {}; points there, by themselves, may tell more",
                    percent(upper)
                )
            }
            _ => "there the audit's paths tell nothing: only of points there, by themselves, may they tell more"
                .to_owned(),
        };
        let (share, below) = (100.0 * dim.share, numbers::rough(dim.below));
        Some(format!(
            "{share:.0} % of places have less than {below} lx, a tenth of what this error is relative to, and hardly count in it; {found}"
        ))
    }

    /// In a line.
    pub fn line(&self) -> String {
        if self.points == 0 {
            return "nothing to audit: there is no surface".to_owned();
        }
        if self.mean_illuminance == 0.0 && self.estimated == 0.0 {
            let places = counted(self.points, "place", "places");
            return format!(
                "no path found light at any of {places}, and the answer has none (what comes through a hole too small for any path to find is missed)"
            );
        }
        let verdict = match (self.achieved, self.out_of_time) {
            (true, _) => "reached",
            (false, true) => "NOT reached in the time given",
            (false, false) if self.is_lost_in_writing() || self.upper_95_one_sided.is_infinite() => "NOT reached",
            (false, false) if self.left_open => {
                "NOT shown to be reached (light comes by few bright paths, and those of the audit leave it open)"
            }
            (false, false) if self.stalled => "NOT reached (the last rounds came no nearer: more would hardly help)",
            (false, false) => "NOT reached (allow more --rounds, more --memory or, if given, a smaller --element-size)",
        };
        let bound = match self.upper_95_one_sided {
            upper if upper.is_finite() => format!("at most {} with 95 % confidence", percent(upper)),
            _ => "without a bound, since the audit had too few points".to_owned(),
        };
        if self.estimated.is_infinite() {
            let asked = percent(self.asked);
            return format!(
                "error asked {asked}: NOT reached; the audit finds no light at all, but the answer has some"
            );
        }
        let says = match self.estimated {
            estimated if percent(estimated) == percent(0.0) && self.upper_95_one_sided > 0.0 => {
                "sees nothing but its own noise".to_owned()
            }
            estimated => format!("says {}", percent(estimated)),
        };
        let mut line = format!("error asked {}: {verdict}; audit {says}, {bound}", percent(self.asked));
        if self.is_told_beside_the_solution() {
            let within = percent(self.solution_upper_95_one_sided);
            line += &format!("; the solution itself is within {within}");
            if !self.finer.is_empty() {
                line += &format!(": {}", self.finer);
            }
        }
        line
    }
}

/// Part of all places that dim ones are at least where that is said beside the verdict: dark corners and what is beneath furniture are an eighth of a furnished office.
const MUCH: f64 = 0.15;

/// How many times as far off as its solution what was written is at least for that to be said: three quarters of the squared error are not the solution's.
const MUCH_WORSE: f64 = 2.0;

fn percent(x: f64) -> String {
    format!("{:.3} %", 100.0 * x)
}

/// What is said of a solution.
#[derive(Clone, Debug, Serialize)]
pub struct SolutionReport {
    /// Elements.
    pub elements: usize,
    /// Width of an element, metres; of the widest where what is seen has smaller ones.
    pub element_size: f64,
    /// Elements that lie inside solids.
    pub buried: usize,
    /// Elements that lie inside solids in part.
    pub partly_buried: usize,
    /// Cells that triangles were cut into; where direct light varies, a cell is several elements.
    pub cells: usize,
    /// Rays per cell; the elements of a divided cell share them.
    pub rays_per_cell: usize,
    /// Largest difference of a row sum from one, before any repair.
    pub raw_closure: f64,
    /// Applications of the transport in the last solve.
    pub steps: usize,
    /// Relative residual by band.
    pub relative_residual: Vec<f64>,
    /// Guaranteed bound of the discrete equation's error by band, lm/m².
    pub guaranteed_bound: Vec<f64>,
    /// What that may change of what is displayed; infinite (in JSON: null) where nothing is guaranteed.
    pub displayed: Shown,
}

/// What is said of time.
#[derive(Clone, Debug, Serialize)]
pub struct TimeReport {
    /// Seconds in all.
    pub seconds: f64,
    /// Threads.
    pub threads: usize,
    /// Seconds by stage, in the order of first use.
    pub stages: Vec<StageReport>,
}

/// The time of a stage.
#[derive(Clone, Debug, Serialize)]
pub struct StageReport {
    /// Its name.
    pub name: String,
    /// Seconds.
    pub seconds: f64,
}

/// What is said of a lightmap.
#[derive(Clone, Debug, Serialize)]
pub struct LightmapReport {
    /// Texels per metre, at least.
    pub density: f64,
    /// Texels per metre where light is roughest.
    pub finest: f64,
    /// Charts too large for a page, which got fewer.
    pub reduced_charts: usize,
    /// Texels that the map has.
    pub texels: usize,
    /// About how many it would need for the error asked, where it has too few and that is known.
    pub needed: Option<f64>,
    /// Pages, width and height.
    pub pages: Vec<[u32; 2]>,
    /// Root mean square difference across seams, lx, before fitting.
    pub seams_before: f64,
    /// The same after fitting.
    pub seams_after: f64,
}

impl LightmapReport {
    /// Of a lightmap.
    pub fn new(map: &Lightmap) -> LightmapReport {
        LightmapReport {
            density: map.density,
            finest: map.finest,
            reduced_charts: map.reduced,
            texels: map.texels,
            needed: map.needed.filter(|texels| texels.is_finite()),
            pages: map.pages.clone(),
            seams_before: map.seams[0],
            seams_after: map.seams[1],
        }
    }
}

impl Report {
    /// Of a bake that is done but for the writing of this report.
    pub fn new(
        input: &input::Input,
        solve: &input::SolveArguments,
        (baked, view, exposure): (&Baked, Option<&View>, f64),
        (written, written_rounds, lightmap, is_hurried): (&Audit, Vec<WrittenRound>, Option<LightmapReport>, bool),
        outputs: &[&Path],
        progress: &Progress,
    ) -> Result<Report, Failure> {
        let solution = &baked.solution;
        let finer = match &lightmap {
            Some(map) => {
                let needed = map
                    .needed
                    .map_or(String::new(), |texels| format!(", and what was asked would take some {texels:.0}"));
                let finest = if map.finest > map.density { format!(" to {:.1}", map.finest) } else { String::new() };
                let (texels, density) = (map.texels, map.density);
                // One that is fine where light is rough is not beaten by a little more everywhere.
                let advice = match map.finest > density {
                    _ if map.reduced_charts > 0 => "--max-atlas allows larger pages".to_owned(),
                    _ if is_hurried => "allow more --time for it".to_owned(),
                    true => "no more are made unasked, --texels-per-metre sets one density everywhere".to_owned(),
                    false => format!("--texels-per-metre {:.0} comes nearer", (2.0 * density).ceil()),
                };
                format!("the lightmap has {texels} texels, {density:.1}{finest} per metre{needed}; {advice}")
            }
            None => {
                let width = solution.narrowest();
                let advice = match is_hurried {
                    true => "allow more --time for them".to_owned(),
                    false => format!("try --element-size {:.3}", 0.5 * width),
                };
                format!("vertices are {width:.3} m apart, {advice}")
            }
        };
        let lights = solution.luminaires.lamps().iter().enumerate();
        let light = |(i, name): (usize, &str)| match name {
            "" => format!("light {i}"),
            name => name.to_owned(),
        };
        let (illuminance, balance, raw_closure) = (
            Illuminance::new(solution, view.map(|v| v.illuminance.as_slice())),
            solution.balance()?,
            solution.raw_closure()?,
        );
        let stages: Vec<StageReport> =
            progress.spent().into_iter().map(|(name, seconds)| StageReport { name, seconds }).collect();
        Ok(Report {
            program: "radiosity".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command(),
            written: utc(SystemTime::now()),
            scene: SceneReport {
                name: input.title.clone(),
                triangles: input.scene.triangles.len(),
                materials: input.scene.materials.len(),
                lights: lights.map(|(i, l)| light((i, l.name()))).collect(),
                other_light: other_light(input, !solution.luminaires.lights.is_empty()),
                area: input.mesh.whole_area(),
            },
            error: ErrorReport {
                finer,
                ..ErrorReport::new(
                    (written, &baked.audit),
                    &baked.rounds,
                    solve,
                    baked.out_of_time || is_hurried || progress.is_over(),
                )
            },
            illuminance,
            rounds: baked.rounds.clone(),
            written_rounds,
            balance,
            solution: SolutionReport {
                elements: solution.elements.len(),
                element_size: solution.element_size,
                buried: solution.exposure.buried,
                partly_buried: solution.exposure.partial,
                cells: solution.elements.cells(),
                rays_per_cell: solution.rays(),
                raw_closure,
                steps: solution.info.steps,
                relative_residual: solution.info.residual.clone(),
                guaranteed_bound: solution.info.bound.clone(),
                displayed: solution.displayed(view.map(|_| exposure)),
            },
            time: TimeReport {
                seconds: stages.iter().map(|stage| stage.seconds).sum(),
                threads: rayon::current_num_threads(),
                stages,
            },
            peak_memory_mb: peak_memory_mb(),
            lightmap,
            faults: input.faults.clone(),
            outputs: outputs.iter().map(|path| path.display().to_string()).collect(),
            about: figures::ABOUT.iter().copied().collect(),
        })
    }
}

/// Where light comes from besides the lights.
fn other_light(input: &input::Input, has_lights: bool) -> Vec<String> {
    let mut names = Vec::new();
    if !has_lights && input.scene.materials.iter().any(Material::emits) {
        names.push("luminous surfaces".to_owned());
    }
    if !input.scene.sky.is_black() {
        let sky = match input.scene.sky {
            Sky::Uniform(_) => "a uniform sky",
            Sky::Overcast { .. } => "an overcast sky",
            _ => "a sky from a picture",
        };
        names.push(sky.to_owned());
    }
    names
}

/// The command line as given; the program by its name, wherever it is installed.
pub fn command() -> Vec<String> {
    let arguments = std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned());
    std::iter::once("radiosity".to_owned()).chain(arguments).collect()
}

/// Peak memory of this process in MB, where the system tells (Linux).
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<f64>().ok()? / 1024.0)
}

/// A moment to the minute, in the calendar of the civil day (Hinnant, "chrono-compatible low-level date algorithms").
pub fn utc(moment: SystemTime) -> String {
    let seconds = moment.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (days, minutes) = (seconds / 86_400, seconds / 60 % 1440);
    // Years begin in March here, so that the leap day is the last; eras are of 400 years.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", minutes / 60, minutes % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// What is reported of such an estimate where 5 % were asked.
    fn report(estimated: f64) -> ErrorReport {
        ErrorReport {
            asked: 0.05,
            achieved: true,
            out_of_time: false,
            stalled: false,
            left_open: false,
            estimated,
            upper_95_one_sided: 0.02,
            lower_95_one_sided: 0.0,
            bias: 0.0,
            bias_standard_error: 0.0,
            points: 100,
            paths_per_estimate: 48,
            mean_illuminance: 10.0,
            dim: None,
            seed: 1,
            solution_estimated: estimated,
            solution_upper_95_one_sided: 0.02,
            finer: String::new(),
        }
    }

    /// An audit that sees nothing but its own noise does not say that there is no error.
    #[test]
    fn an_error_that_is_not_seen_is_not_none() {
        let [unseen, seen] = [0.0, 0.01].map(|estimated| report(estimated).line());
        assert!(unseen.contains("reached; audit sees nothing but its own noise, at most 2.000 %"), "{unseen}");
        assert!(seen.contains("reached; audit says 1.000 %, at most 2.000 %"), "{seen}");
    }

    /// A map that is far behind its solution when time is over tells of that, and what comes nearer.
    #[test]
    fn what_is_far_behind_its_solution_says_so() {
        let of = |upper: f64| {
            let missed =
                ErrorReport { achieved: false, out_of_time: true, solution_upper_95_one_sided: 0.06, ..report(0.1) };
            ErrorReport { upper_95_one_sided: upper, finer: "try more texels".to_owned(), ..missed }.line()
        };
        let [far, near] = [of(0.4), of(0.1)];
        assert!(far.ends_with("; the solution itself is within 6.000 %: try more texels"), "{far}");
        assert!(near.contains("NOT reached in the time given") && near.ends_with("with 95 % confidence"), "{near}");
    }

    /// Where much is dim, a verdict of the rest is not taken for one of it.
    #[test]
    fn dim_places_are_told_of_where_they_are_much() {
        let dim = |share: f64, upper: f64, lower: f64| {
            let dim = Some(Dim { below: 484.1, share, error: 0.5 * upper, upper, lower });
            ErrorReport { dim, ..report(0.01) }.dimly()
        };
        let dimly = |share: f64, upper: f64| dim(share, upper, 0.05);
        assert!(dim(0.44, 0.2, 0.0).unwrap().ends_with("at most 20.000 %; points there, by themselves, may tell more"));
        let told = dimly(0.44, 0.2).unwrap();
        let begins = "44 % of places have less than 484 lx, a tenth of what this error is relative to";
        assert!(told.starts_with(begins) && told.ends_with("the audit says 10.000 %, at most 20.000 %"), "{told}");
        assert!(
            dimly(0.44, f64::INFINITY)
                .unwrap()
                .ends_with("paths tell nothing: only of points there, by themselves, may they tell more")
        );
        assert_eq!((dimly(0.1, 0.2), report(0.01).dimly()), (None, None));
    }

    /// What would not help is no advice.
    #[test]
    fn rounds_are_advised_where_they_may_help() {
        let missed = |[stalled, left_open]: [bool; 2]| {
            ErrorReport { asked: 0.01, achieved: false, stalled, left_open, ..report(0.015) }.line()
        };
        let [by_rounds, in_vain, open] = [[false, false], [true, false], [true, true]].map(missed);
        assert!(by_rounds.contains("NOT reached (allow more --rounds"), "{by_rounds}");
        assert!(in_vain.contains("NOT reached (the last rounds came no nearer: "), "{in_vain}");
        assert!(open.contains("NOT shown to be reached (light comes by few bright paths"), "{open}");
    }

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, date) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (1_709_251_199, "2024-02-29 23:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(utc(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)), date);
        }
    }
}
