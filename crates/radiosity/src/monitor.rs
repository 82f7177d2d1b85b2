//! Watching a run from outside: which stage it is in, how far it has come, whether it should go on.

use crate::Solution;
use radiosity_transport::Progress;
use serde::Serialize;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Sees the stages of a run; may stop it.
pub trait Monitor: Sync {
    /// A round of refinement begins, from 1 on; there are `most` of them if the error asked is not reached before.
    fn round(&self, _round: usize, _most: usize) {}
    /// A stage begins.
    fn stage(&self, _name: &str) {}
    /// `done` of `total` units of the current stage are finished; answers whether to go on.
    fn step(&self, _done: usize, _total: usize) -> bool {
        true
    }
    /// Something worth saying between stages.
    fn note(&self, _text: &str) {}
    /// Something that whoever waits should know.
    fn warn(&self, _text: &str) {}
    /// A whole solution is there: the first before any row is traced, then after each solve.
    fn solved(&self, _solution: &Solution) {}
    /// When the answer so far will do; none for never. What is asked for then ends with what it has by that time: a whole
    /// answer, with its error. Refinement leaves time for what is made of the solution ([`crate::BakeOptions::after`]), which has as many
    /// rays as there is time for. It ends later where the least takes longer: an audit, a pass of few rays over what is seen or written
    /// and, where there are no more than a hundred thousand elements, the first few rays of each. Of more elements those
    /// that were not reached have the mean of the others' direct light, and without rays all have the ambient term
    /// ([`Solution::begin`]). How far it comes depends on the machine, and so do its bytes; all else does not.
    fn deadline(&self) -> Option<Instant> {
        None
    }
}

impl Monitor for () {}

/// Hands a monitor to the transport.
pub(crate) struct Watch<'a>(pub &'a dyn Monitor);

impl Progress for Watch<'_> {
    fn step(&self, done: usize, total: usize) -> bool {
        self.0.step(done, total)
    }
}

/// Whether the answer so far has to do.
pub(crate) fn is_over(monitor: &dyn Monitor) -> bool {
    monitor.deadline().is_some_and(|deadline| Instant::now() >= deadline)
}

/// Whether there is time for what takes some seconds.
pub(crate) fn has_time(monitor: &dyn Monitor, seconds: f64) -> bool {
    monitor.deadline().is_none_or(|deadline| deadline.saturating_duration_since(Instant::now()).as_secs_f64() > seconds)
}

/// Hands a monitor to what may be left undone when its time is over.
pub(crate) struct Hurry<'a>(pub &'a dyn Monitor);

impl Progress for Hurry<'_> {
    fn step(&self, done: usize, total: usize) -> bool {
        self.0.step(done, total) && !is_over(self.0)
    }
}

/// Hands a monitor to what is brought to its end where that is soon, and may else be left undone when its time is over.
pub(crate) struct Begin<'a> {
    pub monitor: &'a dyn Monitor,
    pub is_soon: bool,
}

impl Progress for Begin<'_> {
    fn step(&self, done: usize, total: usize) -> bool {
        self.monitor.step(done, total) && (self.is_soon || !is_over(self.monitor))
    }
}

/// A monitor with a time limit.
///
/// ```
/// use radiosity::{BakeOptions, Mesh, SolveOptions, Timed, Tracer, bake, cornell_box};
/// use std::time::Duration;
///
/// let scene = cornell_box();
/// let mesh = Mesh::new(&scene);
/// let tracer = Tracer::new(&scene, &mesh);
/// let solve = SolveOptions { element_size: Some(0.1), ..SolveOptions::default() };
/// let options = BakeOptions { error: 1e-4, solve, ..BakeOptions::default() };
/// let baked = bake(&tracer, &options, &Timed::new(&(), Duration::ZERO)).unwrap();
/// assert!(baked.out_of_time && !baked.achieved && baked.audit.error < 1.0);
/// ```
pub struct Timed<'a> {
    monitor: &'a dyn Monitor,
    end: Mutex<Option<Instant>>,
}

impl<'a> Timed<'a> {
    /// So long from now on.
    pub fn new(monitor: &'a dyn Monitor, limit: std::time::Duration) -> Timed<'a> {
        Timed { monitor, end: Mutex::new(Some(Instant::now() + limit)) }
    }

    /// As long as the monitor allows, until another end is set.
    pub(crate) fn unlimited(monitor: &'a dyn Monitor) -> Timed<'a> {
        Timed { monitor, end: Mutex::new(None) }
    }

    /// Sets when time ends, no later than the monitor allows.
    pub(crate) fn set_end(&self, end: Instant) {
        *self.end.lock().unwrap_or_else(PoisonError::into_inner) = Some(end);
    }
}

impl Monitor for Timed<'_> {
    fn round(&self, round: usize, most: usize) {
        self.monitor.round(round, most);
    }

    fn stage(&self, name: &str) {
        self.monitor.stage(name);
    }

    fn step(&self, done: usize, total: usize) -> bool {
        self.monitor.step(done, total)
    }

    fn note(&self, text: &str) {
        self.monitor.note(text);
    }

    fn warn(&self, text: &str) {
        self.monitor.warn(text);
    }

    fn solved(&self, solution: &Solution) {
        self.monitor.solved(solution);
    }

    fn deadline(&self) -> Option<Instant> {
        let end = *self.end.lock().unwrap_or_else(PoisonError::into_inner);
        self.monitor.deadline().into_iter().chain(end).min()
    }
}

/// Wall-clock seconds by stage, in the order of first use.
#[derive(Debug, Default, Serialize)]
pub struct Stages {
    seconds: Mutex<Vec<(String, f64)>>,
}

impl Clone for Stages {
    fn clone(&self) -> Self {
        Stages { seconds: Mutex::new(self.all()) }
    }
}

impl Stages {
    /// Runs a stage and adds its time.
    pub fn time<T>(&self, monitor: &dyn Monitor, name: &str, work: impl FnOnce() -> T) -> T {
        monitor.stage(name);
        let start = Instant::now();
        let result = work();
        self.add(name, start.elapsed().as_secs_f64());
        result
    }

    /// Adds seconds to a stage.
    pub fn add(&self, name: &str, seconds: f64) {
        let mut all = self.seconds.lock().unwrap_or_else(|e| e.into_inner());
        match all.iter_mut().find(|(n, _)| n == name) {
            Some((_, s)) => *s += seconds,
            None => all.push((name.to_owned(), seconds)),
        }
    }

    /// The seconds of a stage.
    pub(crate) fn of(&self, name: &str) -> f64 {
        self.all().into_iter().find(|(n, _)| n == name).map_or(0.0, |(_, seconds)| seconds)
    }

    /// All stages with their seconds.
    pub fn all(&self) -> Vec<(String, f64)> {
        self.seconds.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }

    /// Adds the stages of another run.
    pub fn absorb(&self, other: &Stages) {
        for (name, seconds) in other.all() {
            self.add(&name, seconds);
        }
    }
}
