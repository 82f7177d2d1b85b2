//! Why an input could not be used.

use radiosity_scene::Faults;
use std::path::PathBuf;

/// Loading failed: either a file could not be read at all, or what it says cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file itself could not be read.
    #[error("error: {}: cannot be read: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        #[source]
        error: std::io::Error,
    },
    /// The file was read and found wrong; holds every fault found, warnings and notes included.
    #[error("{0}")]
    Faults(Faults),
}

impl LoadError {
    /// The faults found in the file; none where it could not be read.
    pub fn faults(&self) -> Option<&Faults> {
        match self {
            LoadError::Io { .. } => None,
            LoadError::Faults(faults) => Some(faults),
        }
    }

    /// One error about one place.
    pub(crate) fn one(place: impl Into<String>, what: impl Into<String>, hint: impl Into<String>) -> LoadError {
        let mut faults = Faults::default();
        faults.error(place, what, hint);
        LoadError::Faults(faults)
    }
}
