//! `radiosity check`.

use crate::{LAMP, Room, sheet, sheets};

#[test]
fn check_lists_what_is_there() {
    let room = Room::new("check");
    let cornell = room.run(["check", "--json"]).result();
    assert_eq!((cornell["triangles"].as_u64(), cornell["objects"].as_u64()), (Some(38), Some(19)));
    assert!((cornell["area"].as_f64().unwrap() - 1.9207).abs() < 1e-4);
    assert_eq!(cornell["bounding_box"][0], serde_json::json!([0.0, 0.0, 0.0]));
    assert_eq!(cornell["bounding_box"][1], serde_json::json!([0.556, 0.5488, 0.5592]));
    let names: Vec<&str> = cornell["materials"].as_array().unwrap().iter().filter_map(|m| m["name"].as_str()).collect();
    assert_eq!(names, ["white", "red", "green", "light"]);
    assert_eq!((&cornell["lights"], &cornell["cameras"]), (&serde_json::json!([]), &serde_json::json!(["front"])));
    assert_eq!(cornell["faults"][0]["severity"], "note");

    room.write("lamp.gltf", LAMP);
    let lamp = room.run(["check", "lamp.gltf", "--json"]).result();
    assert_eq!((&lamp["lights"][0]["kind"], &lamp["lights"][0]["unit"]), (&"point".into(), &"cd".into()));
    assert_eq!((&lamp["lights"][0]["name"], lamp["lights"][0]["position"][1].as_f64()), (&"bulb".into(), Some(2.0)));

    // An input that cannot be used has its faults listed all the same.
    room.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    let bad = room.run(["check", "bad.obj", "--json"]);
    let events = bad.events();
    assert_eq!((bad.code, events.len()), (Some(2), 1), "{bad:?}");
    let faults = events[0]["faults"].as_array().unwrap();
    assert!(faults.iter().any(|f| f["severity"] == "error" && f["place"] == "bad.obj"), "{faults:?}");

    // Quietly, what is there is not listed, nor what is only worth knowing.
    let quiet = room.run(["check", "-q"]);
    assert_eq!((quiet.code, quiet.out.as_str(), quiet.err.as_str()), (Some(0), "", ""));
    room.write("twice.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3\n");
    let quiet = room.run(["check", "-q", "twice.obj", "--sky", "uniform:1"]);
    assert!(quiet.out.starts_with("warning: twice.obj: ") && quiet.out.lines().count() == 1, "{quiet:?}");

    let said = room.run(["check"]).out;
    assert!(
        said.contains("38 triangles in 19 objects") && said.contains("4 materials, 1 of them luminous\n"),
        "{said}"
    );
    // A lamp that the material library has and no face uses gives no light.
    room.write("m.mtl", "newmtl wall\nKd 1 1 1\nnewmtl lamp\nKd 1 1 1\nKe 9 9 9\n");
    room.write("some.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wall\nf 1 2 3\n");
    let said = room.run(["check", "some.obj"]).out;
    assert!(said.contains("2 materials, 0 of them luminous, 1 on no surface ('lamp')\n"), "{said}");
}

#[test]
fn check_finds_faces_that_look_the_wrong_way() {
    let room = Room::new("check-flipped");
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
    let sides = ["4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"];
    let write = |name: &str, sides: &[&str]| {
        let faces: String = sides.iter().map(|side| format!("f {side}\n")).collect();
        room.write(name, &format!("o cube\n{corners}{faces}"));
    };
    write("cube.obj", &sides);
    let mut turned = sides;
    turned[3] = "6 7 3 2";
    write("turned.obj", &turned);
    // A wall on the middle of the floor is nobody's neighbour.
    room.write(
        "wall.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv 1 0 1\nv 1 1 1\n\
        f 1 2 3 4\nf 2 5 6 3\nf 2 3 8 7\n",
    );

    let said = room.run(["check", "turned.obj"]).out;
    assert!(
        said.contains(
            "warning: turned.obj: object 'cube': 4 edges lie between faces that look opposite ways, the first at ["
        ),
        "{said}"
    );
    let fin = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n";
    room.write("fin.obj", fin);
    let said = room.run(["check", "fin.obj"]).out;
    let told =
        "note: fin.obj: object 'object': 1 edge joins three faces or more, the first at [0.5000, 0.0000, 0.0000] m";
    assert!(said.contains(told), "{said}");
    for good in [&["cube.obj"][..], &["wall.obj"], &["turned.obj", "--obj-double-sided"]] {
        let said = room.run([&["check", "--sky", "uniform:1"], good].concat()).out;
        assert!(!said.contains("warning"), "{said}");
    }
}

#[test]
fn check_finds_surfaces_in_one_plane() {
    let room = Room::new("check-overlap");
    let square = |first: usize, low: f64, high: f64, z: f64, up: bool| {
        let corners = [[low, low], [high, low], [high, high], [low, high]].map(|[x, y]| format!("v {x} {y} {z}\n"));
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| first + if up { i } else { 3 - i });
        format!("o s{first}\n{}f {a} {b} {c} {d}\n", corners.concat())
    };
    let floor = square(1, -3.1, 4.2, 0.0, true);
    for (name, second, warns) in [
        ("in.obj", square(5, 0.0, 1.0, 0.0, true), true),
        ("across.obj", square(5, 4.0, 5.0, 0.0, true), true),
        ("beside.obj", square(5, 4.2, 5.0, 0.0, true), false),
        ("above.obj", square(5, 0.0, 1.0, 0.001, true), false),
        ("under.obj", square(5, 0.0, 1.0, 0.0, false), false),
        // Undersides on the floor that overlap one another.
        ("both.obj", square(5, 0.0, 1.0, 0.0, false) + &square(9, 0.5, 2.0, 0.0, false), false),
        ("free.obj", square(5, 0.0, 1.0, 2.0, false) + &square(9, 0.5, 2.0, 2.0, false), true),
    ] {
        room.write(name, &(floor.clone() + &second));
        let said = room.run(["check", name, "--sky", "uniform:1"]).out;
        assert_eq!(said.contains("in one plane with object"), warns, "{said}");
        assert_eq!(said.contains("warning"), warns, "{said}");
    }
}

#[test]
fn catalogue_12_check_refuses_what_gives_back_more_than_it_gets() {
    let room = Room::new("check-sheets");
    room.write(
        "bright.gltf",
        &sheets(&[sheet("silk", 0.9, 0.5, 1.3), sheet("fine", 0.9, 0.5, 0.9), sheet("net", 0.8, 2.0, 0.5)]),
    );
    let run = room.run(["check", "bright.gltf", "--json"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    let faults = run.events()[0]["faults"].as_array().unwrap().clone();
    let errors: Vec<[&str; 2]> = faults
        .iter()
        .filter(|fault| fault["severity"] == "error")
        .map(|fault| ["place", "what"].map(|key| fault[key].as_str().unwrap()))
        .collect();
    assert_eq!(errors.len(), 2, "{faults:?}");
    assert!(
        errors[0][0] == "bright.gltf: materials[0] 'silk'" && errors[0][1].contains("sum to [0.0, 1."),
        "{errors:?}"
    );
    assert!(errors[1][0].contains("'net'") && errors[1][1].contains("place of 2 of"), "{errors:?}");
    let bake = room.run(["bake", "bright.gltf", "-o", "lit.glb"]);
    assert!(bake.code == Some(2) && bake.err.contains("'silk'") && bake.err.contains("'net'"), "{bake:?}");
}
