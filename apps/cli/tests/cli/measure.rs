//! `radiosity measure`, and the classic methods and solvers that it takes by their names.

use crate::{Room, Run};
use serde_json::Value;

#[test]
fn measure_answers_on_standard_output_or_in_a_file() {
    let room = Room::new("measure");
    // The floor before the blocks.
    let points: String = (0..100).map(|i| format!("0.{:02},0,0.0{},0,1,0\n", 5 + 4 * (i % 10), i / 20)).collect();
    room.write("p.csv", &format!("x,y,z,nx,ny,nz\n{points}"));
    let call = ["measure", "--points", "p.csv", "--error", "20%"];
    let run = room.run(call);
    assert_eq!(run.code, Some(0), "{run:?}");
    let lines: Vec<&str> = run.out.lines().collect();
    assert_eq!(lines[0], "x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b,illuminance_lux");
    assert_eq!(lines.len(), 101);
    let lux: Vec<f64> = lines[1..].iter().map(|l| l.rsplit(',').next().unwrap().parse().unwrap()).collect();
    assert!(lux.iter().all(|e| (1.0..3000.0).contains(e)), "{lux:?}");
    assert!(run.err.contains("reached") && run.err.contains("95 %"), "{}", run.err);

    let run = room.run(call.iter().chain(&["-o", "e.csv", "-q"]));
    assert_eq!((run.code, run.out.as_str(), run.err.as_str()), (Some(0), "", ""));
    assert_eq!(String::from_utf8(room.read("e.csv")).unwrap().lines().collect::<Vec<_>>(), lines);

    // Further columns are kept; an answer from before is replaced.
    let named = points.lines().enumerate().map(|(i, line)| format!("7,\"p, {i}\",{line}\n")).collect::<String>();
    room.write("p.csv", &format!("illuminance_lux,name,x,y,z,nx,ny,nz\n{named}"));
    let run = room.run(call);
    let kept: Vec<&str> = run.out.lines().collect();
    assert_eq!((kept[0], kept[2]), (&*format!("{},name", lines[0]), &*format!("{},\"p, 1\"", lines[2])));

    let result = room.run(call.iter().chain(&["--json"])).result();
    assert_eq!(result["irradiance"].as_array().unwrap().len(), 100);
    assert!(result["error"]["upper_95_one_sided"].as_f64().unwrap() <= 0.2);
}

/// Points in other axes or another unit than the scene: there is light nowhere, and the reason is told.
#[test]
fn points_outside_the_scene_are_told() {
    let room = Room::new("measure-outside");
    room.write("p.csv", "x,y,z,nx,ny,nz\n0.1,0,0.05,0,1,0\n0.3,-0.6,0,0,0,1\n300,0,100,0,1,0\n");
    let run = room.run(["measure", "--points", "p.csv", "--error", "20%"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.err.contains("warning: 2 of 3 points lie outside the scene"), "{}", run.err);
}

/// A point inside of a block reads no light, and that there is none in the scene would be the wrong reason. Points come by a pipe as well.
#[test]
fn points_without_light_are_told_and_levels_summed_up() {
    let room = Room::new("measure-dark");
    room.write("p.csv", "x,y,z,nx,ny,nz\n0.1,0.001,0.05,0,1,0\n0.2,0.1,0.2,0,1,0\n0.3,0.001,0.05,0,1,0\n");
    let mut command = room.command(["measure", "--points", "-", "--error", "20%", "--json"]);
    command.stdin(std::fs::File::open(room.path("p.csv")).unwrap());
    let run = Run::of(command.output().unwrap());
    let told = "1 of 3 points receives no light at all, the first at [0.2000, 0.1000, 0.2000]";
    assert!(run.code == Some(0) && run.out.contains(told), "{run:?}");
    let result = run.result();
    let lux: Vec<f64> = result["irradiance"].as_array().unwrap().iter().map(|e| e[1].as_f64().unwrap()).collect();
    let levels = &result["illuminance"];
    assert!(lux[0] > 0.0 && lux[1] == 0.0 && lux[2] > 0.0, "{lux:?}");
    assert!(levels["least"] == 0.0 && levels["uniformity"] == 0.0 && levels["mean"].as_f64().unwrap() > 1.0);
    assert!(levels["largest"].as_f64() > levels["mean"].as_f64());
    let lit = &result["illuminance_where_lit"];
    let near = |value: &serde_json::Value, expected: f64| (value.as_f64().unwrap() / expected - 1.0).abs() < 1e-6;
    assert!(lit["least"].as_f64() > Some(0.0) && near(&lit["mean"], 1.5 * levels["mean"].as_f64().unwrap()), "{lit}");
    let run = room.run(["measure", "--points", "p.csv", "--error", "20%"]);
    assert!(run.err.contains("without the points that receive none: mean "), "{run:?}");

    room.write("p.csv", "x,y,z,nx,ny,nz\n0.2,0.1,0.2,0,1,0\n");
    let run = room.run(["measure", "--points", "p.csv", "--error", "20%"]);
    assert!(run.code == Some(0) && run.err.contains("1 of 1 point receives no light at all"), "{run:?}");
    assert!(!run.err.contains("there is no light"), "{run:?}");
}

/// Classic methods and solvers by their names give the light that rays give.
#[test]
fn classic_methods_and_solvers_by_name() {
    let room = Room::new("classic");
    room.write("points.csv", "x,y,z,nx,ny,nz\n0.28,0,0.02,0,1,0\n0.1,0,0.5,0,1,0\n0.28,0.5487,0.1,0,-1,0\n");
    let measure = |further: &[&str]| -> Vec<f64> {
        let call = ["measure", "--points", "points.csv", "--error", "20%", "--element-size", "0.14", "--json"];
        let run = room.run([&call, further].concat());
        assert_eq!(run.code, Some(0), "{further:?}: {run:?}");
        let event: Value = serde_json::from_str(run.out.lines().last().unwrap()).unwrap();
        event["irradiance"].as_array().unwrap().iter().map(|e| e[1].as_f64().unwrap()).collect()
    };
    let expected = measure(&[]);
    for further in [
        ["--ff", "adaptive", "--solver", "cg"],
        // These gave up after all the work, asked for a residual that noise never reaches.
        ["--ff", "adaptive", "--solver", "random-walk"],
        ["--ff", "adaptive", "--solver", "stochastic-jacobi"],
        ["--ff", "hemicube", "--solver", "progressive"],
        ["--ff", "single-plane", "--solver", "lu"],
        ["--ff", "rays", "--solver", "gauss-seidel"],
    ] {
        for (found, expected) in measure(&further).into_iter().zip(&expected) {
            assert!((found / expected - 1.0).abs() < 0.1, "{further:?}: {found} for {expected}");
        }
    }
    let refused = |further: [&str; 2], why: &str| {
        let run = room.run([&["measure", "--points", "points.csv"], &further[..]].concat());
        assert!(run.code == Some(2) && run.err.contains(why), "{run:?}");
    };
    refused(["--ff", "guess"], "cubic-tetrahedron");
    refused(["--solver", "guess"], "gauss-seidel");
}
