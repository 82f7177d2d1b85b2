//! The import rule: who may depend on whom inside the workspace.
//!
//! It keeps the seams where they are: a solver that cannot name a triangle cannot come to need one. All kinds of
//! dependency count, those of tests too, else a test would be the door through which the wrong import comes.

use super::text;
use serde_json::Value;
use std::collections::BTreeSet;

/// What each library may import. A crate that is missing here is a violation: its place must be decided.
const RULE: &[(&str, &[&str])] = &[
    ("radiosity-scene", &[]),
    ("radiosity-solve", &[]),
    ("radiosity-trace", &["radiosity-scene"]),
    ("radiosity-transport", &["radiosity-scene", "radiosity-trace", "radiosity-solve"]),
    ("radiosity-view", &["radiosity-scene", "radiosity-trace"]),
    ("radiosity-io", &["radiosity-scene"]),
    (
        "radiosity",
        &[
            "radiosity-scene",
            "radiosity-trace",
            "radiosity-transport",
            "radiosity-solve",
            "radiosity-view",
            "radiosity-io",
        ],
    ),
    ("xtask", &[]),
];

/// What everything under `apps/` may import.
const APPS: &[&str] = &["radiosity"];

/// A crate of the workspace and what it names in its manifest, ours or not.
#[derive(Debug)]
pub struct Crate {
    name: String,
    app: bool,
    imports: Vec<String>,
}

/// The workspace's own crates.
pub fn crates(metadata: &Value) -> Vec<Crate> {
    let root = metadata["workspace_root"].as_str().unwrap_or_default();
    let apps = std::path::Path::new(root).join("apps");
    let members: BTreeSet<&str> =
        metadata["workspace_members"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let packages = metadata["packages"].as_array().into_iter().flatten();
    packages
        .filter(|package| package["id"].as_str().is_some_and(|id| members.contains(id)))
        .map(|package| Crate {
            name: text(package, "name").unwrap_or_default(),
            app: text(package, "manifest_path").is_some_and(|path| std::path::Path::new(&path).starts_with(&apps)),
            imports: package["dependencies"]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(|dependency| text(dependency, "name"))
                .collect(),
        })
        .collect()
}

/// Every import that the rule does not allow, with the rule.
pub fn violations(crates: &[Crate]) -> Vec<String> {
    let ours: BTreeSet<&str> = crates.iter().map(|c| c.name.as_str()).collect();
    let mut found = Vec::new();
    if crates.is_empty() {
        found.push("no crate of the workspace was found".to_owned());
    }
    for c in crates {
        let listed = RULE.iter().find(|(name, _)| *name == c.name).map(|(_, allowed)| *allowed);
        let place = if c.app { Some(APPS) } else { listed };
        let Some(allowed) = place else {
            found.push(format!("{} has no place in the import rule: add it to xtask/src/ci/rule.rs", c.name));
            continue;
        };
        let may = if allowed.is_empty() { "none of ours".to_owned() } else { allowed.join(", ") };
        let imports: BTreeSet<&str> = c.imports.iter().map(String::as_str).collect();
        for import in imports.intersection(&ours).filter(|import| !allowed.contains(import)) {
            found.push(format!("{} imports {import}; the rule: {} -> {may}", c.name, c.name));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// A workspace of (folder, name, imports).
    fn workspace(members: &[(&str, &str, &[&str])]) -> Value {
        let packages: Vec<Value> = members
            .iter()
            .map(|(folder, name, imports)| {
                let dependencies: Vec<Value> = imports.iter().map(|name| json!({ "name": name })).collect();
                json!({
                    "id": name,
                    "name": name,
                    "manifest_path": format!("/w/{folder}/Cargo.toml"),
                    "dependencies": dependencies,
                })
            })
            .chain([json!({ "id": "glam", "name": "glam", "manifest_path": "/r/glam/Cargo.toml", "dependencies": [] })])
            .collect();
        let ids: Vec<&str> = members.iter().map(|(_, name, _)| *name).collect();
        json!({ "workspace_root": "/w", "workspace_members": ids, "packages": packages })
    }

    fn judge(members: &[(&str, &str, &[&str])]) -> Vec<String> {
        violations(&crates(&workspace(members)))
    }

    const SCENE: (&str, &str, &[&str]) = ("crates/scene", "radiosity-scene", &["glam"]);
    const LIBRARY: (&str, &str, &[&str]) = ("crates/radiosity", "radiosity", &["radiosity-scene"]);

    #[test]
    fn imports_along_the_rule_pass() {
        let app: (_, _, &[_]) = ("apps/cli", "radiosity-cli", &["radiosity", "clap"]);
        assert_eq!(judge(&[SCENE, LIBRARY, app, ("xtask", "xtask", &["glam"])]), [""; 0]);
    }

    #[test]
    fn a_solver_that_sees_geometry_is_named_with_the_rule() {
        let solve: (_, _, &[_]) = ("crates/solve", "radiosity-solve", &["rayon", "radiosity-scene"]);
        assert_eq!(
            judge(&[SCENE, solve]),
            ["radiosity-solve imports radiosity-scene; the rule: radiosity-solve -> none of ours"]
        );
    }

    #[test]
    fn an_app_reaches_the_libraries_through_radiosity_only() {
        let app: (_, _, &[_]) = ("apps/viewer", "radiosity-viewer", &["radiosity", "radiosity-scene"]);
        let found = judge(&[SCENE, LIBRARY, app]);
        assert_eq!(found, ["radiosity-viewer imports radiosity-scene; the rule: radiosity-viewer -> radiosity"]);
    }

    #[test]
    fn a_library_never_imports_an_app() {
        let app: (_, _, &[_]) = ("apps/cli", "radiosity-cli", &["radiosity"]);
        let view: (_, _, &[_]) = ("crates/view", "radiosity-view", &["radiosity-cli", "radiosity-scene"]);
        let found = judge(&[SCENE, LIBRARY, app, view]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with("radiosity-view imports radiosity-cli"), "{found:?}");
    }

    /// An app is known by its folder, not by what it is called.
    #[test]
    fn a_new_library_must_be_given_a_place() {
        let found = judge(&[SCENE, ("crates/appstore", "radiosity-gpu", &[])]);
        assert_eq!(found, ["radiosity-gpu has no place in the import rule: add it to xtask/src/ci/rule.rs"]);
    }

    #[test]
    fn metadata_without_crates_is_no_proof() {
        assert_eq!(violations(&crates(&json!({}))).len(), 1);
    }
}
