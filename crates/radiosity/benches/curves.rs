//! Error against time: `measure` beside the path tracer, at points whose irradiance is known.
//!
//! `cargo bench -p radiosity --bench curves -- FOLDER [PLOT.svg]`: FOLDER holds one scene (OBJ in metres, z up, or
//! glTF), points.csv (x, y, z, nx, ny, nz) and reference.csv (a row per point: irradiance in three bands, then the
//! standard errors of these). One thread; the tree of boxes is made beforehand for both.
//!
//! The path tracer is the referee of audits, its first bounce stratified, with twice the paths from row to row. `measure` is
//! asked for ever smaller errors; the time of its answer and that of the audit are told apart, as no peer certifies.
//! Errors are root mean squares of luminance relative to its mean, less the variance of the reference.

#![expect(clippy::print_stdout, reason = "the result of a bench is what it prints")]

use radiosity::io::{LoadOptions, load, read_points_csv};
use radiosity::{Bands, MeasureOptions, Mesh, Place, Referee, Tracer, Up, luminance, measure, stations};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

/// Errors that `measure` is asked for.
const ASKED: [f64; 3] = [0.04, 0.02, 0.01];

/// Paths of the path tracer at each point.
const PATHS: [u32; 6] = [16, 64, 256, 1024, 2048, 4096];

/// The error at which times are compared.
const TARGET: f64 = 0.01;

/// What is known of the points: illuminance and its standard error.
struct Truth(Vec<[f64; 2]>);

impl Truth {
    fn read(path: &Path) -> Result<Truth, Failure> {
        let number = |cell: &str| cell.trim().parse::<f32>().map_err(|e| format!("{}: {cell}: {e}", path.display()));
        let row = |line: &str| -> Result<[f64; 2], Failure> {
            let cells: Vec<f32> = line.split(',').map(number).collect::<Result<_, _>>()?;
            let [r, g, b, dr, dg, db] = cells[..] else { return Err(format!("{}: not six numbers", line).into()) };
            Ok([[r, g, b], [dr, dg, db]].map(|bands| f64::from(luminance(bands))))
        };
        Ok(Truth(std::fs::read_to_string(path)?.lines().skip(1).map(row).collect::<Result<_, _>>()?))
    }

    /// Relative root mean square error, 99th percentile of errors relative to each point (or a twentieth of the mean), bias.
    fn judge(&self, answer: &[Bands]) -> [f64; 3] {
        let n = self.0.len() as f64;
        let mean = self.0.iter().map(|[e, _]| e).sum::<f64>() / n;
        let (mut square, mut bias, mut relative) = (0.0, 0.0, Vec::new());
        for (h, [e, noise]) in answer.iter().zip(&self.0) {
            let off = f64::from(luminance(*h)) - e;
            square += off * off - noise * noise;
            bias += off;
            relative.push(off.abs() / e.max(0.05 * mean));
        }
        relative.sort_by(f64::total_cmp);
        let worst = relative[((0.99 * n) as usize).min(relative.len() - 1)];
        [(square / n).max(0.0).sqrt() / mean, worst, bias / n / mean]
    }
}

/// A point of a curve.
struct Sample {
    seconds: f64,
    error: f64,
}

/// Seconds at the target, on straight lines between the points of a curve whose axes are logarithmic; beyond its end on the
/// line of a random error, ∝ 1/√time.
fn at_target(curve: &[Sample]) -> f64 {
    let beyond = |sample: &Sample| sample.seconds * (sample.error / TARGET).powi(2);
    for pair in curve.windows(2) {
        if pair[0].error > TARGET && pair[1].error <= TARGET {
            let share = (pair[0].error / TARGET).ln() / (pair[0].error / pair[1].error).ln();
            return pair[0].seconds * (pair[1].seconds / pair[0].seconds).powf(share);
        }
    }
    match curve {
        [first, ..] if first.error <= TARGET => first.seconds,
        [.., last] => beyond(last),
        [] => f64::NAN,
    }
}

fn row(name: &str, seconds: f64, audit: f64, [error, worst, bias]: [f64; 3]) -> Sample {
    let [error_in_percent, worst, bias] = [error, worst, bias].map(|x| 100.0 * x);
    println!("| {name} | {seconds:.3} | {audit:.3} | {error_in_percent:.2} | {worst:.1} | {bias:+.2} |");
    Sample { seconds, error }
}

fn scene_in(folder: &Path) -> Result<PathBuf, Failure> {
    let is_scene = |path: &PathBuf| path.extension().is_some_and(|e| ["obj", "gltf", "glb"].iter().any(|x| e == *x));
    let found = std::fs::read_dir(folder)?.filter_map(|entry| Some(entry.ok()?.path())).find(is_scene);
    found.ok_or_else(|| format!("{}: no scene in it", folder.display()).into())
}

fn run(folder: &Path, plot: Option<&Path>) -> Result<(), Failure> {
    let path = scene_in(folder)?;
    let loaded = load(&path, &LoadOptions { up: Some(Up::Z), ..LoadOptions::default() })?;
    let points: Vec<_> =
        read_points_csv(&folder.join("points.csv"))?.points.iter().map(|p| (p.position, p.normal)).collect();
    let truth = Truth::read(&folder.join("reference.csv"))?;
    if truth.0.len() != points.len() {
        return Err(format!("{} points and {} references", points.len(), truth.0.len()).into());
    }
    let begun = Instant::now();
    let mesh = Mesh::new(&loaded.scene);
    let tracer = Tracer::new(&loaded.scene, &mesh);
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    println!("{name}: {} points, mesh and tree {:.3} s\n", points.len(), begun.elapsed().as_secs_f64());
    println!("| | s | audit, s | error, % | 99th percentile, % | bias, % |\n|---|---|---|---|---|---|");

    let places: Vec<Place> = points.iter().map(|(p, n)| stations::snap(&tracer, *p, *n)).collect();
    let referee = Referee::new(&tracer);
    let traced: Vec<Sample> = PATHS
        .iter()
        .map(|&paths| {
            let start = Instant::now();
            let at = |(i, place): (usize, &Place)| referee.irradiance(place, paths, i as u64);
            let answer: Vec<Bands> = places.iter().enumerate().map(at).collect();
            row(&format!("path tracer, {paths} paths"), start.elapsed().as_secs_f64(), 0.0, truth.judge(&answer))
        })
        .collect();
    let mut measured = Vec::new();
    for error in ASKED {
        let start = Instant::now();
        let answer = measure(&tracer, &points, &MeasureOptions { error, ..MeasureOptions::default() }, &())?;
        let all = start.elapsed().as_secs_f64();
        let audit = answer.stages.all().iter().filter(|(name, _)| name == "audit").map(|(_, seconds)| seconds).sum();
        let title = format!("asked for {} %, stated at most {:.2} %", 100.0 * error, 100.0 * answer.audit.upper);
        measured.push(row(&title, all - audit, audit, truth.judge(&answer.irradiance)));
    }
    let (tracer_takes, engine_takes) = (at_target(&traced), at_target(&measured));
    println!("\nat {:.0} %: path tracer {tracer_takes:.2} s, answer {engine_takes:.2} s", 100.0 * TARGET);
    println!("ratio {:.1}", tracer_takes / engine_takes);
    if let Some(plot) = plot {
        std::fs::write(plot, drawn(&name, [("path tracer", &traced), ("measure", &measured)]))?;
    }
    Ok(())
}

/// Error over seconds, both logarithmic.
fn drawn(name: &str, curves: [(&str, &[Sample]); 2]) -> String {
    let (width, height, left, bottom) = (640.0, 400.0, 64.0, 48.0);
    let all = || curves.iter().flat_map(|(_, curve)| curve.iter());
    let decades = |of: fn(&Sample) -> f64| {
        let (low, high) = all().map(of).fold((f64::INFINITY, 0f64), |(l, h), x| (l.min(x), h.max(x)));
        (low.log10().floor(), high.log10().ceil())
    };
    let ((x0, x1), (y0, y1)) = (decades(|s| s.seconds), decades(|s| 100.0 * s.error));
    let x = |seconds: f64| left + (seconds.log10() - x0) / (x1 - x0) * (width - left - 24.0);
    let y = |percent: f64| height - bottom - (percent.log10() - y0) / (y1 - y0) * (height - bottom - 40.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\" \
         fill=\"#333\"><rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\
         <text x=\"{left}\" y=\"22\" font-size=\"15\">{name}: error of irradiance over time, one thread</text>"
    );
    let line = |svg: &mut String, from: [f64; 2], to: [f64; 2]| {
        let ([a, b], [c, d]) = (from, to);
        let _ = write!(svg, "<path d=\"M{a:.1} {b:.1}L{c:.1} {d:.1}\" stroke=\"#ddd\"/>");
    };
    for k in x0 as i32..=x1 as i32 {
        let at = x(10f64.powi(k));
        line(&mut svg, [at, y(10f64.powf(y0))], [at, y(10f64.powf(y1))]);
        let _ = write!(
            svg,
            "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{} s</text>",
            height - 26.0,
            10f64.powi(k)
        );
    }
    for k in y0 as i32..=y1 as i32 {
        let at = y(10f64.powi(k));
        line(&mut svg, [x(10f64.powf(x0)), at], [x(10f64.powf(x1)), at]);
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{} %</text>",
            left - 8.0,
            at + 4.0,
            10f64.powi(k)
        );
    }
    for ((_, curve), colour) in curves.iter().zip(["#888", "#c2410c"]) {
        let path: Vec<String> =
            curve.iter().map(|s| format!("{:.1} {:.1}", x(s.seconds), y(100.0 * s.error))).collect();
        let _ = write!(svg, "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>", path.join("L"));
        for s in *curve {
            let (x, y) = (x(s.seconds), y(100.0 * s.error));
            let _ = write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{colour}\"/>");
        }
    }
    // The one from above its start, the other below its end: nothing else is there.
    let mut name = |at: Option<&Sample>, [dx, dy]: [f64; 2], colour: &str, title: &str| {
        if let Some(s) = at {
            let (x, y) = (x(s.seconds) + dx, y(100.0 * s.error) + dy);
            let _ = write!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{colour}\">{title}</text>");
        }
    };
    let [(first, tracer), (second, answer)] = curves;
    name(tracer.first(), [10.0, -6.0], "#888", first);
    name(answer.last(), [-20.0, 20.0], "#c2410c", second);
    svg + "</svg>\n"
}

fn main() -> Result<(), Failure> {
    let given: Vec<PathBuf> =
        std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).map(PathBuf::from).collect();
    let [folder, rest @ ..] = &given[..] else {
        println!("curves: name a folder that holds a scene, points.csv and reference.csv");
        return Ok(());
    };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    one_thread.install(|| run(folder, rest.first().map(PathBuf::as_path)).map_err(|e| e.to_string()))?;
    Ok(())
}
