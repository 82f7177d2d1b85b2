//! Time at an error, path tracer over engine, one thread.
//!
//! `cargo bench -p radiosity --bench elements [-- SCENE [PERCENT [ELEMENTS [means]]]]`: the Cornell box at 1 % and 10,000 elements without
//! a scene or with `-` for one. OBJ files are in metres, y up.
//!
//! Both answer the same question, the irradiance at the centres of all elements, or its means over what is exposed of them, and are judged
//! by the same norm, the area-weighted relative L2 error of its luminance. The path tracer is the referee as audits use it, its
//! first bounce stratified. At centres the engine is what `render` runs: elements, exposure, direct light, rows, solver,
//! continuous field, and direct light once more at the centres. It doubles M, the rays per element, and sends M shadow
//! rays from each centre. For means it is `Solution::light_of`, with half the variance each time, over a solution of some 4,000 cells and
//! one for each triangle. The mesh and the tree of boxes are made beforehand for both. Nothing is
//! denoised; elements of a plane share the light of their rays, which is part of the method, and so is its error in the result.
//!
//! The judge is a pair of independent references a and b: mean((h − a)(h − b)) estimates the squared error of h without
//! bias, however noisy a and b are. Where there are many elements, every n-th is judged, and the path tracer answers at
//! these alone: it takes n times as long at all of them. The time at the target is interpolated between doublings, both axes logarithmic.

#![expect(clippy::print_stdout, reason = "the result of a bench is what it prints")]

use radiosity::answer::Station;
use radiosity::io::{LoadOptions, load};
use radiosity::transport::{ElementReceivers, Exposure, Receivers, Shadowing, Site, exposure::is_buried};
use radiosity::{
    Bands, Elements, Indirect, Mesh, Referee, Scene, Solution, SolveOptions, Tracer, cornell_box, luminance, stations,
};
use rayon::prelude::*;
use std::path::Path;
use std::time::{Duration, Instant};

/// Elements asked for; divisions are powers of two, and make twice as many of them in the Cornell box.
const ELEMENTS: usize = 5_000;

/// The error at which times are compared.
const TARGET: f64 = 0.01;

/// Elements that are judged, about.
const JUDGED: usize = 10_000;

/// Paths of either reference for each element: some 0.8 % of noise each, less than what they judge. Fewer would widen the
/// uncertainty of the errors, which is printed, and shift none of them.
const REFERENCE_PATHS: u32 = 4096;

/// Cells that means are looked up on, beside one for each triangle.
const LOOKED_UP: usize = 4000;

/// Short runs are repeated until they take this long together, and their mean counts.
const LONG_ENOUGH: Duration = Duration::from_secs(2);

/// What is asked.
enum Question {
    /// Light at the centres of elements.
    Centres(Vec<Station>),
    /// Mean light of elements: which of all, and where each is.
    Means(Elements, Vec<(usize, Site)>),
}

impl Question {
    /// At the centres of all elements that are not inside a solid, with their areas, m².
    fn centres(tracer: &Tracer, elements: &Elements) -> (Question, Vec<f64>) {
        let (stations, area) = (0..elements.len() as u32)
            .map(|e| {
                let (triangle, side) = elements.place(e);
                let [a, b, c] = elements.corners(e);
                (stations::station(tracer, triangle, (a + b + c) / 3.0, side), elements.area(tracer.mesh, e))
            })
            .filter(|(station, _)| !is_buried(tracer, &station.place, 0))
            .unzip();
        (Question::Centres(stations), area)
    }

    /// Of all elements of which anything is exposed, with the area of that, m².
    fn means(tracer: &Tracer, elements: Elements) -> (Question, Vec<f64>) {
        let mesh = tracer.mesh;
        let exposure = Exposure::new(tracer, mesh, &elements, &()).expect("nobody stops it");
        let receivers = ElementReceivers { mesh, elements: &elements, exposure: &exposure };
        let exposed = |e: usize| elements.area(mesh, e as u32) * exposure.share(e as u32);
        let asked = (0..elements.len()).filter_map(|e| Some(((e, receivers.site(e)?), exposed(e))));
        let (asked, area) = asked.unzip();
        (Question::Means(elements, asked), area)
    }

    fn len(&self) -> usize {
        match self {
            Question::Centres(stations) => stations.len(),
            Question::Means(_, asked) => asked.len(),
        }
    }

    /// What the path tracer says.
    fn traced(&self, referee: &Referee, tracer: &Tracer, i: usize, (paths, seed): (u32, u64)) -> Bands {
        match self {
            Question::Centres(stations) => referee.irradiance(&stations[i].place, paths, seed),
            Question::Means(_, asked) => {
                let counts = |place: &_| !is_buried(tracer, place, seed as u32);
                referee.mean_irradiance(|[x, y]| asked[i].1.place(x, y), counts, paths, seed)
            }
        }
    }
}

/// A question, and what is known of the answer.
struct Exam {
    question: Question,
    /// One of so many is judged.
    stride: usize,
    /// Area of each element that is judged, m².
    area: Vec<f64>,
    /// Two independent estimates of the illuminance of each that is judged, lx.
    reference: Vec<[f64; 2]>,
    target: f64,
}

impl Exam {
    fn new(tracer: &Tracer, referee: &Referee, (question, area): (Question, Vec<f64>), target: f64) -> Exam {
        // Seeds above 2³² are for references, those below for the path tracer under test.
        let estimate = |i: usize, half: u64| {
            let seed = (1 + half) << 32 | i as u64;
            f64::from(luminance(question.traced(referee, tracer, i, (REFERENCE_PATHS, seed))))
        };
        let stride = (question.len() / JUDGED).max(1);
        let judged: Vec<usize> = (0..question.len()).step_by(stride).collect();
        let reference = judged.par_iter().map(|&i| [0, 1].map(|half| estimate(i, half))).collect();
        let area = judged.iter().map(|&i| area[i]).collect();
        Exam { question, stride, area, reference, target }
    }

    /// Those that are judged.
    fn judged(&self) -> impl Iterator<Item = usize> {
        (0..self.question.len()).step_by(self.stride)
    }

    /// Relative L2 error of an answer at those that are judged, and the standard error of this estimate.
    fn judge(&self, answer: &[Bands]) -> [f64; 2] {
        assert_eq!(answer.len(), self.reference.len());
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

    /// Doubles the work from `first` on until the error falls below the target; answers the seconds at the target, those of the
    /// method `times` over.
    fn time_to_target(&self, (title, first): (&str, u32), times: usize, method: impl Fn(u32) -> Vec<Bands>) -> f64 {
        let target = self.target;
        println!("\n{title:>24}      error, %         s");
        let mut before: Option<[f64; 2]> = None;
        for work in (0..16).map(|k| first << k) {
            let start = Instant::now();
            let (mut answer, mut runs) = (method(work), 1);
            while start.elapsed() < LONG_ENOUGH {
                (answer, runs) = (method(work), runs + 1);
            }
            let seconds = times as f64 * start.elapsed().as_secs_f64() / f64::from(runs);
            let [error, uncertainty] = self.judge(&answer);
            println!("{work:>24} {:7.3} ± {:.3} {seconds:9.3}", 100.0 * error, 100.0 * uncertainty);
            match before {
                Some([old_error, old_seconds]) if error <= target => {
                    let share = (old_error / target).ln() / (old_error / error).ln();
                    return old_seconds * (seconds / old_seconds).powf(share);
                }
                None if error <= target => {
                    panic!("{title}: begin with less than {first}, the error is {error} already")
                }
                _ => before = Some([error, seconds]),
            }
        }
        panic!("{title}: an error of {target} is out of reach")
    }
}

fn run(scene: &Scene, name: &str, target: f64, elements: usize, means: bool) -> Result<(), Box<dyn std::error::Error>> {
    let mesh = Mesh::new(scene);
    let tracer = Tracer::new(scene, &mesh);
    let referee = Referee::new(&tracer);
    let size = (2.0 * mesh.whole_area() / elements as f64).sqrt();
    let elements = Elements::new(scene, &mesh, size);
    let asked = if means { Question::means(&tracer, elements) } else { Question::centres(&tracer, &elements) };
    let exam = Exam::new(&tracer, &referee, asked, target);
    let what = if means { "mean irradiance" } else { "irradiance at the centres" };
    println!("{name}, {what} of {} elements, one thread", exam.question.len());
    if exam.stride > 1 {
        println!("every {}th is judged; the path tracer's time at these, times {0}", exam.stride);
    }

    let paths = |paths: u32| {
        let judged = exam.judged().enumerate();
        judged.map(|(seed, i)| exam.question.traced(&referee, &tracer, i, (paths, seed as u64))).collect()
    };
    let engine = |work: u32| -> Vec<Bands> {
        let solved = |options| Solution::new(&tracer, &options, &()).expect("the scene fits into memory and converges");
        match &exam.question {
            Question::Centres(stations) => {
                let rays = work as usize;
                let solution = solved(SolveOptions { element_size: Some(size), rays, ..SolveOptions::default() });
                let field = solution.indirect_field(&()).expect("nobody stops it");
                let shadowing = Shadowing { places: 1, rays: work };
                let answer = solution.at(stations, Indirect::Field(&field), &shadowing, &());
                let irradiance = answer.expect("nobody stops it").irradiance;
                exam.judged().map(|i| irradiance[i]).collect()
            }
            Question::Means(elements, asked) => {
                let looked_up = SolveOptions { looked_up: true, cells: LOOKED_UP, rays: 16, ..SolveOptions::default() };
                let solution = solved(looked_up);
                let exposure = Exposure::new(&tracer, &mesh, elements, &()).expect("nobody stops it");
                let light =
                    solution.light_of(elements, &exposure, f64::from(work).powf(-0.5), &()).expect("nobody stops it");
                exam.judged().map(|i| light.irradiance[asked[i].0]).collect()
            }
        }
    };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    one_thread.install(|| {
        let path_tracer = exam.time_to_target(("path tracer: paths", 64), exam.stride, paths);
        let engine =
            exam.time_to_target(if means { ("engine: 1 / noise²", 256) } else { ("engine: rays", 8) }, 1, engine);
        println!("\nat {:.1} %: path tracer {path_tracer:.2} s, engine {engine:.3} s", 100.0 * target);
        println!("ratio {:.1}", path_tracer / engine);
    });
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let given: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let percent = |text: &String| text.parse::<f64>().map(|percent| percent / 100.0);
    let target = given.get(1).map_or(Ok(TARGET), percent)?;
    let elements = given.get(2).map_or(Ok(ELEMENTS), |text| text.parse())?;
    let means = match given.get(3).map(String::as_str) {
        None => false,
        Some("means") => true,
        Some(other) => return Err(format!("'{other}' is not known; 'means' asks for means over elements").into()),
    };
    match given.first().map(String::as_str) {
        None | Some("-") => run(&cornell_box(), "Cornell box", target, elements, means),
        Some(path) => {
            let loaded = load(Path::new(path), &LoadOptions::default()).map_err(|faults| faults.to_string())?;
            run(&loaded.scene, path, target, elements, means)
        }
    }
}
