//! What goes out: lines on standard output, and files that appear all together or not at all.
//!
//! Files are *promised* before the work, which finds out early what could not be written after hours; *staged* under
//! a temporary name as soon as their bytes are there; and *committed*, that is renamed, when nothing can fail any
//! more. A run that fails or is interrupted leaves no file and changes none that was there.

use crate::Failure;
use radiosity::io::Staged;
use std::fs::{File, canonicalize, remove_file};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Exit code of an interrupted run: 128 and the number of SIGINT, as shells have it.
const INTERRUPTED: i32 = 130;

/// Temporary files of this process, for whoever ends it.
static TEMPORARY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn temporary() -> MutexGuard<'static, Vec<PathBuf>> {
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the program at once and leaves no file of it behind.
pub fn interrupt() -> ! {
    // Held to the end: no file is begun or committed from now on.
    let temporary = temporary();
    for path in temporary.iter() {
        // There is nobody left to tell.
        let _ = remove_file(path);
    }
    std::process::exit(INTERRUPTED)
}

/// A line on standard output.
pub fn print(line: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).map_err(|e| Failure::work(format!("standard output: {e}")))
}

/// A line on standard error.
pub fn complain(line: &str) {
    // Where not even this can be written, there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Why a file is not to be written.
const READ: &str = "is read by this run, or belongs to the scene, and would be replaced; choose another name";

/// The files of one run.
pub struct Outputs {
    inputs: Vec<PathBuf>,
    promised: Vec<PathBuf>,
    staged: Vec<Staged>,
}

impl Outputs {
    /// None yet; `inputs` are files that no output may replace.
    pub fn new(inputs: &[&Path]) -> Outputs {
        let inputs = inputs.iter().filter_map(|path| canonicalize(path).ok()).collect();
        Outputs { inputs, promised: Vec::new(), staged: Vec::new() }
    }

    /// Refuses, before hours of work, what could not be written after it.
    pub fn promise(&mut self, path: &Path, extensions: &[&str]) -> Result<(), Failure> {
        let refuse = |what: String| Err(Failure::input(format!("{}: {what}", path.display())));
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        if !extensions.contains(&extension.as_str()) {
            let wanted = extensions.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or ");
            return refuse(format!("the name must end in {wanted}"));
        }
        if path.is_dir() {
            return refuse("is a folder".to_owned());
        }
        let folder = folder(path);
        // A file has one place by whatever name, also by that of a link to it.
        let place = match canonicalize(folder) {
            Ok(folder) if folder.is_dir() => {
                canonicalize(path).unwrap_or_else(|_| folder.join(path.file_name().unwrap_or_default()))
            }
            Ok(_) => return refuse(format!("{} is no folder", folder.display())),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return refuse(format!("there is no folder {}; make it first", folder.display()));
            }
            Err(error) => return refuse(error.to_string()),
        };
        if self.inputs.contains(&place) {
            return refuse(READ.to_owned());
        }
        if self.promised.contains(&place) {
            return refuse("two outputs have this name".to_owned());
        }
        // Permissions, a full disk, a read-only one: trying is the only way to know.
        let probe = begin(path);
        let tried = File::create(probe.beside());
        end(probe);
        if let Err(error) = tried {
            return refuse(format!("cannot be written: {error}"));
        }
        self.promised.push(place);
        Ok(())
    }

    /// Refuses what would replace one of these files, which belong to the scene.
    pub fn spare(&mut self, files: &[PathBuf]) -> Result<(), Failure> {
        match self.promised.iter().find(|place| files.contains(place)) {
            Some(place) => Err(Failure::input(format!("{}: {READ}", place.display()))),
            None => {
                self.inputs.extend_from_slice(files);
                Ok(())
            }
        }
    }

    /// Writes bytes beside their place.
    pub fn stage(&mut self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        self.stage_with(path, |out| out.write_all(bytes))
    }

    /// As [`Outputs::stage`], piece by piece, for what would fill the memory.
    pub fn stage_with(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
    ) -> Result<(), Failure> {
        let staged = begin(path);
        let written = staged.write_with(write);
        self.staged.push(staged);
        written.map_err(|error| unwritten(path, &error))
    }

    /// Puts all staged files in place.
    pub fn commit(mut self) -> Result<(), Failure> {
        // An interrupt waits until all are there.
        let mut temporary = temporary();
        if let Some(staged) = self.staged.iter().find(|staged| staged.target().is_dir()) {
            return Err(Failure::work(format!("{}: has become a folder", staged.target().display())));
        }
        for staged in self.staged.drain(..) {
            let (beside, target) = (staged.beside().to_owned(), staged.target().to_owned());
            staged.place().map_err(|error| unwritten(&target, &error))?;
            temporary.retain(|t| *t != beside);
        }
        Ok(())
    }
}

impl Drop for Outputs {
    fn drop(&mut self) {
        self.staged.drain(..).for_each(end);
    }
}

/// Writes a file at once, in place of what may be there: whole, or not at all.
pub fn write_now(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let staged = begin(path);
    let beside = staged.beside().to_owned();
    let written = staged.write(bytes).and_then(|()| staged.place());
    temporary().retain(|t| *t != beside);
    written.map_err(|error| unwritten(path, &error))
}

fn unwritten(path: &Path, error: &std::io::Error) -> Failure {
    Failure::work(format!("{}: cannot be written: {error}", path.display()))
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file for `path`, whose temporary name is known to [`interrupt`] before it exists.
fn begin(path: &Path) -> Staged {
    let staged = Staged::new(path);
    temporary().push(staged.beside().to_owned());
    staged
}

fn end(staged: Staged) {
    let beside = staged.beside().to_owned();
    drop(staged);
    temporary().retain(|t| *t != beside);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{create_dir, read_dir, read_to_string, write};

    /// A fresh folder; the name keeps tests and processes apart.
    fn room(name: &str) -> PathBuf {
        let room = std::env::temp_dir().join(format!("radiosity-output-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&room);
        create_dir(&room).unwrap();
        room
    }

    fn names(room: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            read_dir(room).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn files_appear_together_at_the_end() {
        let room = room("together");
        let (a, b) = (room.join("a.csv"), room.join("b.csv"));
        write(&a, "old").unwrap();
        let mut outputs = Outputs::new(&[]);
        outputs.promise(&a, &["csv"]).unwrap();
        outputs.promise(&b, &["csv"]).unwrap();
        assert_eq!(names(&room), ["a.csv"], "a promise leaves nothing");
        outputs.stage(&a, b"new").unwrap();
        outputs.stage(&b, b"also").unwrap();
        assert_eq!((read_to_string(&a).unwrap().as_str(), b.exists()), ("old", false));
        outputs.commit().unwrap();
        assert_eq!((read_to_string(&a).unwrap(), read_to_string(&b).unwrap()), ("new".to_owned(), "also".to_owned()));
        assert_eq!(names(&room), ["a.csv", "b.csv"]);
        std::fs::remove_dir_all(room).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn one_file_by_two_names_is_promised_once() {
        let room = room("names");
        let at = |name: &str| room.join(name);
        create_dir(at("folder")).unwrap();
        std::os::unix::fs::symlink("folder", at("link")).unwrap();
        std::os::unix::fs::symlink("a.csv", at("b.csv")).unwrap();
        write(at("a.csv"), "").unwrap();
        let mut outputs = Outputs::new(&[]);
        for (name, is_new) in [
            ("a.csv", true),
            ("./a.csv", false),
            ("folder/../a.csv", false),
            ("b.csv", false),
            ("folder/a.csv", true),
            ("link/a.csv", false),
        ] {
            assert_eq!(outputs.promise(&at(name), &["csv"]).is_ok(), is_new, "{name}");
        }
        std::fs::remove_dir_all(room).unwrap();
    }

    #[test]
    fn what_is_not_committed_never_was() {
        let room = room("never");
        let (a, b) = (room.join("a.csv"), room.join("b.csv"));
        write(&a, "old").unwrap();
        let mut outputs = Outputs::new(&[]);
        outputs.stage(&a, b"new").unwrap();
        outputs.stage(&b, b"also").unwrap();
        create_dir(&b).unwrap();
        assert_eq!(outputs.commit().unwrap_err().code, 1);
        assert_eq!(
            (names(&room), read_to_string(&a).unwrap().as_str()),
            (["a.csv", "b.csv"].map(str::to_owned).into(), "old")
        );
        let mut outputs = Outputs::new(&[]);
        outputs.stage(&a, b"newer").unwrap();
        drop(outputs);
        assert_eq!((names(&room).len(), read_to_string(&a).unwrap().as_str()), (2, "old"));
        std::fs::remove_dir_all(room).unwrap();
    }
}
