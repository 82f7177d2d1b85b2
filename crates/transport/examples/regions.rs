//! Regions of office buildings, found without help: how many, what they cost beside the partition by hand, and in what
//! time; and a plan of the lowest floor as a picture.
//!
//! `cargo run --release -p radiosity-transport --example regions -- out/regions.svg`

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

#[path = "../tests/rooms/building.rs"]
mod building;

use building::{Building, Plan};
use glam::DVec3;
use radiosity_transport::{RegionOptions, Regions, regions};
use std::fmt::Write;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("walls  rooms  facets  regions  patches  seconds  (sum p)^2  sum (p+q)^2  by hand  ratio");
    for thickness in [0.2, 0.0] {
        for rooms in [1, 4, 20, 100] {
            let building = Building::new(Plan::of_rooms(rooms, thickness, 0.5));
            let start = Instant::now();
            let found = regions(&building.enclosure, &RegionOptions::default());
            let seconds = start.elapsed().as_secs_f64();
            let facets = building.enclosure.facets.len();
            println!(
                "{thickness:5} {rooms:6} {facets:7} {:8} {:8} {seconds:8.3} {:10.3e} {:12.3e} {:8.2e} {:6.3}",
                found.len(),
                found.patches.len(),
                (facets as f64).powi(2),
                found.cost(),
                building.cost_by_hand(),
                found.cost() / building.cost_by_hand()
            );
            if let (20, Some(path)) = (rooms, std::env::args().nth(1).filter(|_| thickness > 0.0)) {
                std::fs::write(path, plan(&found))?;
            }
        }
    }
    Ok(())
}

/// The plan of what reaches below 2 m, seen from above: facets that look up filled with their region's colour, the
/// others and the boundary patches (black) as lines.
fn plan(found: &Regions) -> String {
    let mut svg = String::from("<svg xmlns='http://www.w3.org/2000/svg' viewBox='-0.3 -10.7 26.5 11' width='1325'>\n");
    let low = |corners: &[DVec3]| corners.iter().map(|c| c.z).fold(f64::INFINITY, f64::min) < 2.0;
    let points = |corners: &[DVec3]| {
        corners.iter().fold(String::new(), |mut all, c| {
            let _ = write!(all, "{:.3},{:.3} ", c.x, -c.y);
            all
        })
    };
    for (piece, region) in found.pieces.iter().zip(&found.region_of) {
        if low(piece.corners()) && piece.normal().z > -0.5 {
            // The golden angle keeps the colours of neighbours apart.
            let hue = f64::from(*region) * 137.508 % 360.0;
            let style = match piece.normal().z > 0.5 {
                true => format!("fill='hsl({hue:.0},60%,75%)' stroke='white' stroke-width='0.015'"),
                false => format!("fill='none' stroke='hsl({hue:.0},60%,35%)' stroke-width='0.05'"),
            };
            let _ = writeln!(svg, "<polygon points='{}' {style}/>", points(piece.corners()));
        }
    }
    for patch in found.patches.iter().filter(|patch| low(patch.corners())) {
        let style = "fill='none' stroke='black' stroke-width='0.08'";
        let _ = writeln!(svg, "<polygon points='{}' {style}/>", points(patch.corners()));
    }
    svg + "</svg>\n"
}
