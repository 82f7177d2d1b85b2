//! Time to 1 % error, path tracer over engine: the Cornell box, one thread.
//!
//! Both answer the same question, the irradiance at the centres of some 10,000 elements, and are judged by the same
//! norm, the area-weighted relative L2 error of its luminance. The path tracer is the referee as audits use it, its
//! first bounce stratified. The engine is what `bake` runs: elements, exposure, direct light, rows, solver,
//! continuous field, and direct light once more at the centres. It doubles M, the rays per element, and sends M shadow
//! rays from each centre. The mesh and the tree of boxes are made beforehand for both. Nothing is
//! denoised; the field averages neighbouring elements, which is part of the method, and so is its error in the result.
//!
//! The judge is a pair of independent references a and b: mean((h − a)(h − b)) estimates the squared error of h without
//! bias, however noisy a and b are. The time at 1 % is interpolated between doublings, both axes logarithmic.

#![expect(clippy::print_stdout, reason = "the result of a bench is what it prints")]

use radiosity::answer::Station;
use radiosity::transport::{Shadowing, exposure::is_buried};
use radiosity::{
    Bands, Elements, Indirect, Mesh, Referee, Solution, SolveOptions, Tracer, cornell_box, luminance, stations,
};
use rayon::prelude::*;
use std::time::{Duration, Instant};

/// Gives 10,016 elements. Divisions are powers of two, and the next larger size that changes any gives 6,944.
const ELEMENT_SIZE: f64 = 0.029;

/// The error at which times are compared.
const TARGET: f64 = 0.01;

/// Paths of either reference at each centre: some 0.8 % of noise each, less than what they judge. Fewer would widen the
/// uncertainty of the errors, which is printed, and shift none of them.
const REFERENCE_PATHS: u32 = 4096;

/// Short runs are repeated until they take this long together, and their mean counts.
const LONG_ENOUGH: Duration = Duration::from_secs(2);

/// Where light is asked for, and what is known of it.
struct Exam {
    stations: Vec<Station>,
    /// Area of each station's element, m².
    area: Vec<f64>,
    /// Two independent estimates of the illuminance at each station, lx.
    reference: Vec<[f64; 2]>,
}

impl Exam {
    /// At the centres of all elements that are not inside a solid.
    fn new(tracer: &Tracer, referee: &Referee) -> Exam {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        let elements = Elements::new(scene, mesh, ELEMENT_SIZE);
        let (stations, area): (Vec<Station>, Vec<f64>) = (0..elements.len() as u32)
            .map(|e| {
                let (triangle, side) = elements.place(e);
                let [a, b, c] = elements.corners(e);
                (stations::station(tracer, triangle, (a + b + c) / 3.0, side), elements.area(mesh, e))
            })
            .filter(|(station, _)| !is_buried(tracer, &station.place, 0))
            .unzip();
        // Seeds above 2³² are for references, those below for the path tracer under test.
        let estimate = |i: usize, half: u64| {
            let seed = (1 + half) << 32 | i as u64;
            f64::from(luminance(referee.irradiance(&stations[i].place, REFERENCE_PATHS, seed)))
        };
        let reference = (0..stations.len()).into_par_iter().map(|i| [0, 1].map(|half| estimate(i, half))).collect();
        Exam { stations, area, reference }
    }

    /// Relative L2 error of an answer, and the standard error of this estimate.
    fn judge(&self, answer: &[Bands]) -> [f64; 2] {
        assert_eq!(answer.len(), self.stations.len());
        let all = || answer.iter().zip(&self.reference).zip(&self.area);
        let square: f64 = all().map(|((_, [a, b]), area)| area * a * b).sum();
        let product = |h: &Bands, [a, b]: &[f64; 2]| {
            let h = f64::from(luminance(*h));
            (h - a) * (h - b)
        };
        let mean = all().map(|((h, pair), area)| area * product(h, pair)).sum::<f64>() / self.area.iter().sum::<f64>();
        let noise: f64 = all().map(|((h, pair), area)| (area * (product(h, pair) - mean)).powi(2)).sum();
        let error = (mean * self.area.iter().sum::<f64>() / square).max(0.0).sqrt();
        // Of the square root: half the relative error of the square.
        [error, 0.5 * noise.sqrt() / (square * error)]
    }

    /// Doubles the work from `first` on until the error falls below the target; answers the seconds at the target.
    fn time_to_target(&self, title: &str, first: u32, method: impl Fn(u32) -> Vec<Bands>) -> f64 {
        println!("\n{title:>24}      error, %         s");
        let mut before: Option<[f64; 2]> = None;
        for work in (0..16).map(|k| first << k) {
            let start = Instant::now();
            let (mut answer, mut runs) = (method(work), 1);
            while start.elapsed() < LONG_ENOUGH {
                (answer, runs) = (method(work), runs + 1);
            }
            let seconds = start.elapsed().as_secs_f64() / f64::from(runs);
            let [error, uncertainty] = self.judge(&answer);
            println!("{work:>24} {:7.3} ± {:.3} {seconds:9.3}", 100.0 * error, 100.0 * uncertainty);
            match before {
                Some([old_error, old_seconds]) if error <= TARGET => {
                    let share = (old_error / TARGET).ln() / (old_error / error).ln();
                    return old_seconds * (seconds / old_seconds).powf(share);
                }
                None if error <= TARGET => {
                    panic!("{title}: begin with less than {first}, the error is {error} already")
                }
                _ => before = Some([error, seconds]),
            }
        }
        panic!("{title}: an error of {TARGET} is out of reach")
    }
}

fn main() {
    let scene = cornell_box();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let referee = Referee::new(&tracer);
    let exam = Exam::new(&tracer, &referee);
    println!("Cornell box, irradiance at the centres of {} elements, one thread", exam.stations.len());

    let paths = |paths: u32| {
        let at = |(i, station): (usize, &Station)| referee.irradiance(&station.place, paths, i as u64);
        exam.stations.iter().enumerate().map(at).collect()
    };
    let engine = |rays: u32| {
        let options = SolveOptions { element_size: Some(ELEMENT_SIZE), rays: rays as usize, ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &options, &()).expect("the box fits into memory and converges");
        let field = solution.indirect_field(&()).expect("nobody stops it");
        let shadowing = Shadowing { places: 1, rays };
        let answer = solution.at(&exam.stations, Indirect::Field(&field), &shadowing, &());
        answer.expect("nobody stops it").irradiance
    };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    one_thread.install(|| {
        let path_tracer = exam.time_to_target("path tracer: paths", 256, paths);
        let engine = exam.time_to_target("engine: rays", 16, engine);
        println!("\nat {:.0} %: path tracer {path_tracer:.2} s, engine {engine:.3} s", 100.0 * TARGET);
        println!("ratio {:.1}", path_tracer / engine);
    });
}
