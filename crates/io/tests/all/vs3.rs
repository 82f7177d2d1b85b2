//! View3D files: what they say reaches the enclosure, and every fault is named with its line.

use glam::DVec3;
use radiosity_io::vs3::NoRow;
use radiosity_io::{Grouping, LoadOptions, Vs3, load_enclosure, parse_vs3};
use radiosity_scene::Facet;

fn data(file: &str) -> Vec<u8> {
    std::fs::read(format!("{}/tests/data/vs3/{file}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn read(file: &str) -> Vs3 {
    parse_vs3(file, &data(file)).unwrap_or_else(|faults| panic!("{faults}"))
}

fn names(vs3: &Vs3) -> Vec<&str> {
    vs3.enclosure.surfaces.iter().map(|s| s.name.as_str()).collect()
}

/// By the divergence theorem; of a closed enclosure seen from inside.
fn volume(vs3: &Vs3) -> f64 {
    vs3.enclosure.facets.iter().map(|f| -f.area() * f.normal().dot(f.centroid()) / 3.0).sum()
}

#[test]
fn a_cube_is_closed_and_looks_inwards() {
    let cube = read("cube.vs3");
    assert_eq!(names(&cube), ["floor", "ceiling", "south", "east", "north", "west"]);
    assert_eq!(cube.enclosure.title, "Unit cube, seen from inside");
    assert_eq!(cube.enclosure.surface_areas(), [1.0; 6]);
    assert_eq!(cube.numbers, [1, 2, 3, 4, 5, 6]);
    assert!(cube.enclosure.is_closed && cube.settings.encl && !cube.settings.emit);
    assert!((volume(&cube) - 1.0).abs() < 1e-15);
    assert!(cube.warnings.0.is_empty(), "{}", cube.warnings);
}

#[test]
fn both_forms_of_the_l_room_say_the_same() {
    let (by_vertices, by_planes) = (read("l-room.vs3"), read("l-room-3a.vs3"));
    for room in [&by_vertices, &by_planes] {
        let expected = [9.0, 3.0, 6.0, 6.0, 3.0, 9.0, 5.0, 5.0];
        assert_eq!(room.enclosure.surface_areas(), expected);
        assert_eq!(room.enclosure.surface_of, [0, 1, 2, 3, 4, 5, 6, 7, 6, 6, 7, 7]);
        assert!((volume(room) - 15.0).abs() < 1e-12, "{}", volume(room));
        assert_eq!(room.enclosure.surfaces[7].emittance, Some(0.7));
        assert!(room.warnings.0.is_empty(), "{}", room.warnings);
    }
    assert_eq!(by_vertices.settings, by_planes.settings);
    assert_eq!((by_planes.settings.eps, by_planes.settings.max_u), (1e-5, 10));
    let corners = |facet: &Facet| {
        let mut corners: Vec<[u64; 3]> =
            facet.corners().iter().map(|c| (*c + 0.0).to_array().map(f64::to_bits)).collect();
        corners.sort_unstable();
        corners
    };
    for (a, b) in by_vertices.enclosure.facets.iter().zip(&by_planes.enclosure.facets) {
        assert_eq!((corners(a), a.normal()), (corners(b), b.normal()));
    }
}

#[test]
fn obstructions_are_no_surfaces() {
    let squares = read("obstructed-squares.vs3");
    assert_eq!(names(&squares), ["lower", "upper"]);
    assert_eq!(squares.enclosure.obstructions.len(), 1);
    assert_eq!((squares.enclosure.obstructions[0].area(), squares.enclosure.is_closed), (0.25, false));
    assert_eq!(squares.enclosure.surfaces[0].emittance, Some(1.0));
}

#[test]
fn what_lies_upon_a_base_is_cut_out_of_it() {
    let wall = read("wall.vs3");
    assert_eq!(names(&wall), ["wall", "opposite", "frame", "pane", "door"]);
    assert_eq!(wall.numbers, [1, 2, 3, 5, 7]);
    let areas = wall.enclosure.surface_areas();
    let (frame, cupboard, hole, door, picture) = (1.0, 1.0, 0.18, 2.0, 0.5);
    let expected = [18.0 - frame - cupboard - hole - door, 18.0, frame - 0.36, 0.36, door + picture];
    assert!(areas.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{areas:?}");
    assert!(wall.enclosure.facets.iter().all(Facet::is_convex));

    // The pieces face as their surface does, and no point in the middle of what was cut out is in one.
    let of = |surface: u32| {
        let pairs = wall.enclosure.facets.iter().zip(&wall.enclosure.surface_of);
        pairs.filter(move |(_, s)| **s == surface).map(|(facet, _)| facet)
    };
    let holds = |facet: &Facet, p: DVec3| facet.edges().all(|[a, b]| (b - a).cross(p - a).dot(facet.normal()) > 0.0);
    assert!(of(0).all(|f| f.normal().distance(DVec3::Z) < 1e-12));
    for (x, y, inside) in [(1.5, 1.5, 0), (3.5, 1.0, 0), (4.5, 1.5, 0), (5.5, 0.4, 0), (2.5, 1.6, 1), (5.3, 0.7, 1)] {
        let count = of(0).filter(|f| holds(f, DVec3::new(x, y, 0.0))).count();
        assert_eq!(count, inside, "{x}, {y}");
    }

    // Each surface of the file that has no row is named, and why.
    let rowless: Vec<_> = wall.rowless.iter().map(|r| (r.number, r.name.as_str(), r.why)).collect();
    assert_eq!(
        rowless,
        [(6, "hole", NoRow::Null(0)), (8, "picture", NoRow::Part(4)), (9, "surface 9", NoRow::Obstruction)]
    );

    // The mask, the hole, and the screen without its picture stand in the way.
    let obstructions: f64 = wall.enclosure.obstructions.iter().map(Facet::area).sum();
    assert!((obstructions - (cupboard + hole + 2.0 - picture)).abs() < 1e-12, "{obstructions}");
}

#[test]
fn masks_come_back_with_their_rows() {
    let wall = read("wall.vs3");
    let mask = &wall.masks[0];
    assert_eq!((mask.name.as_str(), mask.number, mask.base, mask.row), ("cupboard", 4, 0, 3));
    let areas = wall.enclosure.surface_areas();
    let n = areas.len();
    // Symmetric AᵢFᵢⱼ, rows that sum to one.
    let total: f64 = areas.iter().sum();
    let factors: Vec<f64> = (0..n * n).map(|k| areas[k % n] / total).collect();
    let errors: Vec<f32> = (0..n * n).map(|k| 1e-3 * (k + 1) as f32).collect();
    let masked = wall.with_masks(&areas, &factors, &errors);
    let all = n + 1;
    // What the mask and its base see of each other is certain; of the base, less is in doubt by its share that is bare.
    let error = |i: usize, j: usize| masked.errors[i * all + j];
    assert_eq!([error(3, 0), error(0, 3), error(3, 1), error(1, 3)], [0.0; 4]);
    let bare = areas[0] / (areas[0] + 1.0);
    assert!((f64::from(error(0, 1)) / (2e-3 * bare) - 1.0).abs() < 1e-6 && f64::from(error(0, 1)) >= 2e-3 * bare);
    assert!((error(1, 2) / errors[n + 2] - 1.0).abs() < 1e-6 && error(1, 2) >= errors[n + 2]);
    assert_eq!(masked.surfaces[3].name, "cupboard");
    assert_eq!(masked.surfaces[5].name, "door");
    assert!((masked.areas[0] - areas[0] - 1.0).abs() < 1e-12 && (masked.areas[3] - 1.0).abs() < 1e-12);
    for i in 0..all {
        let sum: f64 = masked.factors[i * all..(i + 1) * all].iter().sum();
        assert!((sum - 1.0).abs() < 1e-12, "row {i}: {sum}");
        for j in (0..all).filter(|j| *j != i) {
            let [there, back] = [(i, j), (j, i)].map(|(i, j)| masked.areas[i] * masked.factors[i * all + j]);
            // The base's own factor is halved by no mask: what it sends to others is what they send to it.
            assert!((there - back).abs() < 1e-12, "{i} {j}: {there} {back}");
        }
    }
    assert_eq!(masked.factors[3 * all], 1.0);
}

#[test]
fn latin_1_tabs_commas_and_lines_that_go_on_are_read() {
    let office = read("latin-1.vs3");
    assert_eq!(office.enclosure.title, "Büro, 2 m × 3 m");
    assert_eq!(names(&office), ["Fußboden", "Rückseite"]);
    assert_eq!(office.enclosure.surface_areas(), [6.0, 3.0]);
    assert_eq!(office.settings.list, 2);
    let text = "1 surface has no emittance, from here on; taken as 0.001, as View3D does";
    assert!(office.warnings.to_string().contains(text), "{}", office.warnings);
}

#[test]
fn every_fault_is_named_once_with_its_line() {
    let faults = parse_vs3("broken.vs3", &data("broken.vs3")).unwrap_err().to_string();
    let expected = [
        "broken.vs3:2: eps is 'fast'",
        "broken.vs3:10: x y z is 'nan'",
        "broken.vs3:11: vertex 1 is there already, in line 4",
        "broken.vs3:22: 'Q' begins no line of a View3D file",
        "broken.vs3:13: there is no vertex 99",
        "broken.vs3:14: surface 3: the corners do not lie in a plane",
        "broken.vs3:15: surface 4 is not convex",
        "broken.vs3:16: the emittance is 1.2",
        "broken.vs3:20: 5 of at least 8 values",
        "broken.vs3:24: vertex 1 stands there twice",
        "broken.vs3:19: there is no surface 88 for the base",
        "broken.vs3:23: mask 11 faces as its base 1 does",
        "broken.vs3:18: there is no surface 77 to combine with",
    ];
    let errors: Vec<&str> = faults.lines().filter(|line| line.starts_with("error")).collect();
    for expected in expected {
        assert!(errors.iter().any(|error| error.contains(expected)), "{expected}\n{faults}");
    }
    assert_eq!(errors.len(), expected.len(), "{faults}");
    assert!(errors.iter().all(|error| error.ends_with(')')), "no hint: {faults}");
}

#[test]
fn what_cannot_lie_upon_a_base_is_refused() {
    let square = "F 3\nV 1 0 0 0\nV 2 4 0 0\nV 3 4 4 0\nV 4 0 4 0\nV 5 1 1 0\nV 6 2 1 0\nV 7 2 2 0\nV 8 1 2 0\nV 9 5 2 0\n\
                  V 10 1 1 1\nV 11 2 1 1\nV 12 2 2 1\nS 1 1 2 3 4 0 0 .9 base\n";
    let with = |lines: &str| match parse_vs3("t", format!("{square}{lines}").as_bytes()) {
        Ok(_) => String::new(),
        Err(faults) => faults.to_string(),
    };
    for (lines, expected) in [
        ("S 2 5 6 7 8 1 0 .9 a", ""),
        ("M 2 8 7 6 5 1 0 .9 a", ""),
        ("S 2 8 7 6 5 1 0 .9 a", "faces away from its base 1"),
        ("N 2 5 6 7 8 1 0 .9 a", "null surface 2 faces as its base 1 does"),
        ("S 2 10 11 12 0 1 0 .9 a", "does not lie in the plane of its base 1: it is 1.0e0 m off"),
        ("S 2 6 9 7 0 1 0 .9 a", "reaches 1.0e0 m out of its base 1"),
        ("S 2 5 6 7 8 1 0 .9 a\nS 3 5 6 7 0 1 0 .9 b", "surface 3 overlaps another upon its base 1 by 5.000e-1 m²"),
        ("S 2 5 6 7 8 3 0 .9 a\nS 3 1 2 3 4 0 0 .9 b", "the base 3 comes after it"),
        ("S 2 5 6 7 8 2 0 .9 a", "the base 2 comes after it"),
        ("M 2 8 7 6 5 0 0 .9 a", "mask 2 has no base"),
        ("N 2 8 7 6 5 0 0 .9 a", "null surface 2 has no base"),
        ("M 2 8 7 6 5 1 0 .9 a\nS 3 8 7 6 5 2 0 .9 b", "surface 3 lies upon mask 2"),
        ("M 2 8 7 6 5 1 1 .9 a", "mask 2 cannot be a part of another"),
        ("S 2 5 6 7 8 0 3 .9 a\nS 3 1 2 3 4 0 0 .9 b", "surface 3 to combine with does not stand before it"),
        ("S 2 5 6 7 8 0 1 .9 a\nS 3 1 2 3 4 0 2 .9 b", "surface 2 is itself a part of surface 1"),
        ("O 2 5 6 7 8\nS 3 5 6 7 8 0 2 .9 b", "surface 3 cannot be combined with obstruction 2"),
        ("S 2 1 2 3 4 1 0 .9 a", "nothing is left of surface 1"),
        ("O 2 5 6 7 8\nS 3 5 6 7 8 2 0 .9 b", ""),
        ("C row=2", "row is 2 (there is no such surface"),
        ("C col=1", "col is 1 and row is not given"),
        ("F 2", "the geometry is '2'"),
        ("F 3a\nS 2 R 0 0 .9 a", "0 of 7 numbers in the lines after it"),
        ("F 3a\nS 2 W 0 0 .9 a\n 1", "'W' is no shape"),
    ] {
        let faults = with(lines);
        let is_expected = if expected.is_empty() { faults.is_empty() } else { faults.contains(expected) };
        assert!(is_expected, "{lines}\nexpected: {expected}\nfound: {faults}");
    }
    assert!(parse_vs3("t", b"").unwrap_err().to_string().contains("no surfaces"));
}

#[test]
fn gaps_and_differing_parts_are_warnings() {
    let text = "V 1 0 0 0\nV 2 1 0 0\nV 5 1 1 0\nS 1 1 2 5 0 0 0 .9 a\nS 3 1 2 5 0 0 1 .8 b\nX\nC speed=1\n";
    let vs3 = parse_vs3("t", text.as_bytes()).unwrap();
    let warnings = vs3.warnings.to_string();
    for expected in [
        "t:1: no F line",
        "t:3: vertices are not numbered",
        "t:5: surfaces are not numbered",
        "t:5: surface 3 has emittance 0.8 and becomes a part of surface 1, which has 0.9",
        "t:6: X lines are passed over",
        "t:7: 'speed' is no setting",
    ] {
        assert!(warnings.contains(expected), "{expected}\n{warnings}");
    }
    assert_eq!((vs3.enclosure.surface_of.as_slice(), vs3.enclosure.surface_areas()), (&[0, 0][..], vec![1.0]));
}

#[test]
fn enclosures_come_from_view3d_files_and_scenes() {
    let data = |file: &str| std::path::PathBuf::from(format!("{}/tests/data/{file}", env!("CARGO_MANIFEST_DIR")));
    let feet = LoadOptions { metres_per_unit: 0.3048, ..LoadOptions::default() };
    let wall = load_enclosure(&data("vs3/wall.vs3"), &feet, Grouping::Material).unwrap();
    let (areas, square_foot) = (wall.enclosure.surface_areas(), 0.3048_f64.powi(2));
    assert!((areas[1] - 18.0 * square_foot).abs() < 1e-12, "{areas:?}");
    assert!((wall.vs3.unwrap().masks[0].area - square_foot).abs() < 1e-12);

    for grouping in [Grouping::Material, Grouping::Object, Grouping::Triangle] {
        let cornell = load_enclosure(&data("scenes/cornell/cornell-box.obj"), &feet, grouping).unwrap().enclosure;
        assert!(!cornell.surfaces.is_empty() && cornell.surfaces.len() <= cornell.facets.len());
        assert_eq!(cornell.surface_of.len(), cornell.facets.len());
        assert!(cornell.surface_areas().iter().all(|area| *area > 0.0));
    }
    let missing = load_enclosure(&data("vs3/none.vs3"), &feet, Grouping::Object).unwrap_err().to_string();
    assert!(missing.contains("none.vs3: cannot be read"), "{missing}");
    let none = LoadOptions { metres_per_unit: 0.0, ..feet };
    let refused = load_enclosure(&data("vs3/wall.vs3"), &none, Grouping::Object).unwrap_err().to_string();
    assert!(refused.contains("0 metres per unit"), "{refused}");
}
