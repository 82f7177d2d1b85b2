//! Factors between analytic shapes against reference values: Howell's closed forms and independent integrals, as listed in
//! `data/view_factors.json` and the curved cases of `data/view_factors_occluded.json`.

// Each case is shown with its error, for whoever runs the test to see.
#![allow(clippy::print_stdout)]

use glam::{DVec2, DVec3};
use radiosity_scene::Facet;
use radiosity_transport::Factor;
use radiosity_transport::pair::shapes::flat::{self, Profile};
use radiosity_transport::pair::shapes::{self, Facing, Shape, ShapeError};
use serde_json::Value;

/// Cases of `view_factors.json` between two shapes in space: all but eleven in the plane and three polyhedra.
const IN_SPACE: usize = 57;

fn cases(name: &str) -> Vec<Value> {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["cases"].as_array().unwrap().clone()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap_or(f64::NEG_INFINITY)).collect()
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_slice(&numbers(value))
}

fn facet(vertices: &Value) -> Shape {
    let corners: Vec<DVec3> = vertices.as_array().unwrap().iter().map(vector).collect();
    Facet::new(corners.clone()).map_or(Shape::Fan(corners), Shape::Facet)
}

fn shape(s: &Value) -> Option<Shape> {
    let facing = if s["facing"] == "inside" { Facing::Inside } else { Facing::Outside };
    let v = |key: &str| vector(&s[key]);
    let x = |key: &str| s[key].as_f64().unwrap();
    Some(match s["type"].as_str().unwrap() {
        "element" => Shape::Element { position: v("position"), normal: v("normal") },
        "polygon" => facet(&s["vertices"]),
        "disk" => Shape::disc(v("center"), v("normal"), x("radius")),
        "annulus" => Shape::Disc {
            center: v("center"),
            normal: v("normal"),
            radius: x("radius"),
            inner_radius: x("inner_radius"),
        },
        "ellipse" => {
            let axes = numbers(&s["semi_axes"]);
            Shape::Ellipse { center: v("center"), normal: v("normal"), axis: v("axis1"), semi_axes: [axes[0], axes[1]] }
        }
        "sphere" => Shape::Sphere { center: v("center"), radius: x("radius"), facing },
        "spherical_patch" => Shape::cap_of_share(DVec3::ZERO, DVec3::X, 1.0, x("area_fraction"), Facing::Inside),
        "cylinder_lateral" if s["height"] == "inf" => {
            let mut point = v("base_center");
            point.z = 0.0;
            Shape::Tube { point, axis: v("axis"), radius: x("radius") }
        }
        "cylinder_lateral" => Shape::cylinder(v("base_center"), v("axis"), x("height"), x("radius"), facing),
        "cone_lateral" => Shape::cone(v("apex"), v("axis"), x("height"), x("radius"), facing),
        "frustum_lateral" => Shape::Frustum {
            base: v("base_center"),
            axis: v("axis"),
            height: x("height"),
            radius_base: x("radius_base"),
            radius_top: x("radius_top"),
            facing,
        },
        "infinite_hemisphere" => Shape::Sky { up: DVec3::Z },
        _ => return None,
    })
}

/// From, to and what stands between, by what the quantity says.
fn asked(case: &Value, shapes: &[Shape]) -> Option<(Shape, Shape, Vec<Shape>)> {
    let quantity = case["quantity"].as_str().unwrap();
    let [i, j] = match quantity {
        "F12" | "F_d1-2" | "F_d1-sky" => [0, 1],
        "F11" | "F_LL" => [0, 0],
        "F21" => [0, 1],
        "F21 (base to wall)" => [1, 0],
        "F21 (outer to inner)" => [0, 1],
        "F22 (outer to itself)" => [0, 0],
        "F23 (outer to one annulus)" => [0, 2],
        _ => return None,
    };
    let mut blockers: Vec<Shape> =
        case["blockers"].as_array().into_iter().flatten().map(|b| shape(b).unwrap()).collect();
    if quantity.contains("itself") || quantity.contains("annulus") {
        blockers.push(shapes[1].clone());
    }
    Some((shapes[i].clone(), shapes[j].clone(), blockers))
}

/// A method from shapes to a factor.
type Method = fn(&Shape, &Shape, &[Shape], f64) -> Result<Factor, ShapeError>;

/// Holds a method to the reference values of all cases in space, within `allowed` of the value; answers how many.
fn check(name: &str, tolerance: f64, allowed: f64, by: Method) -> usize {
    let mut done = 0;
    for case in cases(name) {
        let started = std::time::Instant::now();
        let shapes: Option<Vec<_>> = case["surfaces"].as_array().unwrap().iter().map(shape).collect();
        let Some((from, to, blockers)) = shapes.and_then(|shapes| asked(&case, &shapes)) else { continue };
        let got = by(&from, &to, &blockers, tolerance).unwrap();
        let (id, value) = (case["id"].as_str().unwrap(), case["value"].as_f64().unwrap());
        let off = got.value - value;
        println!("{id:42} {:.15} {off:9.1e}, stated {:8.1e}, {:?}", got.value, got.error, started.elapsed());
        assert!(off.abs() <= allowed, "{id}: {got:?} is {off:e} off {value}");
        assert!(got.error <= tolerance + 2e-13, "{id}: {got:?}");
        done += 1;
    }
    done
}

/// Every case in space, by closed forms where there are any.
#[test]
fn catalogue_21_reference_values_in_space() {
    assert_eq!(check("view_factors.json", 1e-10, 1e-10, shapes::factor), IN_SPACE);
}

/// The same by integration of the differential factor alone.
#[test]
fn catalogue_17_reference_values_by_integration() {
    assert_eq!(check("view_factors.json", 1e-10, 1e-10, shapes::integrated), IN_SPACE);
}

/// Blockers of every kind. The reference value past the sphere is 2.2e-9 below an independent quadrature with exact break
/// points, which gives 0.300_899_597_00; that past the disc is good to 1e-12.
#[test]
fn catalogue_30_reference_values_past_blockers() {
    assert_eq!(check("view_factors_occluded.json", 1e-5, 1e-5, shapes::factor), 10);
    let disc = |z: f64, up: f64, r: f64| Shape::disc(DVec3::Z * z, DVec3::Z * up, r);
    let sphere = Shape::Sphere { center: DVec3::Z * 0.5, radius: 0.3, facing: Facing::Outside };
    for (blocker, exact) in [(disc(0.5, 1.0, 0.5), 0.210_755_517_232_5), (sphere, 0.300_899_597_0)] {
        let got = shapes::factor(&disc(0.0, 1.0, 1.0), &disc(1.0, -1.0, 1.0), &[blocker], 1e-10).unwrap();
        assert!((got.value - exact).abs() < 1e-10, "{got:?} {exact}");
    }
}

/// Faces of a closed polyhedron: every factor of its first face, and their sum.
#[test]
fn catalogue_20_polyhedra_close() {
    for case in cases("view_factors.json").iter().filter(|case| !case["F0j"].is_null()) {
        let faces: Vec<Shape> = case["surfaces"][0]["faces"].as_array().unwrap().iter().map(facet).collect();
        let row = faces[1..].iter().map(|face| shapes::factor(&faces[0], face, &[], 1e-10).unwrap().value);
        let row: Vec<f64> = row.collect();
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{row:?}");
        for (got, exact) in row.iter().zip(numbers(&case["F0j"])) {
            assert!((got - exact).abs() < 1e-10, "{}: {got} {exact}", case["id"]);
        }
    }
}

/// Strips, cylinders, ducts and tubes.
#[test]
fn catalogue_21_reference_values_in_the_plane() {
    let profile = |s: &Value| {
        let at = |key: &str| DVec2::from_slice(&numbers(&s[key]));
        match s["type"].as_str().unwrap() {
            "strip" => Some(Profile::strip(at("p0"), at("p1"))),
            "circle2d" => Some(Profile::circle(at("center"), s["radius"].as_f64().unwrap())),
            _ => None,
        }
    };
    let mut done = 0;
    for case in cases("view_factors.json").iter().filter(|case| case["id"].as_str().unwrap().contains("-2d-")) {
        let surfaces = case["surfaces"].as_array().unwrap();
        let value = case["value"].as_f64().unwrap();
        let got = match surfaces[0]["type"].as_str().unwrap() {
            "duct2d" => flat::triangular_duct(numbers(&surfaces[0]["sides"]).try_into().unwrap()).unwrap()[0][1],
            "plane2d" => {
                let length = |key: &str| surfaces[1][key].as_f64().unwrap();
                flat::tube_row(length("diameter"), length("pitch")).unwrap()
            }
            _ => {
                let [from, to] = [0, 1].map(|i| profile(&surfaces[i]).unwrap());
                let sum = flat::integrated(&from, &to, &[], 1e-12).unwrap();
                assert!((sum.value - value).abs() < 1e-12, "{} {sum:?}", case["id"]);
                flat::factor(&from, &to, &[], 1e-12).unwrap().value
            }
        };
        assert!((got - value).abs() < 1e-13, "{}: {got} {value}", case["id"]);
        done += 1;
    }
    assert_eq!(done, 11);
}

/// The tolerance is kept decade by decade, and the error stated bounds the true one.
#[test]
fn the_tolerance_is_a_promise() {
    let sphere = |x: f64, r: f64| Shape::Sphere { center: DVec3::X * x, radius: r, facing: Facing::Outside };
    let wall = Shape::Frustum {
        base: DVec3::ZERO,
        axis: DVec3::Z,
        height: 1.5,
        radius_base: 2.0,
        radius_top: 1.0,
        facing: Facing::Inside,
    };
    let disc = |z: f64, up: f64, r: f64| Shape::disc(DVec3::Z * z, DVec3::Z * up, r);
    let rectangle = |x: f64| {
        let corners = [[x, 0.0], [x, 2.0], [x + 1.0, 2.0], [x + 1.0, 0.0]];
        Shape::Facet(Facet::new(corners.map(|[x, y]| DVec3::new(x, y, 1.5)).to_vec()).unwrap())
    };
    let pairs = [
        (sphere(0.0, 1.0), sphere(3.0, 1.0), 0.029_590_312_250_550_255),
        (wall.clone(), wall, 0.297_991_158_419_026_9),
        (sphere(0.0, 0.75), rectangle(0.0), 0.036_588_946_139_465_06),
        (disc(0.0, 1.0, 1.0), disc(1.5, -1.0, 2.0), 0.601_653_344_388_043_9),
    ];
    for (from, to, exact) in pairs {
        for k in 3..10 {
            let tolerance = 0.1_f64.powi(k);
            let got = shapes::integrated(&from, &to, &[], tolerance).unwrap();
            let off = (got.value - exact).abs();
            assert!(off <= got.error && got.error <= tolerance + 1e-13, "{tolerance}: {got:?} is {off:e} off {exact}");
        }
    }
}

/// Element to sphere along its normal, catalogue 30, and the disc on its axis, catalogue 19.
#[test]
fn catalogue_19_and_30_element_on_the_axis() {
    let element = Shape::Element { position: DVec3::ZERO, normal: DVec3::Z };
    for (r, d) in [(0.5, 2.0), (1.0, 1.001), (1e-3, 40.0)] {
        let sphere = Shape::Sphere { center: DVec3::Z * d, radius: r, facing: Facing::Outside };
        let disc = Shape::disc(DVec3::Z * d, -DVec3::Z, r);
        let f = |to: &Shape| shapes::factor(&element, to, &[], 1e-12).unwrap().value;
        assert!((f(&sphere) - (r / d).powi(2)).abs() < 1e-15);
        assert!((f(&disc) - r * r / (r * r + d * d)).abs() < 1e-12);
    }
}

/// A tilted element before a cylinder with ends, a plane below and the sky: everything that it sees sums to one.
#[test]
fn catalogue_16_what_an_element_sees_sums_to_one() {
    for (x, z) in [(1.0, 0.0), (0.3, 1.0), (0.7, -0.4), (-0.2, 0.9)] {
        let element = Shape::Element { position: DVec3::new(0.0, 0.0, 0.5), normal: DVec3::new(x, 0.2, z) };
        let base = DVec3::new(1.5, 0.3, 0.0);
        let all = [
            Shape::cylinder(base, DVec3::Z, 1.2, 0.6, Facing::Outside),
            Shape::disc(base + 1.2 * DVec3::Z, DVec3::Z, 0.6),
            Shape::Sphere { center: DVec3::new(-1.0, 0.5, 1.0), radius: 0.4, facing: Facing::Outside },
            Shape::Plane { point: DVec3::ZERO, normal: DVec3::Z },
            Shape::Sky { up: DVec3::Z },
        ];
        let share = |i: usize| {
            let blockers: Vec<Shape> = (0..all.len()).filter(|j| *j != i && *j != 4).map(|j| all[j].clone()).collect();
            shapes::factor(&element, &all[i], &blockers, 1e-12).unwrap().value
        };
        let sum: f64 = (0..all.len()).map(share).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{x} {z}: {sum}");
    }
}

/// Wrong shapes are named.
#[test]
fn what_is_no_shape_is_refused() {
    let disc = |r: f64| Shape::disc(DVec3::ZERO, DVec3::Z, r);
    let element = Shape::Element { position: DVec3::ZERO, normal: DVec3::Z };
    let sky = Shape::Sky { up: DVec3::Z };
    let is = |from: &Shape, to: &Shape, tolerance: f64| shapes::factor(from, to, &[], tolerance).unwrap_err();
    assert!(matches!(is(&disc(0.0), &disc(1.0), 1e-6), ShapeError::NotPositive { .. }));
    assert!(matches!(is(&disc(f64::NAN), &disc(1.0), 1e-6), ShapeError::NotFinite(_)));
    assert_eq!(is(&disc(1.0), &element, 1e-6), ShapeError::SeenElement);
    assert_eq!(is(&sky, &disc(1.0), 1e-6), ShapeError::CannotEmit);
    assert_eq!(is(&disc(1.0), &sky, -1.0), ShapeError::Tolerance(-1.0));
    let flat = Shape::Disc { center: DVec3::ZERO, normal: DVec3::ZERO, radius: 1.0, inner_radius: 0.0 };
    assert_eq!(is(&flat, &sky, 1e-6), ShapeError::NoDirection("normal"));
}
