//! Time: how long a contender may take, how long it would take, and how much of the processors it took.

use crate::Monitor;
use radiosity_transport::Progress;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

/// Seconds that the first rows are given before they are asked how long all will take.
const PROBE: f64 = 0.15;

/// Lets a computation go on while it seems to end within its time, and keeps the estimate.
pub(super) struct Allowance<'a> {
    monitor: &'a dyn Monitor,
    begun: Instant,
    seconds: f64,
    estimate: AtomicU64,
    is_over: AtomicBool,
}

impl<'a> Allowance<'a> {
    /// From now on.
    pub fn new(monitor: &'a dyn Monitor, seconds: f64) -> Allowance<'a> {
        let (estimate, is_over) = (AtomicU64::new(0), AtomicBool::new(false));
        Allowance { monitor, begun: Instant::now(), seconds, estimate, is_over }
    }

    /// Seconds that the whole would have taken, if it was stopped for taking too long.
    pub fn exceeded(&self) -> Option<f64> {
        let estimate = f64::from_bits(self.estimate.load(Ordering::Relaxed));
        self.is_over.load(Ordering::Relaxed).then_some(estimate)
    }
}

impl Progress for Allowance<'_> {
    fn step(&self, done: usize, total: usize) -> bool {
        let passed = self.begun.elapsed().as_secs_f64();
        let whole = passed * total.max(1) as f64 / done.max(1) as f64;
        if passed > PROBE && whole > self.seconds {
            // The first to say so has seen the most rows by its time; later ones differ little.
            if !self.is_over.swap(true, Ordering::Relaxed) {
                self.estimate.store(whole.to_bits(), Ordering::Relaxed);
            }
            return false;
        }
        self.monitor.step(done, total)
    }
}

/// Seconds of all processors that this process has taken so far, where the system tells.
pub(super) fn processor_seconds() -> Option<f64> {
    /// Clock ticks of Linux' process statistics in a second, on all machines that we know of.
    const TICKS: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the name in parentheses, which may hold anything: user and system time are fields 14 and 15.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / TICKS)
}
