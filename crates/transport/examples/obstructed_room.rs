//! View factors of a room of 5 × 4 × 3 m with two boxes that hang in it, by number of patches: time, closure, choices.
//!
//! `cargo run --release -p radiosity-transport --example obstructed_room -- 800 3200`

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};
use radiosity_transport::view_factors::{ViewFactorOptions, view_factors};
use std::time::Instant;

/// Adds the six sides of a box, each cut into patches about `size` wide, active inwards or outwards.
fn add_box(enclosure: &mut Enclosure, low: DVec3, high: DVec3, size: f64, inwards: bool) {
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let cells = |k: usize| ((high[k] - low[k]) / size).round().max(1.0) as usize;
        let (nu, nv) = (cells(u), cells(v));
        for (side, at) in [(false, low[axis]), (true, high[axis])] {
            for i in 0..nu {
                for j in 0..nv {
                    let point = |i: usize, j: usize| {
                        let mut p = DVec3::ZERO;
                        p[axis] = at;
                        p[u] = low[u] + (high[u] - low[u]) * i as f64 / nu as f64;
                        p[v] = low[v] + (high[v] - low[v]) * j as f64 / nv as f64;
                        p
                    };
                    let mut corners = vec![point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
                    // The order (u, v) is counter-clockwise about +axis.
                    if side == inwards {
                        corners.reverse();
                    }
                    if let Ok(facet) = Facet::new(corners) {
                        enclosure.add(format!("{}", enclosure.facets.len()), facet);
                    }
                }
            }
        }
    }
}

fn room(patches: usize) -> Enclosure {
    let mut enclosure = Enclosure { is_closed: true, ..Enclosure::default() };
    let size = (103.0 / patches as f64).sqrt();
    add_box(&mut enclosure, DVec3::ZERO, DVec3::new(5.0, 4.0, 3.0), size, true);
    add_box(&mut enclosure, DVec3::new(1.0, 1.0, 0.4), DVec3::new(2.2, 1.8, 1.4), size, false);
    add_box(&mut enclosure, DVec3::new(3.2, 2.2, 0.3), DVec3::new(3.9, 3.0, 2.1), size, false);
    enclosure
}

fn main() {
    let sizes: Vec<f64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let asked = |name: &str, usual: f64| std::env::var(name).ok().and_then(|a| a.parse().ok()).unwrap_or(usual);
    let (accuracy, clear_accuracy) = (asked("ACCURACY", 1e-5), asked("CLEAR", 1e-9));
    for patches in sizes {
        let enclosure = room(patches as usize);
        let start = Instant::now();
        let options = ViewFactorOptions { accuracy, clear_accuracy, ..ViewFactorOptions::default() };
        let Ok(mut factors) = view_factors(&enclosure, &options, &()) else { return };
        let seconds = start.elapsed().as_secs_f64();
        let closure = factors.closure();
        println!("{} patches: {seconds:.3} s, {closure:?}", enclosure.facets.len());
        println!("  {:?} of {}", factors.choices, factors.choices.total());
        if std::env::var_os("REPAIR").is_some() {
            println!("  {:?}", factors.repair());
        }
    }
}
