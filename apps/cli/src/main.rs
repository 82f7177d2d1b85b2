//! The `radiosity` program: a verb per file.

mod bake;
mod blind;
mod check;
mod compare;
mod factors;
mod faults;
mod figures;
mod frames;
mod html;
mod illuminance;
mod input;
mod measure;
mod numbers;
mod output;
mod progress;
mod render;
mod report;
mod view;
mod views;

use clap::error::ContextKind;
use clap::{Args, Parser, Subcommand};
use radiosity::io::LoadError;
use radiosity::{Faults, Severity};
use std::process::ExitCode;

/// Diffuse global illumination and radiative exchange by the radiosity method.
///
/// SCENE is a .glb, .gltf or .obj file (`factors`: or a View3D .vs3); without one the built-in Cornell box is used. Lengths in metres, light in
/// cd/m², lm and lx. Exit code 0: done; 1: the work failed; 2: the call or the input was wrong; 130: interrupted.
/// Files are written whole and all together at the end; a run that fails or is interrupted leaves none (but `--frames`).
#[derive(Parser)]
#[command(name = "radiosity", version)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    verb: Verb,
}

/// Options of every verb.
#[derive(Args, Clone, Debug)]
pub struct Global {
    /// Threads to use; all processors by default. The answer does not depend on it.
    #[arg(long, global = true, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Progress and result as lines of JSON on standard output.
    #[arg(long, global = true)]
    json: bool,
    /// Say nothing but errors (`check`: and warnings); with --json, errors and the result.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say more: the rounds of refinement, notes on the input; without a terminal how far the work has come, every ten seconds
    /// instead of every minute.
    #[arg(short, long, global = true)]
    verbose: bool,
}

#[derive(Subcommand)]
enum Verb {
    /// Solve, and write the lit model, a picture, a report.
    Bake(bake::Arguments),
    /// Illuminance at points, to an asked error.
    Measure(measure::Arguments),
    /// A picture from the solution.
    Render(render::Arguments),
    /// View factors between surfaces, for heat and for study.
    Factors(factors::Arguments),
    /// Form-factor methods and solvers side by side: time, memory, error, as tables and plots.
    Compare(compare::Arguments),
    /// Walk through a scene in the browser while it is lit, and change it.
    View(view::Arguments),
    /// Every fault of a scene, and what is in it.
    Check(check::Arguments),
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return refuse(error),
    };
    let progress = progress::Progress::new(&cli.global);
    let result = work(&cli, &progress);
    progress.finish();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if cli.global.json {
                let mut event = serde_json::json!({
                    "event": "error", "exit_code": failure.code, "message": failure.message,
                });
                if !failure.faults.0.is_empty() {
                    event["faults"] = serde_json::json!(failure.faults);
                }
                // Whether or not somebody reads it, standard error and the exit code say the same.
                let _ = output::print(&event.to_string());
            }
            output::complain(&failure.message);
            ExitCode::from(failure.code)
        }
    }
}

/// A call that cannot be read, or one for help.
fn refuse(mut error: clap::Error) -> ExitCode {
    // The advice to write `-- -x`, which would name a scene; that of similar options is kept elsewhere.
    error.remove(ContextKind::Suggested);
    let wants_json = std::env::args_os().skip(1).take_while(|word| word != "--").any(|word| word == "--json");
    if wants_json && error.use_stderr() {
        let message = error.to_string().trim_end().to_owned();
        let event = serde_json::json!({ "event": "error", "exit_code": error.exit_code(), "message": message });
        let _ = output::print(&event.to_string());
    }
    // Where nobody reads, the exit code says it.
    let _ = error.print();
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
}

fn work(cli: &Cli, progress: &progress::Progress) -> Result<(), Failure> {
    if let Some(threads) = cli.global.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
        pool.build_global().map_err(|error| Failure::input(format!("--threads {threads}: {error}")))?;
    }
    // `view` has nothing to save and ends in its own way.
    let ends_itself = matches!(cli.verb, Verb::View(_));
    if !ends_itself && let Err(error) = progress.listen_for_interrupts() {
        output::complain(&format!("warning: Ctrl-C may leave temporary files: {error}"));
    }
    match &cli.verb {
        Verb::Bake(arguments) => bake::run(arguments, &cli.global, progress),
        Verb::Measure(arguments) => measure::run(arguments, &cli.global, progress),
        Verb::Render(arguments) => render::run(arguments, &cli.global, progress),
        Verb::Factors(arguments) => factors::run(arguments, &cli.global, progress),
        Verb::Compare(arguments) => compare::run(arguments, &cli.global, progress),
        Verb::View(arguments) => view::run(arguments, &cli.global, progress),
        Verb::Check(arguments) => check::run(arguments, &cli.global),
    }
}

/// Why a verb failed, and so with which exit code.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    message: String,
    faults: Faults,
}

impl Failure {
    /// A failure of the work.
    pub fn work(error: impl std::fmt::Display) -> Failure {
        Failure { code: 1, message: format!("error: {error}"), faults: Faults::default() }
    }

    /// A wrong call or input.
    pub fn input(error: impl std::fmt::Display) -> Failure {
        Failure { code: 2, message: format!("error: {error}"), faults: Faults::default() }
    }
}

impl From<Faults> for Failure {
    /// The faults of an input that cannot be used, one to a line. Warnings tell why, as where all that was there was
    /// dropped; notes never do.
    fn from(faults: Faults) -> Self {
        let told = faults.0.iter().filter(|fault| fault.severity > Severity::Note);
        let message = told.map(ToString::to_string).collect::<Vec<_>>().join("\n");
        Failure { code: 2, message, faults }
    }
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        match error {
            LoadError::Faults(faults) => faults.into(),
            // The message has its "error:" already.
            LoadError::Io { .. } => Failure { code: 2, message: error.to_string(), faults: Faults::default() },
        }
    }
}

impl From<radiosity::Error> for Failure {
    fn from(error: radiosity::Error) -> Self {
        match error {
            radiosity::Error::Elimination { .. } => Failure::input(format!(
                "{error} (use a larger --element-size, an iterative --solver such as gmres, or allow more by --memory)"
            )),
            radiosity::Error::Reciprocity { .. } => {
                Failure::input(format!("{error} (find them by --ff adaptive, or take another --solver, such as gmres)"))
            }
            radiosity::Error::Empty(_)
            | radiosity::Error::Memory { .. }
            | radiosity::Error::Factors(_)
            | radiosity::Error::Matrix { .. }
            | radiosity::Error::Element(_)
            | radiosity::Error::Tolerance { .. }
            | radiosity::Error::Transmission { .. }
            | radiosity::Error::Lightmap(_) => Failure::input(error),
            other => Failure::work(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// The manual has each option of each verb, in its own part or in one that verbs share.
    #[test]
    fn the_manual_has_every_option() {
        let manual = include_str!("../../../docs/manual.md");
        let part = |title: &str| {
            let from = manual.find(title).unwrap_or_else(|| panic!("{title}"));
            let end = manual[from + 1..].find("\n#").map_or(manual.len(), |length| from + 1 + length);
            &manual[from..end]
        };
        let shared = ["\n## The scene", "\n## The solution", "\n## Pictures", "\n## Everywhere"].map(part).concat();
        let mut missing = Vec::new();
        for verb in Cli::command().get_subcommands() {
            let own = format!("{}{shared}", part(&format!("\n### {}\n", verb.get_name())));
            let has = |name: &str| {
                let is_end = |rest: &str| !rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '-');
                own.match_indices(name).any(|(at, _)| is_end(&own[at + name.len()..]))
            };
            let names = verb.get_arguments().filter(|argument| !argument.is_hide_set()).filter_map(|argument| {
                argument.get_short().map(|c| format!("-{c}")).or(argument.get_long().map(|long| format!("--{long}")))
            });
            missing.extend(
                names.filter(|name| !has(name) && name != "-h").map(|name| format!("{} {name}", verb.get_name())),
            );
        }
        assert!(missing.is_empty(), "docs/manual.md does not have {missing:?}");
    }
}
