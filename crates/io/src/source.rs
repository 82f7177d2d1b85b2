//! Where the bytes behind an address in a file come from: the folder of that file and nothing else.
//!
//! A scene is somebody else's data. Its addresses must not reach what the user did not hand over, so the folder
//! reader refuses networks, absolute paths, drive letters, `..` out of the folder (also percent-encoded or with `\`)
//! and symbolic links that lead outside. It opens plain files only, since reading a pipe or a device may never end.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Largest file that is read into memory. A GLB cannot be longer (its length has 32 bits), and half of it would
/// already refuse scans that people have.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// Everything outside the file itself goes through this.
pub trait Source {
    /// The bytes behind an address as the file writes it (percent-encoded, relative).
    fn read(&self, uri: &str) -> Result<Vec<u8>, SourceError>;

    /// Takes note of an address that is not read: what is there belongs to the scene all the same.
    fn mention(&self, _uri: &str) {}
}

/// Why an address gave no bytes.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The address names a scheme, i.e. a network or a drive.
    #[error("'{0}' is not a relative path; nothing is fetched from a network or a drive")]
    NotRelative(String),
    /// The address leads out of the folder of the input.
    #[error("'{0}' leads outside the folder of the input")]
    Outside(String),
    /// The address is not text after decoding, or empty.
    #[error("'{0}' is not a path")]
    NotAPath(String),
    /// There is no such file.
    #[error("'{0}' does not exist")]
    Missing(String),
    /// The file is larger than can be read.
    #[error("'{0}' has more than {MAX_FILE_BYTES} bytes")]
    TooLarge(String),
    /// It exists and is not a readable plain file.
    #[error("'{uri}' cannot be read: {what}")]
    Unreadable {
        /// The address.
        uri: String,
        /// What the system says.
        what: String,
    },
}

impl SourceError {
    /// What the user can do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            SourceError::NotRelative(_) | SourceError::Outside(_) => {
                "put the file into the folder of the input and name it by its relative path"
            }
            SourceError::NotAPath(_) => "write a relative path",
            SourceError::Missing(_) => "put the file there or correct its name; upper and lower case differ",
            SourceError::TooLarge(_) => "split it",
            SourceError::Unreadable { .. } => "check its permissions",
        }
    }
}

/// A folder on disk; reads below it, nowhere else.
#[derive(Debug)]
pub struct Folder {
    root: PathBuf,
    files: Mutex<Vec<PathBuf>>,
}

impl Folder {
    /// The folder that holds `input`.
    pub fn of(input: &Path) -> std::io::Result<Folder> {
        let parent = input.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Ok(Folder { root: parent.canonicalize()?, files: Mutex::default() })
    }

    /// The files that were named, by their places.
    pub fn into_files(self) -> Vec<PathBuf> {
        self.files.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Source for Folder {
    fn read(&self, uri: &str) -> Result<Vec<u8>, SourceError> {
        let relative = relative_path(uri)?;
        let unreadable = |error: std::io::Error| match error.kind() {
            std::io::ErrorKind::NotFound => SourceError::Missing(uri.to_owned()),
            _ => SourceError::Unreadable { uri: uri.to_owned(), what: error.to_string() },
        };
        let path = self.root.join(relative).canonicalize().map_err(unreadable)?;
        if !path.starts_with(&self.root) {
            return Err(SourceError::Outside(uri.to_owned()));
        }
        self.files.lock().unwrap_or_else(PoisonError::into_inner).push(path.clone());
        read_plain_file(&path).map_err(|error| match error.kind() {
            std::io::ErrorKind::FileTooLarge => SourceError::TooLarge(uri.to_owned()),
            _ => unreadable(error),
        })
    }

    fn mention(&self, uri: &str) {
        if let Some(path) = relative_path(uri).ok().and_then(|relative| self.root.join(relative).canonicalize().ok()) {
            self.files.lock().unwrap_or_else(PoisonError::into_inner).push(path);
        }
    }
}

/// Files held in memory, by decoded relative path.
#[derive(Clone, Debug, Default)]
pub struct Memory(pub BTreeMap<String, Vec<u8>>);

impl Source for Memory {
    fn read(&self, uri: &str) -> Result<Vec<u8>, SourceError> {
        let path = relative_path(uri)?;
        let name = path.to_str().unwrap_or_default();
        self.0.get(name).cloned().ok_or_else(|| SourceError::Missing(uri.to_owned()))
    }
}

/// Reads a plain file of bounded size whole; pipes and devices are refused.
pub(crate) fn read_plain_file(path: &Path) -> std::io::Result<Vec<u8>> {
    // The kind is asked for before opening: opening a pipe without a writer would already wait for ever.
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(std::io::Error::other("not a plain file"));
    }
    read_bounded(std::fs::File::open(path)?)
}

/// Reads all there is, if it is of bounded size.
pub(crate) fn read_bounded(from: impl Read) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(std::io::ErrorKind::FileTooLarge.into());
    }
    Ok(bytes)
}

/// The relative path that an address means, with `.` and inner `..` resolved; never leads above its start.
pub(crate) fn relative_path(uri: &str) -> Result<PathBuf, SourceError> {
    let decoded = percent_decoded(uri).ok_or_else(|| SourceError::NotAPath(uri.to_owned()))?;
    if decoded.is_empty() || decoded.contains('\0') {
        return Err(SourceError::NotAPath(uri.to_owned()));
    }
    // A colon within the first part is a scheme ("http:") or a drive ("C:"); neither is relative.
    let first = decoded.split(['/', '\\']).next().unwrap_or_default();
    if first.contains(':') {
        return Err(SourceError::NotRelative(uri.to_owned()));
    }
    if decoded.starts_with(['/', '\\']) {
        return Err(SourceError::Outside(uri.to_owned()));
    }

    // Backslashes separate too: exporters on Windows write them, and there they would lead upwards.
    let mut parts: Vec<&str> = Vec::new();
    for part in decoded.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop().ok_or_else(|| SourceError::Outside(uri.to_owned()))?;
            }
            part => parts.push(part),
        }
    }
    if parts.is_empty() {
        return Err(SourceError::NotAPath(uri.to_owned()));
    }
    Ok(parts.iter().collect())
}

/// The text behind percent signs; a percent sign that starts no code stands for itself. `None` where it is not UTF-8.
pub(crate) fn percent_decoded(text: &str) -> Option<String> {
    String::from_utf8(percent_decoded_bytes(text)).ok()
}

/// As [`percent_decoded`], any bytes.
pub(crate) fn percent_decoded_bytes(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let digit = |at: usize| bytes.get(at).and_then(|&b| char::from(b).to_digit(16));
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        match (bytes[at], digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                out.push((16 * high + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                out.push(byte);
                at += 1;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_never_lead_out_of_the_folder() {
        for uri in [
            "../secret",
            "a/../../secret",
            "%2e%2e/secret",
            "%2E%2E%2Fsecret",
            "..\\secret",
            "a\\..\\..\\secret",
            "%2e%2e%5csecret",
            "/etc/passwd",
            "\\\\server\\share",
            "//server/share",
            "%2fetc/passwd",
        ] {
            assert!(matches!(relative_path(uri), Err(SourceError::Outside(_))), "{uri}");
        }
        for uri in ["http://example.invalid/x", "https:x", "file:///etc/passwd", "C:\\x", "c:x", "C%3A/x", "data:,x"] {
            assert!(matches!(relative_path(uri), Err(SourceError::NotRelative(_))), "{uri}");
        }
        for uri in ["", ".", "a/..", "a%00b", "%ff"] {
            assert!(matches!(relative_path(uri), Err(SourceError::NotAPath(_))), "{uri}");
        }
    }

    #[test]
    fn addresses_inside_the_folder_are_found() {
        for (uri, path) in [
            ("a.bin", "a.bin"),
            ("./b/c.png", "b/c.png"),
            ("b\\c.png", "b/c.png"),
            ("b/../a.bin", "a.bin"),
            ("cesium%20logo.png", "cesium logo.png"),
            ("100%.png", "100%.png"),
            ("t%C3%BCr.png", "tür.png"),
        ] {
            assert_eq!(relative_path(uri).unwrap(), Path::new(path), "{uri}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_and_pipes_are_not_followed() {
        let folder = std::env::temp_dir().join(format!("radiosity-io-source-{}", std::process::id()));
        let inside = folder.join("inside");
        std::fs::create_dir_all(&inside).unwrap();
        std::fs::write(folder.join("secret"), "s").unwrap();
        std::fs::write(inside.join("own"), "o").unwrap();
        let _ = std::os::unix::fs::symlink(folder.join("secret"), inside.join("out"));
        let _ = std::os::unix::fs::symlink(inside.join("own"), inside.join("in"));
        let source = Folder::of(&inside.join("scene.gltf")).unwrap();
        let answers = ["own", "in", "out", "none", "."].map(|uri| source.read(uri));
        let folder_itself = Folder::of(&inside).unwrap().read("inside");
        std::fs::remove_dir_all(&folder).unwrap();

        let [own, linked, out, none, dot] = answers;
        assert_eq!(own.unwrap(), b"o");
        assert_eq!(linked.unwrap(), b"o");
        assert!(matches!(out, Err(SourceError::Outside(_))), "{out:?}");
        assert!(matches!(none, Err(SourceError::Missing(_))), "{none:?}");
        assert!(matches!(dot, Err(SourceError::NotAPath(_))), "{dot:?}");
        assert!(matches!(folder_itself, Err(SourceError::Unreadable { .. })), "{folder_itself:?}");
    }
}
