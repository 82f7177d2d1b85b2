//! Makes a compressed document plain: what KHR_draco_mesh_compression, EXT_ and KHR_meshopt_compression hold goes into
//! ordinary buffers, and the extensions disappear, so that nobody after this needs to know of them.

use super::json::{list, shown, text, whole};
use super::meshopt::{self, Filter, Mode};
use super::{AccessorError, Component, Document};
use crate::Bytes;
use draco_core::{DecodeLimits, DecoderBuffer, FaceIndex, Mesh, MeshDecoder};
use radiosity_scene::Faults;
use serde_json::{Value, json};
use std::collections::BTreeMap;

const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
const DRACO: &str = "KHR_draco_mesh_compression";

/// Most bytes that all compressed parts of a file may become. Compression of constant data has no bound of its own (a
/// kilobyte can become gigabytes); the largest scenes in common use hold a quarter of this.
const MAX_DECODED: usize = 1 << 31;

/// Whether a buffer only stands for what decoding will give: it says so, or it has no bytes and a compressed view
/// names it.
pub(crate) fn is_placeholder(json: &Value, index: usize, has_bytes: bool) -> bool {
    let extension = |json: &Value, read: &dyn Fn(&Value) -> bool| {
        MESHOPT.iter().any(|name| json.get("extensions").and_then(|all| all.get(name)).is_some_and(read))
    };
    let buffer = list(json, "buffers").get(index);
    let says_so = |own: &Value| own.get("fallback").and_then(Value::as_bool) == Some(true);
    if buffer.is_some_and(|buffer| extension(buffer, &says_so)) {
        return true;
    }
    let names_it = |view: &Value| view.get("buffer").and_then(whole) == Some(index) && extension(view, &|_| true);
    !has_bytes && list(json, "bufferViews").iter().any(names_it)
}

impl Document {
    pub(super) fn decompress(&mut self, file: &str, faults: &mut Faults) {
        let mut budget = MAX_DECODED;
        self.decompress_views(file, &mut budget, faults);
        self.decompress_primitives(file, &mut budget, faults);
        self.placeholders.clear();

        for kind in ["extensionsUsed", "extensionsRequired"] {
            let Some(names) = self.json.get_mut(kind).and_then(Value::as_array_mut) else { continue };
            names.retain(|name| !MESHOPT.iter().chain([&DRACO]).any(|known| name == known));
            if names.is_empty()
                && let Some(json) = self.json.as_object_mut()
            {
                json.remove(kind);
            }
        }
        for buffer in self.json.get_mut("buffers").and_then(Value::as_array_mut).into_iter().flatten() {
            for name in MESHOPT {
                remove_extension(buffer, name);
            }
        }
    }

    fn decompress_views(&mut self, file: &str, budget: &mut usize, faults: &mut Faults) {
        for index in 0..list(&self.json, "bufferViews").len() {
            let Some(view) = list(&self.json, "bufferViews").get(index) else { continue };
            let found = MESHOPT.iter().find_map(|name| Some((*name, view.get("extensions")?.get(name)?)));
            let Some((name, extension)) = found else { continue };
            let place = format!("{file}: bufferViews[{index}]");
            let buffer = view.get("buffer").and_then(whole).unwrap_or(usize::MAX);
            let mut new_place = None;
            if self.buffers.get(buffer).is_none() {
                faults.error(&place, format!("buffer {} does not exist", shown(view.get("buffer"))), "export again");
            } else if self.placeholders.contains_key(&buffer) {
                let decoded = match self.meshopt(extension, budget) {
                    Ok(decoded) => Some(decoded),
                    Err(AccessorError::BufferNotLoaded(_)) => None,
                    Err(error) => match self.fallback(view, buffer) {
                        Some(bytes) => {
                            let what = format!("{name}: {error}; the uncompressed fallback is used");
                            faults.warning(&place, what, "export the model again");
                            Some(bytes)
                        }
                        None => {
                            faults.error(&place, format!("{name}: {error}"), "the file is damaged; export it again");
                            None
                        }
                    },
                };
                if let Some(decoded) = decoded {
                    let mut target = std::mem::take(&mut self.buffers[buffer]).into_vec();
                    target.resize(target.len().next_multiple_of(4), 0);
                    new_place = Some((target.len(), decoded.len()));
                    target.extend(decoded);
                    self.buffers[buffer] = target.into();
                }
            }
            let length = self.buffers.get(buffer).map_or(0, |bytes| bytes.len());
            if let Some(view) = self.json.pointer_mut(&format!("/bufferViews/{index}")) {
                remove_extension(view, name);
                if let Some((offset, length)) = new_place {
                    view["byteOffset"] = json!(offset);
                    view["byteLength"] = json!(length);
                }
            }
            if new_place.is_some()
                && let Some(json) = self.json.pointer_mut(&format!("/buffers/{buffer}"))
            {
                json["byteLength"] = json!(length);
            }
        }
    }

    /// The uncompressed bytes that the file holds of a compressed view.
    fn fallback(&self, view: &Value, buffer: usize) -> Option<Vec<u8>> {
        let offset = view.get("byteOffset").map_or(Some(0), whole)?;
        let end = offset.checked_add(view.get("byteLength").and_then(whole)?)?;
        self.placeholders.get(&buffer)?.get(offset..end).map(<[u8]>::to_vec)
    }

    /// Decodes a view; what it takes goes off `budget`.
    fn meshopt(&self, extension: &Value, budget: &mut usize) -> Result<Vec<u8>, AccessorError> {
        let wrong = |what: String| AccessorError::Invalid { place: "extension".to_owned(), what };
        let number = |name: &str, default: Option<usize>| {
            let given = extension.get(name).map_or(default, whole);
            given.ok_or_else(|| wrong(format!("{name} is {}", shown(extension.get(name)))))
        };
        let buffer = number("buffer", None)?;
        let (offset, length) = (number("byteOffset", Some(0))?, number("byteLength", None)?);
        let (stride, count) = (number("byteStride", None)?, number("count", None)?);
        if self.not_loaded.contains(&buffer) {
            return Err(AccessorError::BufferNotLoaded(buffer));
        }
        let bytes = self.buffers.get(buffer).filter(|_| !self.placeholders.contains_key(&buffer));
        let bytes = bytes.ok_or_else(|| wrong(format!("buffer {buffer} holds no data")))?;
        let data = offset.checked_add(length).and_then(|end| bytes.get(offset..end));
        let data = data.ok_or_else(|| wrong(format!("{length} bytes from {offset} on of {}", bytes.len())))?;
        let mode = match text(extension, "mode") {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            other => return Err(wrong(format!("mode '{other}'"))),
        };
        let filter = match text(extension, "filter") {
            "" | "NONE" => Filter::None,
            "OCTAHEDRAL" => Filter::Octahedral,
            "QUATERNION" => Filter::Quaternion,
            "EXPONENTIAL" => Filter::Exponential,
            "COLOR" => Filter::Color,
            other => return Err(wrong(format!("filter '{other}'"))),
        };
        let left = count.checked_mul(stride).and_then(|size| budget.checked_sub(size));
        *budget = left.ok_or_else(|| {
            wrong(format!("{count} elements of {stride} bytes; all compressed data may have {MAX_DECODED} bytes"))
        })?;
        meshopt::decode(data, count, stride, mode, filter).map_err(wrong)
    }

    fn decompress_primitives(&mut self, file: &str, budget: &mut usize, faults: &mut Faults) {
        // What was decoded already: primitives may share accessors.
        let mut done: BTreeMap<usize, usize> = BTreeMap::new();
        for mesh in 0..list(&self.json, "meshes").len() {
            let count = list(&self.json, "meshes").get(mesh).map_or(0, |mesh| list(mesh, "primitives").len());
            for primitive in 0..count {
                let pointer = format!("/meshes/{mesh}/primitives/{primitive}");
                let Some(json) = self.json.pointer(&pointer) else { continue };
                if json.get("extensions").and_then(|all| all.get(DRACO)).is_none() {
                    continue;
                }
                let json = json.clone();
                match self.draco(&json, &mut done, budget) {
                    Ok(()) | Err(AccessorError::BufferNotLoaded(_)) => {}
                    Err(error) => {
                        let place = format!("{file}: meshes[{mesh}].primitives[{primitive}]");
                        faults.error(place, format!("{DRACO}: {error}"), "the file is damaged; export it again");
                    }
                }
                if let Some(json) = self.json.pointer_mut(&pointer) {
                    remove_extension(json, DRACO);
                }
            }
        }
    }

    /// Decodes a primitive and gives its accessors ordinary buffer views.
    fn draco(
        &mut self,
        primitive: &Value,
        done: &mut BTreeMap<usize, usize>,
        budget: &mut usize,
    ) -> Result<(), AccessorError> {
        let wrong = |what: String| AccessorError::Invalid { place: "extension".to_owned(), what };
        let extension = &primitive["extensions"][DRACO];
        let view = extension.get("bufferView").and_then(whole);
        let view = view.ok_or_else(|| wrong(format!("bufferView is {}", shown(extension.get("bufferView")))))?;
        let attributes = extension.get("attributes").and_then(Value::as_object);
        let attributes = attributes.ok_or_else(|| wrong("has no attributes".to_owned()))?;
        let mut targets: Vec<(usize, Option<u32>)> = Vec::new();
        if let Some(indices) = primitive.get("indices").and_then(whole) {
            targets.push((indices, None));
        }
        for (name, id) in attributes {
            let accessor = primitive["attributes"].get(name).and_then(whole);
            let id = whole(id).and_then(|id| u32::try_from(id).ok());
            if let (Some(accessor), Some(id)) = (accessor, id) {
                targets.push((accessor, Some(id)));
            }
        }
        if targets.iter().all(|(accessor, _)| done.get(accessor) == Some(&view)) {
            return Ok(());
        }

        // The limits bound what decoding itself takes; what the accessors then ask for is bounded by the mesh.
        let (data, _) = self.view(view)?;
        let mut limits = DecodeLimits::default();
        limits.max_decoded_bytes = *budget as u64;
        limits.max_faces = (*budget / 12) as u64;
        limits.max_points = (*budget / 12) as u64;
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(data).with_limits(limits);
        MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|error| wrong(error.to_string()))?;

        for (accessor, id) in targets {
            if done.insert(accessor, view).is_some() {
                continue;
            }
            let pointer = format!("/accessors/{accessor}");
            let json =
                self.json.pointer(&pointer).ok_or_else(|| wrong(format!("accessor {accessor} does not exist")))?;
            let component = json.get("componentType").and_then(whole).and_then(Component::from_code);
            let component = component.ok_or_else(|| wrong(format!("accessors[{accessor}] has no component type")))?;
            let (bytes, count) = match id {
                None => {
                    let corners = (0..mesh.num_faces()).flat_map(|f| mesh.face(FaceIndex(f as u32)));
                    let bytes: Vec<u8> = corners.flat_map(|point| written(component, f64::from(point.0))).collect();
                    (bytes, 3 * mesh.num_faces())
                }
                Some(id) => {
                    let attribute = mesh.attribute_by_unique_id(id);
                    let attribute = attribute.ok_or_else(|| wrong(format!("attribute {id} is not in the data")))?;
                    let width = match text(json, "type") {
                        "SCALAR" => 1,
                        "VEC2" => 2,
                        "VEC3" => 3,
                        "VEC4" => 4,
                        other => return Err(wrong(format!("accessors[{accessor}] of type '{other}'"))),
                    };
                    let points = mesh.num_points();
                    if points.saturating_mul(4 * width) > *budget {
                        return Err(wrong(format!("{points} points; all data may have {MAX_DECODED} bytes")));
                    }
                    let values = attribute.read_f32s(points, width);
                    (values.iter().flat_map(|&v| written(component, f64::from(v))).collect(), points)
                }
            };
            *budget = budget.saturating_sub(bytes.len());
            let buffers = list(&self.json, "buffers").len();
            let views = list(&self.json, "bufferViews").len();
            push(&mut self.json, "buffers", json!({ "byteLength": bytes.len() }));
            push(&mut self.json, "bufferViews", json!({ "buffer": buffers, "byteLength": bytes.len() }));
            self.buffers.resize(buffers, Bytes::default());
            self.buffers.push(bytes.into());
            if let Some(json) = self.json.pointer_mut(&pointer).and_then(Value::as_object_mut) {
                json.insert("bufferView".to_owned(), json!(views));
                json.insert("count".to_owned(), json!(count));
                json.remove("byteOffset");
            }
        }
        Ok(())
    }
}

/// A number as a component stores it.
fn written(component: Component, value: f64) -> impl Iterator<Item = u8> {
    let bytes = match component {
        Component::I8 => (value as i8).to_le_bytes().to_vec(),
        Component::U8 => (value as u8).to_le_bytes().to_vec(),
        Component::I16 => (value as i16).to_le_bytes().to_vec(),
        Component::U16 => (value as u16).to_le_bytes().to_vec(),
        Component::U32 => (value as u32).to_le_bytes().to_vec(),
        Component::F32 => (value as f32).to_le_bytes().to_vec(),
    };
    bytes.into_iter()
}

fn push(json: &mut Value, name: &str, entry: Value) {
    if let Some(list) = json.get_mut(name).and_then(Value::as_array_mut) {
        list.push(entry);
    }
}

fn remove_extension(json: &mut Value, name: &str) {
    let Some(all) = json.get_mut("extensions").and_then(Value::as_object_mut) else { return };
    all.remove(name);
    if all.is_empty()
        && let Some(json) = json.as_object_mut()
    {
        json.remove("extensions");
    }
}
