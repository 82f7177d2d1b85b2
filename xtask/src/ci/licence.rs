//! Licences of everything we build upon: each package's SPDX expression must be satisfiable by permissive licences.
//!
//! The grammar is that of the SPDX specification 2.3, annex D, without references to other documents: `OR` binds
//! weaker than `AND`, `WITH` names an exception, a `+` means "or later". Cargo's older `MIT/Apache-2.0` means `OR`.

use super::text;
use serde_json::Value;

/// Licences that ask for no more than a notice. Anything else is a decision that somebody must take.
const PERMISSIVE: &[&str] = &[
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Nesting of parentheses that is read; real expressions have one or two.
const DEEPEST: usize = 32;

/// A package and its licence expression.
#[derive(Debug)]
pub struct Package {
    name: String,
    version: String,
    licence: Option<String>,
}

/// Every package of the lock file, our own among them.
pub fn packages(metadata: &Value) -> Vec<Package> {
    let packages = metadata["packages"].as_array().into_iter().flatten();
    packages
        .map(|package| Package {
            name: text(package, "name").unwrap_or_default(),
            version: text(package, "version").unwrap_or_default(),
            licence: text(package, "license"),
        })
        .collect()
}

/// Every package that cannot be used under permissive licences alone.
pub fn violations(packages: &[Package]) -> Vec<String> {
    let mut found = Vec::new();
    if packages.is_empty() {
        found.push("no package was found".to_owned());
    }
    for Package { name, version, licence } in packages {
        let Some(expression) = licence else {
            found.push(format!("{name} {version} states no licence expression"));
            continue;
        };
        match permitted(expression) {
            Ok(true) => {}
            Ok(false) => {
                found.push(format!("{name} {version}: licence '{expression}' is not among the permissive ones"))
            }
            Err(what) => found.push(format!("{name} {version}: licence '{expression}' cannot be read: {what}")),
        }
    }
    found
}

/// Whether an expression can be met by permissive licences.
fn permitted(expression: &str) -> Result<bool, String> {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut reader = Reader { words: &words, depth: 0 };
    let answer = reader.alternatives()?;
    match reader.words.first() {
        None => Ok(answer),
        Some(word) => Err(format!("'{word}' is one too many")),
    }
}

/// Recursive descent over the words that are left.
struct Reader<'a> {
    words: &'a [&'a str],
    depth: usize,
}

impl Reader<'_> {
    fn alternatives(&mut self) -> Result<bool, String> {
        let mut any = self.conjunction()?;
        while self.skip("OR") {
            any |= self.conjunction()?;
        }
        Ok(any)
    }

    fn conjunction(&mut self) -> Result<bool, String> {
        let mut all = self.single()?;
        while self.skip("AND") {
            all &= self.single()?;
        }
        Ok(all)
    }

    fn single(&mut self) -> Result<bool, String> {
        if self.skip("(") {
            self.depth += 1;
            if self.depth > DEEPEST {
                return Err(format!("more than {DEEPEST} nested parentheses"));
            }
            let inner = self.alternatives()?;
            self.depth -= 1;
            return if self.skip(")") { Ok(inner) } else { Err("')' is missing".to_owned()) };
        }
        let name = self.name("a licence")?;
        // An exception only adds permissions: the licence itself decides.
        if self.skip("WITH") {
            self.name("an exception")?;
        }
        Ok(PERMISSIVE.contains(&name.strip_suffix('+').unwrap_or(&name)))
    }

    fn name(&mut self, expected: &str) -> Result<String, String> {
        match self.words.split_first() {
            Some((word, rest)) if !["(", ")", "AND", "OR", "WITH"].contains(word) => {
                self.words = rest;
                Ok((*word).to_owned())
            }
            Some((word, _)) => Err(format!("{expected} was expected, not '{word}'")),
            None => Err(format!("{expected} was expected, not the end")),
        }
    }

    fn skip(&mut self, word: &str) -> bool {
        let there = self.words.first() == Some(&word);
        if there {
            self.words = &self.words[1..];
        }
        there
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_are_judged_by_what_they_let_us_choose() {
        for (expression, answer) in [
            ("MIT", true),
            ("GPL-3.0-only", false),
            ("MIT OR GPL-3.0-only", true),
            ("GPL-3.0-only OR MIT", true),
            ("MIT AND GPL-3.0-only", false),
            ("MIT/Apache-2.0", true),
            ("GPL-2.0/MIT", true),
            ("(MIT OR Apache-2.0) AND Unicode-3.0", true),
            ("(MIT OR Apache-2.0) AND GPL-3.0-only", false),
            ("((MIT))", true),
            ("Apache-2.0 WITH LLVM-exception", true),
            ("GPL-2.0-only WITH Classpath-exception-2.0", false),
            ("GPL-3.0-only AND GPL-3.0-only OR MIT", true),
            ("MIT OR GPL-3.0-only AND GPL-3.0-only", true),
            ("GPL-3.0-only AND (GPL-3.0-only OR MIT)", false),
            ("Apache-2.0+", true),
            ("MPL-2.0", false),
            ("mit", false),
        ] {
            assert_eq!(permitted(expression), Ok(answer), "{expression}");
        }
    }

    #[test]
    fn what_is_no_expression_is_never_permitted() {
        for expression in
            ["", "MIT OR", "OR MIT", "(MIT", "MIT)", "MIT Apache-2.0", "MIT AND OR Zlib", "MIT WITH", "()"]
        {
            assert!(permitted(expression).is_err(), "{expression}");
        }
        assert!(permitted(&"(".repeat(100_000)).is_err());
    }

    #[test]
    fn each_offender_is_named() {
        let metadata = serde_json::json!({ "packages": [
            { "name": "good", "version": "1.0.0", "license": "MIT OR Apache-2.0" },
            { "name": "viral", "version": "2.0.0", "license": "AGPL-3.0-only" },
            { "name": "silent", "version": "3.0.0", "license": null, "license_file": "LICENSE" },
            { "name": "garbled", "version": "4.0.0", "license": "MIT OR" },
        ]});
        let found = violations(&packages(&metadata));
        assert_eq!(found.len(), 3, "{found:?}");
        for (line, name) in found.iter().zip(["viral 2.0.0", "silent 3.0.0", "garbled 4.0.0"]) {
            assert!(line.starts_with(name), "{line}");
        }
        assert_eq!(violations(&[]).len(), 1);
    }
}
