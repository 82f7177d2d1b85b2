//! What is wrong with an input: every fault at once, each with its place, what it is and what to do.

use serde::Serialize;
use std::fmt;

/// How bad a fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing; nothing was changed.
    Note,
    /// The scene loads, but a part was dropped or altered.
    Warning,
    /// The scene cannot be used.
    Error,
}

/// One fault of an input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// How bad it is.
    pub severity: Severity,
    /// Where: file and the place in it, e.g. `room.gltf: accessors[3]` or `room.obj:17`.
    pub place: String,
    /// What is wrong, with the value.
    pub what: String,
    /// What to do about it; empty where nothing helps.
    pub hint: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{severity}: {}: {}", self.place, self.what)?;
        if !self.hint.is_empty() {
            write!(f, " ({})", self.hint)?;
        }
        Ok(())
    }
}

/// A count with its words: `counted(1, "edge lies", "edges lie")`.
pub fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// Names that are listed before "and N more".
const LISTED: usize = 6;

/// The first names with commas between, and how many there are more.
pub fn listed(mut names: impl ExactSizeIterator<Item = String>) -> String {
    let first: Vec<String> = names.by_ref().take(LISTED).collect();
    let more = names.len();
    first.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}

/// Bytes in the largest unit (powers of 1024) of which there is one at least, to two digits: `size(1 << 20)` is "1.0 MB".
pub fn size(bytes: usize) -> String {
    let units = [("TB", 40), ("GB", 30), ("MB", 20), ("KB", 10)];
    match units.into_iter().find(|(_, shift)| bytes >> shift > 0) {
        None => counted(bytes, "byte", "bytes"),
        Some((unit, shift)) => {
            let value = bytes as f64 / (1u64 << shift) as f64;
            if value < 9.95 { format!("{value:.1} {unit}") } else { format!("{value:.0} {unit}") }
        }
    }
}

/// All faults of an input, in the order they were met.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Faults(pub Vec<Fault>);

impl Faults {
    /// Adds an error.
    pub fn error(&mut self, place: impl Into<String>, what: impl Into<String>, hint: impl Into<String>) {
        self.push(Severity::Error, place.into(), what.into(), hint.into());
    }

    /// Adds a warning.
    pub fn warning(&mut self, place: impl Into<String>, what: impl Into<String>, hint: impl Into<String>) {
        self.push(Severity::Warning, place.into(), what.into(), hint.into());
    }

    /// Adds a note.
    pub fn note(&mut self, place: impl Into<String>, what: impl Into<String>, hint: impl Into<String>) {
        self.push(Severity::Note, place.into(), what.into(), hint.into());
    }

    fn push(&mut self, severity: Severity, place: String, what: String, hint: String) {
        self.0.push(Fault { severity, place, what, hint });
    }

    /// Whether any fault is an error.
    pub fn has_errors(&self) -> bool {
        self.0.iter().any(|fault| fault.severity == Severity::Error)
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.0.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{fault}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Faults {}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole megabytes made "0 MB allowed" of a small limit.
    #[test]
    fn sizes_have_the_unit_that_fits() {
        let said = [0, 1, 1023, 1024, 10 << 10, 1_000_000, 1 << 20, 51_539_607_552, usize::MAX].map(size);
        assert_eq!(
            said,
            ["0 bytes", "1 byte", "1023 bytes", "1.0 KB", "10 KB", "977 KB", "1.0 MB", "48 GB", "16777216 TB"]
        );
    }
}
