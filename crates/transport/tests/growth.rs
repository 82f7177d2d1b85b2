//! How work and memory grow with the elements (catalogue 44): exponents of lines through logarithms, from counts, which no other
//! work of the machine changes; by the clock in a test of its own, which is ignored. And many right-hand sides go through a table as each alone.

#![expect(clippy::print_stdout, reason = "the exponents are what one runs this for")]

use glam::DVec3;
use radiosity_scene::{Bands, Elements, Enclosure, Material, Mesh, Scene, Sky, SkyPatches};
use radiosity_solve::{DiffuseResponse, Go, Params, Solver, Transport, solve_operator};
use radiosity_trace::Tracer;
use radiosity_transport::{
    ElementReceivers, Exposure, FormFactorMethod, FormFactorOptions, FormFactors, HitTable, IdSpace, Luminaires,
    Shadowing,
};
use std::time::Instant;

/// M: rays of each element.
const RAYS: usize = 16;

/// A unit cube from inside, with a block in it, each face of `cut` × `cut` squares: a triangle is cut into 64 × 64 elements at
/// most.
fn room(cut: usize) -> Scene {
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    let mut cube = |low: DVec3, size: f64, is_inside: bool| {
        let p = |x: f64, y: f64, z: f64| low + size * DVec3::new(x, y, z);
        for mut corners in [
            [p(0., 0., 0.), p(0., 0., 1.), p(1., 0., 1.), p(1., 0., 0.)],
            [p(0., 1., 0.), p(1., 1., 0.), p(1., 1., 1.), p(0., 1., 1.)],
            [p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.)],
            [p(0., 0., 1.), p(0., 1., 1.), p(1., 1., 1.), p(1., 0., 1.)],
            [p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 1.), p(0., 0., 1.)],
            [p(1., 0., 0.), p(1., 0., 1.), p(1., 1., 1.), p(1., 1., 0.)],
        ] {
            if !is_inside {
                corners.reverse();
            }
            let [corner, u, v] = [corners[0], corners[1] - corners[0], corners[3] - corners[0]].map(|x| x / cut as f64);
            for (i, j) in (0..cut * cut).map(|k| ((k % cut) as f64, (k / cut) as f64)) {
                let at = corner * cut as f64 + u * i + v * j;
                scene.add_quad("cube", 0, [at, at + u, at + u + v, at + v]);
            }
        }
    };
    cube(DVec3::ZERO, 1.0, true);
    cube(DVec3::new(0.3, 0.2, 0.4), 0.3, false);
    scene
}

/// What a mesh took.
struct Cost {
    elements: f64,
    /// Rays traced, and so many ids of four bytes kept.
    rays: f64,
    /// Ids read until the residual was 1e-4.
    read: f64,
}

/// Rows and a solve of the room with elements of a width.
fn cost(size: f64) -> Cost {
    let scene = room(4);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let elements = Elements::new(&scene, &mesh, size);
    let n = elements.len();
    let area: Vec<f64> = (0..n as u32).map(|e| elements.area(&mesh, e)).collect();
    let exposure = Exposure::new(&tracer, &mesh, &elements, &()).unwrap();
    let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    let ids = IdSpace { elements: &elements, sky: SkyPatches::new(&Sky::default(), DVec3::Y) };
    let mut table = HitTable::new(area, &ids);
    table.extend(&tracer, (&ids, &[]), &receivers, RAYS, &()).unwrap();
    let rays: usize = table.map_rows(|row| row.ids().count()).unwrap().into_iter().sum();

    // The ceiling gives off light.
    let e: Vec<f64> = (0..n as u32).map(|e| f64::from(elements.normal(&mesh, e).y < -0.9)).collect();
    let response = DiffuseResponse { reflectance: vec![0.7; n], bands: 1, reciprocal_area: None };
    let params = Params { tolerance: 1e-4, ..Params::default() };
    let mut b = e.clone();
    let info = solve_operator(Solver::DeflatedJacobi, &table, &response, &e, &mut b, &params, |_, _| Go::On).unwrap();
    Cost { elements: n as f64, rays: rays as f64, read: rays as f64 * info.work }
}

/// p of y ∝ x^p: the slope of the least squares line.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / count, b + y / count));
    let (up, down) = logs.iter().fold((0.0, 0.0), |(a, b), (u, v)| (a + (u - x) * (v - y), b + (u - x) * (u - x)));
    up / down
}

fn fitted(costs: &[Cost], of: impl Fn(&Cost) -> f64) -> f64 {
    exponent(&costs.iter().map(|cost| (cost.elements, of(cost))).collect::<Vec<_>>())
}

/// Widths for 960, 15,360 and 245,760 elements.
const WIDTHS: [f64; 3] = [1.0 / 8.0, 1.0 / 32.0, 1.0 / 128.0];

/// Catalogue 44: rays and memory of a hit table grow as N, from 10³ to 10⁵ elements, and so does what a solve reads, as
/// the sweeps that it takes do not depend on N. Half of a decade of N² in three would show as 1.2.
#[test]
fn catalogue_44_tables_and_solves_grow_with_the_elements() {
    let costs = WIDTHS.map(cost);
    assert!(costs[0].elements < 1e3 && costs[2].elements > 1e5, "{} {}", costs[0].elements, costs[2].elements);
    let (memory, work) = (fitted(&costs, |cost| cost.rays), fitted(&costs, |cost| cost.read));
    println!("exponents: rays and memory {memory:.4}, work of a solve {work:.4}");
    assert!((memory - 1.0).abs() < 1e-3, "{memory}");
    assert!((work - 1.0).abs() < 0.05, "{work}");
    for cost in &costs {
        assert_eq!(cost.rays, RAYS as f64 * cost.elements);
        assert_eq!(HitTable::bytes(cost.elements as usize, RAYS) as f64, 4.0 * cost.rays);
    }
}

/// Many right-hand sides go through a table together, as bands of one field, in groups of up to 32: each comes out, bit for bit,
/// as alone.
#[test]
fn bands_of_any_number_come_out_as_alone() {
    let scene = room(2);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let elements = Elements::new(&scene, &mesh, 0.2);
    let n = elements.len();
    let area = (0..n as u32).map(|e| elements.area(&mesh, e)).collect();
    let exposure = Exposure::new(&tracer, &mesh, &elements, &()).unwrap();
    let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    let ids = IdSpace { elements: &elements, sky: SkyPatches::new(&Sky::default(), DVec3::Y) };
    let mut table = HitTable::new(area, &ids);
    table.extend(&tracer, (&ids, &[]), &receivers, RAYS, &()).unwrap();
    let light = |i: usize, band: usize| ((7 * i + 13 * band) % 97) as f64 / 31.0;
    let alone: Vec<Vec<f64>> = (0..70)
        .map(|band| {
            let (b, mut h): (Vec<f64>, _) = ((0..n).map(|i| light(i, band)).collect(), vec![0.0; n]);
            table.apply(&b, &mut h, 1).unwrap();
            h
        })
        .collect();
    assert!(alone[0].iter().all(|h| *h > 0.0) && alone[0] != alone[1]);
    for bands in (1..=34).chain([64, 70]) {
        let b: Vec<f64> = (0..n * bands).map(|k| light(k / bands, k % bands)).collect();
        let mut h = vec![0.0; n * bands];
        table.apply(&b, &mut h, bands).unwrap();
        for (k, h) in h.iter().enumerate() {
            assert_eq!(h.to_bits(), alone[k % bands][k / bands].to_bits(), "{bands} bands, number {k}");
        }
    }
}

/// Catalogue 44: matrices grow as N², which is what tables are there to avoid: factors that are stored, where all pairs that
/// face each other may see each other. To 10³ elements; 10⁵ would take 120 GB.
#[test]
fn catalogue_44_matrices_grow_with_the_square_of_the_elements() {
    let scene = room(1);
    let mesh = Mesh::new(&scene);
    let stored = |size: f64| {
        let elements = Elements::new(&scene, &mesh, size);
        let enclosure = Enclosure::of_elements(&mesh, &elements).unwrap();
        let method: FormFactorMethod = "disc".parse().unwrap();
        let factors = FormFactors::new(method, &enclosure, &FormFactorOptions::default(), &()).unwrap();
        let pairs: usize = (0..factors.len()).map(|i| factors.row(i).count()).sum();
        (elements.len() as f64, pairs as f64)
    };
    let points = [0.5, 0.25, 0.125].map(stored);
    let grown = exponent(&points);
    println!("exponent: stored factors {grown:.4} of {points:?}");
    assert!((grown - 2.0).abs() < 0.1, "{grown}");
}

/// The engine's stages, as they follow each other.
const STAGES: [&str; 6] = ["mesh", "tree", "exposure", "direct light", "rows", "solve"];

/// What it takes from its triangles to its light.
struct Whole {
    elements: f64,
    /// Seconds by stage.
    seconds: [f64; STAGES.len()],
    /// Most memory that the process held until then, bytes; none where the system does not tell.
    peak: Option<f64>,
}

/// The room with a lamp in it and a triangle to each element.
fn whole(cut: usize) -> Whole {
    let mut scene = room(cut);
    scene.materials.push(Material { emissive: [1000.0; 3], ..Material::default() });
    let p = |x: f64, z: f64| DVec3::new(x, 0.99, z);
    scene.add_quad("lamp", 1, [p(0.4, 0.4), p(0.6, 0.4), p(0.6, 0.6), p(0.4, 0.6)]);
    let mut clock = Instant::now();
    let mut seconds = [0.0; STAGES.len()];
    let mut ends = |stage: usize| {
        seconds[stage] = clock.elapsed().as_secs_f64();
        clock = Instant::now();
    };

    let mesh = Mesh::new(&scene);
    let elements = Elements::new(&scene, &mesh, 1.0);
    ends(0);
    let tracer = Tracer::new(&scene, &mesh);
    ends(1);
    let n = elements.len();
    let area: Vec<f64> = (0..n as u32).map(|e| elements.area(&mesh, e)).collect();
    let exposure = Exposure::new(&tracer, &mesh, &elements, &()).unwrap();
    let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    ends(2);
    let exitance: Vec<Bands> = (0..n as u32).map(|e| elements.optics(&scene, &mesh, e).1).collect();
    let luminaires = Luminaires::new(&tracer, &elements, &area, &exitance);
    assert_eq!(luminaires.lights.len(), 1, "the lamp is a light of its own");
    let columns = luminaires.columns(&tracer, &receivers, &Shadowing { places: 2, rays: 8 }, &()).unwrap();
    ends(3);
    let ids = IdSpace { elements: &elements, sky: SkyPatches::new(&Sky::default(), DVec3::Y) };
    let mut table = HitTable::new(area, &ids);
    table.extend(&tracer, (&ids, &[]), &receivers, RAYS, &()).unwrap();
    ends(4);
    let response = DiffuseResponse { reflectance: vec![0.7; 3 * n], bands: 3, reciprocal_area: None };
    let e: Vec<f64> = (0..n).flat_map(|i| columns.mean(i)).map(|direct| 0.7 * f64::from(direct)).collect();
    let mut b = e.clone();
    let params = Params { tolerance: 1e-4, ..Params::default() };
    solve_operator(Solver::DeflatedJacobi, &table, &response, &e, &mut b, &params, |_, _| Go::On).unwrap();
    ends(5);
    Whole { elements: n as f64, seconds, peak: peak_memory() }
}

/// Most memory that the process has held, bytes; none where the system does not tell.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024.0 * line.trim().strip_suffix(" kB")?.parse::<f64>().ok()?)
}

/// Catalogue 44 by the clock, to 10⁶ elements, from triangles to light: for an idle machine, in release. What is more than 1 is the
/// depth of the tree and memory that caches do not hold.
#[test]
#[ignore = "takes a minute in release, and the clock is only worth something on an idle machine"]
fn catalogue_44_time_to_a_million_elements() {
    let before = peak_memory();
    whole(7); // wakes the threads
    let wholes: Vec<Whole> = [7, 21, 65, 204].into_iter().map(whole).collect();
    let fit = |of: &dyn Fn(&Whole) -> f64| exponent(&wholes.iter().map(|w| (w.elements, of(w))).collect::<Vec<_>>());
    let total = |w: &Whole| w.seconds.iter().sum::<f64>();
    println!("{:>16}{}       all  peak, MB", "elements", STAGES.map(|stage| format!("{stage:>14}")).concat());
    for w in &wholes {
        let seconds = w.seconds.map(|s| format!("{s:>14.4}")).concat();
        println!("{:>16}{seconds}{:>10.3}{:>10.1}", w.elements, total(w), 1e-6 * w.peak.unwrap_or(f64::NAN));
    }
    let stages: [String; STAGES.len()] = std::array::from_fn(|k| format!("{:>14.2}", fit(&|w| w.seconds[k])));
    let time = fit(&total);
    println!("{:>16}{}{time:>10.2}", "exponent", stages.concat());
    assert!(wholes[3].elements > 0.99e6 && time < 1.1, "{time}");
    // From ten thousand elements on, where they and not the program fill the memory.
    if let (Some(before), Some(..)) = (before, wholes[3].peak) {
        let points = wholes[1..].iter().map(|w| (w.elements, w.peak.unwrap_or(f64::NAN) - before));
        let memory = exponent(&points.collect::<Vec<_>>());
        println!("exponent of memory {memory:.2}");
        assert!(memory < 1.1, "{memory}");
    }
}
