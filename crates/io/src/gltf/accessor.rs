//! Numbers out of a glTF's buffers (glTF 2.0, 3.6): strided, sparse, normalised, quantised, and never trusted.
//!
//! Every size is checked against the bytes that are there before memory is taken; an accessor without bytes (all
//! zeros, or sparse over zeros) may have at most `MAX_ZERO_FILLED` components.

use super::Document;
use super::json::{list, shown, text, whole};
use crate::Bytes;
use glam::{DMat4, Vec2, Vec3, Vec4};
use serde_json::Value;
use std::ops::Range;

/// Most components of an accessor that stands for zeros without any bytes behind it. Morph targets use such accessors, with as many
/// elements as their mesh has vertices; 4 million components are those of a mesh of 1.4 million vertices, or 16 MB.
const MAX_ZERO_FILLED: usize = 1 << 22;

/// How each component is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// 8 bits, signed.
    I8,
    /// 8 bits, unsigned.
    U8,
    /// 16 bits, signed.
    I16,
    /// 16 bits, unsigned.
    U16,
    /// 32 bits, unsigned.
    U32,
    /// Single precision.
    F32,
}

impl Component {
    pub(crate) fn from_code(code: usize) -> Option<Component> {
        Some(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return None,
        })
    }

    /// Bytes of one component.
    pub fn bytes(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// Value of the component at the start of `bytes`, which holds at least [`Component::bytes`].
    fn value(self, bytes: &[u8], normalized: bool) -> f32 {
        let byte = |at: usize| bytes.get(at).copied().unwrap_or_default();
        let short = [byte(0), byte(1)];
        let long = [byte(0), byte(1), byte(2), byte(3)];
        // Divisors and the clamp at −1 are those of glTF 2.0, 3.6.2.2.
        match (self, normalized) {
            (Component::F32, _) => f32::from_le_bytes(long),
            (Component::I8, false) => f32::from(byte(0) as i8),
            (Component::U8, false) => f32::from(byte(0)),
            (Component::I16, false) => f32::from(i16::from_le_bytes(short)),
            (Component::U16, false) => f32::from(u16::from_le_bytes(short)),
            (Component::U32, false) => u32::from_le_bytes(long) as f32,
            (Component::I8, true) => (f32::from(byte(0) as i8) / 127.0).max(-1.0),
            (Component::U8, true) => f32::from(byte(0)) / 255.0,
            (Component::I16, true) => (f32::from(i16::from_le_bytes(short)) / 32767.0).max(-1.0),
            (Component::U16, true) => f32::from(u16::from_le_bytes(short)) / 65535.0,
            (Component::U32, true) => (f64::from(u32::from_le_bytes(long)) / f64::from(u32::MAX)) as f32,
        }
    }

    fn index(self, bytes: &[u8]) -> u32 {
        let byte = |at: usize| bytes.get(at).copied().unwrap_or_default();
        match self.bytes() {
            1 => u32::from(byte(0)),
            2 => u32::from(u16::from_le_bytes([byte(0), byte(1)])),
            _ => u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)]),
        }
    }
}

/// Why an accessor cannot be read. The message names the place in the JSON.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AccessorError {
    /// Something is wrong at `place`.
    #[error("{place}: {what}")]
    Invalid {
        /// Where, e.g. `accessors[3]`.
        place: String,
        /// What, with the value.
        what: String,
    },
    /// Its buffer could not be loaded; that was reported already.
    #[error("buffers[{0}] was not loaded")]
    BufferNotLoaded(usize),
}

fn invalid(place: impl Into<String>, what: impl Into<String>) -> AccessorError {
    AccessorError::Invalid { place: place.into(), what: what.into() }
}

/// A whole number under `name`, or `default` where it is absent and a default exists.
fn whole_in(value: &Value, place: &str, name: &str, default: Option<usize>) -> Result<usize, AccessorError> {
    match value.get(name) {
        None if default.is_some() => Ok(default.unwrap_or_default()),
        found => found
            .and_then(whole)
            .ok_or_else(|| invalid(place, format!("{name} is {}, not a whole number of at least 0", shown(found)))),
    }
}

/// Shape of an accessor, checked against the bytes behind it.
#[derive(Clone, Copy, Debug)]
pub struct Accessor<'a> {
    /// How components are stored.
    pub component: Component,
    /// Components per element: 1 SCALAR, 2, 3, 4 VECn, 16 MAT4.
    pub width: usize,
    /// Number of elements.
    pub count: usize,
    /// Whether integers stand for −1..1 or 0..1.
    pub normalized: bool,
    /// First byte of the first element to the end of the view, and the distance of elements; `None`: zeros.
    elements: Option<(&'a [u8], usize)>,
    sparse: Option<Sparse<'a>>,
}

#[derive(Clone, Copy, Debug)]
struct Sparse<'a> {
    count: usize,
    component: Component,
    indices: &'a [u8],
    values: &'a [u8],
}

impl Document {
    /// The bytes of a buffer view and its stride, where it has one.
    pub fn view(&self, index: usize) -> Result<(&[u8], Option<usize>), AccessorError> {
        let (buffer, range, stride) = self.stretch(index)?;
        Ok((&buffer[range], stride))
    }

    /// The bytes of a buffer view, to be kept beside the document without a copy.
    pub(super) fn view_bytes(&self, index: usize) -> Result<Bytes, AccessorError> {
        let (buffer, range, _) = self.stretch(index)?;
        Ok(buffer.part(range).unwrap_or_default())
    }

    /// The buffer behind a view, the view's place in it, which is inside, and its stride.
    fn stretch(&self, index: usize) -> Result<(&Bytes, Range<usize>, Option<usize>), AccessorError> {
        let place = format!("bufferViews[{index}]");
        let views = list(&self.json, "bufferViews");
        let view = views.get(index).ok_or_else(|| invalid(&place, format!("there are only {}", views.len())))?;
        let buffer = whole_in(view, &place, "buffer", None)?;
        let offset = whole_in(view, &place, "byteOffset", Some(0))?;
        let length = whole_in(view, &place, "byteLength", None)?;
        let stride = view.get("byteStride").map(|_| whole_in(view, &place, "byteStride", None)).transpose()?;
        let bytes = self
            .buffers
            .get(buffer)
            .ok_or_else(|| invalid(&place, format!("buffer {buffer} of {}", self.buffers.len())))?;
        if self.not_loaded.contains(&buffer) {
            return Err(AccessorError::BufferNotLoaded(buffer));
        }
        let end = offset.checked_add(length).filter(|end| *end <= bytes.len()).ok_or_else(|| {
            invalid(&place, format!("{length} bytes from {offset} on, but its buffer has {}", bytes.len()))
        })?;
        Ok((bytes, offset..end, stride))
    }

    /// An accessor, with every size checked.
    pub fn accessor(&self, index: usize) -> Result<Accessor<'_>, AccessorError> {
        let place = format!("accessors[{index}]");
        let all = list(&self.json, "accessors");
        let json = all.get(index).ok_or_else(|| invalid(&place, format!("there are only {}", all.len())))?;

        let code = whole_in(json, &place, "componentType", None)?;
        let component = Component::from_code(code)
            .ok_or_else(|| invalid(&place, format!("componentType {code} does not exist in glTF 2.0")))?;
        let width = match text(json, "type") {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => return Err(invalid(&place, format!("type '{other}' is not used for geometry"))),
        };
        let count = whole_in(json, &place, "count", None)?;
        if count == 0 {
            return Err(invalid(&place, "count is 0"));
        }
        let normalized = json.get("normalized").and_then(Value::as_bool).unwrap_or(false);

        let size = width * component.bytes();
        let elements = match json.get("bufferView") {
            None if count.saturating_mul(width) > MAX_ZERO_FILLED => {
                return Err(invalid(
                    &place,
                    format!("{count} elements without a bufferView; at most {MAX_ZERO_FILLED} components"),
                ));
            }
            None => None,
            Some(_) => {
                let view = whole_in(json, &place, "bufferView", None)?;
                let offset = whole_in(json, &place, "byteOffset", Some(0))?;
                let (bytes, stride) = self.view(view)?;
                let stride = stride.unwrap_or(size);
                if stride < size {
                    return Err(invalid(
                        &place,
                        format!("elements of {size} bytes, but bufferViews[{view}] has a byteStride of {stride}"),
                    ));
                }
                let needed = stride.checked_mul(count - 1).and_then(|n| n.checked_add(size)?.checked_add(offset));
                if needed.is_none_or(|needed| needed > bytes.len()) {
                    return Err(invalid(
                        &place,
                        format!(
                            "{count} elements of {size} bytes do not fit into the {} bytes of bufferViews[{view}]",
                            bytes.len()
                        ),
                    ));
                }
                Some((bytes.get(offset..).unwrap_or_default(), stride))
            }
        };
        let sparse = json.get("sparse").map(|sparse| self.sparse(sparse, &place, size, count)).transpose()?;
        Ok(Accessor { component, width, count, normalized, elements, sparse })
    }

    fn sparse(&self, json: &Value, place: &str, size: usize, elements: usize) -> Result<Sparse<'_>, AccessorError> {
        let place = format!("{place}.sparse");
        let count = whole_in(json, &place, "count", None)?;
        if count > elements {
            return Err(invalid(&place, format!("count is {count}, more than the {elements} elements")));
        }
        let null = Value::Null;
        let indices = json.get("indices").unwrap_or(&null);
        let code = whole_in(indices, &place, "componentType", None)?;
        let component = Component::from_code(code)
            .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32))
            .ok_or_else(|| invalid(&place, format!("indices of componentType {code}")))?;
        let part = |json: &Value, size: usize| {
            let view = whole_in(json, &place, "bufferView", None)?;
            let offset = whole_in(json, &place, "byteOffset", Some(0))?;
            let (bytes, _) = self.view(view)?;
            let end = size.checked_mul(count).and_then(|n| n.checked_add(offset));
            end.and_then(|end| bytes.get(offset..end)).ok_or_else(|| {
                invalid(
                    &place,
                    format!("{count} entries do not fit into the {} bytes of bufferViews[{view}]", bytes.len()),
                )
            })
        };
        let index_bytes = part(indices, component.bytes())?;
        let value_bytes = part(json.get("values").unwrap_or(&null), size)?;
        Ok(Sparse { count, component, indices: index_bytes, values: value_bytes })
    }

    /// All components of an accessor one after the other, `width` per element; integers normalised where they say so.
    pub fn read_components(&self, index: usize, widths: &[usize]) -> Result<(Vec<f32>, usize), AccessorError> {
        let accessor = self.accessor(index)?;
        if !widths.contains(&accessor.width) {
            return Err(invalid(
                format!("accessors[{index}]"),
                format!("{} components per element where {widths:?} are expected", accessor.width),
            ));
        }
        let (width, size) = (accessor.width, accessor.component.bytes());
        let mut out = vec![0.0; accessor.count.saturating_mul(width)];
        if let Some((bytes, stride)) = accessor.elements {
            for (element, slots) in bytes.chunks(stride).zip(out.chunks_exact_mut(width)) {
                for (bytes, slot) in element.chunks_exact(size).zip(slots) {
                    *slot = accessor.component.value(bytes, accessor.normalized);
                }
            }
        }
        if let Some(sparse) = accessor.sparse {
            let places = sparse.indices.chunks_exact(sparse.component.bytes());
            for (place, values) in places.zip(sparse.values.chunks_exact(size * width)) {
                let target = sparse.component.index(place) as usize;
                let slots = out.get_mut(target * width..(target + 1) * width).ok_or_else(|| {
                    let what = format!("index {target} of {} elements", accessor.count);
                    invalid(format!("accessors[{index}].sparse"), what)
                })?;
                for (bytes, slot) in values.chunks_exact(size).zip(slots) {
                    *slot = accessor.component.value(bytes, accessor.normalized);
                }
            }
        }
        Ok((out, width))
    }

    /// Scalars, e.g. weights.
    pub fn read_scalar(&self, index: usize) -> Result<Vec<f32>, AccessorError> {
        Ok(self.read_components(index, &[1])?.0)
    }

    /// VEC2, e.g. texture coordinates.
    pub fn read_vec2(&self, index: usize) -> Result<Vec<Vec2>, AccessorError> {
        let (flat, _) = self.read_components(index, &[2])?;
        Ok(flat.chunks_exact(2).map(Vec2::from_slice).collect())
    }

    /// VEC3, e.g. positions and normals.
    pub fn read_vec3(&self, index: usize) -> Result<Vec<Vec3>, AccessorError> {
        let (flat, _) = self.read_components(index, &[3])?;
        Ok(flat.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    /// VEC4, e.g. tangents, rotations, weights.
    pub fn read_vec4(&self, index: usize) -> Result<Vec<Vec4>, AccessorError> {
        let (flat, _) = self.read_components(index, &[4])?;
        Ok(flat.chunks_exact(4).map(Vec4::from_slice).collect())
    }

    /// Colours: VEC3 (alpha 1) or VEC4.
    pub fn read_colors(&self, index: usize) -> Result<Vec<[f32; 4]>, AccessorError> {
        let (flat, width) = self.read_components(index, &[3, 4])?;
        Ok(flat.chunks_exact(width).map(|c| std::array::from_fn(|i| c.get(i).copied().unwrap_or(1.0))).collect())
    }

    /// MAT4, e.g. inverse bind matrices.
    pub fn read_mat4(&self, index: usize) -> Result<Vec<DMat4>, AccessorError> {
        let (flat, _) = self.read_components(index, &[16])?;
        Ok(flat.chunks_exact(16).map(|m| DMat4::from_cols_array(&std::array::from_fn(|i| f64::from(m[i])))).collect())
    }

    /// Unsigned whole numbers: vertex indices. Not checked against a vertex count.
    pub fn read_indices(&self, index: usize) -> Result<Vec<u32>, AccessorError> {
        Ok(self.read_whole(index, 1)?.into_iter().map(|[i, ..]| i).collect())
    }

    /// Four unsigned whole numbers per element: joints.
    pub fn read_joints(&self, index: usize) -> Result<Vec<[u32; 4]>, AccessorError> {
        self.read_whole(index, 4)
    }

    fn read_whole(&self, index: usize, width: usize) -> Result<Vec<[u32; 4]>, AccessorError> {
        let accessor = self.accessor(index)?;
        let component = accessor.component;
        if accessor.width != width || !matches!(component, Component::U8 | Component::U16 | Component::U32) {
            return Err(invalid(
                format!("accessors[{index}]"),
                format!(
                    "{} components of {component:?} per element where {width} of U8, U16 or U32 are expected",
                    accessor.width
                ),
            ));
        }
        let size = component.bytes();
        let element = |bytes: &[u8]| {
            let mut out = [0; 4];
            for (slot, bytes) in out.iter_mut().take(width).zip(bytes.chunks_exact(size)) {
                *slot = component.index(bytes);
            }
            out
        };
        let mut out = vec![[0; 4]; accessor.count];
        if let Some((bytes, stride)) = accessor.elements {
            for (bytes, slot) in bytes.chunks(stride).zip(&mut out) {
                *slot = element(bytes);
            }
        }
        if let Some(sparse) = accessor.sparse {
            let places = sparse.indices.chunks_exact(sparse.component.bytes());
            for (place, values) in places.zip(sparse.values.chunks_exact(size * width)) {
                let target = sparse.component.index(place) as usize;
                let slot = out.get_mut(target).ok_or_else(|| {
                    let what = format!("index {target} of {} elements", accessor.count);
                    invalid(format!("accessors[{index}].sparse"), what)
                })?;
                *slot = element(values);
            }
        }
        Ok(out)
    }
}

impl Accessor<'_> {
    /// Whether an override list is attached.
    pub fn is_sparse(&self) -> bool {
        self.sparse.is_some_and(|sparse| sparse.count > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn document(views: Value, accessors: Value, bytes: &[u8]) -> Document {
        let json = json!({ "asset": {"version": "2.0"}, "bufferViews": views, "accessors": accessors });
        Document { json, buffers: vec![bytes.to_vec().into()], ..Document::default() }
    }

    #[test]
    fn reads_strided_normalised_and_sparse() {
        // Two I8 vec2 four bytes apart, normalised, the second overridden by a sparse entry.
        let bytes = [127, 0x81, 9, 9, 0x80, 0, 9, 9, 1, 64, 0xC0];
        let views = json!([
            {"buffer": 0, "byteLength": 8, "byteStride": 4},
            {"buffer": 0, "byteOffset": 8, "byteLength": 1},
            {"buffer": 0, "byteOffset": 9, "byteLength": 2},
        ]);
        let accessors = json!([
            {"bufferView": 0, "componentType": 5120, "normalized": true, "count": 2, "type": "VEC2"},
            {"bufferView": 0, "componentType": 5120, "count": 2.0, "type": "VEC2", "sparse": {
                "count": 1, "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 2}}},
        ]);
        let document = document(views, accessors, &bytes);
        assert_eq!(document.read_vec2(0).unwrap(), [Vec2::new(1.0, -1.0), Vec2::new(-1.0, 0.0)]);
        assert_eq!(document.read_vec2(1).unwrap(), [Vec2::new(127.0, -127.0), Vec2::new(64.0, -64.0)]);
        assert!(document.accessor(1).unwrap().is_sparse());
    }

    #[test]
    fn every_size_is_checked_before_memory_is_taken() {
        let cases = [
            (json!({"bufferView": 0, "componentType": 5126, "count": 4294967295u32, "type": "VEC3"}), "do not fit"),
            (
                json!({"bufferView": 0, "componentType": 5126, "count": 9007199254740991u64, "type": "VEC3"}),
                "do not fit",
            ),
            (json!({"componentType": 5126, "count": 2000000000, "type": "VEC3"}), "without a bufferView"),
            (json!({"bufferView": 0, "componentType": 5126, "count": -3, "type": "VEC3"}), "count is -3"),
            (json!({"bufferView": 0, "componentType": 5126, "count": 0, "type": "VEC3"}), "count is 0"),
            (json!({"bufferView": 0, "componentType": 5130, "count": 1, "type": "VEC3"}), "componentType 5130"),
            (json!({"bufferView": 1, "componentType": 5126, "count": 1, "type": "VEC3"}), "but its buffer has 12"),
            (json!({"bufferView": 2, "componentType": 5126, "count": 1, "type": "VEC3"}), "byteStride of 4"),
            (json!({"bufferView": 3, "componentType": 5126, "count": 1, "type": "VEC3"}), "there are only 3"),
            (
                json!({"bufferView": 0, "byteOffset": 4, "componentType": 5126, "count": 1, "type": "VEC3"}),
                "do not fit",
            ),
            (
                json!({"bufferView": 0, "byteOffset": u64::MAX, "componentType": 5126, "count": 1, "type": "VEC3"}),
                "do not",
            ),
        ];
        let views = json!([
            {"buffer": 0, "byteLength": 12},
            {"buffer": 0, "byteOffset": u64::MAX, "byteLength": 2},
            {"buffer": 0, "byteLength": 12, "byteStride": 4},
        ]);
        for (accessor, expected) in cases {
            let document = document(views.clone(), json!([accessor]), &[0; 12]);
            let error = document.read_vec3(0).unwrap_err().to_string();
            assert!(error.contains(expected), "{error} should contain {expected}");
        }
    }

    #[test]
    fn reads_every_kind_of_index() {
        let bytes = [1, 2, 0, 0, 3, 0, 4, 0, 5, 0, 1, 0];
        let views = json!([{"buffer": 0, "byteLength": 12}]);
        let accessor = |kind: u32, offset: u32, count: u32| json!({"bufferView": 0, "componentType": kind, "byteOffset": offset, "count": count, "type": "SCALAR"});
        let accessors = json!([accessor(5121, 0, 2), accessor(5123, 4, 2), accessor(5125, 8, 1), accessor(5126, 8, 1)]);
        let document = document(views, accessors, &bytes);
        assert_eq!(document.read_indices(0).unwrap(), [1, 2]);
        assert_eq!(document.read_indices(1).unwrap(), [3, 4]);
        assert_eq!(document.read_indices(2).unwrap(), [65541]);
        assert!(document.read_indices(3).is_err());
    }
}
