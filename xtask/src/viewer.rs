//! The page of `radiosity view`: built by npm from `apps/viewer/src` into `apps/viewer/dist`, which is committed, so that
//! the program builds without Node.

use crate::fault::Fault;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The oldest Node that its tools run on.
const NODE: u32 = 20;

/// Names of the browser whose engine the tests are written for.
const BROWSERS: &[&str] = &["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// `cargo xtask viewer`.
pub fn command(arguments: &[&str]) -> Result<String, Fault> {
    let root = crate::root();
    let viewer = root.join("apps/viewer");
    let committed = viewer.join("dist/index.html");
    match arguments {
        [] => {
            install(&viewer)?;
            build(&viewer, "dist")?;
            Ok(format!("viewer: wrote {}", committed.display()))
        }
        ["--check"] => {
            install(&viewer)?;
            build(&viewer, "node_modules/.check")?;
            let read = |path: &Path| std::fs::read(path).map_err(Fault::at(path));
            let built = read(&viewer.join("node_modules/.check/index.html"))?;
            match built == read(&committed)? {
                true => Ok("viewer: what is committed is current".to_owned()),
                false => Err(Fault::Viewer(format!(
                    "{} is not what its sources make; run `cargo xtask viewer` and commit it",
                    committed.display()
                ))),
            }
        }
        ["--test-all"] => test(&viewer, &[], true),
        // Whoever names a test wants to see it run.
        ["--test", names @ ..] => test(&viewer, names, !names.is_empty()),
        _ => Err(Fault::Usage("'viewer' takes nothing, '--check', '--test [NAME]...', or '--test-all'".to_owned())),
    }
}

/// Runs the page's tests in a browser: those with one of some names, or all; and with those that are `slow`, or without.
fn test(viewer: &Path, names: &[&str], slow: bool) -> Result<String, Fault> {
    install(viewer)?;
    let browser = browser()?;
    // The program that its own tests run: nothing is compiled where `cargo test --workspace` has been. Built by itself it
    // would have fewer features of its dependencies, and all of them would be compiled again.
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    run(build.current_dir(crate::root()).args(["test", "--locked", "--workspace", "--test", "cli", "--no-run"]))?;
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| crate::root().join("target"), PathBuf::from);
    let mut tests = Command::new("node");
    tests.current_dir(viewer).args(["--test", "--test-concurrency=1"]);
    if slow {
        tests.env("SLOW", "1");
    }
    for name in names {
        tests.args(["--test-name-pattern", name]);
    }
    tests.args(tests_in(viewer)?).env("RADIOSITY", target.join("debug/radiosity")).env("CHROMIUM", browser);
    run(&mut tests)?;
    Ok("viewer: all tests passed".to_owned())
}

/// The files of tests, each with a program and a browser of its own.
fn tests_in(viewer: &Path) -> Result<Vec<PathBuf>, Fault> {
    let folder = viewer.join("test");
    let entries =
        std::fs::read_dir(&folder).and_then(Iterator::collect::<Result<Vec<_>, _>>).map_err(Fault::at(&folder))?;
    let mut tests: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
    tests.retain(|path| path.to_string_lossy().ends_with(".test.mjs"));
    tests.sort();
    Ok(tests)
}

/// What the page is made of, as the lock file says.
fn install(viewer: &Path) -> Result<(), Fault> {
    let version = Command::new("node").arg("--version").output().ok();
    check(version.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).as_deref())?;
    run(Command::new("npm").current_dir(viewer).args(["ci", "--no-audit", "--no-fund", "--loglevel=error"]))
}

/// Whether this Node.js, if there is any, is new enough.
fn check(version: Option<&str>) -> Result<(), Fault> {
    let major =
        version.and_then(|version| version.trim().trim_start_matches('v').split('.').next()?.parse::<u32>().ok());
    if major.is_some_and(|major| major >= NODE) {
        return Ok(());
    }
    let version = version.map(str::trim).filter(|version| !version.is_empty());
    let there = version.map_or_else(|| "there is none".to_owned(), |version| format!("there is {version}"));
    Err(Fault::Viewer(format!(
        "Node.js {NODE} or newer is needed, {there}; install it with npm (https://nodejs.org). The program itself is built without"
    )))
}

fn build(viewer: &Path, folder: &str) -> Result<(), Fault> {
    run(Command::new("npx").current_dir(viewer).arg("tsc"))?;
    run(Command::new("npx").current_dir(viewer).args([
        "vite",
        "build",
        "--logLevel=warn",
        "--emptyOutDir",
        "--outDir",
        folder,
    ]))
}

/// The browser that is asked for by `CHROMIUM`, or one that is installed.
fn browser() -> Result<PathBuf, Fault> {
    if let Some(asked) = std::env::var_os("CHROMIUM") {
        return Ok(asked.into());
    }
    let folders: Vec<PathBuf> =
        std::env::var_os("PATH").map(|path| std::env::split_paths(&path).collect()).unwrap_or_default();
    let places = BROWSERS.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    places.into_iter().find(|place| place.is_file()).ok_or_else(|| {
        Fault::Viewer(
            "the tests need Chromium; install it (Debian: apt install chromium), or name it by CHROMIUM".to_owned(),
        )
    })
}

/// Runs a program whose output goes where ours goes.
fn run(command: &mut Command) -> Result<(), Fault> {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let line = words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Fault::Viewer(format!("`{line}`: {status}"))),
        Err(error) => Err(Fault::Viewer(format!("`{line}` did not start: {error}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn node_that_is_missing_or_old_is_named() {
        let refused = |version| check(version).unwrap_err().to_string();
        for (version, there) in
            [(None, "there is none;"), (Some("v18.19.0\n"), "there is v18.19.0;"), (Some("\n"), "there is none;")]
        {
            let text = refused(version);
            assert!(text.contains(&format!("Node.js {NODE} or newer is needed")) && text.contains(there), "{text}");
            assert!(text.contains("https://nodejs.org"), "{text}");
        }
        for version in ["v20.0.0\n", "v22.11.1", "24.1.0"] {
            assert!(check(Some(version)).is_ok(), "{version}");
        }
    }
}
