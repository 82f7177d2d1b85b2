//! The planar cases of the reference values, closed forms and exact integrals of 15 digits, by every method that
//! promises digits.

use glam::DVec3;
use radiosity_scene::Facet;
use radiosity_transport::pair::blockers::Blockers;
use radiosity_transport::pair::cubature::Cubature;
use radiosity_transport::pair::exact::exact;
use radiosity_transport::pair::nusselt;
use radiosity_transport::polygon::point_to_polygon;
use radiosity_transport::{Pair, Unoccluded};
use serde_json::Value;

fn cases(text: &str) -> Vec<Value> {
    let file: Value = serde_json::from_str(text).unwrap();
    file["cases"].as_array().unwrap().clone()
}

fn vector(v: &Value) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|k| v[k].as_f64().unwrap()))
}

fn facet(corners: &Value) -> Facet {
    Facet::new(corners.as_array().unwrap().iter().map(vector).collect()).unwrap()
}

/// The cases between two polygons: their name, the polygons, and F.
fn pairs(text: &str) -> Vec<(Value, [Facet; 2], f64)> {
    let pair = |case: Value| {
        let surfaces =
            case["surfaces"].as_array().filter(|s| s.len() == 2 && s.iter().all(|s| s["type"] == "polygon"))?;
        let facets = [0, 1].map(|k| facet(&surfaces[k]["vertices"]));
        let value = case["value"].as_f64().unwrap();
        Some((case, facets, value))
    };
    cases(text).into_iter().filter_map(pair).collect()
}

#[test]
fn catalogue_17_polygons_by_the_closed_form() {
    let pairs = pairs(include_str!("../data/view_factors.json"));
    assert!(pairs.len() >= 17, "{}", pairs.len());
    for (case, [from, to], truth) in pairs {
        let value = exact(&from, &to) / from.area();
        // The reference has 15 digits.
        assert!((value - truth).abs() <= 1e-13, "{}: {value} for {truth}", case["id"]);
        assert_eq!(exact(&from, &to), exact(&to, &from), "{}", case["id"]);
    }
}

/// What leaves a face of a regular solid reaches the others, and by symmetry in the shares of the reference.
#[test]
fn catalogue_17_rows_of_platonic_solids_sum_to_one() {
    let mut count = 0;
    for case in cases(include_str!("../data/view_factors.json")) {
        let Some(faces) = case["surfaces"][0]["faces"].as_array() else { continue };
        let faces: Vec<Facet> = faces.iter().map(facet).collect();
        for from in &faces {
            let mut row: Vec<f64> = faces.iter().map(|to| exact(from, to) / from.area()).collect();
            let sum: f64 = row.iter().sum();
            assert!((sum - 1.0).abs() < 1e-13, "{}: {sum}", case["id"]);
            let mut truth: Vec<f64> = case["F0j"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
            truth.push(0.0);
            row.sort_by(f64::total_cmp);
            truth.sort_by(f64::total_cmp);
            for (value, truth) in row.iter().zip(&truth) {
                assert!((value - truth).abs() < 1e-13, "{}: {value} for {truth}", case["id"]);
            }
        }
        count += 1;
    }
    assert!(count >= 3);
}

#[test]
fn catalogue_17_polygons_by_cubature() {
    for (case, [from, to], truth) in pairs(include_str!("../data/view_factors.json")) {
        let cubature = Cubature { tolerance: 1e-8, ..Cubature::default() };
        let factor = cubature.factor(&from, &to, &Unoccluded);
        assert!((factor.value - truth).abs() <= factor.error && factor.error <= 1e-8, "{}: {factor:?}", case["id"]);
    }
}

/// Blockers of every kind: flat, upright, tilted, a box, and a wall that touches.
#[test]
fn catalogue_18_polygons_behind_blockers() {
    let mut count = 0;
    for (case, [from, to], truth) in pairs(include_str!("../data/view_factors_occluded.json")) {
        let blockers = case["blockers"].as_array().unwrap();
        let blockers: Vec<Facet> = blockers.iter().map(|b| facet(&b["vertices"])).collect();
        let blockers = Blockers::new(&blockers);
        let free = exact(&from, &to) / from.area();
        assert!((free - case["unoccluded"].as_f64().unwrap_or(free)).abs() < 1e-12);
        let factor = Cubature { tolerance: 1e-4, ..Cubature::default() }.factor(&from, &to, &blockers);
        assert!((factor.value - truth).abs() <= 1e-4 && factor.error <= 1e-4, "{}: {factor:?}", case["id"]);
        assert!((factor.value - truth).abs() <= factor.error, "{}: {factor:?}", case["id"]);
        assert!(factor.value <= free, "{}: {factor:?}", case["id"]);
        count += 1;
    }
    assert!(count >= 8, "{count}");
}

/// Elements and polygons by Lambert's formula and by Nusselt's analog, one of them not flat; discs, an ellipse's polygon
/// and spheres by Nusselt's analog.
#[test]
fn catalogue_16_and_19_elements() {
    let mut count = 0;
    for case in cases(include_str!("../data/view_factors.json")) {
        let Some([element, other]) =
            case["surfaces"].as_array().and_then(|s| <&[Value; 2]>::try_from(s.as_slice()).ok())
        else {
            continue;
        };
        if element["type"] != "element" {
            continue;
        }
        let (point, normal) = (vector(&element["position"]), vector(&element["normal"]).normalize());
        let number = |name: &str| other[name].as_f64().unwrap();
        let value = match other["type"].as_str() {
            Some("polygon") => {
                let corners: Vec<DVec3> = other["vertices"].as_array().unwrap().iter().map(vector).collect();
                let value = point_to_polygon(point, normal, &corners);
                if let Ok(facet) = Facet::new(corners) {
                    let nusselt = nusselt::to_polygon(point, normal, &facet);
                    assert!((nusselt - value).abs() < 1e-14, "{}: {nusselt} {value}", case["id"]);
                }
                value
            }
            Some("disk") => {
                let axis = vector(&other["normal"]).normalize();
                nusselt::to_disc(point, normal, vector(&other["center"]), axis, number("radius"))
            }
            Some("sphere") => nusselt::to_sphere(point, normal, vector(&other["center"]), number("radius")),
            _ => continue,
        };
        let truth = case["value"].as_f64().unwrap();
        assert!((value - truth).abs() < 1e-13, "{}: {value} for {truth}", case["id"]);
        count += 1;
    }
    assert!(count >= 14, "{count}");
}
