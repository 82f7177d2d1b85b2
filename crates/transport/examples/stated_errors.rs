//! Do the stated errors of partly hidden view factors hold? Factors as exact as asked against those a fiftieth as far off: how
//! many are off by more than stated, and by how many times as much at most.
//!
//! `cargo run --release -p radiosity-transport --example stated_errors`

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use glam::{DMat3, DVec3};
use radiosity_scene::{Enclosure, Facet};
use radiosity_trace::sampling::Random;
use radiosity_transport::view_factors::{ViewFactorOptions, view_factors};

/// The six sides of a turned box, each cut into n × n patches, active inwards or outwards.
fn add_box(enclosure: &mut Enclosure, (low, size): (DVec3, DVec3), turn: f64, n: usize, inwards: bool) {
    let middle = low + 0.5 * size;
    let turned = DMat3::from_rotation_z(turn);
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (side, i, j) in (0..2).flat_map(|s| (0..n).flat_map(move |i| (0..n).map(move |j| (s, i, j)))) {
            let at = |i: usize, j: usize| {
                let mut p = DVec3::splat(-0.5);
                p[axis] += f64::from(side as u8);
                (p[u], p[v]) = (p[u] + i as f64 / n as f64, p[v] + j as f64 / n as f64);
                middle + turned * (p * size)
            };
            let corners = vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if let Ok(facet) = Facet::new(corners) {
                let is_turned = (side == 1) == inwards;
                enclosure.add("", if is_turned { facet.flipped() } else { facet });
            }
        }
    }
}

/// A room of 5 × 4 × 3 m with a table, two stools, a cupboard and a lamp, some of them turned.
fn furnished() -> Enclosure {
    let mut room = Enclosure { is_closed: true, ..Enclosure::default() };
    let p = DVec3::new;
    add_box(&mut room, (DVec3::ZERO, p(5.0, 4.0, 3.0)), 0.0, 6, true);
    add_box(&mut room, (p(1.5, 1.2, 0.7), p(1.6, 0.9, 0.05)), 0.2, 2, false);
    for [x, y] in [[1.6, 1.2], [2.9, 1.45], [1.5, 1.85], [2.8, 2.1]] {
        add_box(&mut room, (p(x, y, 0.001), p(0.06, 0.06, 0.69)), 0.2, 1, false);
    }
    add_box(&mut room, (p(1.1, 2.5, 0.1), p(0.4, 0.4, 0.35)), 0.7, 2, false);
    add_box(&mut room, (p(3.4, 0.8, 0.1), p(0.4, 0.4, 0.35)), -0.4, 2, false);
    add_box(&mut room, (p(4.2, 1.0, 0.1), p(0.6, 2.0, 1.8)), 0.0, 3, false);
    add_box(&mut room, (p(2.2, 1.5, 2.2), p(0.3, 0.3, 0.3)), 0.5, 1, false);
    room
}

/// Six sheets that stand at random and go through one another, active on both sides.
fn sheets(random: &mut Random) -> Enclosure {
    let mut scene = Enclosure::default();
    for k in 0..6 {
        let mut vector = |size: f64| DVec3::from_array(std::array::from_fn(|_| size * random.next_unit()));
        let centre = vector(1.0);
        let size = 0.1 + 0.7 * vector(1.0).x.powi(2);
        let [mut u, mut v] = [(); 2].map(|()| vector(2.0 * size) - DVec3::splat(size));
        if k % 2 == 0 {
            (u[k / 2], v[k / 2]) = (0.0, 0.0);
        }
        if let Ok(sheet) = Facet::new(vec![centre - u - v, centre + u - v, centre + u + v, centre - u + v]) {
            scene.add("", sheet.clone());
            scene.add("", sheet.flipped());
        }
    }
    scene
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut random = Random::new(11);
    let sheets: Vec<Enclosure> = (0..100).map(|_| sheets(&mut random)).collect();
    for (name, scenes, accuracies) in
        [("random sheets", &sheets[..], [1e-2, 1e-3]), ("a furnished room", &[furnished()][..], [1e-3, 1e-4])]
    {
        for accuracy in accuracies {
            let (mut all, mut missed, mut worst, mut tenfold) = (0, 0, 0.0f64, 0);
            for scene in scenes {
                let solve = |accuracy: f64| {
                    let options = ViewFactorOptions { accuracy, ..ViewFactorOptions::default() };
                    view_factors(scene, &options, &())
                };
                let (found, truth) = (solve(accuracy)?, solve(0.02 * accuracy)?);
                for (i, j, value, error) in found.entries().filter(|(.., error)| *error > 1e-9) {
                    let area = found.areas()[i];
                    let truth = truth.factor(i, j);
                    let off = ((value - truth.value * area).abs() - truth.error * area).max(0.0);
                    all += 1;
                    missed += usize::from(off > error);
                    tenfold += usize::from(10.0 * off < error);
                    worst = worst.max(off / error);
                }
            }
            println!(
                "{name}, {accuracy:e} asked: {missed} of {all} off by more than stated, at most {worst:.1} times; {tenfold} by \
                 less than a tenth"
            );
        }
    }
    Ok(())
}
