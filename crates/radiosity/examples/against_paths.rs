//! How far the light of a session is off on an object, beside the path tracer at the same places: as it is shown, and by rays of the
//! places themselves.
//!
//! `cargo run --release -p radiosity --example against_paths -- FILE.glb OBJECT [LUX]`, under an overcast sky of so much horizontal
//! illuminance.

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use radiosity::io::{LoadOptions, load};
use radiosity::session::{Session, SessionOptions, SurfacePlace, Survey};
use radiosity::{Mesh, Referee, Sky, Tracer, luminance, stations};
use rayon::prelude::*;
use std::error::Error;
use std::path::Path;
use std::time::Duration;

/// Places: means over them are known to some 0.2 %.
const PLACES: u64 = 400;

/// Paths at each: together they are off by 0.1 % where a window lights a room.
const PATHS: u32 = 4096;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, name, rest @ ..] = arguments.as_slice() else {
        return Err("give a file and the name of an object".into());
    };
    let mut scene = load(Path::new(file), &LoadOptions::default())?.scene;
    if let Some(lux) = rest.first() {
        scene.sky = Sky::Overcast { horizontal: [lux.parse()?; 3] };
    }
    let mut session = Session::new(scene.clone(), &SessionOptions::default())?;
    while !session.step(Duration::from_millis(50)).is_done {}

    let model = session.model();
    let object = model.objects.iter().find(|object| object.name == *name);
    let object = object.ok_or_else(|| format!("{file} has no object that is named '{name}'"))?;
    let triangles = object.indices.len() as u64 / 3;
    // A large prime takes them from all over the object.
    let triangle = |k: u64| (k * 7919 % triangles) as u32;
    let places = (0..PLACES).map(|k| SurfacePlace { object: object.id, triangle: triangle(k), uv: [0.3, 0.3] });
    let mut survey = Survey::new(places.collect());
    let found = loop {
        if let Some(found) = session.survey(&mut survey, Duration::from_secs(1)) {
            break found;
        }
    };

    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let referee = Referee::new(&tracer);
    let readings: Vec<_> = found.readings.into_iter().flatten().filter(|reading| reading.lux > 0.0).collect();
    let traced: Vec<f64> = readings
        .par_iter()
        .enumerate()
        .map(|(seed, reading)| {
            let place = stations::snap(&tracer, reading.position.into(), reading.normal.into());
            f64::from(luminance(referee.irradiance(&place, PATHS, seed as u64)))
        })
        .collect();
    let n = readings.len() as f64;
    let truth = traced.iter().sum::<f64>() / n;
    let shown = readings.iter().map(|reading| f64::from(reading.shown)).sum::<f64>() / n;
    let measured = readings.iter().map(|reading| f64::from(reading.lux)).sum::<f64>() / n;
    let off = |light: f64| 100.0 * (light / truth - 1.0);
    println!("{name}, {n} lit places: {truth:.1} lx by paths");
    println!("  shown    {shown:8.1} lx, {:+.2} %", off(shown));
    println!("  measured {measured:8.1} lx, {:+.2} %", off(measured));
    Ok(())
}
