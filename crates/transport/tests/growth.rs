//! How work and memory grow with the elements (catalogue 44): exponents of lines through logarithms, from counts, which no other
//! work of the machine changes; by the clock in a test of its own, which is ignored.

#![expect(clippy::print_stdout, reason = "the exponents are what one runs this for")]

use glam::DVec3;
use radiosity_scene::{Elements, Enclosure, Material, Mesh, Scene, Sky, SkyPatches};
use radiosity_solve::{DiffuseResponse, Go, Params, Solver, solve_operator};
use radiosity_trace::Tracer;
use radiosity_transport::{
    ElementReceivers, Exposure, FormFactorMethod, FormFactorOptions, FormFactors, HitTable, IdSpace,
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
    /// Seconds for exposure and rows, and for the solve.
    seconds: [f64; 2],
}

/// Rows and a solve of the room with elements of a width.
fn cost(size: f64) -> Cost {
    let scene = room(4);
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let elements = Elements::new(&scene, &mesh, size);
    let n = elements.len();
    let begun = Instant::now();
    let area: Vec<f64> = (0..n as u32).map(|e| elements.area(&mesh, e)).collect();
    let exposure = Exposure::new(&tracer, &mesh, &elements, &()).unwrap();
    let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    let ids = IdSpace { elements: &elements, sky: SkyPatches::new(&Sky::default(), DVec3::Y) };
    let mut table = HitTable::new(area, &ids);
    table.extend(&tracer, (&ids, &[]), &receivers, RAYS, &()).unwrap();
    let rows = begun.elapsed().as_secs_f64();
    let rays: usize = (0..n).map(|i| table.row_ids(i).count()).sum();

    // The ceiling gives off light.
    let e: Vec<f64> = (0..n as u32).map(|e| f64::from(elements.normal(&mesh, e).y < -0.9)).collect();
    let response = DiffuseResponse { reflectance: vec![0.7; n], bands: 1, reciprocal_area: None };
    let params = Params { tolerance: 1e-4, ..Params::default() };
    // The first run wakes the threads.
    let mut b = e.clone();
    let _ = solve_operator(Solver::DeflatedJacobi, &table, &response, &e, &mut b, &params, |_, _| Go::On);
    b.clone_from(&e);
    let begun = Instant::now();
    let info = solve_operator(Solver::DeflatedJacobi, &table, &response, &e, &mut b, &params, |_, _| Go::On).unwrap();
    let seconds = [rows, begun.elapsed().as_secs_f64()];
    Cost { elements: n as f64, rays: rays as f64, read: rays as f64 * info.work, seconds }
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

/// Catalogue 44 by the clock, to 10⁶ elements: for an idle machine, in release. What is more than 1 is the depth of the tree
/// and memory that caches do not hold.
#[test]
#[ignore = "takes a minute in release, and the clock is only worth something on an idle machine"]
fn catalogue_44_time_to_a_million_elements() {
    let costs: Vec<Cost> = WIDTHS.into_iter().chain([1.0 / 256.0]).map(cost).collect();
    for cost in &costs {
        let [rows, solve] = cost.seconds;
        let megabytes = 4e-6 * cost.rays;
        println!("{:>8} elements: rows {rows:.3} s, solve {solve:.3} s, table {megabytes:.1} MB", cost.elements);
    }
    let [rows, solve] = [0, 1].map(|k| fitted(&costs, |cost| cost.seconds[k]));
    let memory = fitted(&costs, |cost| cost.rays);
    println!("exponents: rows {rows:.2}, solve {solve:.2}, memory {memory:.3}");
    assert!(costs[3].elements > 0.9e6 && rows < 1.3 && solve < 1.4 && (memory - 1.0).abs() < 1e-3);
}
