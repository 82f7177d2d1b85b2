//! Edits of a furnished room, timed: to the first complete picture after each, and to the end.
//!
//! `cargo run --release -p radiosity --example live -- [ELEMENTS] [RAYS] [LAMPS] [BOOKS]`

#![allow(clippy::print_stdout)]

#[path = "../tests/common/room.rs"]
mod room;

use radiosity::session::{Edit, LightId, ObjectId, Session, SessionOptions};
use room::{Furnishing, room};
use std::time::{Duration, Instant};

/// Steps of a viewer: a third of a frame.
const BUDGET: Duration = Duration::from_millis(5);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<usize> = std::env::args().skip(1).filter_map(|x| x.parse().ok()).collect();
    let argument = |k: usize, default: usize| arguments.get(k).copied().unwrap_or(default);
    let scene = room(&Furnishing { tables: 6, lamps: argument(2, 4), books: argument(3, 400) });
    println!("{} triangles, {} objects", scene.triangles.len(), scene.objects.len());
    let chair = scene.objects.iter().position(|object| object.name == "chair 1.2").ok_or("no chair")?;
    let lamp_object = scene.objects.iter().position(|object| object.name == "lamp 0").ok_or("no lamp")?;
    let options =
        SessionOptions { elements: argument(0, 60_000), rays: argument(1, 256) as u32, ..SessionOptions::default() };

    let started = Instant::now();
    let mut session = Session::new(scene, &options)?;
    println!("ready: {:.0} ms, {} elements", 1e3 * started.elapsed().as_secs_f64(), session.status().elements);
    let mut last = 0;
    loop {
        let step = session.step(BUDGET);
        let status = session.status();
        if status.rays != last {
            last = status.rays;
            let seconds = started.elapsed().as_secs_f64();
            println!("{last:5} rays: {:7.0} ms, error {:.1} %", 1e3 * seconds, 100.0 * status.error);
        }
        if step.is_done {
            break;
        }
    }
    let status = session.status();
    println!(
        "done: {:.2} s, {:.1} million rays, error {:.2} %, {} MB",
        started.elapsed().as_secs_f64(),
        status.rays_traced as f64 * 1e-6,
        100.0 * status.error,
        status.memory >> 20
    );

    let shift = |x: f64, z: f64| glam::DMat4::from_translation(glam::DVec3::new(x, 0.0, z)).to_cols_array();
    let edits = [
        ("dimming", Edit::Light { light: LightId(0), dimming: 0.4, colour: [1.0; 3] }),
        ("reflectance", Edit::Reflectance { object: ObjectId(4), reflectance: [0.2, 0.6, 0.3] }),
        ("move a chair", Edit::Move { object: ObjectId(chair as u32), matrix: shift(0.3, 0.4) }),
        ("move it again", Edit::Move { object: ObjectId(chair as u32), matrix: shift(0.5, 0.2) }),
        ("move a lamp", Edit::Move { object: ObjectId(lamp_object as u32), matrix: shift(0.4, 0.3) }),
        ("delete a chair", Edit::Delete { object: ObjectId(chair as u32 + 1) }),
        ("copy a chair", Edit::Copy { object: ObjectId(chair as u32), matrix: shift(1.0, -0.9) }),
    ];
    for (name, edit) in edits {
        let (started, rays) = (Instant::now(), session.status().rays_traced);
        session.apply(&edit)?;
        let applied = started.elapsed();
        let mut first = None;
        loop {
            let step = session.step(BUDGET);
            if step.is_complete && first.is_none() {
                first = Some(started.elapsed());
            }
            if step.is_done {
                break;
            }
        }
        println!(
            "{name:15} applied {:5.1} ms, complete {:6.1} ms, done {:7.1} ms, {} rays",
            1e3 * applied.as_secs_f64(),
            1e3 * first.unwrap_or_default().as_secs_f64(),
            1e3 * started.elapsed().as_secs_f64(),
            session.status().rays_traced - rays
        );
    }
    Ok(())
}
