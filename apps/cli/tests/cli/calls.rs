//! Calls and inputs that are wrong, and what is said of faults by every verb.

use crate::{LAMP, Room};
use std::fs;

#[test]
fn wrong_calls_and_inputs_exit_with_2_and_say_what_to_do() {
    let room = Room::new("wrong");
    room.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    room.write("bad.csv", "x,y,z\n1,2,3\n");
    room.write("good.csv", "x,y,z,nx,ny,nz\n0.3,0,0.3,0,1,0\n");
    room.write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (call, said) in [
        ("", "Usage"),
        ("bakke", "similar subcommand exists: 'bake'"),
        ("bake --eror 1%", "similar argument exists: '--error'"),
        ("bake -error 1%", "unexpected argument '-e'"),
        ("bake --error 1", "such as 1%"),
        ("bake --error nan", "such as 1%"),
        ("bake --error 0%", "such as 1%"),
        ("bake --element-size 0", "above 0"),
        ("bake --delta-e 0", "from 0.001 to 100"),
        ("render -o a.png --delta-e -1", "from 0.001 to 100"),
        ("bake --time 60", "from 1s to 24h with its unit"),
        ("measure --points good.csv --budget 1", "from 1s to 24h with its unit"),
        ("compare --time 60", "from 1s to 24h with its unit"),
        ("render -o a.png --frames good.csv", "--frames good.csv: is no folder"),
        ("render -o a.png --frames none/below", "--frames none/below: cannot be made"),
        ("bake --memory lots", "500M or 4G"),
        ("bake --memory 4", "a size with its unit, such as 500M or 4G"),
        ("bake --seed one", "invalid digit"),
        ("bake --size 0x5", "1280x720"),
        ("bake --exposure inf", "-60 to 60"),
        ("bake --texels-per-metre 1e9", "1.9e18 texels need 1.1e15 MB at least; 4.0 GB are allowed (use 1755 or less"),
        ("bake --texels-per-metre inf", "above 0"),
        ("bake --texels-per-metre 85 --memory 8M --element-size 0.3 --error 50%", "ask for fewer per metre"),
        (
            "bake --element-size 1e-9",
            "3.8e18 elements need 1.9e15 MB at least; 4.0 GB are allowed (use 0.00075 or more",
        ),
        ("render -o a.png --element-size 1e-9", "elements need"),
        ("measure --points good.csv --element-size 1e-9", "elements need"),
        ("bake --max-atlas 3", "16..=16384"),
        ("bake --vertices --unlit", "cannot be used with"),
        ("bake --threads 0", "1..=1024"),
        ("bake --up w", "y or z"),
        ("bake --sky green", "uniform:L"),
        ("bake --sky uniform:-1", "uniform:L"),
        ("bake --sky hdr:none.hdr", "none.hdr: cannot be read"),
        ("bake none.glb", "none.glb: cannot be read: No such file"),
        ("bake bad.obj", "bad.obj"),
        ("bake picture.stl", ".glb, .gltf or .obj"),
        ("bake -o out.gltf", "must end in .glb"),
        ("bake --report out.txt", "must end in .json or .html"),
        ("bake --camera 7", "its cameras: 0 = 'front'"),
        ("bake --element-size -1", "above 0"),
        ("bake --texels-per-metre -5", "above 0"),
        ("bake --error -1%", "such as 1%"),
        ("bake --memory -1G", "500M or 4G"),
        ("bake --rounds -1", "invalid digit"),
        ("bake --threads -1", "1..=1024"),
        ("bake --unit cm", "--unit is for .obj files"),
        ("bake a.glb --obj-double-sided", "--obj-double-sided is for .obj files"),
        ("bake --up z", "--up is for scenes from files"),
        ("bake --vertices --max-atlas 64", "cannot be used with"),
        ("bake --unlit --lightmap-encoding linear", "cannot be used with"),
        ("bake --sky uniform:1 --sky overcast:1", "cannot be used multiple times"),
        ("check -q -v", "cannot be used with"),
        ("check .", ".: is a folder (name the .glb"),
        ("render -o a.png --eye 1,2,3", "--target <X,Y,Z>"),
        ("render -o a.png --target 1,2,3", "--eye <X,Y,Z>"),
        ("render -o a.png --size -5x10", "use WIDTHxHEIGHT"),
        ("render -o a.png --eye 1,2 --target 1,2,3", "three numbers, X,Y,Z"),
        ("render -o a.png --eye -1,2,3 --target -1,2,3", "the same place"),
        ("render -o a.png --eye 1,2,3 --target 0,0,0 --camera front", "cannot be used with"),
        ("render -o a.png --eye 1,2,3 --target 0,0,0 --fov 200", "degrees from 1 to 170"),
        (
            "bake --memory 1K",
            "1 MB at least, to be welded, seen by rays and solved; 1.0 KB are allowed (allow more by --memory)",
        ),
        (
            "bake --solver lu --element-size 0.003",
            "450 GB; 4.0 GB are allowed (use a larger --element-size, an iterative --solver",
        ),
        ("bake --solver cg", "those by rays do not (find them by --ff adaptive, or take another --solver"),
        ("render -o a.png --solver cholesky --ff hemicube", "--ff adaptive"),
        ("measure --points good.csv --solver random-walk", "--ff adaptive"),
        ("bake --solver stochastic-jacobi", "--ff adaptive"),
        ("bake one.obj -o lit.obj", "must end in .glb"),
        ("render", "--output"),
        ("render -o a.jpg", ".png or .exr"),
        ("measure", "--points"),
        ("measure --points none.csv", "none.csv: cannot be read"),
        ("measure --points bad.csv", "no column nx, ny, nz"),
        ("check none.obj", "none.obj: cannot be read"),
        (
            "compare --methods hemicub",
            "no form-factor method is called \"hemicub\"; there are rays, adaptive, hemicube",
        ),
        ("compare --methods=", "no form-factor method is called \"\""),
        ("compare --solvers cg,gauss", "no solver is called \"gauss\"; there are jacobi"),
        ("compare --budget 60", "from 1s to 24h with its unit"),
        ("compare --elements 0", "4..=1000000"),
        ("view --elements 0", "1..=4294967295"),
        ("compare --memory 1M", "ask for fewer elements"),
        ("compare -o a.pdf", "must end in .html or .json"),
        ("factors .", ".: is a folder (name the .vs3, .glb"),
    ] {
        let run = room.run(call.split_whitespace());
        assert_eq!(run.code, Some(2), "{call}: {run:?}");
        assert!(run.err.contains(said), "{call}: {}", run.err);
        assert!(run.out.is_empty() && !run.err.contains("panicked"), "{call}: {run:?}");
        assert!(run.err.matches("error:").count() <= 1, "{call}: {}", run.err);
        assert!(!run.err.contains("as a value"), "{call}: {}", run.err);
    }
    assert_eq!(room.names(), ["bad.csv", "bad.obj", "good.csv", "one.obj"], "nothing is left of a failed run");
    for help in ["--help", "--version", "bake --help"] {
        assert_eq!(room.run(help.split(' ')).code, Some(0));
    }
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let room = Room::new("refused");
    room.write("room.glb", "not read before");
    room.write("file", "");
    room.write("points.csv", "x,y,z,nx,ny,nz\n0.3,0,0.3,0,1,0\n");
    fs::create_dir(room.0.join("folder.glb")).unwrap();
    let before = room.names();
    for (call, said) in [
        ("bake -o nowhere/a.glb", "nowhere/a.glb: there is no folder nowhere; make it first"),
        ("bake --report nowhere/a.html", "there is no folder nowhere"),
        ("bake -o file/a.glb", "file"),
        ("bake -o folder.glb", "is a folder"),
        ("bake room.glb -o room.glb", "is read by this run"),
        ("bake room.glb -o ./../refused/room.glb", "is read by this run"),
        ("bake --report a.html --report ./a.html", "two outputs"),
        ("bake -o a.glb --image a.lightmap0.exr", "two outputs"),
        ("render -o nowhere/a.png", "there is no folder nowhere"),
        ("measure --points points.csv -o points.csv", "is read by this run"),
    ] {
        let run = room.run(["--json"].into_iter().chain(call.split(' ')));
        assert_eq!(run.code, Some(2), "{call}: {run:?}");
        assert!(run.err.contains(said), "{call}: {}", run.err);
        let events = run.events();
        assert_eq!(events.len(), 1, "{call}: no stage has begun: {events:?}");
        assert_eq!((&events[0]["event"], &events[0]["exit_code"]), (&"error".into(), &2.into()));
        assert!(events[0]["message"].as_str().unwrap().contains(said));
    }
    assert_eq!(room.names(), before);
}

/// Pictures and buffers are inputs as well as the file that names them.
#[test]
fn files_that_a_scene_refers_to_are_not_replaced() {
    let room = Room::new("spared");
    room.write("one.obj", "mtllib one.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
    room.write("one.mtl", "newmtl a\nmap_Kd wood.png\nmap_Bump -bm 0.5 bump.png\n");
    room.write("bump.png", "is not read");
    fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/cornell.png"), room.0.join("wood.png")).unwrap();
    let before = fs::read(room.0.join("wood.png")).unwrap();
    for call in ["render one.obj --sky uniform:1 -o wood.png", "bake one.obj --sky uniform:1 --image ./wood.png"] {
        let run = room.run(call.split(' '));
        assert!(run.code == Some(2) && run.err.contains("wood.png: is read by this run"), "{call}: {run:?}");
    }
    let run = room.run("render one.obj --sky uniform:1 -o bump.png".split(' '));
    assert!(run.code == Some(2) && run.err.contains("bump.png: is read by this run"), "{run:?}");
    assert!(fs::read(room.0.join("wood.png")).unwrap() == before);
    assert_eq!(room.names(), ["bump.png", "one.mtl", "one.obj", "wood.png"]);
}

#[test]
fn a_call_that_cannot_be_read_is_an_event_too() {
    let room = Room::new("unread");
    for call in ["bake --json --error 1", "--json bakke", "render --json"] {
        let run = room.run(call.split(' '));
        let events = run.events();
        assert_eq!((run.code, events.len()), (Some(2), 1), "{call}: {run:?}");
        assert_eq!((&events[0]["event"], &events[0]["exit_code"]), (&"error".into(), &2.into()));
        assert!(run.err.starts_with(events[0]["message"].as_str().unwrap()), "{call}: {run:?}");
    }
    assert_eq!(room.run(["--json", "--help"]).code, Some(0));
    let quiet = room.run(["check", "--json", "-q"]);
    assert_eq!(quiet.events().len(), 1);
}

/// Other verbs were silent about what `check` finds.
#[test]
fn every_verb_tells_the_same_faults() {
    let room = Room::new("faults");
    room.write(
        "two.obj",
        "o floor\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 4 3\no rug\nv .2 .1 0\nv .5 .1 0\nv .5 .2 0\nf 5 6 7\n",
    );
    let sky = ["two.obj", "--sky", "uniform:100", "--json"];
    let checked = room.run(["check"].iter().chain(&sky)).result();
    let said = checked["faults"].to_string();
    for fault in ["1 edge lies between", "1 triangle lies in one plane with object 'floor', overlaps it and faces"] {
        assert!(said.contains(fault), "{said}");
    }
    let bake = ["bake", "--vertices", "--report", "r.json", "--size", "9x9", "--error", "50%", "--rounds", "0"];
    let baked = room.run(bake.iter().chain(&sky));
    assert_eq!(baked.result()["report"]["faults"], checked["faults"]);
    assert!(baked.out.contains("--size has no effect: no picture"), "{}", baked.out);
    assert_eq!(baked.result()["report"]["scene"]["other_light"][0], "a uniform sky");
}

/// Most models from a library have no lamp: their first bake was black, and its error of nothing "reached".
#[test]
fn the_lack_of_any_light_is_told() {
    let room = Room::new("no-light");
    // A lamp that no face is made of gives no light.
    room.write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    room.write("a.mtl", "newmtl lamp\nKe 9 9 9\n");
    let warning = "warning: a.obj: there is no light, and all will be black (give it a sky, --sky overcast:10000, ";
    for call in ["check", "check --sky uniform:0"] {
        let checked = room.run(call.split(' ').chain(["a.obj"]));
        assert!(checked.code == Some(0) && checked.out.contains(warning), "{call}: {checked:?}");
    }
    assert!(!room.run(["check", "a.obj", "--sky", "overcast:1000"]).out.contains("no light"));
    let baked = room.run(["bake", "a.obj", "--vertices"]);
    assert_eq!(baked.code, Some(0));
    assert!(baked.err.contains(warning) && baked.err.contains("the answer has none"), "{}", baked.err);
    assert!(!baked.err.contains("reached"), "{}", baked.err);
}

/// Notes on the rest of a damaged file were printed below its fault.
#[test]
fn a_fault_that_ends_a_run_is_told_with_its_reasons_and_nothing_else() {
    let room = Room::new("fatal");
    room.write("short.gltf", &LAMP.replace("\"count\":3", "\"count\":9"));
    room.write("nan.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n");
    for (name, severities) in [("short.gltf", &["error"][..]), ("nan.obj", &["warning", "warning", "error"])] {
        for verb in ["check", "bake"] {
            let run = room.run([verb, "-v", name]);
            let told: Vec<&str> = run.err.lines().filter_map(|line| Some(line.split_once(':')?.0)).collect();
            assert_eq!((run.code, told.as_slice()), (Some(2), severities), "{run:?}");
        }
    }
}
