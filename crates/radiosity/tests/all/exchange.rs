//! The matrix route end to end, polygons to factors to elimination, against radiosity that is known exactly
//! (`radiosity.json`: boxes of constant elements, integral equations, networks of textbooks).

use glam::DVec3;
use radiosity::solve::{DiffuseResponse, Go, Params, Solver, SparseTransport, script_f, solve};
use radiosity::transport::{FormFactorMethod, FormFactorOptions, FormFactors};
use radiosity::{Elements, Enclosure, Facet, Mesh, cornell_box};
use serde_json::Value;
use std::f64::consts::TAU;

fn case(list: &str, id: &str) -> Value {
    let data: Value = serde_json::from_str(include_str!("../data/radiosity.json")).unwrap();
    data[list].as_array().unwrap().iter().find(|c| c["id"] == id).unwrap().clone()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn factors(enclosure: &Enclosure) -> FormFactors {
    FormFactors::new(FormFactorMethod::Adaptive, enclosure, &FormFactorOptions::default(), &()).unwrap()
}

/// B of B = E + R F B by elimination.
fn radiosity(factors: &FormFactors, e: &[f64], reflectance: Vec<f64>) -> Vec<f64> {
    let response = DiffuseResponse { reflectance, bands: 1, reciprocal_area: Some(factors.areas.clone()) };
    let mut b = vec![0.0; e.len()];
    let params = Params { tolerance: 1e-11, ..Params::default() };
    solve(Solver::Lu, &factors.transport().unwrap(), &response, e, &mut b, &params, |_, _| Go::On).unwrap();
    b
}

/// The same of a matrix that is given.
fn network(areas: &[f64], rows: &[f64], e: &[f64], reflectance: &[f64]) -> Vec<f64> {
    let n = areas.len();
    let factors = FormFactors {
        areas: areas.to_vec(),
        starts: (0..=n).map(|i| i * n).collect(),
        columns: (0..n * n).map(|k| (k % n) as u32).collect(),
        values: rows.to_vec(),
        errors: vec![0.0; n * n],
        ..FormFactors::default()
    };
    radiosity(&factors, e, reflectance.to_vec())
}

/// Adds a parallelogram in `cuts` parts along u and v as surface of its number; those along v follow each other.
fn add(enclosure: &mut Enclosure, [corner, u, v]: [DVec3; 3], cuts: [usize; 2], inwards: DVec3) {
    let (a, b) = (u / cuts[0] as f64, v / cuts[1] as f64);
    for i in 0..cuts[0] {
        for j in 0..cuts[1] {
            let at = corner + a * i as f64 + b * j as f64;
            let facet = Facet::new(vec![at, at + a, at + a + b, at + b]).unwrap();
            enclosure.add("part", if facet.normal().dot(inwards) > 0.0 { facet } else { facet.flipped() });
        }
    }
}

/// Means over consecutive runs of facets, by area.
fn means(b: &[f64], areas: &[f64], run: usize) -> Vec<f64> {
    let mean = |(b, a): (&[f64], &[f64])| b.iter().zip(a).map(|(b, a)| b * a).sum::<f64>() / a.iter().sum::<f64>();
    b.chunks(run).zip(areas.chunks(run)).map(mean).collect()
}

/// Catalogue 7: boxes of n × n constant elements a face, with exact factors: the means of the faces to 1e-8, and for n = 2
/// each element; and nearer to the converged means with each n (catalogue 3, the error falls with the mesh).
#[test]
fn catalogue_7_boxes_of_constant_elements() {
    for id in ["rad-box-1", "rad-box-2", "rad-box-3"] {
        let case = case("cases", id);
        let given = |key: &str| numbers(&case["given"][key]);
        let (size, exitance, reflectance) = (given("dimensions"), given("exitance"), given("reflectance"));
        let [x, y, z] = [DVec3::X * size[0], DVec3::Y * size[1], DVec3::Z * size[2]];
        let converged = numbers(&case["results"]["converged_face_means"]);
        let mut last = f64::INFINITY;
        for n in [1, 2, 4, 8] {
            let mut room = Enclosure::default();
            for (origin, u, v, inwards) in [
                (DVec3::ZERO, x, y, z),
                (z, x, y, -z),
                (DVec3::ZERO, x, z, y),
                (y, x, z, -y),
                (DVec3::ZERO, y, z, x),
                (x, y, z, -x),
            ] {
                add(&mut room, [origin, u, v], [n, n], inwards);
            }
            let found = factors(&room);
            assert!(found.closure().largest < 1e-8, "{id}, {n}: {:?}", found.closure());
            let all = |of: &[f64]| (0..6 * n * n).map(|i| of[i / (n * n)]).collect::<Vec<f64>>();
            let b = radiosity(&found, &all(&exitance), all(&reflectance));
            let faces = means(&b, &found.areas, n * n);
            let exact = numbers(&case["results"]["constant_elements_exact_factors"][n.to_string()]);
            for (face, (mean, exact)) in faces.iter().zip(&exact).enumerate() {
                assert!((mean - exact).abs() < 1e-8, "{id}, {n}, face {face}: {mean} for {exact}");
            }
            if n == 2 {
                let patches = case["results"]["n=2_patch_radiosity[face][u][v]"].as_array().unwrap();
                let patches = patches.iter().flat_map(|f| f.as_array().unwrap().iter().flat_map(numbers));
                for (k, (b, exact)) in b.iter().zip(patches).enumerate() {
                    assert!((b - exact).abs() < 1e-8, "{id}, patch {k}: {b} for {exact}");
                }
            }
            let off = faces.iter().zip(&converged).map(|(b, x)| (b - x).abs()).fold(0.0, f64::max);
            assert!(off < 0.5 * last, "{id}, {n}: {off} after {last}");
            last = off;
        }
        assert!(last < 1e-3, "{id}: {last}");
    }
}

/// Mean radiosities of two surfaces that face each other, for each n in turn, must come nearer to the integral equation's
/// with each doubling until a tenth of `digits`, and in the end to `digits`.
fn check_refinement(id: &str, steps: &[usize], digits: f64, make: impl Fn(&Value, usize) -> Enclosure) {
    let case = case("cases", id);
    let given = |key: &str| numbers(&case["given"][key]);
    let exact = numbers(&case["results"]["mean_radiosity"]);
    let mut last = f64::INFINITY;
    for n in steps {
        let enclosure = make(&case["given"], *n);
        let found = factors(&enclosure);
        let half = enclosure.facets.len() / 2;
        let all = |of: Vec<f64>| (0..2 * half).map(|i| of[i / half]).collect::<Vec<f64>>();
        let b = radiosity(&found, &all(given("exitance")), all(given("reflectance")));
        let off =
            means(&b, &found.areas, half).iter().zip(&exact).map(|(b, x)| (b / x - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < 0.5 * last || off < 0.1 * digits, "{id}, {n}: {off} after {last}");
        last = off;
    }
    assert!(last < digits, "{id}: {last}");
}

/// Catalogue 3: two opposed squares, against the Fredholm equation.
#[test]
fn catalogue_3_opposed_squares() {
    for id in ["rad-squares-1", "rad-squares-2"] {
        check_refinement(id, &[2, 4, 8, 16], 1e-4, |given, n| {
            let gap = DVec3::Z * given["gap"].as_f64().unwrap();
            let mut pair = Enclosure::default();
            add(&mut pair, [DVec3::ZERO, DVec3::X, DVec3::Y], [n, n], gap);
            add(&mut pair, [gap, DVec3::X, DVec3::Y], [n, n], -gap);
            pair
        });
    }
}

/// Length of what stands for infinitely long, in widths: the ends take some 1/LONG.
const LONG: f64 = 4000.0;

/// Catalogue 3: two long strips, against Sparrow's equation (1960).
#[test]
fn catalogue_3_facing_strips() {
    for id in ["rad-2d-plates-1", "rad-2d-plates-2"] {
        check_refinement(id, &[4, 8, 16, 32], 1e-3, |given, n| {
            let (gap, along) = (DVec3::Z * given["gap"].as_f64().unwrap(), DVec3::Y * LONG);
            let mut pair = Enclosure::default();
            add(&mut pair, [DVec3::ZERO, DVec3::X, along], [n, 1], gap);
            add(&mut pair, [gap, DVec3::X, along], [n, 1], -gap);
            pair
        });
    }
}

/// Catalogue 3: coaxial discs of 32 sides and the true area, cut into rings, against the Fredholm equation along the radius.
#[test]
fn catalogue_3_coaxial_discs() {
    const SIDES: usize = 32;
    for id in ["rad-coaxial-disks-1", "rad-coaxial-disks-2"] {
        check_refinement(id, &[1, 2, 4, 8], 3e-3, |given, n| {
            let (radii, gap) = (numbers(&given["radius"]), given["gap"].as_f64().unwrap());
            let step = TAU / SIDES as f64;
            let mut pair = Enclosure::default();
            for (radius, z, up) in [(radii[0], 0.0, true), (radii[1], gap, false)] {
                let at = |ring: usize, k: usize| {
                    let r = radius * (step / step.sin()).sqrt() * ring as f64 / n as f64;
                    DVec3::new(r * (step * k as f64).cos(), r * (step * k as f64).sin(), z)
                };
                for (ring, k) in (0..n).flat_map(|ring| (0..SIDES).map(move |k| (ring, k))) {
                    let mut corners = vec![at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1)];
                    corners.truncate(if ring == 0 { 3 } else { 4 });
                    let facet = Facet::new(corners).unwrap();
                    pair.add("part", if (facet.normal().z > 0.0) == up { facet } else { facet.flipped() });
                }
            }
            pair
        });
    }
}

/// Catalogue 3: isothermal V-grooves, against Sparrow and Lin's equation (1962); strips are narrower towards the fold.
#[test]
fn catalogue_3_v_grooves() {
    for id in ["v-groove-60", "v-groove-90"] {
        let case = case("cases", id);
        let emissivity = case["given"]["emissivity"].as_f64().unwrap();
        let (sine, cosine) = case["given"]["angle_deg"].as_f64().unwrap().to_radians().sin_cos();
        let n = 24;
        let mut groove = Enclosure::default();
        let (level, steep) = (DVec3::X, DVec3::new(cosine, 0.0, sine));
        for (wall, inwards) in [(level, DVec3::Z), (steep, DVec3::new(sine, 0.0, -cosine))] {
            let at = |k: usize| (k as f64 / n as f64).powi(3);
            for k in 0..n {
                add(&mut groove, [wall * at(k), wall * (at(k + 1) - at(k)), DVec3::Y * LONG], [1, 1], inwards);
            }
        }
        let found = factors(&groove);
        let b = radiosity(&found, &vec![emissivity; 2 * n], vec![1.0 - emissivity; 2 * n]);
        let exact = case["results"]["mean_radiosity_over_sigmaT4"].as_f64().unwrap();
        for mean in means(&b, &found.areas, n) {
            assert!((mean - exact).abs() < 1e-3, "{id}: {mean} for {exact}");
        }
    }
}

/// Catalogue 5 and 6: furnaces, and the inside of a sphere, where every patch sees the others by their areas.
#[test]
fn catalogue_6_spheres_of_patches() {
    for id in ["rad-sphere-patches-1", "rad-sphere-patches-2"] {
        let case = case("cases", id);
        let given = |key: &str| numbers(&case["given"][key]);
        let areas = given("area_fraction");
        let rows: Vec<f64> = areas.iter().flat_map(|_| areas.clone()).collect();
        let b = network(&areas, &rows, &given("exitance"), &given("reflectance"));
        for (b, exact) in b.iter().zip(numbers(&case["results"]["radiosity"])) {
            assert!((b - exact).abs() < 1e-12, "{id}: {b} for {exact}");
        }
    }
    for id in ["rad-spherical-cavity-1", "rad-spherical-cavity-2"] {
        let case = case("cases", id);
        let (open, e) =
            (case["given"]["open_fraction"].as_f64().unwrap(), case["given"]["emissivity"].as_f64().unwrap());
        let exact = case["results"]["wall_radiosity_over_sigmaT4"].as_f64().unwrap();
        let b = network(&[1.0 - open], &[1.0 - open], &[e], &[1.0 - e]);
        assert!((b[0] - exact).abs() < 1e-12, "{id}: {}", b[0]);
    }
}

/// Catalogue 82: networks of textbooks by script-F and by radiosities: plates and shields, spheres, cylinders.
#[test]
fn catalogue_82_two_surfaces() {
    let check = |is: f64, exact: f64, id: &str| assert!((is / exact - 1.0).abs() < 1e-12, "{id}: {is} for {exact}");
    for (id, round, result) in [
        ("rad-infinite-plates-1", None, "q12"),
        ("rad-infinite-plates-2", None, "q12"),
        ("rad-concentric-spheres-1", Some(2), "Q1"),
        ("rad-concentric-cylinders-1", Some(1), "Q1_per_length"),
    ] {
        let case = case("cases", id);
        let given = |key: &str| numbers(&case["given"][key]);
        let sigma = case["given"]["sigma"].as_f64().unwrap();
        let emissivity = given("emissivity");
        let black: Vec<f64> = given("T").iter().map(|t| sigma * t.powi(4)).collect();
        // Area of the inner surface, and what share of the outer one's view it is.
        let (area, share) = match round {
            None => (1.0, 1.0),
            Some(power) => {
                let radii = given("radii");
                let area = if power == 2 { 2.0 * TAU * radii[0] * radii[0] } else { TAU * radii[0] };
                (area, (radii[0] / radii[1]).powi(power))
            }
        };
        let rows = [0.0, 1.0, share, 1.0 - share];
        let script = script_f(&rows, &emissivity).unwrap();
        check(area * script[1] * (black[0] - black[1]), case["results"][result].as_f64().unwrap(), id);
        let e: Vec<f64> = black.iter().zip(&emissivity).map(|(black, e)| black * e).collect();
        let reflectance: Vec<f64> = emissivity.iter().map(|e| 1.0 - e).collect();
        let b = network(&[1.0, 1.0 / share], &rows, &e, &reflectance);
        for (b, exact) in b.iter().zip(numbers(&case["results"]["J"])) {
            check(*b, exact, id);
        }
        let Some(shields) = case["results"]["q12_with_n_shields"].as_object() else { continue };
        let shield = case["given"]["shield_emissivity_both_sides"].as_f64().unwrap();
        let resistance = |a: f64, b: f64| 1.0 / script_f(&rows, &[a, b]).unwrap()[1];
        for (n, q) in shields {
            let between = (n.parse::<f64>().unwrap() - 1.0) * resistance(shield, shield);
            let all = resistance(emissivity[0], shield) + between + resistance(shield, emissivity[1]);
            check((black[0] - black[1]) / all, q.as_f64().unwrap(), id);
        }
    }
}

/// Catalogue 82: an oven with a wall that gives back all it receives, and a furnace with a black side.
#[test]
fn catalogue_82_three_surfaces() {
    let near = |is: f64, exact: f64, id: &str| assert!((is / exact - 1.0).abs() < 1e-9, "{id}: {is} for {exact}");
    let oven = case("textbook", "txt-incropera-paint-oven");
    let (sigma, results) = (oven["sigma"].as_f64().unwrap(), &oven["recomputed"]);
    let black = [1200f64, 500.0].map(|t| sigma * t.powi(4));
    let rows = [0.0, 0.5, 0.5, 0.5, 0.0, 0.5, 0.5, 0.5, 0.0];
    let j = network(&[1.0; 3], &rows, &[0.8 * black[0], 0.4 * black[1], 0.0], &[0.2, 0.6, 1.0]);
    for (j, exact) in j.iter().zip(numbers(&results["J"])) {
        near(*j, exact, "oven");
    }
    near((black[0] - j[0]) * 0.8 / 0.2, results["q_per_length"].as_f64().unwrap(), "oven, heat");
    near((j[2] / sigma).powf(0.25), results["T_R"].as_f64().unwrap(), "oven, wall");

    let furnace = case("textbook", "txt-cengel-cylindrical-furnace");
    let results = &furnace["recomputed"];
    let f = results["F12"].as_f64().unwrap();
    // Discs of area π, a side of 2π: what does not go to the other disc goes to the side, and comes back by reciprocity.
    let side = 1.0 - f;
    let rows = [0.0, f, side, f, 0.0, side, side / 2.0, side / 2.0, 1.0 - side];
    let (areas, emissivity) = ([TAU / 2.0, TAU / 2.0, TAU], [0.8, 0.4, 1.0]);
    let black = [700f64, 500.0, 400.0].map(|t| sigma * t.powi(4));
    let e: Vec<f64> = black.iter().zip(emissivity).map(|(black, e)| black * e).collect();
    let j = network(&areas, &rows, &e, &emissivity.map(|e| 1.0 - e));
    for (j, exact) in j.iter().zip(numbers(&results["J"])) {
        near(*j, exact, "furnace");
    }
    let script = script_f(&rows, &emissivity).unwrap();
    for (i, exact) in numbers(&results["Q_kW"]).into_iter().enumerate() {
        let net: f64 = (0..3).map(|k| script[3 * i + k] * (black[i] - black[k])).sum();
        near(areas[i] * net / 1000.0, exact, "furnace, heat");
    }
}

/// Catalogue 34: the Cornell box, its tall block painted a little darker: from the old light, half the work of a cold start
/// suffices for the same residual, that of the engine's default among them. Where digits are asked for beyond, both go on
/// at the same rate, and the start counts for less: at 1e-6 it is up to two thirds.
#[test]
fn catalogue_34_warm_start_after_repainting() {
    let scene = cornell_box();
    let mesh = Mesh::new(&scene);
    let elements = Elements::new(&scene, &mesh, 0.12);
    let enclosure = Enclosure::of_elements(&mesh, &elements).unwrap();
    let hemisphere: FormFactorMethod = "hemisphere".parse().unwrap();
    let mut options = FormFactorOptions::default();
    options.look.resolution = 32;
    let factors = FormFactors::new(hemisphere, &enclosure, &options, &()).unwrap();
    let transport: SparseTransport<f64> = factors.transport().unwrap();
    let optics: Vec<_> = (0..elements.len()).map(|e| elements.optics(&scene, &mesh, e as u32)).collect();
    let e: Vec<f64> = optics.iter().map(|(_, exitance)| f64::from(exitance[1])).collect();
    let before: Vec<f64> = optics.iter().map(|(reflectance, _)| f64::from(reflectance[1])).collect();
    let object = |i: usize| scene.triangle_object[mesh.source[elements.place(i as u32).0] as usize];
    let painted = object(elements.len() - 1);
    let after = (0..before.len()).map(|i| if object(i) == painted { 0.9 * before[i] } else { before[i] }).collect();
    let response = |reflectance: Vec<f64>| DiffuseResponse { reflectance, bands: 1, reciprocal_area: None };
    let run = |solver, response: &DiffuseResponse, mut b: Vec<f64>, tolerance| {
        let params = Params { tolerance, max_steps: 5000, ..Params::default() };
        let info = solve(solver, &transport, response, &e, &mut b, &params, |_, _| Go::On).unwrap();
        (b, info.work)
    };
    let cold = vec![0.0; e.len()];
    let (old, _) = run(Solver::Lu, &response(before.clone()), cold.clone(), 1e-9);
    let after = response(after);
    for solver in [Solver::Jacobi, Solver::GaussSeidel, Solver::DeflatedJacobi, Solver::Gmres, Solver::Progressive] {
        for tolerance in [1e-3, 1e-4] {
            let [all, rest] = [cold.clone(), old.clone()].map(|start| run(solver, &after, start, tolerance).1);
            assert!(rest <= 0.5 * all, "{solver} to {tolerance:e}: {rest} of {all}");
        }
    }
}
