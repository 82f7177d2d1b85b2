//! What can go wrong in a task.

use std::path::{Path, PathBuf};

/// A task's fault. `Usage` is the caller's (exit code 2), the others are the world's (exit code 1).
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    #[error("{0}")]
    Usage(String),
    #[error("{path}: {source}", path = .path.display())]
    File { path: PathBuf, source: std::io::Error },
    #[error("assets/kaykit/{model}: {what}")]
    Kit { model: String, what: String },
    #[error("encoding a picture: {0}")]
    Picture(#[from] png::EncodingError),
    #[error("the file would need {0} bytes; GLB ends at 4 GiB, ask for fewer triangles")]
    TooLarge(u64),
    #[error("viewer: {0}")]
    Viewer(String),
    #[error("bench: {0}")]
    Bench(String),
    #[error("ci: {step} FAILED after {seconds:.1} s\n{what}")]
    Check { step: &'static str, seconds: f64, what: String },
}

impl Fault {
    /// Names the file in an input or output error.
    pub fn at(path: &Path) -> impl FnOnce(std::io::Error) -> Fault + '_ {
        move |source| Fault::File { path: path.to_owned(), source }
    }
}

/// Options of the form `name value`; every name must be among `known`.
pub fn options<'a>(arguments: &[&'a str], known: &[&str]) -> Result<Vec<(&'a str, &'a str)>, Fault> {
    let mut found = Vec::new();
    let mut rest = arguments.iter();
    while let Some(&name) = rest.next() {
        if !known.contains(&name) {
            return Err(Fault::Usage(format!("'{name}' is not known here; known: {}", known.join(", "))));
        }
        let value = rest.next().ok_or_else(|| Fault::Usage(format!("'{name}' needs a value")))?;
        found.push((name, *value));
    }
    Ok(found)
}
