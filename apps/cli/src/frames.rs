//! Pictures on the way (`--frames`): one for each whole solution that there is, written at once.
//!
//! Each file is put in place by a rename, so that whoever looks never sees a half of one. What cannot be written ends the
//! run only after its solve, where it is told.

use crate::input::PictureArguments;
use crate::output::write_now;
use crate::progress::Progress;
use crate::{Failure, views};
use radiosity::{Camera, Glimpse, Monitor, Picture, Solution, SolveOptions, Tracer};
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// By how much smaller than the picture they are: at half, the camera's rays alone take most of a second on two processors.
const SMALLER: u32 = 4;

/// How a frame's file is called.
fn name(number: usize) -> String {
    format!("frame-{number:03}.png")
}

/// Makes a folder for frames, or takes an empty one: those of two runs in one folder would be taken for one.
pub fn prepare(folder: &Path) -> Result<(), Failure> {
    let refuse = |what: String| Failure::input(format!("--frames {}: {what}", folder.display()));
    if !folder.exists() {
        return fs::create_dir(folder).map_err(|error| refuse(format!("cannot be made: {error}")));
    }
    if !folder.is_dir() {
        return Err(refuse("is no folder".to_owned()));
    }
    let mut entries = fs::read_dir(folder).map_err(|error| refuse(error.to_string()))?;
    let is_frame = |name: &str| name.starts_with("frame-") && name.ends_with(".png");
    match entries.any(|entry| entry.is_ok_and(|entry| is_frame(&entry.file_name().to_string_lossy()))) {
        true => Err(refuse("has frames of another run; name a new folder".to_owned())),
        false => Ok(()),
    }
}

/// Watches a run for the user, and shows it.
pub struct Frames<'a> {
    progress: &'a Progress,
    folder: PathBuf,
    glimpse: Glimpse,
    exposure: Option<f64>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    count: usize,
    first: Option<f64>,
    failure: Option<Failure>,
}

impl<'a> Frames<'a> {
    /// Through a camera, of a quarter of the width and height of the picture.
    fn new(
        (folder, asked): (&Path, &PictureArguments),
        (tracer, camera): (&Tracer, &Camera),
        progress: &'a Progress,
    ) -> Frames<'a> {
        let (width, height) = views::picture_size(camera, asked.size);
        let glimpse = Glimpse::new(tracer, camera, width.div_ceil(SMALLER), height.div_ceil(SMALLER));
        Frames {
            progress,
            folder: folder.to_owned(),
            glimpse,
            exposure: asked.exposure,
            state: Mutex::new(State::default()),
        }
    }

    /// Those that are asked for, with the coarse ones written; none where none are.
    pub fn begin(
        asked: &PictureArguments,
        (tracer, camera): (&Tracer, Option<&Camera>),
        options: &SolveOptions,
        progress: &'a Progress,
    ) -> Result<Option<Frames<'a>>, Failure> {
        let (Some(folder), Some(camera)) = (&asked.frames, camera) else { return Ok(None) };
        progress.part("first pictures");
        let frames = Frames::new((folder, asked), (tracer, camera), progress);
        let picture = frames.glimpse.first(tracer, options, progress)?;
        frames.put(&mut frames.lock(), &picture, None);
        radiosity::preview(tracer, options, &frames)?;
        progress.parts();
        Ok(Some(frames))
    }

    /// What has been written, or why not.
    pub fn end(self) -> Result<(), Failure> {
        let state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        state.failure.map_or(Ok(()), Err)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self, picture: &Picture, number: usize) -> Result<PathBuf, Failure> {
        let png = views::png(picture, self.exposure.unwrap_or_else(|| picture.exposure()))?;
        let path = self.folder.join(name(number));
        write_now(&path, &png)?;
        Ok(path)
    }

    /// Writes a picture, of a solution or the first, and tells of it.
    fn put(&self, state: &mut State, picture: &Picture, of: Option<&Solution>) {
        match self.write(picture, state.count) {
            Ok(path) => {
                let seconds = self.progress.seconds();
                let (rays, elements) = (of.map_or(0, Solution::rays), of.map(|solution| solution.elements.len()));
                self.progress.event(&json!({
                    "event": "frame", "output": path, "rays": rays, "elements": elements, "seconds": seconds,
                }));
                if state.first.is_none() {
                    self.progress.line(&format!("first picture after {seconds:.2} s: {}", path.display()));
                }
                state.first.get_or_insert(seconds);
                state.count += 1;
            }
            Err(failure) => state.failure = Some(failure),
        }
    }
}

impl Monitor for Frames<'_> {
    fn round(&self, round: usize, most: usize) {
        self.progress.round(round, most);
    }

    fn stage(&self, name: &str) {
        self.progress.stage(name);
    }

    fn step(&self, done: usize, total: usize) -> bool {
        self.progress.step(done, total)
    }

    fn note(&self, text: &str) {
        self.progress.note(text);
    }

    fn warn(&self, text: &str) {
        self.progress.warn(text);
    }

    fn deadline(&self) -> Option<Instant> {
        self.progress.deadline()
    }

    fn solved(&self, solution: &Solution) {
        let mut state = self.lock();
        // The answer begins anew without rays: its first picture is older than those that are there. Of the coarse solutions'
        // only that of all elements is better than the picture before.
        if state.failure.is_some() || (state.count > 1 && solution.rays() == 0) {
            return;
        }
        self.put(&mut state, &self.glimpse.picture(solution), Some(solution));
    }
}
