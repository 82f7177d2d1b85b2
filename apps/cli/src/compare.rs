//! `radiosity compare`: methods and solvers side by side on a scene.

use crate::input::{self, SceneArguments};
use crate::output::{Outputs, print};
use crate::progress::Progress;
use crate::{Failure, Global, html, numbers, report};
use clap::Args;
use radiosity::compare::{Comparison, Contender, Trial};
use radiosity::solve::Solver;
use radiosity::{CompareOptions, Tracer};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Arguments of `compare`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Form-factor methods by name, with commas between; all by default.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = method)]
    methods: Vec<Contender>,
    /// Solvers by name, with commas between; all by default.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = solver)]
    solvers: Vec<Solver>,
    /// Time to spend, such as 60s or 5min; what would take too long is left out and named.
    #[arg(long, alias = "time", default_value = "60s", value_name = "TIME", allow_hyphen_values = true,
        value_parser = numbers::seconds)]
    budget: f64,
    /// About how many elements to cut the surfaces into; each triangle is one at least.
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=1_000_000))]
    elements: u32,
    /// Memory for form factors, e.g. 4G or 500M, also written 4GiB or 500MB; powers of 1024.
    #[arg(long, default_value = "4G", value_name = "BYTES", allow_hyphen_values = true, value_parser = numbers::bytes)]
    memory: usize,
    /// Seed of the referee, which tells what the mesh costs; other seeds examine other points.
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    seed: u64,
    /// The report: a page (.html) or all numbers (.json); may be given for each.
    #[arg(short, long, value_name = "REPORT.html")]
    output: Vec<PathBuf>,
}

fn method(name: &str) -> Result<Contender, String> {
    name.trim().parse::<Contender>().map_err(|error| error.to_string())
}

fn solver(name: &str) -> Result<Solver, String> {
    name.trim().parse::<Solver>().map_err(|error| error.to_string())
}

/// What a page tells beside the comparison.
#[derive(Serialize)]
pub struct Account {
    /// Name of the program.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// The command line as it was given.
    pub command: Vec<String>,
    /// When it was written, UTC.
    pub written: String,
    /// The scene's file, or the name of the built-in one.
    pub scene: String,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Threads.
    pub threads: usize,
    /// The rest.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// Runs the verb.
pub fn run(arguments: &Arguments, global: &Global, progress: &Progress) -> Result<(), Failure> {
    let mut outputs = Outputs::new(&arguments.scene.files());
    for path in &arguments.output {
        outputs.promise(path, &["html", "json"])?;
    }
    progress.part("reading");
    let input = input::load(&arguments.scene, arguments.memory, global, progress)?;
    outputs.spare(&input.files)?;
    let tracer = Tracer::new(&input.scene, &input.mesh);
    progress.parts();
    let comparison = radiosity::compare(&tracer, &options(arguments), progress)?;
    progress.part("report");
    let account = Account {
        program: "radiosity",
        version: env!("CARGO_PKG_VERSION"),
        command: report::command(),
        written: report::utc(SystemTime::now()),
        scene: input.title.clone(),
        triangles: input.scene.triangles.len(),
        threads: rayon::current_num_threads(),
        comparison,
    };
    for path in &arguments.output {
        outputs.stage(path, &bytes(path, &account)?)?;
    }
    outputs.commit()?;
    progress.finish();
    if global.json {
        let mut result = serde_json::to_value(&account).map_err(Failure::work)?;
        result["event"] = "result".into();
        result["output"] = serde_json::json!(arguments.output);
        result["stages"] = serde_json::json!(progress.spent());
        return print(&result.to_string());
    }
    if !global.quiet {
        print(&table(&account.comparison))?;
    }
    for path in &arguments.output {
        progress.say(&format!("wrote {}, {:.1} s", path.display(), progress.seconds()));
    }
    if arguments.output.is_empty() {
        progress.say("-o REPORT.html writes this as a page with plots and pictures");
    }
    Ok(())
}

fn options(arguments: &Arguments) -> CompareOptions {
    let default = CompareOptions::default();
    let mut methods = arguments.methods.clone();
    let mut solvers = arguments.solvers.clone();
    dedup(&mut methods);
    dedup(&mut solvers);
    CompareOptions {
        elements: arguments.elements as usize,
        methods: if methods.is_empty() { default.methods } else { methods },
        solvers: if solvers.is_empty() { default.solvers } else { solvers },
        seconds: arguments.budget,
        memory: arguments.memory,
        seed: arguments.seed,
        ..CompareOptions::default()
    }
}

/// Keeps the first of each.
fn dedup<T: PartialEq + Copy>(all: &mut Vec<T>) {
    let mut kept: Vec<T> = Vec::new();
    all.retain(|one| {
        let is_new = !kept.contains(one);
        kept.push(*one);
        is_new
    });
}

fn bytes(path: &Path, account: &Account) -> Result<Vec<u8>, Failure> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        return Ok(serde_json::to_string_pretty(account).map_err(Failure::work)?.into_bytes());
    }
    Ok(html::comparison(account)?.into_bytes())
}

/// The terminal's table: the finest trial of each method, and the solvers by what they display.
fn table(comparison: &Comparison) -> String {
    let percent = |x: f64| match 100.0 * x {
        p if p == 0.0 || p >= 0.01 => format!("{p:.2} %"),
        p => format!("{p:.0e} %"),
    };
    let audited = |audit: &radiosity::Audit| match audit.lower > 0.0 {
        true => percent(audit.error),
        false => format!("less than {}", percent(audit.upper)),
    };
    let reference = &comparison.reference;
    let missed = match misses_accuracy(comparison) {
        true => format!(
            "warning: the exact factors were asked for {:e} and state errors up to {:.1e}\n",
            reference.accuracy, reference.largest_stated_error
        ),
        false => String::new(),
    };
    let mut out = missed;
    out += &format!(
        "{} elements: exact discrete light is {} from the truth, the engine by itself {}\n\n{:<19} {:<24} {:>9} {:>9} {:>10} {:>10} {:>9}\n",
        comparison.elements,
        audited(&comparison.truth.constant),
        audited(&comparison.truth.engine),
        "form factors",
        "finest within the time",
        "seconds",
        "MB",
        "F off",
        "light off",
        "covered"
    );
    for trial in finest(&comparison.trials) {
        out += &format!(
            "{:<19} {:<24} {:>9.3} {:>9.2} {:>10} {:>10} {:>9}\n",
            trial.method,
            trial.label,
            trial.seconds,
            trial.bytes as f64 / f64::from(1 << 20),
            percent(trial.factor_error),
            percent(trial.light_error),
            trial.covered.map_or("-".to_owned(), |c| format!("{:.1} %", 100.0 * c))
        );
    }
    for skipped in &comparison.skipped {
        let name = format!("{} {}", skipped.method, skipped.label);
        let seconds = numbers::rough(skipped.estimated_seconds.max(1e-9));
        out += &format!("{:<44} left out: {seconds} s by estimate, too much of what was left\n", name.trim_end());
    }
    out += &format!("\n{:<19} {:>22} {:>10} {:>12}\n", "solver", "displayed error after", "1 sweep", "10 sweeps");
    for march in &comparison.marches {
        let at = |work: f64| march.at(work).map_or("-".to_owned(), |mark| percent(mark.displayed));
        out += &format!("{:<19} {:>22} {:>10} {:>12}\n", march.solver, at(0.1), at(1.0), at(10.0));
    }
    out.truncate(out.trim_end().len());
    out
}

/// How much larger than asked a stated error may be before anybody is told: what is judged here is far further off.
const A_LITTLE: f64 = 1.1;

/// Whether the exact factors are less exact than was asked.
pub fn misses_accuracy(comparison: &Comparison) -> bool {
    comparison.reference.largest_stated_error > A_LITTLE * comparison.reference.accuracy
}

/// The last, and so finest, trial of each method.
pub fn finest(trials: &[Trial]) -> impl Iterator<Item = &Trial> {
    trials.chunk_by(|a, b| a.method == b.method).filter_map(|of_method| of_method.last())
}
