//! Progress on a terminal or as JSON, with the time left; Ctrl-C.

use crate::Global;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use radiosity::Monitor;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// Events are printed at most this often.
const EVERY_MILLISECONDS: u64 = 200;

/// Watches a run for the user.
pub struct Progress {
    bar: ProgressBar,
    json: bool,
    verbose: bool,
    quiet: bool,
    stopped: Arc<AtomicBool>,
    start: Instant,
    stage: Mutex<(String, Instant)>,
    last: AtomicU64,
}

impl Progress {
    /// A bar on a terminal, events with `--json`, nothing otherwise.
    pub fn new(global: &Global) -> Progress {
        let visible = !global.json && !global.quiet && std::io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr_with_hz(8) } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(1), target);
        let template = "{prefix:>14} [{bar:32}] {percent:>3} %  {elapsed} passed, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        Progress {
            bar,
            json: global.json,
            verbose: global.verbose,
            quiet: global.quiet,
            stopped: Arc::new(AtomicBool::new(false)),
            start: Instant::now(),
            stage: Mutex::new((String::new(), Instant::now())),
            last: AtomicU64::new(0),
        }
    }

    /// The first Ctrl-C ends the run cleanly, the second at once.
    pub fn listen_for_interrupts(&self) -> Result<(), ctrlc::Error> {
        let stopped = self.stopped.clone();
        ctrlc::set_handler(move || {
            if stopped.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
        })
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
            println!("{}", serde_json::json!({ "event": "note", "message": text, "seconds": self.seconds() }));
        } else if !self.quiet {
            self.bar.suspend(|| eprintln!("{text}"));
        }
    }
}

impl Monitor for Progress {
    fn stage(&self, name: &str) {
        *self.stage.lock().unwrap_or_else(|e| e.into_inner()) = (name.to_owned(), Instant::now());
        self.bar.reset();
        self.bar.set_prefix(name.to_owned());
        self.last.store(0, Ordering::Relaxed);
        if self.json {
            println!("{}", serde_json::json!({ "event": "stage", "stage": name, "seconds": self.seconds() }));
        }
    }

    fn step(&self, done: usize, total: usize) -> bool {
        let now = self.start.elapsed().as_millis() as u64;
        let last = self.last.load(Ordering::Relaxed);
        let due = now >= last + EVERY_MILLISECONDS;
        if due && self.last.compare_exchange(last, now, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
            self.bar.set_length(total as u64);
            self.bar.set_position(done as u64);
            if self.json {
                let (stage, since) = self.stage.lock().unwrap_or_else(|e| e.into_inner()).clone();
                let left = since.elapsed().as_secs_f64() * (total - done.min(total)) as f64 / done.max(1) as f64;
                let event = serde_json::json!({
                    "event": "progress", "stage": stage, "done": done, "total": total,
                    "seconds": self.seconds(), "seconds_left_in_stage": left,
                });
                println!("{event}");
            }
        }
        !self.stopped.load(Ordering::SeqCst)
    }

    fn note(&self, text: &str) {
        if self.verbose || self.json {
            self.say(text);
        }
    }
}
