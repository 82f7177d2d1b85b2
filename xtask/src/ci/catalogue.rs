//! The catalogue of methods, `docs/catalogue.md`, is complete and true: each item has its row, each file and test that a
//! row names exists, and each test that is named for an item is in a row.
//!
//! A row is `| item | what | where | tests | figure |`. In backticks: what has a slash is a file of the repository; what
//! stands among the tests is a function of the sources.

use std::collections::BTreeSet;
use std::path::Path;

/// The items that a row is asked for.
fn items() -> impl Iterator<Item = String> {
    ["0a", "0b", "0c"].map(str::to_owned).into_iter().chain((1..=44).chain(89..=94).map(|n: u32| n.to_string()))
}

/// Everything that is wrong with the table of a repository.
pub fn violations(root: &Path) -> Vec<String> {
    let table = match std::fs::read_to_string(root.join("docs/catalogue.md")) {
        Ok(table) => table,
        Err(error) => return vec![format!("docs/catalogue.md: {error}")],
    };
    let mut tests = BTreeSet::new();
    for folder in ["crates", "apps"] {
        functions(&root.join(folder), &mut tests);
    }
    judge(&table, &tests, |file| root.join(file).exists())
}

/// Names of all functions below a folder.
fn functions(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            functions(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.extend(names(&std::fs::read_to_string(path).unwrap_or_default()).map(str::to_owned));
        }
    }
}

/// Names of the functions without parameters, as tests are, that a source defines.
fn names(source: &str) -> impl Iterator<Item = &str> {
    source.lines().filter_map(|line| line.trim().strip_prefix("fn ")?.split_once("()").map(|(name, _)| name))
}

fn judge(table: &str, tests: &BTreeSet<String>, exists: impl Fn(&str) -> bool) -> Vec<String> {
    let mut found = Vec::new();
    let (mut seen, mut named) = (BTreeSet::new(), BTreeSet::new());
    for line in table.lines().filter(|line| line.starts_with('|')) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        if cells[0] == "item" || cells[0].starts_with('-') {
            continue;
        }
        let item = cells[0];
        if cells.len() != 5 || cells.iter().any(|cell| cell.is_empty()) {
            found.push(format!("item {item}: a row has five cells, none of them empty"));
            continue;
        }
        if !seen.insert(item) {
            found.push(format!("item {item}: has two rows"));
        }
        let quoted = |cell| str::split(cell, '`').skip(1).step_by(2);
        let files = cells.iter().flat_map(|cell| quoted(*cell)).filter(|word| word.contains('/'));
        found.extend(files.filter(|file| !exists(file)).map(|file| format!("item {item}: there is no file {file}")));
        for test in quoted(cells[3]).filter(|word| !word.contains('/')) {
            named.insert(test);
            if !tests.contains(test) {
                found.push(format!("item {item}: there is no test {test}"));
            }
        }
    }
    found.extend(items().filter(|item| !seen.contains(item.as_str())).map(|item| format!("item {item}: has no row")));
    let numbered = tests.iter().filter(|test| test.starts_with("catalogue_") && !named.contains(test.as_str()));
    found.extend(numbered.map(|test| format!("{test}: is in no row")));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_complete_and_true() {
        let found = violations(&super::super::root());
        assert!(found.is_empty(), "docs/catalogue.md:\n{}", found.join("\n"));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let source =
            "#[test]\n    fn catalogue_1_a() {\n}\nfn catalogue_2_b() {}\n// fn catalogue_3_c() {\nfn help(x: u8) {}\n";
        let tests: BTreeSet<String> = names(source).map(str::to_owned).collect();
        assert_eq!(tests.iter().collect::<Vec<_>>(), ["catalogue_1_a", "catalogue_2_b"]);
        let rows: String = items().map(|item| format!("| {item} | w | `a/b.rs` | `catalogue_1_a` | 1 |\n")).collect();
        let table = format!("| item | what | where | tests | figure |\n|---|---|---|---|---|\n{rows}");
        let said = |table: &str| judge(table, &tests, |file| file == "a/b.rs");
        assert_eq!(said(&table), ["catalogue_2_b: is in no row"]);
        let table = table.replace("| 44 |", "| 95 |").replacen("a/b.rs", "a/c.rs", 1);
        let table =
            format!("{table}| 8 | w | w | `catalogue_2_b`, `gone` | |\n| 8 | w | w | `catalogue_2_b`, `gone` | f |\n");
        assert_eq!(
            said(&table),
            [
                "item 0a: there is no file a/c.rs",
                "item 8: a row has five cells, none of them empty",
                "item 8: has two rows",
                "item 8: there is no test gone",
                "item 44: has no row"
            ]
        );
    }
}
