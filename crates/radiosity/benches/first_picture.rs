//! Catalogue 43: how long a scene takes to its first picture, and to the next ones, from a scene that has been read.
//!
//! The built-in Cornell box, or the files named: `cargo bench -p radiosity --bench first_picture -- FILE...`. Pictures are
//! those of `render --frames` at its usual size, a quarter of 1280 x 720 pixels.

#![expect(clippy::print_stdout, reason = "the result of a bench is what it prints")]

use radiosity::io::{LoadOptions, load};
use radiosity::{Glimpse, Mesh, Monitor, Scene, Solution, SolveOptions, Tracer, cornell_box, place_camera, preview};
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

const SIZE: [u32; 2] = [320, 180];

/// Takes the time of each picture.
struct Watch<'a> {
    start: Instant,
    glimpse: &'a Glimpse,
    times: Mutex<Vec<(usize, usize, f64)>>,
}

impl Monitor for Watch<'_> {
    fn solved(&self, solution: &Solution) {
        let picture = self.glimpse.picture(solution);
        assert!(picture.pixels.len() == (SIZE[0] * SIZE[1]) as usize && picture.exposure().is_finite());
        let seconds = self.start.elapsed().as_secs_f64();
        let mut times = self.times.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        times.push((solution.rays(), solution.elements.len(), seconds));
    }
}

fn measure(name: &str, scene: &Scene) {
    for _ in 0..3 {
        let start = Instant::now();
        let mesh = Mesh::new(scene);
        let tracer = Tracer::new(scene, &mesh);
        let camera = scene.cameras.first().cloned().unwrap_or_else(|| place_camera(&tracer, None));
        let glimpse = Glimpse::new(&tracer, &camera, SIZE[0], SIZE[1]);
        let cast = start.elapsed().as_secs_f64();
        let watch = Watch { start, glimpse: &glimpse, times: Mutex::default() };
        let picture = glimpse.first(&tracer, &SolveOptions::default(), &watch).expect("nobody stops it");
        assert!(picture.exposure().is_finite());
        let first = start.elapsed().as_secs_f64();
        preview(&tracer, &SolveOptions::default(), &watch).expect("nobody stops it");
        let times = watch.times.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
        let (_, elements, whole) = times[0];
        print!(
            "{name:>24} {elements:>7} elements: seen {cast:.2} s, first picture {first:.2} s, of all elements {whole:.2} s; "
        );
        print!("by rays per cell");
        times[1..].iter().for_each(|(rays, _, seconds)| print!(" {rays}: {seconds:.2} s"));
        println!();
    }
}

fn main() {
    // Cargo passes --bench, which is not for us.
    let files: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    println!("{} threads", rayon::current_num_threads());
    if files.is_empty() {
        measure("Cornell box", &cornell_box());
    }
    for file in files {
        let loaded = load(Path::new(&file), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        measure(&file, &loaded.scene);
    }
}
