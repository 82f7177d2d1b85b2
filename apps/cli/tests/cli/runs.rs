//! What holds for runs of any verb: the same bytes, no half of the files, interrupts, readers that went away.

use crate::{COARSE, Room, Run};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let room = Room::new("threads");
    let ways: [&[&str]; 3] = [&["--texels-per-metre", "40"], &["--vertices"], &["--unlit"]];
    for (way, options) in ways.iter().enumerate() {
        let ending = if way == 1 { "exr" } else { "png" };
        for threads in ["1", "2"] {
            fs::create_dir(room.0.join(threads)).unwrap();
            let (model, image) = (format!("{threads}/a.glb"), format!("{threads}/a.{ending}"));
            let call = ["bake", "--threads", threads, "-o", &model, "--image", &image];
            let run = room.run(call.iter().chain(&COARSE).chain(*options));
            assert_eq!(run.code, Some(0), "{run:?}");
        }
        let mut names: Vec<_> =
            fs::read_dir(room.0.join("1")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        let expected: &[&str] =
            if way == 0 { &["a.glb", "a.lightmap0.exr", "a.png"] } else { &["a.glb", &format!("a.{ending}")] };
        let mut expected = expected.to_vec();
        expected.sort_unstable();
        assert_eq!(names, expected);
        for name in names {
            assert!(room.read(&format!("1/{name}")) == room.read(&format!("2/{name}")), "{options:?} {name}");
        }
        for threads in ["1", "2"] {
            fs::remove_dir_all(room.0.join(threads)).unwrap();
        }
    }
}

#[test]
fn a_run_that_fails_late_changes_no_file() {
    let room = Room::new("late");
    for name in ["a.glb", "a.lightmap0.exr", "a.png"] {
        room.write(name, "precious");
    }
    let call = ["bake", "--json", "-o", "a.glb", "--image", "a.png", "--report", "a.json", "--texels-per-metre", "20"];
    let mut child =
        room.command(call.iter().chain(&COARSE)).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The first line comes after the outputs were examined; then somebody takes the report's name.
    let mut out = BufReader::new(child.stdout.take().unwrap());
    out.read_line(&mut String::new()).unwrap();
    fs::create_dir(room.0.join("a.json")).unwrap();
    out.read_to_string(&mut String::new()).unwrap();
    let run = Run::of(child.wait_with_output().unwrap());
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("a.json"), "{}", run.err);
    assert_eq!(room.names(), ["a.glb", "a.json", "a.lightmap0.exr", "a.png"]);
    for name in ["a.glb", "a.lightmap0.exr", "a.png"] {
        assert_eq!(room.read(name), b"precious", "{name}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_long_run_at_once_and_leaves_nothing() {
    let room = Room::new("interrupt");
    room.write("a.glb", "precious");
    let call = ["bake", "--json", "-o", "a.glb", "--image", "a.png", "--error", "0.01%", "--rounds", "40"];
    let mut child = room.command(call).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    while !line.contains("\"rays\"") {
        line.clear();
        assert!(out.read_line(&mut line).unwrap() > 0, "the run ended by itself");
    }
    let sent = std::time::Instant::now();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let mut rest = String::new();
    out.read_to_string(&mut rest).unwrap();
    let run = Run::of(child.wait_with_output().unwrap());
    // A second leaves room for a busy machine; the rays of this run would take minutes.
    assert!(sent.elapsed().as_secs_f64() < 3.0, "{:?}", sent.elapsed());
    assert_eq!((run.code, run.err.as_str()), (Some(130), "interrupted\n"));
    let last: Value = serde_json::from_str(rest.lines().last().unwrap()).unwrap();
    assert_eq!((&last["event"], &last["exit_code"]), (&"error".into(), &130.into()));
    assert_eq!(room.names(), ["a.glb"]);
    assert_eq!(room.read("a.glb"), b"precious");
}

/// Rays that the memory does not hold lie in a temporary file: the same bytes, or an error where there is no place for it.
#[test]
fn rays_beyond_the_memory_lie_in_a_temporary_file() {
    let room = Room::new("memory");
    let call = |output: &str, memory: &str| {
        let call = ["render", "-v", "--memory", memory, "-o", output, "--rounds", "0"];
        let mut command = room.command(call.iter().chain(&COARSE));
        command.env("TMPDIR", &room.0).env("TMP", &room.0);
        command
    };
    let run = |output: &str, memory: &str| Run::of(call(output, memory).output().unwrap());
    let (whole, little) = (run("a.exr", "1G"), run("b.exr", "900K"));
    assert_eq!((whole.code, little.code), (Some(0), Some(0)), "{whole:?} {little:?}");
    assert!(!whole.err.contains("temporary file") && little.err.contains("temporary file in "), "{}", little.err);
    assert!(room.read("a.exr") == room.read("b.exr"));

    let nowhere = room.0.join("nowhere");
    let failed = Run::of(call("c.exr", "900K").env("TMPDIR", &nowhere).env("TMP", &nowhere).output().unwrap());
    assert_eq!(failed.code, Some(1), "{failed:?}");
    for said in ["KB that memory does not hold", "nowhere: ", "allow more memory, or set"] {
        assert!(failed.err.contains(said) && !failed.err.contains("panicked"), "{}", failed.err);
    }
    assert_eq!(room.names(), ["a.exr", "b.exr"]);
}

#[cfg(target_os = "linux")]
#[test]
fn an_answer_that_nobody_can_read_is_a_failure_and_no_panic() {
    let room = Room::new("full");
    for call in [&["check"][..], &["check", "--json"]] {
        let full = fs::File::create("/dev/full").unwrap();
        let run = Run::of(room.command(call).stdout(full).stderr(Stdio::piped()).output().unwrap());
        assert_eq!(run.code, Some(1), "{run:?}");
        assert!(run.err.starts_with("error: standard output") && run.err.lines().count() == 1, "{}", run.err);
    }
    // Progress that nobody reads does not cost the model.
    let full = fs::File::create("/dev/full").unwrap();
    let call = ["bake", "--json", "--vertices", "-o", "a.glb"];
    let run = Run::of(room.command(call.iter().chain(&COARSE)).stdout(full).stderr(Stdio::piped()).output().unwrap());
    assert_eq!((run.code, room.names()), (Some(1), vec!["a.glb".to_owned()]), "{run:?}");
}
