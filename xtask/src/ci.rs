//! Everything that guards the main branch, in one command: format, import rule, licences, the catalogue of
//! methods, lints, tests, documentation.
//!
//! The quick checks come first; the first failure ends the run. The import rule and the licences are judged here, from
//! what `cargo metadata` says of every package in the lock file, for all platforms.

mod catalogue;
mod licence;
mod rule;

use crate::fault::Fault;
use crate::root;
use serde_json::Value;
use std::process::Command;
use std::time::Instant;

/// `cargo xtask ci`.
pub fn command(arguments: &[&str]) -> Result<String, Fault> {
    if !arguments.is_empty() {
        return Err(Fault::Usage("'ci' takes no arguments".to_owned()));
    }
    let started = Instant::now();
    step("format", || cargo(&["fmt", "--all", "--check"], &[]))?;
    let metadata = metadata()?;
    step("import rule", || verdict(rule::violations(&rule::crates(&metadata))))?;
    step("licences", || verdict(licence::violations(&licence::packages(&metadata))))?;
    step("catalogue", || verdict(catalogue::violations(&root())))?;
    step("clippy", || cargo(&["clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"], &[]))?;
    // Examples are checked by clippy; linking them takes time and tests nothing.
    step("tests", || cargo(&["test", "--workspace", "--locked", "--lib", "--bins", "--tests"], &[]))?;
    step("tests of documentation", || cargo(&["test", "--workspace", "--locked", "--doc"], &[]))?;
    // Libraries only: the program and the library share the name `radiosity`, and so would their pages.
    step("documentation", || {
        cargo(&["doc", "--workspace", "--lib", "--no-deps", "--locked"], &[("RUSTDOCFLAGS", "-D warnings")])
    })?;
    Ok(format!("ci: all passed in {:.1} s", started.elapsed().as_secs_f64()))
}

/// Runs one step between two lines that name it.
#[expect(clippy::print_stdout, reason = "steps take minutes; who waits wants to know for what")]
fn step(name: &'static str, work: impl FnOnce() -> Result<(), String>) -> Result<(), Fault> {
    println!("ci: {name} ...");
    let started = Instant::now();
    let outcome = work();
    let seconds = started.elapsed().as_secs_f64();
    match outcome {
        Ok(()) => {
            println!("ci: {name} passed in {seconds:.1} s");
            Ok(())
        }
        Err(what) => Err(Fault::Check { step: name, seconds, what }),
    }
}

/// Success if there is nothing to complain of, else all complaints, one per line.
fn verdict(violations: Vec<String>) -> Result<(), String> {
    if violations.is_empty() { Ok(()) } else { Err(violations.join("\n")) }
}

/// Runs cargo in the root of the workspace; its output goes where ours goes.
fn cargo(arguments: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
    let line = format!("cargo {}", arguments.join(" "));
    let status = cargo_command().args(arguments).envs(environment.iter().copied()).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{line}`: {status}")),
        Err(error) => Err(format!("`{line}` did not start: {error}")),
    }
}

/// What cargo knows of every package of the workspace and below it.
fn metadata() -> Result<Value, Fault> {
    let failed = |what| Fault::Check { step: "cargo metadata", seconds: 0.0, what };
    let output = cargo_command()
        .args(["metadata", "--format-version", "1", "--locked"])
        .output()
        .map_err(|error| failed(format!("did not start: {error}")))?;
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| failed(error.to_string()))
}

/// The cargo that runs us, or the one on the path.
fn cargo_command() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// Text of a field, if it is there.
fn text(value: &Value, field: &str) -> Option<String> {
    value[field].as_str().map(str::to_owned)
}
