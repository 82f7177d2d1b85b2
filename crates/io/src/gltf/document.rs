//! A glTF file as it stands: its JSON, the bytes of its buffers and pictures.
//!
//! The JSON is kept as a tree rather than as structs, so that what we do not know survives being written back, and
//! one wrong field is one fault instead of the end (this is also why the `gltf` crate is not used). Buffer views and
//! accessors that were compressed are plain here: their extension is gone and their buffer holds the decoded bytes.

use super::decompress;
use super::json::{list, shown, text, whole};
use crate::source::relative_path;
use crate::{Bytes, Source, SourceError, data_uri};
use radiosity_scene::Faults;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A glTF with everything it refers to in memory.
#[derive(Clone, Debug, Default)]
pub struct Document {
    /// The whole JSON, extensions and extras included.
    pub json: Value,
    /// Bytes by buffer index, `byteLength` long each; empty where a buffer could not be loaded.
    pub buffers: Vec<Bytes>,
    /// Encoded pictures by image index; `None` where one could not be loaded.
    pub images: Vec<Option<EncodedImage>>,
    /// Buffers that could not be loaded and were reported.
    pub(crate) not_loaded: Vec<usize>,
    /// Buffers to be filled by decoding, with the uncompressed bytes the file may hold of them.
    pub(crate) placeholders: BTreeMap<usize, Bytes>,
}

/// A picture as the file carries it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedImage {
    /// Media type, told from the first bytes; empty where unknown.
    pub mime: String,
    /// The encoded bytes.
    pub bytes: Bytes,
}

const GLB_MAGIC: &[u8] = b"glTF";
const GLB_JSON: &[u8] = b"JSON";
const GLB_BIN: &[u8] = b"BIN\0";

impl Document {
    /// Reads a .gltf or .glb (told by its first bytes, not by its name) and all it refers to.
    ///
    /// `file` is the name for messages. What is wrong goes to `faults`; `None` where not even the JSON can be read.
    pub fn read(file: &str, bytes: &[u8], source: &dyn Source, faults: &mut Faults) -> Option<Document> {
        let (json, chunk) = if bytes.starts_with(GLB_MAGIC) || file.to_ascii_lowercase().ends_with(".glb") {
            match split_glb(bytes) {
                Ok(parts) => parts,
                Err(what) => {
                    faults.error(file, what, "the file is damaged or no GLB; export or copy it again");
                    return None;
                }
            }
        } else {
            (bytes, None)
        };
        if json.iter().all(u8::is_ascii_whitespace) {
            faults.error(file, "the file is empty", "export or copy it again");
            return None;
        }
        // A byte order mark is not allowed but met.
        let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
        let json: Value = match serde_json::from_slice(json) {
            Ok(json) => json,
            Err(error) => {
                faults.error(file, format!("not JSON: {error}"), "the file is damaged or no glTF; export it again");
                return None;
            }
        };

        let version = json.get("asset").map(|asset| text(asset, "version"));
        match version {
            None => faults.error(file, "'asset' is missing", "a glTF 2.0 file must have asset.version"),
            Some(version) if !version.starts_with("2.") => {
                faults.error(format!("{file}: asset"), format!("version '{version}'"), "only glTF 2.0 can be read");
            }
            Some(_) => {}
        }
        if let Some(least) = json.get("asset").map(|asset| text(asset, "minVersion"))
            && !least.is_empty()
            && least != "2.0"
        {
            faults.error(format!("{file}: asset"), format!("minVersion '{least}'"), "only glTF 2.0 can be read");
        }

        let mut document = Document { json, ..Document::default() };
        let mut files = Files { source, known: BTreeMap::new() };
        document.load_buffers(file, chunk, &mut files, faults);
        document.decompress(file, faults);
        document.load_images(file, &mut files, faults);
        Some(document)
    }

    fn load_buffers(&mut self, file: &str, chunk: Option<&[u8]>, files: &mut Files<'_>, faults: &mut Faults) {
        for (index, buffer) in list(&self.json, "buffers").iter().enumerate() {
            let place = format!("{file}: buffers[{index}]");
            let length = buffer.get("byteLength");
            let uri = buffer.get("uri").and_then(Value::as_str);
            let has_bytes = uri.is_some() || (index == 0 && chunk.is_some());
            // What stands for decoded data need not be there; it is kept for the case that decoding fails.
            if decompress::is_placeholder(&self.json, index, has_bytes) {
                let fallback = uri.and_then(|uri| files.read(uri, &place, &mut Faults::default()));
                self.placeholders.insert(index, fallback.map(|(_, bytes)| bytes).unwrap_or_default());
                self.buffers.push(Bytes::default());
                continue;
            }
            let loaded = match (uri, chunk) {
                (Some(uri), _) => files.read(uri, &place, faults).map(|(_, bytes)| bytes),
                (None, Some(chunk)) if index == 0 => Some(Bytes::from(chunk.to_vec())),
                (None, _) => {
                    faults.error(&place, "neither a uri nor a binary chunk", "export the model again");
                    None
                }
            };
            let checked = loaded.and_then(|bytes| {
                let Some(length) = length.and_then(whole) else {
                    faults.error(&place, format!("byteLength is {}", shown(length)), "export the model again");
                    return None;
                };
                let cut = bytes.part(0..length);
                if cut.is_none() {
                    let what = format!("byteLength is {length}, but there are only {} bytes", bytes.len());
                    faults.error(&place, what, "the file is cut short; copy or export it again");
                }
                cut
            });
            if checked.is_none() {
                self.not_loaded.push(index);
            }
            self.buffers.push(checked.unwrap_or_default());
        }
    }

    fn load_images(&mut self, file: &str, files: &mut Files<'_>, faults: &mut Faults) {
        let mut images = Vec::new();
        for (index, image) in list(&self.json, "images").iter().enumerate() {
            let place = format!("{file}: images[{index}]");
            let loaded = match (image.get("uri").and_then(Value::as_str), image.get("bufferView")) {
                // A missing picture is a missing colour, not a missing scene: a warning.
                (Some(uri), _) => {
                    let mut own = Faults::default();
                    let loaded = files.read(uri, &place, &mut own);
                    for fault in own.0 {
                        let what = format!("{}; materials are as without it", fault.what);
                        faults.warning(fault.place, what, fault.hint);
                    }
                    loaded
                }
                (None, Some(view)) => match whole(view).map(|view| self.view_bytes(view)) {
                    Some(Ok(bytes)) => Some((text(image, "mimeType").to_owned(), bytes)),
                    Some(Err(error)) => {
                        faults.warning(&place, error.to_string(), "export the model again");
                        None
                    }
                    None => {
                        faults.warning(&place, format!("bufferView is {}", shown(Some(view))), "export again");
                        None
                    }
                },
                (None, None) => {
                    faults.warning(&place, "neither a uri nor a bufferView", "export the model again");
                    None
                }
            };
            images.push(
                loaded.map(|(mime, bytes)| EncodedImage { mime: sniff(&bytes).map_or(mime, str::to_owned), bytes }),
            );
        }
        self.images = images;
    }
}

/// Media type by the first bytes.
fn sniff(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Some("image/png")
    } else if bytes.starts_with(b"\xFF\xD8\xFF") {
        Some("image/jpeg")
    } else if bytes.starts_with(b"\xABKTX 20\xBB\r\n\x1a\n") {
        Some("image/ktx2")
    } else {
        None
    }
}

/// What addresses name; a file that several of them name is read once, in whatever way they spell it.
struct Files<'a> {
    source: &'a dyn Source,
    known: BTreeMap<PathBuf, Result<Bytes, SourceError>>,
}

impl Files<'_> {
    /// Media type, where the address says it, and bytes.
    fn read(&mut self, uri: &str, place: &str, faults: &mut Faults) -> Option<(String, Bytes)> {
        let read = match data_uri::decode(uri) {
            Some(Ok((mime, bytes))) => return Some((mime, bytes.into())),
            Some(Err(what)) => {
                faults.error(place, what, "export the model again");
                return None;
            }
            None => match relative_path(uri) {
                Ok(path) => {
                    let source = self.source;
                    &*self.known.entry(path).or_insert_with(|| source.read(uri).map(Bytes::from))
                }
                Err(_) => &self.source.read(uri).map(Bytes::from),
            },
        };
        match read {
            Ok(bytes) => Some((String::new(), bytes.clone())),
            Err(error) => {
                faults.error(place, error.to_string(), error.hint());
                None
            }
        }
    }
}

/// JSON and binary chunk of a GLB (glTF 2.0, chapter 4).
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes([four[0], four[1], four[2], four[3]]) as usize)
    };
    if bytes.is_empty() {
        return Err("the file is empty".to_owned());
    }
    if !bytes.starts_with(GLB_MAGIC) {
        return Err("does not begin with 'glTF'".to_owned());
    }
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(format!("container version {version}; only version 2 can be read")),
        None => return Err("cut short within its header".to_owned()),
    }
    let length = word(8).ok_or("cut short within its header")?;
    let body = bytes
        .get(..length)
        .ok_or_else(|| format!("cut short: its header says {length} bytes, there are {}", bytes.len()))?;

    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while at < body.len() {
        let cut = || format!("cut short within the chunk at byte {at}");
        let size = word(at).ok_or_else(cut)?;
        let kind = body.get(at + 4..at + 8).ok_or_else(cut)?;
        let end = (at + 8).checked_add(size).ok_or_else(cut)?;
        let chunk = body.get(at + 8..end).ok_or_else(cut)?;
        match kind {
            _ if json.is_none() && kind != GLB_JSON => return Err("its first chunk is not JSON".to_owned()),
            _ if kind == GLB_JSON && json.is_none() => json = Some(chunk),
            _ if kind == GLB_BIN && binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = end;
    }
    Ok((json.ok_or("has no JSON chunk")?, binary))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::cell::Cell;

    /// Counts how often it is asked.
    struct Counting(Cell<usize>);

    impl Source for Counting {
        fn read(&self, _: &str) -> Result<Vec<u8>, SourceError> {
            self.0.set(self.0.get() + 1);
            Ok(vec![7; 1000])
        }
    }

    /// 20,000 pictures of one view of 2 MB asked for 40 GB, and every address was read anew.
    #[test]
    fn what_is_named_many_times_is_held_once() {
        let uris = ["a.bin", "./a.bin", "b/../%61.bin"];
        let buffers: Vec<Value> = (0..300).map(|i| json!({ "uri": uris[i % 3], "byteLength": 1 + i })).collect();
        let mut images: Vec<Value> = (0..300).map(|i| json!({ "uri": uris[i % 3] })).collect();
        images.extend((0..300).map(|_| json!({ "bufferView": 0 })));
        let views = json!([{ "buffer": 250, "byteOffset": 50, "byteLength": 100 }]);
        let json = json!({ "asset": {"version": "2.0"}, "buffers": buffers, "bufferViews": views, "images": images });
        let (source, mut faults) = (Counting(Cell::new(0)), Faults::default());
        let document = Document::read("t", json.to_string().as_bytes(), &source, &mut faults).unwrap();
        assert!(faults.0.is_empty(), "{faults}");
        assert_eq!(source.0.get(), 1);
        let first = document.buffers[0].as_ptr();
        assert!(document.buffers.iter().enumerate().all(|(i, bytes)| bytes.len() == 1 + i && bytes.as_ptr() == first));
        for (i, image) in document.images.iter().enumerate() {
            let image = image.as_ref().unwrap();
            let (offset, length) = if i < 300 { (0, 1000) } else { (50, 100) };
            assert_eq!((image.bytes.as_ptr(), image.bytes.len()), (first.wrapping_add(offset), length));
        }
    }
}
