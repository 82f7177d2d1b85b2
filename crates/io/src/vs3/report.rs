//! The faults of a file by line: the first are kept, the rest is counted, so that a damaged file takes no more memory than
//! it has bytes.

use radiosity_scene::{Fault, Faults, Severity, counted};

/// Most errors, and most warnings, that are kept of one file; nobody reads past the first hundreds.
const MAX_OF_A_KIND: usize = 500;

/// Faults on their way.
#[derive(Debug)]
pub(super) struct Report<'a> {
    file: &'a str,
    faults: Faults,
    errors: usize,
    warnings: usize,
}

impl<'a> Report<'a> {
    pub fn new(file: &'a str) -> Report<'a> {
        Report { file, faults: Faults::default(), errors: 0, warnings: 0 }
    }

    pub fn error(&mut self, line: usize, what: impl Into<String>, hint: impl Into<String>) {
        self.errors += 1;
        if self.errors <= MAX_OF_A_KIND {
            self.faults.error(format!("{}:{line}", self.file), what, hint);
        }
    }

    pub fn warning(&mut self, line: usize, what: impl Into<String>, hint: impl Into<String>) {
        self.warnings += 1;
        if self.warnings <= MAX_OF_A_KIND {
            self.faults.warning(format!("{}:{line}", self.file), what, hint);
        }
    }

    pub fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// All that was kept, and how many more there were.
    pub fn finish(mut self) -> Faults {
        for (count, severity, one, many) in [
            (self.errors, Severity::Error, "more error", "more errors"),
            (self.warnings, Severity::Warning, "more warning", "more warnings"),
        ] {
            if count > MAX_OF_A_KIND {
                let what = format!("and {}", counted(count - MAX_OF_A_KIND, one, many));
                self.faults.0.push(Fault { severity, place: self.file.to_owned(), what, hint: String::new() });
            }
        }
        self.faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_much_is_counted() {
        let mut report = Report::new("f");
        (0..MAX_OF_A_KIND + 3).for_each(|line| report.error(line, "bad", ""));
        report.warning(9, "odd", "");
        let faults = report.finish();
        assert_eq!(faults.0.len(), MAX_OF_A_KIND + 2);
        assert_eq!(faults.0.last().unwrap().to_string(), "error: f: and 3 more errors");
    }
}
