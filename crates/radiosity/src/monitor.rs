//! Watching a run from outside: which stage it is in, how far it has come, whether it should go on.

use radiosity_transport::Progress;
use serde::Serialize;
use std::sync::Mutex;
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
}

impl Monitor for () {}

/// Hands a monitor to the transport.
pub(crate) struct Watch<'a>(pub &'a dyn Monitor);

impl Progress for Watch<'_> {
    fn step(&self, done: usize, total: usize) -> bool {
        self.0.step(done, total)
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
