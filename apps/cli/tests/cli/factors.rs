//! `radiosity factors`.

use crate::Room;
use serde_json::Value;

/// Two unit squares a metre apart, a half-size one between.
const SQUARES: &str = "T squares\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\nV 5 0 0 1\nV 6 1 0 1\nV 7 1 1 1\nV 8 0 1 1\n\
                       V 9 .25 .25 .5\nV 10 .75 .25 .5\nV 11 .75 .75 .5\nV 12 .25 .75 .5\n\
                       S 1 1 2 3 4 0 0 .8 floor\nS 2 8 7 6 5 0 0 .4 ceiling\nO 3 9 10 11 12\nEnd of data\n";

#[test]
fn factors_are_written_by_the_ending() {
    let room = Room::new("factors");
    room.write("squares.vs3", SQUARES);
    for name in ["f.csv", "f.npz", "f.mtx", "f.txt"] {
        let run = room.run(["factors", "squares.vs3", "-o", name]);
        assert_eq!(run.code, Some(0), "{run:?}");
        assert!(!room.read(name).is_empty());
    }
    let text = String::from_utf8(room.read("f.csv")).unwrap();
    let rows: Vec<Vec<f64>> = text.lines().map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    assert_eq!((rows.len(), rows[0].len()), (2, 2));
    assert!((rows[0][1] - 0.099_506_294_6).abs() < 1e-5 && rows[0][1] == rows[1][0]);

    let run = room.run(["factors", "squares.vs3", "--json", "--method", "exact"]);
    let event: Value = serde_json::from_str(run.out.lines().last().unwrap()).unwrap();
    assert!((event["factors"][0][1].as_f64().unwrap() - 0.199_824_895_7).abs() < 1e-9, "{event}");
    let run = room.run(["factors", "squares.vs3", "--json", "--script-f"]);
    let event: Value = serde_json::from_str(run.out.lines().last().unwrap()).unwrap();
    let f = rows[0][1];
    let exact = 0.8 * f * 0.4 / (1.0 - 0.2 * 0.6 * f * f);
    assert!((event["factors"][0][1].as_f64().unwrap() - exact).abs() < 1e-8, "{event}");
}

#[test]
fn factors_refuse_what_makes_no_sense() {
    let room = Room::new("factors-refused");
    room.write("squares.vs3", SQUARES);
    room.write("broken.vs3", "T broken\nF 3\nV 1 0 0\nS 1 1 2 3 4 0 0 .8 floor\nEnd\n");
    let refused = |arguments: &[&str], why: &str| {
        let run = room.run([&["factors"], arguments].concat());
        assert!(run.code == Some(2) && run.err.contains(why), "{arguments:?}: {run:?}");
    };
    refused(&["broken.vs3"], "broken.vs3:3");
    refused(&["squares.vs3", "--method", "guess"], "hemicube");
    refused(&["squares.vs3", "-o", "f.doc"], "must end in");
    refused(&["squares.vs3", "--close", "--method", "hemicube"], "adaptive");
    refused(&["squares.vs3", "--by", "element"], ".vs3");
    refused(&["squares.vs3", "--by", "object"], "--by is for scenes");
    refused(&["squares.vs3", "--resolution", "64"], "adaptive does not");
    refused(&["squares.vs3", "--resolution", "64", "--method", "lambert"], "lambert does not");
    refused(&["squares.vs3", "--resolution", "4096", "--method", "hemicube"], "even and at most 2048");
    refused(&["squares.vs3", "--resolution", "65", "--method", "single-plane"], "even and at most 2048");
    refused(&["squares.vs3", "--accuracy", "1e-3", "--method", "hemicube"], "hemicube is as exact as it is");
    refused(&["--unit", "mm"], "--unit is for");
    refused(&["--element-size", "0.1"], "--by element");
    refused(
        &["--by", "element", "--element-size", "0.1", "--memory", "1K", "--method", "disc"],
        "than the 1.0 KB allowed",
    );
    refused(&["--by", "element"], "--element-size");
    // Elements that take more than memory before a factor is asked for.
    refused(
        &["--by", "element", "--element-size", "1e-9", "--memory", "16M"],
        "elements take more than the 16 MB allowed",
    );
    refused(&["--script-f"], "emittance");
    refused(&["--by", "element", "--element-size", "0.02", "--memory", "1M"], "allow more");
    assert_eq!(room.names(), ["broken.vs3", "squares.vs3"]);
}

/// Whoever chose `exact` by its name had light go through furniture.
#[test]
fn help_names_the_methods_that_see_no_occlusion() {
    let room = Room::new("help");
    for verb in ["factors", "bake"] {
        let help = room.run([verb, "--help"]).out;
        let words: Vec<&str> = help.split_whitespace().collect();
        let words = words.join(" ");
        assert!(words.contains("`contour` and `exact` do not see what stands between"), "{verb}: {words}");
    }
}

/// A wall with a mask, a null surface and a combined one, a plate before it, and the opposite wall.
const WALL: &str = "T wall\nF 3\nV 1 0 0 0\nV 2 4 0 0\nV 3 4 3 0\nV 4 0 3 0\nV 5 0 0 2\nV 6 4 0 2\nV 7 4 3 2\nV 8 0 3 2\n\
                    V 9 .5 .5 0\nV 10 1 .5 0\nV 11 1 1 0\nV 12 .5 1 0\nV 13 2 .5 0\nV 14 3 .5 0\nV 15 3 1 0\nV 16 2 1 0\n\
                    V 17 1 1 1\nV 18 2 1 1\nV 19 2 2 1\nV 20 1 2 1\nV 21 2 2 0\nV 22 3 2 0\nV 23 3 2.5 0\nV 24 2 2.5 0\n\
                    S 1 1 2 3 4 0 0 .9 wall\nS 2 8 7 6 5 0 0 .8 opposite\nM 3 12 11 10 9 1 0 .6 cupboard\n\
                    N 4 16 15 14 13 1 0 .4 hole\nS 5 21 22 23 24 1 2 .8 panel\nO 6 17 18 19 20\nEnd of data\n";

/// The summary told of fewer surfaces than the file has rows, and `error` was missing in it.
#[test]
fn rows_of_masks_and_lack_of_rows_are_explained() {
    let room = Room::new("factors-masks");
    room.write("wall.vs3", WALL);
    let run = room.run(["factors", "wall.vs3", "-o", "f.npz"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    for said in [
        "wall.vs3: 2 surfaces",
        "1 mask: 3 'cupboard' upon 'wall'",
        "the matrix has 3 rows, 2 of surfaces and 1 of masks",
        "1 null surface has no row: what it covers is no part of the base and lets nothing through (4 'hole')",
        "1 surface is combined with another and counted there (5 'panel' with 'opposite')",
        "1 obstruction has no row",
        "errors of factors at most",
    ] {
        assert!(run.err.contains(said), "{said}: {}", run.err);
    }
    let holds = |bytes: Vec<u8>, name: &[u8]| bytes.windows(name.len()).any(|part| part == name);
    assert!(holds(room.read("f.npz"), b"error.npy"));

    let script = room.run(["factors", "wall.vs3", "--script-f", "-o", "s.npz"]);
    assert_eq!(script.code, Some(0), "{script:?}");
    for said in [
        "script-F has 2 rows, of surfaces",
        "rows of F sum to",
        "script-F, with all reflections in it, is what goes out",
    ] {
        assert!(script.err.contains(said), "{said}: {}", script.err);
    }
    assert!(script.err.contains("no error is known of it") && !holds(room.read("s.npz"), b"error.npy"));
}

#[test]
fn an_accuracy_that_was_not_reached_and_rows_above_one_are_warned_of() {
    let room = Room::new("factors-doubt");
    room.write("squares.vs3", SQUARES);
    let fine = room.run(["factors", "squares.vs3", "--accuracy", "1e-3"]);
    assert!(fine.code == Some(0) && !fine.err.contains("warning"), "{fine:?}");
    let call = ["factors", "squares.vs3", "--accuracy", "1e-30", "-o", "f.npz"];
    let missed = room.run(call);
    assert_eq!(missed.code, Some(0), "{missed:?}");
    assert!(
        missed.err.contains("warning: the accuracy of 1e-30 was not reached between 1 pair of surfaces"),
        "{missed:?}"
    );
    assert_eq!(missed.err.matches("errors of factors at most").count(), 1, "{missed:?}");
    let event = room.run(call.iter().chain(&["--json"])).result();
    assert_eq!(event["accuracy_missed"]["pairs"], 1, "{event}");
    assert!(event["largest_error"]["error"].as_f64().unwrap() > 1e-30, "{event}");
    let mut pair: Vec<&str> =
        event["largest_error"]["pair"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    pair.sort_unstable();
    assert_eq!(pair, ["ceiling", "floor"]);
    assert!(event["excess"].is_null(), "{event}");

    // A second floor in the place of the first.
    room.write(
        "twice.vs3",
        &SQUARES
            .replace("O 3 9 10 11 12", "S 3 1 2 3 4 0 0 .8 again")
            .replace(" 0 0 1\n", " 0 0 .05\n")
            .replace(" 1 0 1\n", " 1 0 .05\n")
            .replace(" 1 1 1\n", " 1 1 .05\n")
            .replace(" 0 1 1\n", " 0 1 .05\n"),
    );
    let twice = room.run(["factors", "twice.vs3"]);
    assert!(
        twice.err.contains("warning: 1 row sums to more than one") && twice.err.contains("at 'ceiling'"),
        "{twice:?}"
    );
}

/// All rows went out in silence; matrices for writing were no part of the memory; a name filled a .npz with zeros.
#[test]
fn what_factors_do_not_do_is_told() {
    let room = Room::new("factors-told");
    room.write("row.vs3", &SQUARES.replace("F 3\n", "F 3\nC row=1\n"));
    let run = room.run(["factors", "row.vs3"]);
    assert!(run.code == Some(0) && run.err.contains("warning: row.vs3: row=1 col=0"), "{run:?}");
    room.write("squares.vs3", SQUARES);
    let run = room.run(["factors", "squares.vs3"]);
    assert!(run.code == Some(0) && !run.err.contains("warning"), "{run:?}");
    let run = room.run(["factors", "squares.vs3", "--script-f", "--memory", "0.1K"]);
    assert!(run.code == Some(2) && run.err.contains("script-F of 2 surfaces needs full matrices"), "{run:?}");

    let name = "n".repeat(5000);
    room.write("long.obj", &format!("v 0 0 0\nv 1 0 0\nv 0 1 0\no {name}\nf 1 2 3\n"));
    let run = room.run(["factors", "long.obj", "-o", "f.npz"]);
    assert!(run.code == Some(2) && run.err.contains("has 5000 characters"), "{run:?}");
    assert_eq!(room.run(["factors", "long.obj", "-q", "-o", "f.csv"]).code, Some(0));
}

/// A row of zeros looks like a fault until it is told why it is one: squares with a third between them that hides all, and one
/// that looks away.
#[test]
fn rows_of_zeros_are_explained() {
    let room = Room::new("factors-zeros");
    let hidden = SQUARES.replace(".25", "0").replace(".75", "1");
    room.write("hidden.vs3", &hidden.replace("End of data", "S 4 5 6 7 8 0 0 .5 away\nEnd of data"));
    let run = room.run(["factors", "hidden.vs3"]);
    assert!(run.code == Some(0) && run.err.contains("3 rows are all zero: their surfaces see no other: "), "{run:?}");
    let why = "'floor' (covered or walled in), 'ceiling' (covered or walled in), 'away' (none faces it)";
    assert!(run.err.contains(why), "{run:?}");
    // A method that looks from points and along rays knows what it met, no more.
    let sampled = room.run(["factors", "hidden.vs3", "--method", "hemicube"]);
    let why = "'floor' (nothing was met), 'ceiling' (nothing was met), 'away' (none faces it)";
    assert!(sampled.code == Some(0) && sampled.err.contains(why), "{sampled:?}");
    let event = room.run(["factors", "hidden.vs3", "--json"]).result();
    assert_eq!(event["zero_rows"], serde_json::json!(["floor", "ceiling", "away"]), "{event}");
    room.write("squares.vs3", SQUARES);
    assert!(!room.run(["factors", "squares.vs3"]).err.contains("zero"));
}
