//! What a row costs on one core: the stages of a solve one by one, in a box like Cornell's, made here: open front, lamp
//! in the ceiling, two turned blocks, some 11,000 elements.
//!
//! Times are per element for exposure and columns, per ray for rows, and per entry of the table and band for the sweep
//! that the solver repeats.

use criterion::{BatchSize, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use radiosity_scene::{Bands, Elements, Material, Mesh, Scene, Sky, SkyPatches};
use radiosity_solve::Transport;
use radiosity_trace::Tracer;
use radiosity_transport::{ElementReceivers, Exposure, HitTable, IdSpace, Luminaires, Shadowing};

/// M: rays per element, as the library begins with.
const RAYS: usize = 64;

/// A box with four corners on the floor, counter-clockwise from above; its faces look outwards.
fn block(scene: &mut Scene, centre: [f64; 2], size: DVec3, turn: f64) {
    let corner = |k: usize, y: f64| {
        let [x, z] = [[-0.5, 0.5, 0.5, -0.5][k % 4] * size.x, [0.5, 0.5, -0.5, -0.5][k % 4] * size.z];
        let (sine, cosine) = turn.sin_cos();
        DVec3::new(centre[0] + cosine * x + sine * z, y, centre[1] - sine * x + cosine * z)
    };
    scene.add_quad("block", 0, [0, 1, 2, 3].map(|k| corner(k, size.y)));
    for k in 0..4 {
        scene.add_quad("block", 0, [corner(k, 0.0), corner(k + 1, 0.0), corner(k + 1, size.y), corner(k, size.y)]);
    }
}

/// A unit cube without its front, seen from inside.
fn cornell_like() -> Scene {
    let grey = Material { base_color: [0.7, 0.7, 0.7, 1.0], ..Material::default() };
    let lamp = Material { emissive: [10_000.0; 3], ..grey.clone() };
    let mut scene = Scene { materials: vec![grey, lamp], ..Scene::default() };
    let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    for (name, corners) in [
        ("floor", [p(0., 0., 0.), p(0., 0., 1.), p(1., 0., 1.), p(1., 0., 0.)]),
        ("ceiling", [p(0., 1., 0.), p(1., 1., 0.), p(1., 1., 1.), p(0., 1., 1.)]),
        ("back", [p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.)]),
        ("left", [p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 1.), p(0., 0., 1.)]),
        ("right", [p(1., 0., 0.), p(1., 0., 1.), p(1., 1., 1.), p(1., 1., 0.)]),
    ] {
        scene.add_quad(name, 0, corners);
    }
    scene.add_quad("lamp", 1, [p(0.4, 0.99, 0.4), p(0.6, 0.99, 0.4), p(0.6, 0.99, 0.6), p(0.4, 0.99, 0.6)]);
    block(&mut scene, [0.67, 0.67], p(0.3, 0.3, 0.3), 0.3);
    block(&mut scene, [0.33, 0.35], p(0.3, 0.6, 0.3), -0.3);
    scene
}

fn stages(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nobody made threads before");
    let scene = cornell_like();
    let mesh = Mesh::new(&scene);
    let tracer = Tracer::new(&scene, &mesh);
    let elements = Elements::new(&scene, &mesh, 0.05);
    let n = elements.len();
    let area: Vec<f64> = (0..n as u32).map(|e| elements.area(&mesh, e)).collect();
    let exitance: Vec<Bands> = (0..n as u32).map(|e| elements.optics(&scene, &mesh, e).1).collect();
    let exposure = Exposure::new(&tracer, &mesh, &elements, &()).unwrap();
    let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
    let ids = IdSpace { elements: &elements, sky: SkyPatches::new(&Sky::default(), DVec3::Y) };
    let luminaires = Luminaires::new(&tracer, &elements, &area, &exitance);
    assert_eq!(luminaires.lights.len(), 1, "the lamp is a light of its own");

    let mut group = c.benchmark_group(format!("box of {n} elements"));
    group.sample_size(10).sampling_mode(SamplingMode::Flat).throughput(Throughput::Elements(n as u64));
    group.bench_function("exposure", |b| b.iter(|| Exposure::new(&tracer, &mesh, &elements, &())));
    let shadowing = Shadowing { places: 8, rays: 8 };
    group.bench_function("direct column, 8 x 8 shadow rays", |b| {
        b.iter(|| luminaires.columns(&tracer, &receivers, &shadowing, &()));
    });

    group.throughput(Throughput::Elements((n * RAYS) as u64));
    let empty = || HitTable::new(area.clone(), &ids);
    group.bench_function(format!("rows, {RAYS} rays"), |b| {
        let trace = |mut table: HitTable| table.extend(&tracer, (&ids, &[]), &receivers, RAYS, &()).map(|()| table);
        b.iter_batched(empty, trace, BatchSize::PerIteration);
    });
    for (room, place) in [(usize::MAX, "table"), (0, "table in a file")] {
        let mut table = empty().within(room, std::env::temp_dir());
        table.extend(&tracer, (&ids, &[]), &receivers, RAYS, &()).unwrap();
        for bands in [3, 8, 32] {
            let radiosity: Vec<f64> = (0..bands * n).map(|i| (i % 17) as f64).collect();
            let mut irradiance = vec![0.0; bands * n];
            group.throughput(Throughput::Elements((n * RAYS * bands) as u64));
            group.bench_function(format!("sweep over the {place}, {bands} bands"), |b| {
                b.iter(|| table.apply(&radiosity, &mut irradiance, bands).unwrap());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
