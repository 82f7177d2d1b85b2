//! View factors of a room of 5 × 4 × 3 m with two boxes that hang in it, by number of patches: time, closure, choices.
//!
//! `cargo run --release -p radiosity-transport --example obstructed_room -- 800 3200`
//!
//! BALL=24 hangs a ball of 24 segments into it, of triangles as a file with six digits has them; ACCURACY and CLEAR are those of
//! factors, REPAIR makes rows sum to one.

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};
use radiosity_transport::view_factors::{ViewFactorOptions, view_factors};
use std::f64::consts::{PI, TAU};
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

/// Adds a ball about `centre`, m, of triangles between half as many rings as it has segments.
fn add_ball(enclosure: &mut Enclosure, centre: DVec3, radius: f64, segments: usize) {
    let rings = segments / 2;
    let point = |ring: usize, segment: usize| {
        let (down, about) = (PI * ring as f64 / rings as f64, TAU * (segment % segments) as f64 / segments as f64);
        let place = centre + radius * DVec3::new(down.sin() * about.cos(), down.sin() * about.sin(), down.cos());
        (1e6 * place).round() / 1e6
    };
    for (k, i) in (0..rings).flat_map(|k| (0..segments).map(move |i| (k, i))) {
        let [a, b, c, d] = [point(k, i), point(k + 1, i), point(k + 1, i + 1), point(k, i + 1)];
        // At the poles one of the two has no area.
        for facet in [[a, b, c], [a, c, d]].into_iter().filter_map(|corners| Facet::new(corners.to_vec()).ok()) {
            enclosure.add(format!("{}", enclosure.facets.len()), facet);
        }
    }
}

fn room(patches: usize, ball: usize) -> Enclosure {
    let mut enclosure = Enclosure { is_closed: true, ..Enclosure::default() };
    let size = (103.0 / patches as f64).sqrt();
    add_box(&mut enclosure, DVec3::ZERO, DVec3::new(5.0, 4.0, 3.0), size, true);
    add_box(&mut enclosure, DVec3::new(1.0, 1.0, 0.4), DVec3::new(2.2, 1.8, 1.4), size, false);
    add_box(&mut enclosure, DVec3::new(3.2, 2.2, 0.3), DVec3::new(3.9, 3.0, 2.1), size, false);
    if ball > 0 {
        add_ball(&mut enclosure, DVec3::new(2.5, 2.0, 2.2), 0.3, ball);
    }
    enclosure
}

fn main() {
    let sizes: Vec<f64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let asked = |name: &str, usual: f64| std::env::var(name).ok().and_then(|a| a.parse().ok()).unwrap_or(usual);
    let (accuracy, clear_accuracy) = (asked("ACCURACY", 1e-5), asked("CLEAR", 1e-9));
    for patches in sizes {
        let enclosure = room(patches as usize, asked("BALL", 0.0) as usize);
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
