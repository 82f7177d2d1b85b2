//! The program from outside: exit codes, streams, files, interrupts. A module for each verb.

use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

mod bake;
mod calls;
mod check;
mod compare;
mod factors;
mod measure;
mod render;
mod runs;
mod view;

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

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
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
