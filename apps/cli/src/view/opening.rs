//! How the browser is told the address: by a file that only this user can read and that leads there. On its command line,
//! which every user of the machine can see, the token would be one no more.

use std::fs::{File, OpenOptions};
use std::io::{Error, Write};
use std::path::{Path, PathBuf};

/// A file that leads to an address, until it is dropped.
pub struct Opening {
    path: PathBuf,
}

impl Opening {
    /// For an address, in the user's own folder for such things, or in that of temporary files.
    pub fn new(url: &str) -> std::io::Result<Opening> {
        let own = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|folder| folder.is_dir());
        Opening::within(&own.unwrap_or_else(std::env::temp_dir), url)
    }

    fn within(folder: &Path, url: &str) -> std::io::Result<Opening> {
        let mut bytes = [0; 8];
        getrandom::fill(&mut bytes).map_err(|error| Error::other(error.to_string()))?;
        let name: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let path = folder.join(format!("radiosity-view-{name}.html"));
        // A file that is there already, or a link, is somebody else's.
        let mut file = create(&path)?;
        let opening = Opening { path };
        // The address is made of digits, letters, dots, colons, brackets and slashes: nothing that HTML reads otherwise.
        writeln!(
            file,
            "<!doctype html><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\">\
             <meta http-equiv=\"refresh\" content=\"0; url={url}\"><title>radiosity</title><a href=\"{url}\">radiosity</a>"
        )?;
        Ok(opening)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Opening {
    fn drop(&mut self) {
        // One that is gone already is none.
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(unix)]
fn create(path: &Path) -> std::io::Result<File> {
    use std::os::unix::fs::OpenOptionsExt;
    OpenOptions::new().write(true).create_new(true).mode(0o600).open(path)
}

#[cfg(not(unix))]
fn create(path: &Path) -> std::io::Result<File> {
    OpenOptions::new().write(true).create_new(true).open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_for_its_owner_and_goes() {
        let url = "http://127.0.0.1:8000/0123/";
        let opening = Opening::within(&std::env::temp_dir(), url).unwrap();
        let path = opening.path().to_owned();
        assert!(!path.to_string_lossy().contains("0123/"));
        assert!(std::fs::read_to_string(&path).unwrap().contains(&format!("content=\"0; url={url}\"")));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        drop(opening);
        assert!(!path.exists());
    }
}
