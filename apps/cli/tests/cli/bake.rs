//! `radiosity bake`.

use crate::{COARSE, Room, sheet, sheets};
use serde_json::Value;
use std::path::Path;

#[test]
fn bake_writes_model_picture_and_reports() {
    let room = Room::new("bake");
    let call = ["bake", "--json", "-o", "lit.glb", "--image", "lit.png", "--report", "r.json", "--report", "r.html"];
    let run = room.run(call.iter().chain(&COARSE).chain(&["--texels-per-metre", "20", "--seed", "3"]));
    let result = run.result();
    // Each stage is told once, however often it is entered on end.
    let stages: Vec<Value> = run.events().into_iter().filter(|e| e["event"] == "stage").collect();
    let same = |a: &Value, b: &Value| (&a["stage"], &a["round"]) == (&b["stage"], &b["round"]);
    assert!(stages.len() > 5 && stages.windows(2).all(|two| !same(&two[0], &two[1])), "{stages:?}");
    let files = ["lit.glb", "lit.lightmap0.exr", "lit.png", "r.html", "r.json"];
    assert_eq!(room.names(), files);
    assert_eq!((&room.read("lit.glb")[..4], &room.read("lit.png")[1..4]), (&b"glTF"[..], &b"PNG"[..]));
    assert_eq!(room.read("lit.lightmap0.exr")[..4], [0x76, 0x2f, 0x31, 0x01]);

    let report: Value = serde_json::from_slice(&room.read("r.json")).unwrap();
    assert_eq!(report, result["report"]);
    assert_eq!((&report["program"], &report["version"]), (&"radiosity".into(), &env!("CARGO_PKG_VERSION").into()));
    let command: Vec<&str> = report["command"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert_eq!((command[0], command[1], command.len()), ("radiosity", "bake", 1 + call.len() + COARSE.len() + 4));
    let error = &report["error"];
    assert_eq!((error["asked"].as_f64(), error["seed"].as_u64()), (Some(0.2), Some(3)));
    let [lower, estimated, upper] =
        ["lower_95_one_sided", "estimated", "upper_95_one_sided"].map(|name| error[name].as_f64().unwrap());
    assert!(lower <= estimated && estimated <= upper && upper <= 0.2 && error["achieved"] == true, "{error}");
    let defect = report["balance"]["defect"][1].as_f64().unwrap();
    assert!(defect.abs() < 0.05, "{defect}");
    let solution = &report["solution"];
    assert!(solution["raw_closure"].as_f64().unwrap() < 1e-6);
    assert!(solution["relative_residual"][0].as_f64().unwrap() <= 1e-4);
    assert!(solution["guaranteed_bound"][0].as_f64().unwrap() > 0.0);
    let stages = report["time"]["stages"].as_array().unwrap();
    let (sum, whole) = (stages.iter().filter_map(|s| s["seconds"].as_f64()).sum::<f64>(), &report["time"]["seconds"]);
    assert!(stages.iter().any(|s| s["name"] == "lightmap") && (sum / whole.as_f64().unwrap() - 1.0).abs() < 0.05);
    assert!(cfg!(not(target_os = "linux")) || report["peak_memory_mb"].as_f64().unwrap() > 1.0);
    assert!(report["about"]["error.upper_95_one_sided"].as_str().unwrap().contains("one-sided 95 % bound"));
    let share: f64 =
        report["illuminance"]["classes"].as_array().unwrap().iter().filter_map(|c| c["share"].as_f64()).sum();
    assert!((share - 1.0).abs() < 1e-9, "{share}");

    let page = String::from_utf8(room.read("r.html")).unwrap();
    assert_eq!(page.matches("<img").count(), 2);
    for said in ["error is reached", "radiosity bake --json -o lit.glb", "Energy balance", "Guaranteed bound"] {
        assert!(page.contains(said), "{said}");
    }
    let program = Path::new(env!("CARGO_BIN_EXE_radiosity")).parent().unwrap().display().to_string();
    assert!(!page.contains("://") && !page.contains(&program), "no address and no path of the program");
}

#[test]
fn an_error_that_is_not_reached_is_said_plainly_and_is_no_failure() {
    let room = Room::new("unreached");
    let call = ["bake", "--error", "5%", "--rounds", "0", "--memory", "2M", "--element-size", "0.3", "--vertices"];
    let run = room.run(call.iter().chain(&["-o", "a.glb", "--size", "32x32", "--report", "a.html"]));
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.err.contains("NOT reached"), "{}", run.err);
    assert!(String::from_utf8(room.read("a.html")).unwrap().contains("The asked error is NOT reached"));
    assert_eq!(room.names(), ["a.glb", "a.html"]);
}

/// The page took the picture's temporary file, and the run ended with half of its files in place.
#[test]
fn a_picture_named_like_a_further_page_is_refused() {
    let room = Room::new("page");
    let call = ["bake", "--max-atlas", "64", "-o", "a.glb", "--image", "a.lightmap1.exr", "--texels-per-metre", "40"];
    let run = room.run(call.iter().chain(&COARSE));
    assert!(
        run.code == Some(2) && run.err.contains("a.lightmap1.exr: a page of the lightmap may get this name"),
        "{run:?}"
    );
    assert_eq!(room.names(), [""; 0]);
}

/// A curtain in a lightmap looks as if nothing came through.
#[test]
fn catalogue_13_bake_says_what_a_lit_model_does_not_show_of_sheets() {
    let room = Room::new("bake-sheets");
    room.write("sheet.gltf", &sheets(&[sheet("silk", 0.9, 0.5, 0.9)]));
    let call = ["bake", "sheet.gltf", "-o", "lit.glb", "--vertices", "--report", "r.json", "--error", "20%"];
    let run = room.run(call);
    assert_eq!(run.code, Some(0), "{run:?}");
    let told = run.err.lines().find(|line| line.starts_with("warning: sheet.gltf: light passes through '"));
    assert!(told.is_some_and(|line| line.contains("(shade a side by (ρ E + τ E')/π")), "{run:?}");
    let report: Value = serde_json::from_slice(&room.read("r.json")).unwrap();
    let faults = report["faults"].as_array().unwrap();
    assert!(faults.iter().any(|fault| fault["what"].as_str().unwrap().contains("light passes through")), "{faults:?}");
    // Read again, its two layers are one sheet.
    let lit = room.run(["check", "lit.glb", "--json"]).result();
    let transmittance = lit["materials"][0]["transmittance"][1].as_f64().unwrap();
    assert!(lit["area"] == 0.5 && (transmittance - 0.45).abs() < 1e-6, "{lit}");
    let opaque = sheet("silk", 0.9, 0.0, 0.9);
    room.write("plain.gltf", &sheets(&[opaque]));
    let run = room.run(["bake", "plain.gltf", "-o", "plain.glb", "--vertices", "--error", "20%"]);
    assert!(run.code == Some(0) && !run.err.contains("light passes"), "{run:?}");
}
