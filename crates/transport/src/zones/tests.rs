//! Zones against closed forms, laws and integrals by Gauss rules. A false alarm has the chance that is stated; seeds are fixed.

use super::*;
use crate::pair::Factor;
use glam::DVec3;
use radiosity_scene::Facet;
use radiosity_solve::{Go, Params, Solver, solve};
use std::f64::consts::PI;

fn zone(low: [f64; 3], high: [f64; 3], absorption: f64, scattering: f64) -> Zone {
    let [low, high] = [low, high].map(DVec3::from_array);
    Zone { cell: Cell::cuboid(low, high).unwrap(), absorption, scattering }
}

/// The faces of a box, looking inwards: −x, x, −y, y, −z, z.
fn room(low: [f64; 3], high: [f64; 3]) -> Enclosure {
    let mut room = Enclosure { is_closed: true, ..Enclosure::default() };
    zone(low, high, 0.0, 0.0).cell.faces().iter().for_each(|face| room.add("wall", face.flipped()));
    room
}

/// A box cut into n[0] × n[1] × n[2] zones.
fn grid(high: [f64; 3], n: [usize; 3], medium: impl Fn(usize) -> [f64; 2]) -> Vec<Zone> {
    let step: [f64; 3] = std::array::from_fn(|a| high[a] / n[a] as f64);
    let of = |k: usize| {
        let at = [k % n[0], k / n[0] % n[1], k / n[0] / n[1]];
        let [absorption, scattering] = medium(k);
        let corner = |o: usize| std::array::from_fn(|a| (at[a] + o) as f64 * step[a]);
        zone(corner(0), corner(1), absorption, scattering)
    };
    (0..n.iter().product()).map(of).collect()
}

fn exchange(enclosure: &Enclosure, zones: &[Zone], accuracy: f64) -> ZoneExchange {
    zone_exchange(enclosure, zones, &ZoneOptions { accuracy, vacuum: vacuum(), ..ZoneOptions::default() }, &()).unwrap()
}

/// Where something stands in the way, factors without medium as exact as by default would take most of the time.
fn vacuum() -> ViewFactorOptions {
    ViewFactorOptions { accuracy: 1e-4, ..ViewFactorOptions::default() }
}

/// ∫ over [0, 1]ⁿ by Gauss rules of 24 points: thirteen digits of what is smooth.
fn gauss<const N: usize>(f: impl Fn([f64; N]) -> f64) -> f64 {
    let rule = crate::pair::gauss::gauss(24);
    let n = rule.len();
    let point = |k: usize| {
        let at: [usize; N] = std::array::from_fn(|d| k / n.pow(d as u32) % n);
        at.iter().map(|i| rule[*i][1]).product::<f64>() * f(at.map(|i| rule[i][0]))
    };
    (0..n.pow(N as u32)).map(point).sum()
}

/// 1 − 2E₃(τ) = 2 ∫ μ (1 − e^(−τ/μ)) dμ, with μ = t⁴ so that the end is smooth.
fn slab(depth: f64) -> f64 {
    2.0 * gauss(|[t]: [f64; 1]| 4.0 * t.powi(7) * -(-depth / t.powi(4)).exp_m1())
}

/// 1 − (2/τ²)[1 − (1 + τ)e^−τ].
fn sphere(depth: f64) -> f64 {
    1.0 - 2.0 / (depth * depth) * (1.0 - (1.0 + depth) * (-depth).exp())
}

fn is_near(found: Factor, exact: f64, what: &str) {
    assert!((found.value - exact).abs() <= found.error, "{what}: {found:?} for {exact}");
}

/// Without medium, and with zones of nothing, exchange areas are the vacuum's, bit by bit; a trace of medium takes no
/// more than it can.
#[test]
fn catalogue_14_no_medium_is_vacuum() {
    let mut room = room([0.0; 3], [2.0, 1.0, 1.0]);
    let plate = [[1., 0.2, 0.], [1., 0.8, 0.], [1., 0.8, 0.5], [1., 0.2, 0.5]].map(DVec3::from_array);
    room.add("plate", Facet::new(plate.to_vec()).unwrap());
    room.add("other side", Facet::new(plate.into_iter().rev().collect()).unwrap());
    let vacuum = view_factors(&room, &vacuum(), &()).unwrap();
    let zones = |kappa: f64| grid([2.0, 1.0, 1.0], [2, 1, 1], |_| [kappa, 0.0]);
    for zones in [Vec::new(), zones(0.0)] {
        let found = exchange(&room, &zones, 1e-2);
        assert_eq!(found.factors().dense(), vacuum.dense());
        assert_eq!((found.lines, found.factors().len()), (0, 8));
        assert!(zones.is_empty() || found.surface_gas(0, 1) == Factor::default());
    }
    let kappa = 1e-6;
    let found = exchange(&room, &zones(kappa), 1e-2);
    for i in 0..8 {
        for j in 0..8 {
            let (with, without) =
                (found.surface_surface(i, j).value, room.facets[i].area() * vacuum.factor(i, j).value);
            assert!(with <= without && with >= without * (-kappa * 6f64.sqrt()).exp(), "{i} {j}: {with} {without}");
        }
    }
}

/// A square metre that looks into a layer of gas so wide that no line leaves it sideways: s g/A = 1 − 2E₃(κL). At every
/// accuracy asked, the error is within what is stated and what is asked (three standard errors; some thirty looks).
#[test]
fn catalogue_14_slab_emissivity() {
    let square = |z: f64, half: f64, up: bool| {
        let corners = [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]].map(DVec3::from_array);
        let facet = Facet::new(corners.to_vec()).unwrap();
        if up { facet } else { facet.flipped() }
    };
    assert!((slab(1.0) - 0.780_616_06).abs() < 1e-7, "{}", slab(1.0));
    let mut worst: f64 = 0.0;
    for depth in [0.05, 0.3, 1.0, 3.0] {
        let wide = 400.0;
        let mut slabs = Enclosure::default();
        slabs.add("patch", square(0.0, 0.5, true));
        slabs.add("ceiling", square(1.0, wide, false));
        let gas = zone([-wide, -wide, 0.0], [wide, wide, 1.0], depth, 0.0);
        for accuracy in [1e-1, 1e-2, 1e-3, 1e-4] {
            // Lines along the layer make its own share hard to find, which is not asked for here.
            let options = ZoneOptions { accuracy, lines: 1 << 19, ..ZoneOptions::default() };
            let found = zone_exchange(&slabs, std::slice::from_ref(&gas), &options, &()).unwrap();
            let emissivity = found.surface_gas(0, 0);
            is_near(emissivity, slab(depth), &format!("κL = {depth} at {accuracy}"));
            assert!(emissivity.error <= accuracy, "{emissivity:?} at {accuracy}");
            if accuracy == 1e-4 {
                worst = worst.max((emissivity.value - slab(depth)).abs());
            }
        }
    }
    assert!(worst < 3e-5, "{worst}");
}

/// A ball of gas in a black box: of what it emits, πD² ε reaches the walls, ε = 1 − (2/τ²)[1 − (1 + τ)e^−τ], and 2τ/3
/// where it is thin. A geodesic polyhedron of the same mean chord comes near that.
#[test]
fn catalogue_14_sphere_emissivity() {
    let room = room([-1.0; 3], [1.0; 3]);
    let mut worst: f64 = 0.0;
    for depth in [1e-3, 0.3, 1.0, 10.0] {
        let diameter = 1.5;
        let cell = Cell::ball(DVec3::new(0.1, -0.1, 0.0), 0.5 * diameter).unwrap();
        let gas = Zone { cell, absorption: depth / diameter, scattering: 0.0 };
        let found = exchange(&room, std::slice::from_ref(&gas), 1e-3);
        let ball = gas.cell.surface_area();
        let to_walls = (0..6).map(|wall| found.surface_gas(wall, 0));
        let sum =
            to_walls.fold(Factor::default(), |a, b| Factor { value: a.value + b.value, error: a.error + b.error });
        is_near(sum, ball * sphere(depth), &format!("τ = {depth}"));
        // What it keeps is a small difference where it is thin.
        if depth > 0.01 {
            is_near(found.gas_gas(0, 0), gas.exchange() - ball * sphere(depth), &format!("itself, τ = {depth}"));
        }
        worst = worst.max((sum.value / ball / sphere(depth) - 1.0).abs());
    }
    assert!(worst < 1e-3, "{worst}");

    // Corners of an icosahedron's edges halved, out on the sphere.
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for [a, b] in [[1.0, golden], [-1.0, golden], [1.0, -golden], [-1.0, -golden]] {
        corners.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]].map(|c| DVec3::from_array(c).normalize()));
    }
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1.2;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [corners[i], corners[j], corners[k]];
                if near(a, b) && near(b, c) && near(c, a) {
                    let [b, c] = if (b - a).cross(c - a).dot(a) > 0.0 { [b, c] } else { [c, b] };
                    let half = |p: DVec3, q: DVec3| (p + q).normalize();
                    let [ab, bc, ca] = [half(a, b), half(b, c), half(c, a)];
                    faces.extend([vec![a, ab, ca], vec![b, bc, ab], vec![c, ca, bc], vec![ab, bc, ca]]);
                }
            }
        }
    }
    assert_eq!(faces.len(), 80);
    let cell = Cell::polyhedron(faces).unwrap();
    let mut shell = Enclosure { is_closed: true, ..Enclosure::default() };
    cell.faces().iter().for_each(|face| shell.add("wall", face.flipped()));
    let gas = Zone { absorption: 1.0 / (1.5 * cell.mean_chord()), cell, scattering: 0.0 };
    let found = exchange(&shell, std::slice::from_ref(&gas), 5e-2);
    let emissivity = (0..80).map(|wall| found.surface_gas(wall, 0).value).sum::<f64>() / gas.cell.surface_area();
    assert!((emissivity - sphere(1.0)).abs() < 3e-3, "{emissivity} for {}", sphere(1.0));
}

/// Three cubes of gas in a row: opposite faces, a face and a cube, and two cubes, against integrals by Gauss rules, at
/// every accuracy asked.
#[test]
fn catalogue_14_exchange_areas_are_their_integrals() {
    let kappa = 0.7;
    let zones = grid([3.0, 1.0, 1.0], [3, 1, 1], |_| [0.5 * kappa, 0.5 * kappa]);
    let room = room([0.0; 3], [3.0, 1.0, 1.0]);
    // Differences of coordinates on both sides have triangular density.
    let across = |v: f64, w: f64| 4.0 * (1.0 - v) * (1.0 - w);
    let surfaces = gauss(|[v, w]: [f64; 2]| {
        let r = (9.0 + v * v + w * w).sqrt();
        across(v, w) * 9.0 * (-kappa * r).exp() / (PI * r.powi(4))
    });
    let surface_gas = gauss(|[x, v, w]: [f64; 3]| {
        let (x, r) = (1.0 + x, ((1.0 + x).powi(2) + v * v + w * w).sqrt());
        across(v, w) * kappa * x * (-kappa * r).exp() / (PI * r.powi(3))
    });
    let gas = gauss(|[x, v, w]: [f64; 3]| {
        let of = |x: f64| {
            let squared = x * x + v * v + w * w;
            (-kappa * squared.sqrt()).exp() / squared
        };
        across(v, w) * kappa * kappa / PI * (x * of(1.0 + x) + (1.0 - x) * of(2.0 + x))
    });
    for accuracy in [1e-1, 1e-2, 1e-3, 3e-4] {
        let found = exchange(&room, &zones, accuracy);
        assert!(found.reached() <= accuracy, "{} for {accuracy}", found.reached());
        let pairs = [
            (found.surface_surface(0, 1), surfaces),
            (found.surface_gas(0, 1), surface_gas),
            (found.gas_gas(0, 2), gas),
        ];
        for (value, exact) in pairs {
            is_near(value, exact, &format!("at {accuracy}"));
            assert!((value.value - exact).abs() <= accuracy, "{value:?} for {exact} at {accuracy}");
        }
    }
}

/// A cube in eight zones: stored once, so reciprocal; rows sum to A and 4κV within their errors, and exactly when repaired;
/// zones of one medium add up to the whole.
#[test]
fn catalogue_14_reciprocity_and_closure() {
    let room = room([0.0; 3], [1.0; 3]);
    let (parts, whole) = (grid([1.0; 3], [2, 2, 2], |_| [1.0, 0.5]), grid([1.0; 3], [1, 1, 1], |_| [1.0, 0.5]));
    let (mut parts, whole) = (exchange(&room, &parts, 1e-3), exchange(&room, &whole, 1e-3));
    for wall in 0..6 {
        let sum: f64 = (0..8).map(|zone| parts.surface_gas(wall, zone).value).sum();
        assert!((sum - whole.surface_gas(wall, 0).value).abs() < 1e-3, "{sum}");
    }
    let sum: f64 = (0..64).map(|k| parts.gas_gas(k / 8, k % 8).value).sum();
    assert!((sum - whole.gas_gas(0, 0).value).abs() < 1e-3 * 6.0, "{sum}");
    let (factors, sums) = (parts.factors(), parts.factors().areas().to_vec());
    for (i, j) in (0..14).flat_map(|i| (0..14).map(move |j| (i, j))) {
        let [there, back] = [(i, j), (j, i)].map(|(i, j)| sums[i] * factors.factor(i, j).value);
        assert!((there - back).abs() <= 4.0 * f64::EPSILON * there, "{i} {j}: {there} {back}");
    }

    let raw = parts.closure();
    assert!(raw.largest < 1e-3, "{raw:?}");
    let repair = parts.repair();
    assert!(repair.after.largest < 1e-12 && repair.largest_relative < 1.0, "{repair:?}");
    for (unknown, sum) in parts.factors().row_sums().into_iter().enumerate() {
        assert!((sum - 1.0).abs() < 1e-12, "{unknown}: {sum}");
    }
}

/// Gas and black walls of one temperature: nobody loses anything. Zones differ in all, and a beam stands among them.
#[test]
fn catalogue_14_isothermal_enclosure_is_at_rest() {
    let mut room = room([0.0; 3], [2.0, 1.0, 1.0]);
    let beam = Cell::cuboid(DVec3::new(0.9, 0.0, 0.4), DVec3::new(1.1, 1.0, 0.6)).unwrap();
    beam.faces().iter().filter(|f| f.normal().y.abs() < 0.5).for_each(|face| room.add("beam", face.clone()));
    let mut zones = vec![
        zone([0.0; 3], [0.9, 1.0, 1.0], 2.0, 0.0),
        zone([0.9, 0.0, 0.0], [1.1, 1.0, 0.4], 0.1, 3.0),
        zone([1.1, 0.0, 0.0], [2.0, 1.0, 1.0], 0.0, 0.0),
    ];
    zones.push(zone([0.9, 0.0, 0.6], [1.1, 1.0, 1.0], 0.3, 0.0));
    let mut found = exchange(&room, &zones, 1e-3);
    // The ends of the beam hide a part of the walls that they stand on: the room's own faces there see nothing.
    let hidden = 0.04;
    let raw = found.closure();
    let sums = found.factors().row_sums();
    assert!(sums.iter().enumerate().all(|(i, s)| (s - 1.0).abs() < 1e-3 || [2, 3].contains(&i)), "{raw:?} {sums:?}");
    assert!((sums[2] - (1.0 - hidden / 2.0)).abs() < 1e-3, "{sums:?}");
    found.repair();
    let temperature = 1.0;
    let facets = room.facets.len();
    let e = found.emission(&vec![temperature; facets], &vec![temperature; zones.len()]);
    let response = found.response(&vec![0.0; facets]);
    let mut b = vec![0.0; e.len()];
    let params = Params { tolerance: 1e-13, ..Params::default() };
    solve(Solver::Lu, &found.transport().unwrap(), &response, &e, &mut b, &params, |_, _| Go::On).unwrap();
    let (walls, gas) = found.net_loss(&b);
    for (k, loss) in walls.iter().enumerate().filter(|(k, _)| ![2, 3].contains(k)) {
        assert!(loss.abs() < 1e-9, "wall {k}: {loss}");
    }
    assert!(gas.iter().all(|loss| loss.abs() < 1e-9), "{gas:?}");
}

/// A medium that only scatters keeps nothing: walls absorb what one of them emits, in every solver alike.
#[test]
fn catalogue_14_scattering_conserves_energy() {
    let room = room([0.0; 3], [1.0; 3]);
    let zones = grid([1.0; 3], [2, 2, 1], |k| [0.0, 0.5 + k as f64]);
    let mut found = exchange(&room, &zones, 1e-3);
    let closure = found.closure().largest;
    let reflectances = [0.2, 0.5, 0.5, 0.8, 0.5, 0.3];
    let e = found.emission(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], &[7.0; 4]);
    assert!(e[6..].iter().all(|e| *e == 0.0));
    let params = Params { tolerance: 1e-12, max_steps: 10_000, ..Params::default() };
    for is_repaired in [false, true] {
        if is_repaired {
            found.repair();
        }
        let (transport, response) = (found.transport().unwrap(), found.response(&reflectances));
        let mut first: Option<Vec<f64>> = None;
        for solver in Solver::ALL.iter().filter(|solver| !solver.is_random()) {
            let mut b = vec![0.0; e.len()];
            solve(*solver, &transport, &response, &e, &mut b, &params, |_, _| Go::On).unwrap();
            let (walls, gas) = found.net_loss(&b);
            let off = walls.iter().sum::<f64>();
            // What scatters loses nothing: its equation says so. The rest is the closure.
            assert!(gas.iter().all(|loss| loss.abs() < 1e-10), "{solver}: {gas:?}");
            assert!(off.abs() < if is_repaired { 1e-10 } else { 10.0 * closure }, "{solver}: {off}");
            let first = first.get_or_insert_with(|| b.clone());
            assert!(first.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-9), "{solver}");
        }
    }
}

/// Radiative equilibrium of a grey layer between black plates: a medium that only scatters carries as much, and
/// q/(E₁ − E₂) is 0.5532 at κL = 1 (Heaslet and Warming 1965). Five layers are within 1 % of it, the rims included.
#[test]
fn catalogue_14_radiative_equilibrium_of_a_layer() {
    let (wide, layers) = (100.0, 5);
    let room = room([0.0; 3], [wide, wide, 1.0]);
    let zones = grid([wide, wide, 1.0], [1, 1, layers], |_| [0.0, 1.0]);
    let mut found = exchange(&room, &zones, 3e-3);
    found.repair();
    // The rims are white.
    let response = found.response(&[1.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    let e = found.emission(&[0.0, 0.0, 0.0, 0.0, 1.0, 0.0], &vec![0.0; layers]);
    let mut b = vec![0.0; e.len()];
    solve(Solver::Lu, &found.transport().unwrap(), &response, &e, &mut b, &Params::default(), |_, _| Go::On).unwrap();
    let (walls, _) = found.net_loss(&b);
    let q = walls[4] / (wide * wide);
    assert!((q / 0.5532 - 1.0).abs() < 1e-2, "{q}");
    assert!((walls[4] + walls[5]).abs() < 1e-6 * walls[4], "{walls:?}");
}

/// Total exchange areas by script-F: rows sum to ε, and to 1 − ω for zones; symmetric with A and 4κV.
#[test]
fn catalogue_14_total_exchange_areas() {
    let room = room([0.0; 3], [1.0; 3]);
    let zones = grid([1.0; 3], [1, 1, 2], |k| [0.5, k as f64]);
    let mut found = exchange(&room, &zones, 1e-3);
    found.repair();
    let emittances = [0.8, 0.3, 0.5, 0.5, 0.9, 0.1, 1.0, 1.0 / 3.0];
    let script = radiosity_solve::script_f(&found.factors().dense(), &emittances).unwrap();
    let sums = found.factors().areas();
    for i in 0..8 {
        assert!((script[8 * i..8 * i + 8].iter().sum::<f64>() - emittances[i]).abs() < 1e-12);
        for j in 0..8 {
            assert!((sums[i] * script[8 * i + j] - sums[j] * script[8 * j + i]).abs() < 1e-12);
        }
    }
}

/// Gas behind a wall is not there, and different gases take what theirs is: a line across three layers.
#[test]
fn walls_stop_the_exchange_of_gas() {
    let mut rooms = room([0.0; 3], [1.0; 3]);
    let other = room([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]);
    other.facets.into_iter().for_each(|facet| rooms.add("other", facet));
    let zones = grid([2.0, 1.0, 1.0], [2, 1, 1], |_| [1.0, 0.0]);
    let found = exchange(&rooms, &zones, 1e-2);
    assert_eq!(found.gas_gas(0, 1).value, 0.0);
    for wall in 0..6 {
        assert_eq!((found.surface_gas(wall, 1).value, found.surface_gas(6 + wall, 0).value), (0.0, 0.0));
    }
    assert!(found.closure().largest < 1e-2);
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let room = room([0.0; 3], [1.0; 3]);
    let zones = grid([1.0; 3], [2, 1, 2], |k| [0.5 * k as f64, 0.2]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| exchange(&room, &zones, 1e-2)).factors().dense()
    };
    assert_eq!(with(1), with(3));
}

/// All faults at once, by their types.
#[test]
fn zones_that_cannot_be_are_refused() {
    let mut room = room([0.0; 3], [1.0; 3]);
    let plate = [[0.5, 0., 0.], [0.5, 1., 0.], [0.5, 1., 0.7], [0.5, 0., 0.7]].map(DVec3::from_array);
    room.obstructions.push(Facet::new(plate.to_vec()).unwrap());
    let zones = [
        zone([0.0; 3], [0.5, 1.0, 1.0], -1.0, f64::INFINITY),
        zone([0.4, 0.0, 0.0], [0.6, 1.0, 1.0], 1.0, f64::NAN),
        zone([0.6, 0.0, 0.0], [1.5, 1.0, 1.0], 1.0, 0.0),
    ];
    let refused = zone_exchange(&room, &zones, &ZoneOptions::default(), &()).unwrap_err();
    let ZoneError::Zones(faults) = &refused else { panic!("{refused}") };
    assert_eq!(faults.len(), 6, "{refused}");
    assert_eq!(faults[0], ZoneFault::Coefficient { zone: 0, coefficient: "absorption", value: -1.0 });
    assert!(matches!(faults[1], ZoneFault::Coefficient { zone: 0, coefficient: "scattering", .. }));
    assert_eq!(faults[2], ZoneFault::Overlap { first: 0, second: 1 });
    assert!(matches!(faults[3], ZoneFault::Coefficient { zone: 1, value, .. } if value.is_nan()));
    assert_eq!(faults[4], ZoneFault::Obstructed { zone: 1, obstruction: 0 });
    assert_eq!(faults[5], ZoneFault::Cut { zone: 2, facet: 1 });
    assert!(refused.to_string().contains("zones 0 and 1 overlap"), "{refused}");
    for accuracy in [0.0, -1.0, f64::NAN, 1.0] {
        let options = ZoneOptions { accuracy, ..ZoneOptions::default() };
        assert!(matches!(zone_exchange(&room, &[], &options, &()), Err(ZoneError::Accuracy(_))));
    }
    struct No;
    impl Progress for No {
        fn step(&self, _: usize, _: usize) -> bool {
            false
        }
    }
    let options = ZoneOptions { vacuum: vacuum(), ..ZoneOptions::default() };
    let stopped = zone_exchange(&room, &[], &options, &No).unwrap_err();
    assert_eq!(stopped, ZoneError::Factors(FactorError::Stopped));
}

/// Few lines allowed: what is reached is told.
#[test]
fn lines_are_no_more_than_allowed() {
    let room = room([0.0; 3], [1.0; 3]);
    let zones = grid([1.0; 3], [1, 1, 1], |_| [1.0, 0.0]);
    let options = ZoneOptions { accuracy: 1e-6, lines: 5000, ..ZoneOptions::default() };
    let found = zone_exchange(&room, &zones, &options, &()).unwrap();
    assert!(found.lines <= 7 * 5000 && found.reached() > 1e-6, "{} {}", found.lines, found.reached());
}
