//! Progress on a terminal or as JSON, with the time left; the time of each part of the work; Ctrl-C.

use crate::{Global, output};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use radiosity::Monitor;
use serde_json::json;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Events are printed at most this often.
const EVERY_MILLISECONDS: u64 = 200;

/// Where there is no terminal, a line tells of progress this often.
const LOG_EVERY_MILLISECONDS: u64 = 60_000;
const LOG_VERBOSELY_EVERY_MILLISECONDS: u64 = 10_000;

/// Times the time given beyond which that is told.
const OVERTIME: f64 = 1.1;

/// Seconds of a stage from which on the time that is left of it is told in a line.
const TELLING_SECONDS: f64 = 1.0;

/// Watches a run for the user.
pub struct Progress {
    bar: ProgressBar,
    json: bool,
    verbose: bool,
    quiet: bool,
    start: Instant,
    /// Seconds from the start after which the answer so far will do, by their bits; infinite without a limit.
    limit: AtomicU64,
    stage: Mutex<Stage>,
    last: AtomicU64,
    /// Milliseconds between lines where there is neither a bar nor events, and when the last one was.
    logs_every: Option<u64>,
    logged: AtomicU64,
}

/// What is being done, and the seconds that all parts of the work took so far. Every moment belongs to the part that
/// began last, so that the parts make up the whole.
struct Stage {
    name: String,
    since: Instant,
    /// The library's stages count to the part that the program has named.
    whole: bool,
    /// The round of refinement, from 1, and how many there are at most; while there is one.
    round: Option<[usize; 2]>,
    spent: Vec<(String, f64)>,
    part: usize,
    part_since: Instant,
}

impl Stage {
    fn close(&mut self) {
        // What comes before the first part counts to it.
        if let Some((_, seconds)) = self.spent.get_mut(self.part) {
            let now = Instant::now();
            *seconds += (now - self.part_since).as_secs_f64();
            self.part_since = now;
        }
    }

    fn open(&mut self, name: &str) {
        self.close();
        self.part = self.spent.iter().position(|(n, _)| n == name).unwrap_or_else(|| {
            self.spent.push((name.to_owned(), 0.0));
            self.spent.len() - 1
        });
    }
}

impl Progress {
    /// A bar on a terminal, events with `--json`, a line now and then otherwise.
    pub fn new(global: &Global) -> Progress {
        let speaks = !global.json && !global.quiet;
        let visible = speaks && std::io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr_with_hz(8) } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(1), target);
        let template = "{prefix:>14} [{bar:32}] {percent:>3} %  {elapsed} passed and {eta} left of this stage";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        let start = Instant::now();
        let spent = Vec::new();
        let stage =
            Stage { name: String::new(), since: start, whole: false, round: None, spent, part: 0, part_since: start };
        Progress {
            bar,
            json: global.json,
            verbose: global.verbose,
            quiet: global.quiet,
            start,
            limit: AtomicU64::new(f64::INFINITY.to_bits()),
            stage: Mutex::new(stage),
            last: AtomicU64::new(0),
            logs_every: match (speaks && !visible, global.verbose) {
                (false, _) => None,
                (true, false) => Some(LOG_EVERY_MILLISECONDS),
                (true, true) => Some(LOG_VERBOSELY_EVERY_MILLISECONDS),
            },
            logged: AtomicU64::new(0),
        }
    }

    /// Ctrl-C ends the program at once: files are put in place all together at the end, so there is nothing to save.
    pub fn listen_for_interrupts(&self) -> Result<(), ctrlc::Error> {
        let (bar, json) = (self.bar.clone(), self.json);
        ctrlc::set_handler(move || {
            bar.finish_and_clear();
            // Written in a thread of its own, since a full pipe that nobody reads must not keep the program alive.
            let told = std::thread::spawn(move || {
                if json {
                    let event = json!({ "event": "error", "exit_code": 130, "message": "interrupted" });
                    let _ = output::print(&event.to_string());
                }
                output::complain("interrupted");
            });
            let patience = Instant::now();
            while !told.is_finished() && patience.elapsed().as_millis() < 100 {
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            output::interrupt()
        })
    }

    /// Lets the answer do that there is after so many seconds since the start.
    pub fn limit(&self, seconds: Option<f64>) {
        self.limit.store(seconds.unwrap_or(f64::INFINITY).to_bits(), Ordering::Relaxed);
    }

    /// Whether that time is over.
    pub fn is_over(&self) -> bool {
        self.deadline().is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// What is said where the least that gives an answer took longer than the time that was given.
    pub fn overtime(&self) -> Option<String> {
        let (took, limit) = (self.seconds(), f64::from_bits(self.limit.load(Ordering::Relaxed)));
        (took > OVERTIME * limit).then(|| {
            format!(
                "note: it took {took:.1} s, more than the {limit} s given by --time, as the least that gives an answer takes long here, or the \
                 machine was busy"
            )
        })
    }

    /// Begins a part of the work; the library's own stages count to it.
    pub fn part(&self, name: &str) {
        let mut stage = self.lock();
        stage.open(name);
        (stage.whole, stage.round) = (true, None);
        drop(stage);
        self.show(name);
    }

    /// From now on the library's stages are parts of their own.
    pub fn parts(&self) {
        self.lock().whole = false;
    }

    /// Seconds by part, in the order of first use.
    pub fn spent(&self) -> Vec<(String, f64)> {
        let mut stage = self.lock();
        stage.close();
        stage.spent.clone()
    }

    /// Seconds since the program began.
    pub fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// A line for the user: on standard error, above the bar.
    pub fn say(&self, text: &str) {
        if self.json {
            self.tell(&json!({ "event": "note", "message": text, "seconds": self.seconds() }));
        } else if !self.quiet {
            self.bar.suspend(|| output::complain(text));
        }
    }

    /// A line for the user that events have in their own way.
    pub fn line(&self, text: &str) {
        if !self.json {
            self.say(text);
        }
    }

    /// An event, where events are asked for.
    pub fn event(&self, event: &serde_json::Value) {
        if self.json {
            self.tell(event);
        }
    }

    /// The stage, and the seconds that are left of it if the rest is like what is done.
    fn stage_left(&self, done: usize, total: usize) -> (String, f64) {
        let stage = self.lock();
        let passed = stage.since.elapsed().as_secs_f64();
        (stage.name.clone(), passed * (total - done.min(total)) as f64 / done.max(1) as f64)
    }

    /// A line of progress where it is time for one: in a log there is no bar.
    fn log(&self, now: u64, done: usize, total: usize) {
        let Some(every) = self.logs_every else { return };
        let logged = self.logged.load(Ordering::Relaxed);
        if now < logged + every
            || self.logged.compare_exchange(logged, now, Ordering::Relaxed, Ordering::Relaxed).is_err()
        {
            return;
        }
        self.say(&format!("{:.0} s: {}", self.seconds(), self.told(done, total)));
    }

    /// How far a stage has come.
    fn told(&self, done: usize, total: usize) -> String {
        let (name, left) = self.stage_left(done, total);
        let stage = self.lock();
        let (name, passed) = (in_round(&name, stage.round), stage.since.elapsed().as_secs_f64());
        match 100 * done.min(total) / total.max(1) {
            // Of the first moments nothing follows for the rest.
            percent if percent == 0 || passed < TELLING_SECONDS => format!("{name} has begun"),
            percent => format!("{name}, {percent} %, {left:.0} s left of this stage"),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Stage> {
        self.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn show(&self, name: &str) {
        let mut stage = self.lock();
        // Entered again, as for each portion of texels, a stage is no news.
        let is_new = stage.name != name;
        (stage.name, stage.since) = (name.to_owned(), Instant::now());
        let round = stage.round;
        drop(stage);
        self.bar.reset();
        self.bar.set_prefix(in_round(name, round));
        self.last.store(0, Ordering::Relaxed);
        if self.json && is_new {
            self.tell(&json!({
                "event": "stage", "stage": name, "round": round.map(|r| r[0]), "most_rounds": round.map(|r| r[1]),
                "seconds": self.seconds(),
            }));
        }
    }

    fn tell(&self, event: &serde_json::Value) {
        if self.quiet {
            return;
        }
        // A listener that has gone does not stop the work: its files are still wanted.
        let _ = output::print(&event.to_string());
    }
}

/// The name of a stage with the round that it is in.
fn in_round(name: &str, round: Option<[usize; 2]>) -> String {
    match round {
        Some([round, most]) => format!("round {round} of {most} at most: {name}"),
        None => name.to_owned(),
    }
}

impl Monitor for Progress {
    fn stage(&self, name: &str) {
        let mut stage = self.lock();
        if !stage.whole {
            stage.open(name);
        }
        drop(stage);
        self.show(name);
    }

    fn round(&self, round: usize, most: usize) {
        let mut stage = self.lock();
        stage.round = Some([round, most]);
        // In a new round the same stage is news.
        stage.name.clear();
    }

    fn step(&self, done: usize, total: usize) -> bool {
        let now = self.start.elapsed().as_millis() as u64;
        let last = self.last.load(Ordering::Relaxed);
        let due = now >= last + EVERY_MILLISECONDS;
        if due && self.last.compare_exchange(last, now, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
            self.bar.set_length(total as u64);
            self.bar.set_position(done as u64);
            if self.json {
                let (name, left) = self.stage_left(done, total);
                self.tell(&json!({
                    "event": "progress", "stage": name, "done": done, "total": total,
                    "seconds": self.seconds(), "seconds_left_in_stage": left,
                }));
            }
            self.log(now, done, total);
        }
        true
    }

    fn deadline(&self) -> Option<Instant> {
        let seconds = f64::from_bits(self.limit.load(Ordering::Relaxed));
        seconds.is_finite().then(|| self.start + Duration::from_secs_f64(seconds))
    }

    fn warn(&self, text: &str) {
        self.say(&format!("note: {text}"));
    }

    fn note(&self, text: &str) {
        if self.verbose || self.json {
            self.say(text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As a log has it, where a bar would be.
    #[test]
    fn lines_tell_how_far_a_stage_has_come() {
        let progress = Progress::new(&Global { threads: None, json: false, quiet: true, verbose: false });
        progress.part("picture");
        assert_eq!(progress.told(0, 0), "picture has begun");
        progress.parts();
        progress.round(2, 6);
        progress.stage("rays");
        assert_eq!(progress.told(1, 1000), "round 2 of 6 at most: rays has begun");
        assert_eq!(progress.told(500, 1000), "round 2 of 6 at most: rays has begun");
        progress.lock().since -= Duration::from_secs(2);
        let told = progress.told(500, 1000);
        assert!(told == "round 2 of 6 at most: rays, 50 %, 2 s left of this stage", "{told}");
    }

    #[test]
    fn parts_make_up_the_whole() {
        let progress = Progress::new(&Global { threads: None, json: false, quiet: true, verbose: false });
        progress.part("reading");
        progress.stage("hidden");
        progress.parts();
        progress.stage("rays");
        std::thread::sleep(std::time::Duration::from_millis(5));
        progress.part("picture");
        progress.parts();
        progress.stage("rays");
        let before = progress.seconds();
        let spent = progress.spent();
        let names: Vec<&str> = spent.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["reading", "rays", "picture"]);
        let sum: f64 = spent.iter().map(|(_, seconds)| seconds).sum();
        assert!(spent[1].1 >= 0.005 && sum <= progress.seconds() && sum >= before - 1e-9, "{spent:?} {before}");
    }
}
