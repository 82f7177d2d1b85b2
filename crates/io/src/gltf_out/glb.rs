//! A glTF in the making: JSON lists and one binary chunk; and the container around them (glTF 2.0, chapter 4).

use super::WriteError;
use crate::Staged;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Appends to the lists of a glTF.
#[derive(Default)]
pub(super) struct Builder {
    pub json: Map<String, Value>,
    pub binary: Vec<u8>,
}

/// What a buffer view is used for.
#[derive(Clone, Copy)]
pub(super) enum Target {
    None,
    Vertices,
    Indices,
}

impl Builder {
    /// Appends to a top-level list and returns the index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.list(list);
        list.push(value);
        list.len() - 1
    }

    /// A top-level list, made where it is missing.
    pub fn list(&mut self, name: &str) -> &mut Vec<Value> {
        let slot = self.json.entry(name.to_owned()).or_insert_with(|| Value::Array(Vec::new()));
        if !slot.is_array() {
            *slot = Value::Array(Vec::new());
        }
        match slot {
            Value::Array(list) => list,
            _ => unreachable!("an array was just put there"),
        }
    }

    /// Names an extension as used.
    pub fn uses(&mut self, extension: &str) {
        let list = self.list("extensionsUsed");
        if !list.iter().any(|name| name == extension) {
            list.push(extension.into());
        }
    }

    /// Appends bytes at a multiple of 4 and returns the offset.
    pub fn append(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        offset
    }

    /// A buffer view on new bytes.
    pub fn view(&mut self, bytes: &[u8], target: Target) -> usize {
        let offset = self.append(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        match target {
            Target::None => {}
            Target::Vertices => view["target"] = 34962.into(),
            Target::Indices => view["target"] = 34963.into(),
        }
        self.push("bufferViews", view)
    }

    /// An accessor of floats, `width` per element; what is not finite becomes 0. Bounds are written where asked.
    pub fn floats(&mut self, values: &[f32], width: usize, bounds: bool) -> usize {
        let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
        let bytes: Vec<u8> = values.iter().flat_map(|&v| finite(v).to_le_bytes()).collect();
        let view = self.view(&bytes, Target::Vertices);
        let kind = match width {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            _ => "VEC4",
        };
        let mut accessor =
            json!({ "bufferView": view, "componentType": 5126, "count": values.len() / width, "type": kind });
        if bounds {
            let fold = |start: f32, f: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..width).map(|k| values.iter().skip(k).step_by(width).fold(start, |m, &v| f(m, finite(v)))).collect()
            };
            accessor["min"] = json!(fold(f32::INFINITY, f32::min));
            accessor["max"] = json!(fold(f32::NEG_INFINITY, f32::max));
        }
        self.push("accessors", accessor)
    }

    /// An accessor of joints.
    pub fn joints(&mut self, values: &[[u32; 4]]) -> usize {
        let bytes: Vec<u8> =
            values.iter().flatten().flat_map(|&j| u16::try_from(j).unwrap_or(0).to_le_bytes()).collect();
        let view = self.view(&bytes, Target::Vertices);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": 5123, "count": values.len(), "type": "VEC4" }),
        )
    }

    /// An accessor of indices, as narrow as they allow (65535 is reserved).
    pub fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let flat = triangles.iter().flatten();
        let narrow = flat.clone().all(|&i| i < 65535);
        let bytes: Vec<u8> = match narrow {
            true => flat.flat_map(|&i| (i as u16).to_le_bytes()).collect(),
            false => flat.flat_map(|&i| i.to_le_bytes()).collect(),
        };
        let view = self.view(&bytes, Target::Indices);
        let component = if narrow { 5123 } else { 5125 };
        let count = 3 * triangles.len();
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": component, "count": count, "type": "SCALAR" }),
        )
    }

    /// The whole file.
    pub fn finish(mut self) -> Result<Vec<u8>, WriteError> {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        if self.binary.is_empty() {
            self.json.remove("buffers");
        } else {
            self.json.insert("buffers".into(), json!([{ "byteLength": self.binary.len() }]));
        }
        // The schema wants no empty lists.
        self.json.retain(|_, value| value.as_array().is_none_or(|list| !list.is_empty()));
        let mut json = Value::Object(self.json).to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');

        let total = 12 + 8 + json.len() as u64 + if self.binary.is_empty() { 0 } else { 8 + self.binary.len() as u64 };
        let word = |n: u64| u32::try_from(n).map(u32::to_le_bytes).map_err(|_| WriteError::TooLarge(total));
        let mut out = Vec::new();
        out.extend_from_slice(b"glTF");
        out.extend(2_u32.to_le_bytes());
        out.extend(word(total)?);
        out.extend(word(json.len() as u64)?);
        out.extend_from_slice(b"JSON");
        out.append(&mut json);
        if !self.binary.is_empty() {
            out.extend(word(self.binary.len() as u64)?);
            out.extend_from_slice(b"BIN\0");
            out.append(&mut self.binary);
        }
        Ok(out)
    }
}

/// Writes beside the target first and then renames, so that no half a file is ever seen under the name.
pub(super) fn save(bytes: &[u8], out: &Path) -> Result<(), WriteError> {
    let folder = match out.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(WriteError::NoFolder(folder.to_owned()));
    }
    let io = |error| WriteError::Io { path: out.to_owned(), error };
    if out.file_name().is_none() {
        return Err(io(std::io::ErrorKind::InvalidFilename.into()));
    }
    let staged = Staged::new(out);
    staged.write(bytes).and_then(|()| staged.place()).map_err(io)
}
