//! Where light is wrong: false colours of the error at what a camera sees, `measure` beside the path tracer in the same time.
//!
//! `cargo bench -p radiosity --bench error_maps -- SCENE PICTURE.png [PERCENT [PATHS]]`: SCENE is OBJ in metres, z up, or glTF; the truth
//! are PATHS paths of the path tracer at each pixel, 4,096 unless said. The path tracer that is judged has other paths, as many as it traces while
//! `measure` answers for PERCENT, 2 unless said; audits are no answer and do not count.
//!
//! From left to right: the picture, the error of the path tracer, that of `measure`. White is right, red too bright and blue too dark, full at a tenth of
//! the light there or, in the dark, of a tenth of the mean. Black are lamps, and what is no surface.

#![expect(clippy::print_stdout, reason = "the result of a bench is what it prints")]

use radiosity::io::image_out::encode_png;
use radiosity::io::{LoadOptions, load};
use radiosity::view::picture::ViewRays;
use radiosity::{Bands, MeasureOptions, Mesh, Place, Referee, Tracer, Up, luminance, measure, place_camera};
use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

const SIZE: [u32; 2] = [320, 240];

/// Error at which colours are full, and the part of the mean light that errors are relative to where it is darker.
const FULL: f64 = 0.1;
const DARK: f64 = 0.1;

/// Paths that tell how long the path tracer takes.
const TIMED: u32 = 16;

/// Red above, blue below, white at nothing.
fn colour(error: f64) -> [u8; 3] {
    let x = (error / FULL).clamp(-1.0, 1.0);
    let fade = |full: [f64; 3], x: f64| full.map(|c| (255.0 * (1.0 - x * (1.0 - c))).round() as u8);
    if x > 0.0 { fade([0.75, 0.0, 0.1], x) } else { fade([0.0, 0.2, 0.7], -x) }
}

fn run(scene: &Path, to: &Path, percent: f64, paths: u32) -> Result<(), Failure> {
    let is_obj = scene.extension().is_some_and(|e| e == "obj");
    let loaded = load(scene, &LoadOptions { up: is_obj.then_some(Up::Z), ..LoadOptions::default() })?;
    let mesh = Mesh::new(&loaded.scene);
    let tracer = Tracer::new(&loaded.scene, &mesh);
    let [width, height] = SIZE;
    let aspect = f64::from(width) / f64::from(height);
    let camera = loaded.scene.cameras.first().cloned().unwrap_or_else(|| place_camera(&tracer, Some(aspect)));
    let rays = ViewRays::sampled(&tracer, &camera, (width, height), 1);
    let places: Vec<Place> = rays.seen.iter().map(|seen| seen.place).collect();
    if places.is_empty() {
        return Err("the camera sees no surface".into());
    }
    let points: Vec<_> = places.iter().map(|place| (place.point, place.normal)).collect();

    let options = MeasureOptions { error: percent / 100.0, ..MeasureOptions::default() };
    let start = Instant::now();
    let answer = measure(&tracer, &points, &options, &())?;
    let audit: f64 = answer.stages.all().iter().filter(|(name, _)| name == "audit").map(|(_, seconds)| seconds).sum();
    let seconds = start.elapsed().as_secs_f64() - audit;

    let referee = Referee::new(&tracer);
    let traced = |paths: u32, seed: u64| -> Vec<Bands> {
        let at = |(i, place): (usize, &Place)| referee.irradiance(place, paths, seed << 32 | i as u64);
        places.par_iter().enumerate().map(at).collect()
    };
    let start = Instant::now();
    traced(TIMED, 1);
    let in_time = (f64::from(TIMED) * seconds / start.elapsed().as_secs_f64()).round().max(1.0) as u32;
    let by_paths = traced(in_time, 2);
    let truth = traced(paths, 3);

    let light: Vec<f64> = truth.iter().map(|e| f64::from(luminance(*e))).collect();
    let mean = light.iter().sum::<f64>() / light.len() as f64;
    let errors = |answer: &[Bands]| -> Vec<f64> {
        let of = |(h, e): (&Bands, &f64)| (f64::from(luminance(*h)) - e) / e.max(DARK * mean);
        answer.iter().zip(&light).map(of).collect()
    };
    let shown = [errors(&by_paths), errors(&answer.irradiance)];
    println!("{}: {} places, {seconds:.2} s", scene.display(), places.len());
    let names = [format!("path tracer, {in_time} paths"), format!("measure, {percent} % asked")];
    for ((name, answer), shown) in names.iter().zip([&by_paths, &answer.irradiance]).zip(&shown) {
        let square = |(h, e): (&Bands, &f64)| (f64::from(luminance(*h)) - e).powi(2);
        let off = (answer.iter().zip(&light).map(square).sum::<f64>() / light.len() as f64).sqrt() / mean;
        let beyond = shown.iter().filter(|e| e.abs() > FULL).count() as f64 / shown.len() as f64;
        println!(
            "{name}: {:.2} % off in the root mean square, {:.2} % of places beyond the scale",
            100.0 * off,
            100.0 * beyond
        );
    }

    let picture = rays.picture(&truth);
    let toned = picture.tone_mapped(picture.exposure());
    let mut pixels = vec![[0u8; 3]; (3 * width * height) as usize];
    let mut set = |panel: u32, pixel: u32, colour: [u8; 3]| {
        pixels[(pixel / width * 3 * width + panel * width + pixel % width) as usize] = colour;
    };
    (0..).zip(toned).for_each(|(pixel, colour)| set(0, pixel, colour));
    for (panel, errors) in (1..).zip(&shown) {
        rays.seen.iter().zip(errors).for_each(|(seen, error)| set(panel, seen.pixel, colour(*error)));
    }
    std::fs::write(to, encode_png(3 * width, height, &pixels)?)?;
    Ok(())
}

fn main() -> Result<(), Failure> {
    let given: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let [scene, to, rest @ ..] = &given[..] else {
        println!("error_maps: name a scene and a picture (.png) to write");
        return Ok(());
    };
    let percent = rest.first().map_or(Ok(2.0), |word| word.parse())?;
    let paths = rest.get(1).map_or(Ok(4096.try_into()?), |word| word.parse::<std::num::NonZero<u32>>())?;
    run(Path::new(scene), Path::new(to), percent, paths.get())
}
