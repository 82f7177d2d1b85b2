//! The program from outside: exit codes, streams, files, interrupts.

use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Options of a bake that takes a moment.
const COARSE: [&str; 6] = ["--error", "20%", "--element-size", "0.15", "--size", "48x48"];

/// A folder of a test's own, gone with it.
struct Room(PathBuf);

impl Room {
    fn new(name: &str) -> Room {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Room(path)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.0.join(name), text).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.0.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    fn command<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_radiosity"));
        command.current_dir(&self.0).args(arguments);
        command
    }

    fn run<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Run {
        Run::of(self.command(arguments).output().unwrap())
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// What a run said.
#[derive(Debug)]
struct Run {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Run {
    fn of(output: Output) -> Run {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Run { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }

    /// Standard output as events: one object to a line, and nothing else.
    fn events(&self) -> Vec<Value> {
        let parse = |line: &str| -> Value { serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}")) };
        let events: Vec<Value> = self.out.lines().map(parse).collect();
        assert!(events.iter().all(|e| e["event"].is_string()), "{}", self.out);
        assert!(self.out.is_empty() || self.out.ends_with('\n'));
        events
    }

    /// The last event, which must be the result.
    fn result(&self) -> Value {
        assert_eq!((self.code, self.err.as_str()), (Some(0), ""), "{self:?}");
        let mut events = self.events();
        assert_eq!(events.iter().filter(|e| e["event"] == "result").count(), 1);
        let last = events.pop().unwrap();
        assert_eq!(last["event"], "result");
        last
    }
}

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
        ("bake --memory lots", "500M or 4G"),
        ("bake --memory 4", "a size with its unit, such as 500M or 4G"),
        ("bake --seed one", "invalid digit"),
        ("bake --size 0x5", "1280x720"),
        ("bake --exposure inf", "-60 to 60"),
        ("bake --texels-per-metre 1e9", "1.9e18 texels need 7.3e14 MB at least; 4.0 GB are allowed (use 2149 or less"),
        ("bake --texels-per-metre inf", "above 0"),
        ("bake --texels-per-metre 104 --memory 8M --element-size 0.3 --error 50%", "ask for fewer per metre"),
        (
            "bake --element-size 1e-9",
            "3.8e18 elements need 9.4e14 MB at least; 4.0 GB are allowed (use 0.00053 or more",
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
        ("bake --camera 7", "it has 0 'front'"),
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
        ("render -o a.png --fov 30", "--eye <X,Y,Z>"),
        ("render -o a.png --eye 1,2 --target 1,2,3", "three numbers, X,Y,Z"),
        ("render -o a.png --eye -1,2,3 --target -1,2,3", "the same place"),
        ("render -o a.png --eye 1,2,3 --target 0,0,0 --camera front", "cannot be used with"),
        ("render -o a.png --eye 1,2,3 --target 0,0,0 --fov 200", "degrees from 1 to 170"),
        ("bake --memory 1K", "1.0 KB are allowed (use larger elements or allow more"),
        (
            "bake --solver lu --element-size 0.003",
            "TB; 4.0 GB are allowed (use a larger --element-size, an iterative --solver",
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
        ("compare --budget 60", "with its unit from 1s to 24h"),
        ("compare --elements 0", "4..=1000000"),
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
    assert!(said.contains("38 triangles in 19 objects") && said.contains("4 materials"), "{said}");
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
        said.contains("warning: turned.obj: object 'cube': 4 edges lie between faces that look opposite"),
        "{said}"
    );
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
    assert!(baked.err.contains(warning) && baked.err.contains("all is black"), "{}", baked.err);
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

/// A triangle under a point light.
const LAMP: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
"extensionsUsed":["KHR_lights_punctual"],
"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","name":"bulb","intensity":100}]}},
"nodes":[{"mesh":0},{"translation":[0,2,0],"extensions":{"KHR_lights_punctual":{"light":0}}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAAAAAAAAAAIA/AACAPwAAAAAAAAAA"}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,0,1]}]}"#;

/// The lit triangle as sheets of so many materials: the first is on it.
fn sheets(materials: &[Value]) -> String {
    let materials = serde_json::json!(materials).to_string();
    let used = LAMP.replace(r#""POSITION":0}"#, r#""POSITION":0},"material":0"#);
    used.replacen('{', &format!(r#"{{"materials":{materials},"#), 1)
}

/// A material that passes light by KHR_materials_diffuse_transmission, green.
fn sheet(name: &str, base: f64, factor: f64, color: f64) -> Value {
    serde_json::json!({ "name": name, "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorFactor": [0, base, 0, 1] },
        "extensions": { "KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": factor, "diffuseTransmissionColorFactor": [0, color, 0] } } })
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
    let call = ["bake", "--error", "0.1%", "--rounds", "0", "--memory", "2M", "--element-size", "0.3", "--vertices"];
    let run = room.run(call.iter().chain(&["-o", "a.glb", "--size", "32x32", "--report", "a.html"]));
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.err.contains("NOT reached"), "{}", run.err);
    assert!(String::from_utf8(room.read("a.html")).unwrap().contains("The asked error is NOT reached"));
    assert_eq!(room.names(), ["a.glb", "a.html"]);
}

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

#[test]
fn a_picture_is_the_same_by_render_and_by_bake() {
    let room = Room::new("render");
    let run = room.run(["render", "--json", "-o", "a.png"].iter().chain(&COARSE));
    assert_eq!(run.result()["width"].as_u64(), Some(48));
    let bake = ["bake", "--vertices", "-o", "b.glb", "--image", "b.png"];
    assert_eq!(room.run(bake.iter().chain(&COARSE)).code, Some(0));
    assert!(room.read("a.png") == room.read("b.png"));
    assert_eq!(room.run(["render", "-o", "a.exr"].iter().chain(&COARSE)).code, Some(0));
    assert_eq!(room.read("a.exr")[..4], [0x76, 0x2f, 0x31, 0x01]);
}

/// Things stood before a black sky, and pictures were thought to have failed.
#[test]
fn the_black_below_an_overcast_sky_is_explained() {
    let room = Room::new("horizon");
    room.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let call = ["render", "a.obj", "-o", "a.png", "--error", "50%", "--rounds", "0", "--size", "32x32"];
    for (sky, eye, is_told) in
        [("overcast:1000", "0.3,3,3", true), ("uniform:300", "0.3,3,3", false), ("overcast:1000", "0.3,-3,3", false)]
    {
        let run = room.run(call.iter().chain(&["--sky", sky, "--eye", eye, "--target", "0.3,0.3,0"]));
        assert_eq!((run.code, run.err.contains("ends at the horizon")), (Some(0), is_told), "{run:?}");
    }
}

#[test]
fn the_eye_is_put_where_it_is_asked() {
    let room = Room::new("eye");
    // The room's own camera in other words, with another angle of view, and from where it looks to.
    let fov = (2.0 * (0.0125f64 / 0.035).atan()).to_degrees().to_string();
    let (eye, target) = ("0.278,0.273,-0.8", "0.278,0.273,0");
    let views: [&[&str]; 4] = [
        &["--camera", "front"],
        &["--eye", eye, "--target", target, "--fov", &fov],
        &["--eye", eye, "--target", target, "--fov", "30"],
        &["--eye", target, "--target", eye, "--fov", &fov],
    ];
    let pictures = views.map(|view| {
        assert_eq!(room.run(["render", "-o", "a.png"].iter().chain(&COARSE).chain(view)).code, Some(0));
        room.read("a.png")
    });
    assert!(pictures[1] == pictures[0] && pictures[2] != pictures[0] && pictures[3] != pictures[0]);
}

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
        missed.err.contains("warning: the accuracy of 1e-30 was not reached: 1 pair of facets is stated"),
        "{missed:?}"
    );
    let event = room.run(call.iter().chain(&["--json"])).result();
    assert!(event["accuracy_missed"]["largest"].as_f64().unwrap() > 1e-30, "{event}");
    let mut pair: Vec<&str> =
        event["accuracy_missed"]["pair"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    pair.sort_unstable();
    assert_eq!(pair, ["ceiling", "floor"]);
    assert!(event["excess"].is_null() && event["largest_error"]["error"].as_f64().unwrap() > 0.0, "{event}");

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

/// Classic methods and solvers by their names give the light that rays give.
#[test]
fn classic_methods_and_solvers_by_name() {
    let room = Room::new("classic");
    room.write("points.csv", "x,y,z,nx,ny,nz\n0.28,0,0.02,0,1,0\n0.1,0,0.5,0,1,0\n0.28,0.5487,0.1,0,-1,0\n");
    let measure = |further: &[&str]| -> Vec<f64> {
        let call = ["measure", "--points", "points.csv", "--error", "20%", "--element-size", "0.1", "--json"];
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

/// The page of a comparison stands alone, the numbers are whole, and standard output has both kinds of answer.
#[test]
fn a_comparison_is_written_as_a_page_and_as_numbers() {
    let room = Room::new("compare");
    const FEW: &str = "compare --elements 40 --methods rays,hemicube,exact,cubature --solvers cg,progressive,gauss-seidel --budget 4s";
    let result = room.run(format!("--json -q {FEW} -o a.html -o a.json").split(' ')).result();
    assert_eq!(room.names(), ["a.html", "a.json"]);
    assert_eq!(result["output"], serde_json::json!(["a.html", "a.json"]));
    let numbers: Value = serde_json::from_slice(&room.read("a.json")).unwrap();
    assert_eq!((&numbers["trials"], &numbers["marches"]), (&result["trials"], &result["marches"]));
    assert!(numbers["trials"].as_array().unwrap().iter().any(|t| t["method"] == "rays" && t["light_error"].is_f64()));
    // Of elements that meet in an edge, the centre of one sees something else than the whole of it; exact ones agree.
    let corner = |method: &str| {
        let is_single = |t: &&Value| t["method"] == method && !t["label"].as_str().unwrap().contains("points");
        let trial = numbers["trials"].as_array().unwrap().iter().rfind(is_single).unwrap();
        [0, 1].map(|k| trial["wrong"]["corner"]["factors"][k].as_f64().unwrap())
    };
    let ([seen, whole], [closed, same]) = (corner("hemicube"), corner("exact"));
    assert!((seen / whole - 1.0).abs() > 0.05 && (closed / same - 1.0).abs() < 1e-6, "{seen} {whole} {closed} {same}");
    let page = String::from_utf8(room.read("a.html")).unwrap();
    assert!(page.contains(&format!("takes {seen:.4} of what it sees, on the mean over all its places {whole:.4}")));
    for outside in ["http:", "https:", "//", "<script", "<link", "@import"] {
        let own =
            page.split("base64,").map(|part| part.split_once('"').map_or(part, |(_, rest)| rest)).collect::<String>();
        assert!(!own.contains(outside), "{outside}");
    }
    for said in [
        "When shooting",
        "What each got wrong",
        "gauss-seidel",
        "data:image/png",
        "Content-Security-Policy",
        "<dt>Sweep</dt>",
        "<dt>Of full white</dt>",
        "class=\"sideways\"",
        "hemicube-midpoint</code> see the same",
    ] {
        assert!(page.to_lowercase().contains(&said.to_lowercase()), "{said}");
    }
    assert!(!page.contains("NaN") && page.ends_with("</html>\n"));
    let table = room.run(FEW.split(' '));
    assert_eq!(table.code, Some(0), "{table:?}");
    assert!(table.out.contains("progressive") && table.out.contains("light off"), "{}", table.out);
}
