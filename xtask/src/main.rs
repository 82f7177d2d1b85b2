//! Workspace tasks, run as `cargo xtask VERB`.

mod bench;
mod ci;
mod fault;
mod glb;
mod hash;
mod scenes;
mod showcase;
mod viewer;

use fault::Fault;
use std::path::PathBuf;
use std::process::ExitCode;

const USAGE: &str = "\
Usage: cargo xtask VERB

  ci                                      run every check: format, import rule, licences, catalogue, lints, tests, docs
  bench FOLDER [-o FOLDER]                error against time and error maps of all scenes in a folder whose light is known
  showcase [-o FILE]                      write the furnished living room (default out/showcase.glb)
  scenes building [--rooms N] -o FILE     write a closed building of N rooms joined by doors (default 16)
  scenes soup [--triangles N] -o FILE     write a closed room filled with small boxes (default 10000)
  viewer                                  build the page of `radiosity view` (needs Node.js)
  viewer --check                          is the page that is committed current?
  viewer --test [NAME]...                 its tests in a browser (needs Chromium)
  viewer --test-all                       with the slow ones
  help                                    show this text

Lengths are metres, light is in lux and cd/m². Output is GLB, the same bytes every time.
";

/// Root of the workspace that `cargo run` was called in. Not where this was compiled: two checkouts that share a target
/// folder share the program, and the one would be judged in place of the other.
fn root() -> PathBuf {
    let manifest = std::env::var_os("CARGO_MANIFEST_DIR");
    let mut path = manifest.map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
    path.pop();
    path
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match arguments.split_first() {
        Some((&"ci", rest)) => ci::command(rest),
        Some((&"bench", rest)) => bench::command(rest),
        Some((&"showcase", rest)) => showcase::command(rest),
        Some((&"scenes", rest)) => scenes::command(rest),
        Some((&"viewer", rest)) => viewer::command(rest),
        Some((&("help" | "-h" | "--help"), _)) => Ok(USAGE.to_owned()),
        Some((verb, _)) => Err(Fault::Usage(format!("there is no verb '{verb}'"))),
        None => Err(Fault::Usage("a verb is needed".to_owned())),
    };
    report(outcome)
}

/// The only place that prints: what was done, or what went wrong and how to call it right.
#[expect(clippy::print_stdout, clippy::print_stderr, reason = "a command line tool speaks to its user")]
fn report(outcome: Result<String, Fault>) -> ExitCode {
    match outcome {
        Ok(done) => {
            println!("{}", done.trim_end());
            ExitCode::SUCCESS
        }
        Err(fault @ Fault::Usage(_)) => {
            eprint!("xtask: {fault}\n\n{USAGE}");
            ExitCode::from(2)
        }
        Err(fault) => {
            eprintln!("xtask: {fault}");
            ExitCode::FAILURE
        }
    }
}
