//! The `radiosity` program: a verb per file.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its user")]

mod bake;
mod check;
mod html;
mod input;
mod measure;
mod output;
mod progress;
mod render;
mod report;

use clap::{Args, Parser, Subcommand};
use std::process::ExitCode;

/// Diffuse global illumination and radiative exchange by the radiosity method.
///
/// SCENE is a .glb, .gltf or .obj file; without one the built-in Cornell box is used. Lengths in metres, light in
/// cd/m², lm and lx. Exit code 0: done; 1: the work failed; 2: the call or the input was wrong.
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
    #[arg(long, global = true, value_name = "N")]
    threads: Option<usize>,
    /// Progress and result as lines of JSON on standard output.
    #[arg(long, global = true)]
    json: bool,
    /// Say nothing but errors.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Say more: the rounds of refinement, notes on the input.
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
    /// Every fault of a scene, and what is in it.
    Check(check::Arguments),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(threads) = cli.global.threads
        && let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()
    {
        eprintln!("error: --threads {threads}: {error}");
        return ExitCode::from(2);
    }
    let monitor = progress::Progress::new(&cli.global);
    if let Err(error) = monitor.listen_for_interrupts() {
        eprintln!("warning: Ctrl-C will end the program at once: {error}");
    }
    let result = match &cli.verb {
        Verb::Bake(arguments) => bake::run(arguments, &cli.global, &monitor),
        Verb::Measure(arguments) => measure::run(arguments, &cli.global, &monitor),
        Verb::Render(arguments) => render::run(arguments, &cli.global, &monitor),
        Verb::Check(arguments) => check::run(arguments, &cli.global),
    };
    monitor.finish();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            let (code, text) = match &failure {
                Failure::Input(text) => (2, text.clone()),
                Failure::Work(text) => (1, text.clone()),
            };
            if cli.global.json {
                println!("{}", serde_json::json!({ "event": "error", "message": text }));
            }
            eprintln!("{text}");
            ExitCode::from(code)
        }
    }
}

/// Why a verb failed, and so with which exit code.
#[derive(Debug)]
pub enum Failure {
    /// The call or the input was wrong: 2.
    Input(String),
    /// The work failed: 1.
    Work(String),
}

impl Failure {
    /// A failure of the work.
    pub fn work(error: impl std::fmt::Display) -> Failure {
        Failure::Work(format!("error: {error}"))
    }

    /// A wrong call or input.
    pub fn input(error: impl std::fmt::Display) -> Failure {
        Failure::Input(format!("error: {error}"))
    }
}

impl From<radiosity::Error> for Failure {
    fn from(error: radiosity::Error) -> Self {
        match error {
            radiosity::Error::Empty(_) | radiosity::Error::Memory { .. } => Failure::input(error),
            other => Failure::work(other),
        }
    }
}
