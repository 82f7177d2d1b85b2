//! View factors of a city block: boxes of different heights on a ground, some 22,000 facets, most of which never see
//! each other. Time, memory and the pairs that are stored.
//!
//! `cargo run --release -p radiosity-transport --example city_block -- 12`

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};
use radiosity_transport::view_factors::{ViewFactorOptions, view_factors};
use std::time::Instant;

/// A rectangle at `origin` in nu × nv facets, active along u × v.
fn add_rectangle(enclosure: &mut Enclosure, origin: DVec3, [u, v]: [DVec3; 2], [nu, nv]: [usize; 2]) {
    for k in 0..nu * nv {
        let at = |i: usize, j: usize| origin + u * (i as f64 / nu as f64) + v * (j as f64 / nv as f64);
        let (i, j) = (k % nu, k / nu);
        if let Ok(facet) = Facet::new(vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]) {
            enclosure.add("", facet);
        }
    }
}

/// n × n houses 12 m wide, 20 m apart, 9 to 36 m high, in facets about 3 m wide.
fn city(n: usize) -> Enclosure {
    let (pitch, width, facet) = (20.0, 12.0, 3.0);
    let mut city = Enclosure::default();
    for k in 0..n * n {
        let (i, j) = (k % n, k / n);
        let corner = DVec3::new(pitch * i as f64, pitch * j as f64, 0.0);
        let height = facet * (3 + (7 * i + 11 * j + i * j) % 10) as f64;
        let (x, y, z) = (DVec3::X * width, DVec3::Y * width, DVec3::Z * height);
        let (along, up) = ((width / facet) as usize, (height / facet) as usize);
        add_rectangle(&mut city, corner, [x, z], [along, up]);
        add_rectangle(&mut city, corner + x, [y, z], [along, up]);
        add_rectangle(&mut city, corner + x + y, [-x, z], [along, up]);
        add_rectangle(&mut city, corner + y, [-y, z], [along, up]);
        add_rectangle(&mut city, corner + z, [x, y], [along, along]);
        // The street around the house: beside it and behind it.
        let gap = DVec3::X * (pitch - width);
        add_rectangle(&mut city, corner + x, [gap, DVec3::Y * width], [3, along]);
        add_rectangle(&mut city, corner + y, [DVec3::X * pitch, DVec3::Y * (pitch - width)], [6, 3]);
    }
    city
}

fn main() {
    let n = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(12);
    let city = city(n);
    let start = Instant::now();
    let Ok(factors) = view_factors(&city, &ViewFactorOptions::default(), &()) else { return };
    let seconds = start.elapsed().as_secs_f64();
    println!("{} facets: {seconds:.1} s, {} pairs stored", city.facets.len(), factors.stored());
    println!("{:?}", factors.choices);
    // Peak of the process, where the system tells it.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    println!("{}", status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or(""));
}
