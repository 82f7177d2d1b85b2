//! A file that is written beside its place and moved there when it is whole, so that a failure or an interrupt leaves no
//! half a file and changes none that was there.

use std::fs::{File, remove_file, rename};
use std::io::{BufWriter, IntoInnerError, Result, Write};
use std::path::{Path, PathBuf};

/// A file on its way. Dropped before [`Staged::place`], it leaves nothing behind.
#[derive(Debug)]
pub struct Staged {
    beside: PathBuf,
    target: PathBuf,
}

impl Staged {
    /// A file for `target`; nothing is written yet. The name beside it is hidden and this process's own.
    pub fn new(target: &Path) -> Staged {
        let mut name = std::ffi::OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        name.push(format!(".{}.tmp", std::process::id()));
        Staged { beside: target.with_file_name(name), target: target.to_owned() }
    }

    /// Where it is until it is placed.
    pub fn beside(&self) -> &Path {
        &self.beside
    }

    /// Where it will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Writes it beside its place, down to the disk.
    pub fn write(&self, bytes: &[u8]) -> Result<()> {
        self.write_with(|out| out.write_all(bytes))
    }

    /// As [`Staged::write`], piece by piece, for what would fill the memory.
    pub fn write_with(&self, write: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
        let mut out = BufWriter::new(File::create(&self.beside)?);
        write(&mut out)?;
        out.into_inner().map_err(IntoInnerError::into_error)?.sync_all()
    }

    /// Moves it to its place.
    pub fn place(self) -> Result<()> {
        rename(&self.beside, &self.target)
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // It may never have come to be, or be in its place.
        let _ = remove_file(&self.beside);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_whole_in_its_place_or_not_there() {
        let folder = std::env::temp_dir().join(format!("radiosity-staged-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let target = folder.join("a");
        let names = || std::fs::read_dir(&folder).unwrap().count();

        let staged = Staged::new(&target);
        staged.write(b"some").unwrap();
        assert!(!target.exists() && names() == 1);
        drop(staged);
        assert_eq!(names(), 0);

        let staged = Staged::new(&target);
        staged.write(b"all").unwrap();
        staged.place().unwrap();
        assert_eq!((std::fs::read(&target).unwrap().as_slice(), names()), (&b"all"[..], 1));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
