//! Edits of a furnished room, timed: to the first complete picture after each, and to the end.
//!
//! `cargo run --release -p radiosity --example live -- [ELEMENTS] [RAYS] [LAMPS] [BOOKS]`

#![allow(clippy::print_stdout)]

#[path = "../tests/common/room.rs"]
mod room;

use radiosity::session::{Edit, EditError, LightId, ObjectId, Session, SessionOptions};
use room::{Furnishing, room};
use std::time::{Duration, Instant};

/// Steps of a viewer: a third of a frame.
const BUDGET: Duration = Duration::from_millis(5);

/// How often each edit is measured.
const TIMES: usize = 8;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<usize> = std::env::args().skip(1).filter_map(|x| x.parse().ok()).collect();
    let argument = |k: usize, default: usize| arguments.get(k).copied().unwrap_or(default);
    let scene = room(&Furnishing { tables: 6, lamps: argument(2, 4), books: argument(3, 400) });
    println!("{} triangles, {} objects", scene.triangles.len(), scene.objects.len());
    let chair = scene.objects.iter().position(|object| object.name == "chair 1.2").ok_or("no chair")?;
    let lamp_object = scene.objects.iter().position(|object| object.name == "lamp 0").ok_or("no lamp")?;
    let options =
        SessionOptions { elements: argument(0, 60_000), rays: argument(1, 256) as u32, ..SessionOptions::default() };

    println!("milliseconds by the clock, and of all processors in brackets");
    let started = Clock::new();
    let mut session = Session::new(scene, &options)?;
    println!("{:10} {}, {} elements", "ready", text(started.read()), session.status().elements);
    let mut last = 0;
    loop {
        let step = session.step(BUDGET);
        let status = session.status();
        if status.rays != last {
            last = status.rays;
            println!("{last:5} rays {}, error {:.1} %", text(started.read()), 100.0 * status.error);
        }
        if step.is_done {
            break;
        }
    }
    let status = session.status();
    println!(
        "{:10} {}, {:.1} million rays, error {:.2} %, {} MB",
        "done",
        text(started.read()),
        status.rays_traced as f64 * 1e-6,
        100.0 * status.error,
        status.memory >> 20
    );

    let shift = |x: f64, z: f64| glam::DMat4::from_translation(glam::DVec3::new(x, 0.0, z)).to_cols_array();
    let dimmed = |dimming: f32| Edit::Light { light: LightId(0), dimming, colour: [1.0; 3] };
    let painted = |green: f32| Edit::Reflectance { object: ObjectId(4), reflectance: [0.2, green, 0.3] };
    let moved = |object: usize, x: f64, z: f64| Edit::Move { object: ObjectId(object as u32), matrix: shift(x, z) };
    let deleted = Edit::Delete { object: ObjectId(chair as u32 + 1) };
    let restored = Edit::Restore { object: ObjectId(chair as u32 + 1) };
    println!("medians of {TIMES}:");
    measure(&mut session, "dimming", [dimmed(0.4), dimmed(0.9)])?;
    measure(&mut session, "reflectance", [painted(0.6), painted(0.3)])?;
    measure(&mut session, "move a chair", [moved(chair, 0.3, 0.4), moved(chair, 0.5, 0.2)])?;
    measure(&mut session, "move a lamp", [moved(lamp_object, 0.4, 0.3), moved(lamp_object, 0.1, 0.5)])?;
    measure(&mut session, "delete, restore", [deleted, restored])?;
    Ok(())
}

/// Carries out two edits in turn, and prints how long the light took.
fn measure(session: &mut Session, name: &str, edits: [Edit; 2]) -> Result<(), EditError> {
    let [mut applied, mut complete, mut done] = [const { Vec::new() }; 3];
    let rays = session.status().rays_traced;
    for edit in edits.iter().cycle().take(TIMES) {
        let clock = Clock::new();
        session.apply(edit)?;
        applied.push(clock.read());
        let mut first = None;
        loop {
            let step = session.step(BUDGET);
            if step.is_complete && first.is_none() {
                first = Some(clock.read());
            }
            if step.is_done {
                break;
            }
        }
        complete.extend(first);
        done.push(clock.read());
    }
    let median = |of: Vec<[f64; 2]>| {
        let [wall, busy] = [0, 1].map(|k| {
            let mut sorted: Vec<f64> = of.iter().map(|times| times[k]).collect();
            sorted.sort_by(f64::total_cmp);
            sorted[sorted.len() / 2]
        });
        text([wall, busy])
    };
    println!(
        "{name:15} applied {}, complete {}, done {}, {} rays",
        median(applied),
        median(complete),
        median(done),
        (session.status().rays_traced - rays) / TIMES as u64
    );
    Ok(())
}

fn text([wall, busy]: [f64; 2]) -> String {
    format!("{wall:7.1} ({busy:7.1})")
}

/// Milliseconds since a moment: by the clock, and of all threads on processors (Linux; elsewhere zero), which other
/// programs do not lengthen much.
struct Clock {
    started: Instant,
    busy: f64,
}

impl Clock {
    fn new() -> Clock {
        Clock { started: Instant::now(), busy: Clock::busy() }
    }

    fn busy() -> f64 {
        let Ok(threads) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
        let of = |thread: std::io::Result<std::fs::DirEntry>| {
            let text = std::fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
            text.split(' ').next()?.parse::<f64>().ok()
        };
        1e-6 * threads.filter_map(of).sum::<f64>()
    }

    fn read(&self) -> [f64; 2] {
        [1e3 * self.started.elapsed().as_secs_f64(), Clock::busy() - self.busy]
    }
}
