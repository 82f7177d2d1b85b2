//! The whole, measured: error against time and where the errors are, on every scene of a folder whose light is known.

use crate::fault::{Fault, options};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What belongs to a scene whose light is known.
const KNOWN: [&str; 2] = ["points.csv", "reference.csv"];

/// `cargo xtask bench FOLDER [-o FOLDER]`.
pub fn command(arguments: &[&str]) -> Result<String, Fault> {
    let usage = || Fault::Usage("'bench' takes the folder of the scenes, and '-o FOLDER'".to_owned());
    let [scenes, rest @ ..] = arguments else { return Err(usage()) };
    let to =
        options(rest, &["-o"])?.last().map_or_else(|| crate::root().join("out/bench"), |(_, to)| PathBuf::from(to));
    let absolute = |path: &Path| std::path::absolute(path).map_err(Fault::at(path));
    let (scenes, to) = (absolute(Path::new(scenes))?, absolute(&to)?);
    let known = known_in(&scenes)?;
    if known.is_empty() {
        let what = format!("{}: no folder in it holds a scene with {} and {}", scenes.display(), KNOWN[0], KNOWN[1]);
        return Err(Fault::Bench(what));
    }
    std::fs::create_dir_all(&to).map_err(Fault::at(&to))?;
    let mut said = String::new();
    for (folder, scene) in &known {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (curve, errors) = (to.join(format!("curve-{name}.svg")), to.join(format!("errors-{name}.png")));
        said += &run("curves", &[folder.as_os_str(), curve.as_os_str()])?;
        said += &run("error_maps", &[scene.as_os_str(), errors.as_os_str()])?;
    }
    let table = to.join("bench.md");
    std::fs::write(&table, &said).map_err(Fault::at(&table))?;
    Ok(format!("{said}\nbench: wrote {}, and plots and pictures beside it", table.display()))
}

/// Folders in a folder that hold a scene whose light is known, and the scene, in order.
fn known_in(scenes: &Path) -> Result<Vec<(PathBuf, PathBuf)>, Fault> {
    let entries = |folder: &Path| -> Result<Vec<PathBuf>, Fault> {
        let read = std::fs::read_dir(folder).and_then(|entries| entries.map(|e| Ok(e?.path())).collect());
        let mut paths: Vec<PathBuf> = read.map_err(Fault::at(folder))?;
        paths.sort();
        Ok(paths)
    };
    let is_scene = |path: &&PathBuf| path.extension().is_some_and(|e| ["obj", "gltf", "glb"].iter().any(|x| e == *x));
    let mut known = Vec::new();
    for folder in entries(scenes)?.into_iter().filter(|path| path.is_dir()) {
        if KNOWN.iter().all(|name| folder.join(name).is_file()) {
            let scene = entries(&folder)?.iter().find(is_scene).cloned();
            let none = || Fault::Bench(format!("{}: there is no scene (.obj, .gltf, .glb) in it", folder.display()));
            known.push((folder.clone(), scene.ok_or_else(none)?));
        }
    }
    Ok(known)
}

/// What a bench of the library says.
fn run(bench: &str, arguments: &[&OsStr]) -> Result<String, Fault> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.current_dir(crate::root()).args(["bench", "--locked", "-p", "radiosity", "--bench", bench, "--"]);
    let failed = |what: String| Fault::Bench(format!("{bench}: {what}"));
    let output = command.args(arguments).stderr(Stdio::inherit()).output().map_err(|e| failed(e.to_string()))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned() + "\n"),
        false => Err(failed(format!("{} (what it said is above)", output.status))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_scenes_whose_light_is_known_are_measured() {
        let root = std::env::temp_dir().join(format!("radiosity-bench-{}", std::process::id()));
        let file = |path: &str| {
            let path = root.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        };
        for path in ["b/b.glb", "b/points.csv", "b/reference.csv", "a/a.obj", "a/points.csv", "c/reference.csv"] {
            file(path);
        }
        let known = known_in(&root);
        assert_eq!(known.unwrap(), [(root.join("b"), root.join("b/b.glb"))]);
        file("d/points.csv");
        file("d/reference.csv");
        assert!(matches!(known_in(&root), Err(Fault::Bench(_))), "no scene in d");
        std::fs::remove_dir_all(&root).unwrap();
        assert!(matches!(command(&[]), Err(Fault::Usage(_))));
        assert!(matches!(command(&[root.to_str().unwrap()]), Err(Fault::File { .. })));
    }
}
