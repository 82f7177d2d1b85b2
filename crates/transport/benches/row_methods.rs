//! What a row of form factors costs on one core, by each method: in a room of 600 facets with a block in its middle, where
//! cells matter, and in one of 86,400, where polygons do. A row predicts its errors, by four more glances of half the
//! resolution and by Lambert's integral over small and near facets. The directional row of the global cube does not: it is
//! one bare glance, what others quote for a hemicube. Single rows include what rows have in common, made anew for each.

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};
use radiosity_transport::row::{GlobalCube, Look, Repair, RowMethod};
use std::hint::black_box;

/// Faces of a unit cube, active inside, each cut into k × k, with a block in its middle that only hides.
fn room(k: usize) -> Enclosure {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut room = Enclosure { is_closed: true, ..Enclosure::default() };
    let faces = [[DVec3::ZERO, x, y], [z, y, x], [DVec3::ZERO, y, z], [x, z, y], [DVec3::ZERO, z, x], [y, x, z]];
    let rectangle = |corner: DVec3, u: DVec3, v: DVec3| {
        Facet::new(vec![corner, corner + u, corner + u + v, corner + v]).expect("a rectangle is a facet")
    };
    for [corner, u, v] in faces {
        for i in 0..k * k {
            let at = corner + u * ((i % k) as f64 / k as f64) + v * ((i / k) as f64 / k as f64);
            room.add("", rectangle(at, u / k as f64, v / k as f64));
        }
        room.obstructions.push(rectangle(DVec3::splat(0.4) + corner * 0.2, v * 0.2, u * 0.2));
    }
    room
}

fn rows(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nobody made threads before");
    for k in [10, 120] {
        let room = room(k);
        let n = room.facets.len();
        let mut group = c.benchmark_group(format!("row of {n}"));
        group.sample_size(10).sampling_mode(SamplingMode::Flat);
        for method in RowMethod::all() {
            let row = method.with(Look::default());
            group.bench_function(format!("{method}, 256"), |b| b.iter(|| black_box(row.row(n / 3, &room))));
        }
        let cube = GlobalCube::default();
        group.bench_function("global-cube, 256, directional", |b| {
            b.iter(|| black_box(cube.directional(n / 3, &room, 1)));
        });
        group.finish();
    }
    // All rows, with what they share made once.
    let room = room(4);
    let mut group = c.benchmark_group("all rows of 96");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for method in RowMethod::all() {
        for (name, repair) in [("plain", Repair::None), ("until 1e-2", Repair::UntilError(1e-2))] {
            let rows = method.with(Look { resolution: 64, repair, ..Look::default() });
            group.bench_function(format!("{method}, 64, {name}"), |b| b.iter(|| black_box(rows.rows(&room, &()))));
        }
    }
    group.finish();
}

criterion_group!(benches, rows);
criterion_main!(benches);
