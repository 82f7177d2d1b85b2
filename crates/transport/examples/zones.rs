//! A furnace of hot gas by the zonal method: what each wall takes, how hot the brick of the roof becomes, and where the
//! heat comes from.
//!
//! `cargo run --release -p radiosity-transport --example zones -- 1e-3`

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use glam::DVec3;
use radiosity_scene::Enclosure;
use radiosity_solve::{Go, Params, Solver, solve};
use radiosity_transport::zones::Cell;
use radiosity_transport::{Zone, ZoneOptions, zone_exchange};

/// The constant of Stefan and Boltzmann, W/(m² K⁴).
const SIGMA: f64 = 5.670_374_419e-8;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let accuracy: f64 = std::env::args().nth(1).map_or(Ok(1e-3), |x| x.parse())?;

    // Six metres by two by two, in six slices along x; soot scatters a little, and the flame stands in the second.
    let size = DVec3::new(6.0, 2.0, 2.0);
    let mut furnace = Enclosure { is_closed: true, ..Enclosure::default() };
    let names = ["burner wall", "end wall", "left wall", "right wall", "load", "roof"];
    for (face, name) in Cell::cuboid(DVec3::ZERO, size)?.faces().iter().zip(names) {
        furnace.add(name, face.flipped());
    }
    let slice = |k: usize| -> Result<Zone, Box<dyn std::error::Error>> {
        let low = DVec3::new(k as f64, 0.0, 0.0);
        let cell = Cell::cuboid(low, DVec3::new(low.x + 1.0, size.y, size.z))?;
        let is_flame = k == 1;
        Ok(Zone { cell, absorption: if is_flame { 0.5 } else { 0.2 }, scattering: 0.05 })
    };
    let zones: Vec<Zone> = (0..6).map(slice).collect::<Result<_, _>>()?;
    let mut exchange = zone_exchange(&furnace, &zones, &ZoneOptions { accuracy, ..ZoneOptions::default() }, &())?;
    println!(
        "{} lines, errors up to {:.1e}, rows off by {:.1e}",
        exchange.lines,
        exchange.reached(),
        exchange.closure().largest
    );
    exchange.repair();

    // Steel at 900 K below, water behind the walls, brick above: it gives back all that it gets, as if white.
    let emittances = [0.8, 0.8, 0.8, 0.8, 0.9, 0.0];
    let kelvin = [600.0, 600.0, 600.0, 600.0, 900.0, 0.0];
    let gas_kelvin = [1500.0, 1900.0, 1700.0, 1550.0, 1450.0, 1400.0];
    let black = |kelvin: f64| SIGMA * kelvin.powi(4);
    let emitted: Vec<f64> = emittances.iter().zip(kelvin).map(|(e, t)| e * black(t)).collect();
    let e = exchange.emission(&emitted, &gas_kelvin.map(black));
    let response = exchange.response(&emittances.map(|emittance| 1.0 - emittance));
    let mut b = vec![0.0; e.len()];
    let params = Params { tolerance: 1e-10, ..Params::default() };
    solve(Solver::Cg, &exchange.transport()?, &response, &e, &mut b, &params, |_, _| Go::On)?;

    let (walls, gas) = exchange.net_loss(&b);
    for (name, loss) in names.iter().zip(&walls) {
        println!("{name:>12} takes {:8.1} kW", -1e-3 * loss);
    }
    for (k, loss) in gas.iter().enumerate() {
        println!("     slice {} gives {:8.1} kW", k + 1, 1e-3 * loss);
    }
    println!("roof at {:.0} K; balance {:.1e} of what the gas gives", (b[5] / SIGMA).powf(0.25), {
        (walls.iter().sum::<f64>() + gas.iter().sum::<f64>()) / gas.iter().sum::<f64>()
    });
    Ok(())
}
