//! glTF materials as diffuse ones.
//!
//! Metal is kept as its share (the scene takes it out of the diffuse reflectance). Emission is cd/m²: factor × picture ×
//! KHR_materials_emissive_strength. An unlit surface (KHR_materials_unlit) shows its base colour under any light; in a
//! light simulation it reflects that colour diffusely and gives no light. KHR_materials_pbrSpecularGlossiness
//! reflects its diffuse colour. With KHR_materials_diffuse_transmission the surface is a sheet without thickness: of its
//! diffuse light the share of `diffuseTransmissionFactor` (times the alpha of its picture) is passed on, tinted, in place
//! of what the base colour would reflect, and both sides count, whatever `doubleSided` says. Where that gives back more
//! light than arrives it is refused: which of the two the author meant is not known. A primitive without material is matte
//! grey (0.5) rather than the glTF default, a white mirror, which no author means by leaving the material out.

use super::Document;
use super::json::{list, number, numbers, shown, text, whole};
use crate::picture;
use glam::{DAffine2, DMat2, DVec2};
use radiosity_scene::{AlphaMode, Faults, Material, Texture, TextureRef, Transmission, Wrap};
use serde_json::Value;
use std::collections::BTreeMap;

/// Reflectance of a surface whose author named no material.
pub(crate) const UNNAMED_REFLECTANCE: f32 = 0.5;

/// Materials by glTF index, then one for primitives without material.
pub(crate) struct Materials {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
}

pub(crate) fn read(document: &Document, file: &str, faults: &mut Faults) -> Materials {
    let mut pictures =
        Pictures { document, file, decoded: BTreeMap::new(), textures: Vec::new(), budget: picture::MAX_TEXELS };
    let all = list(&document.json, "materials");
    let mut materials: Vec<Material> =
        all.iter().enumerate().map(|(index, json)| material(json, index, &mut pictures, faults)).collect();
    let grey = [UNNAMED_REFLECTANCE, UNNAMED_REFLECTANCE, UNNAMED_REFLECTANCE, 1.0];
    materials.push(Material { name: "no material".to_owned(), base_color: grey, ..Material::default() });
    Materials { materials, textures: pictures.textures }
}

fn material(json: &Value, index: usize, pictures: &mut Pictures<'_>, faults: &mut Faults) -> Material {
    let name = text(json, "name");
    let place = format!("{}: materials[{index}] '{name}'", pictures.file);
    let null = Value::Null;
    let extension = |name: &str| json.get("extensions").and_then(|all| all.get(name));
    let mut out = Material {
        name: if name.is_empty() { format!("material {index}") } else { name.to_owned() },
        double_sided: json.get("doubleSided").and_then(Value::as_bool).unwrap_or(false),
        ..Material::default()
    };

    // Colour and metal.
    if let Some(old) = extension("KHR_materials_pbrSpecularGlossiness") {
        out.base_color = factor(old, "diffuseFactor", [1.0; 4], &place, faults);
        out.base_color_texture = pictures.used(old.get("diffuseTexture"), &place, faults);
    } else {
        let pbr = json.get("pbrMetallicRoughness").unwrap_or(&null);
        out.base_color = factor(pbr, "baseColorFactor", [1.0; 4], &place, faults);
        out.base_color_texture = pictures.used(pbr.get("baseColorTexture"), &place, faults);
        [out.metallic] = factor(&wrapped(pbr, "metallicFactor"), "metallicFactor", [1.0], &place, faults);
        if out.metallic > 0.0 {
            out.metallic_texture = pictures.used(pbr.get("metallicRoughnessTexture"), &place, faults);
        }
    }

    // Emission.
    let emissive: [f32; 3] = factor(json, "emissiveFactor", [0.0; 3], &place, faults);
    let strength = match extension("KHR_materials_emissive_strength").and_then(|e| e.get("emissiveStrength")) {
        None => 1.0,
        Some(value) => number(value).filter(|s| *s >= 0.0).unwrap_or_else(|| {
            let what = format!("emissiveStrength is {}, not a number of at least 0; 1 is used", shown(Some(value)));
            faults.warning(&place, what, "correct it");
            1.0
        }),
    };
    // Beyond 1e12 (a thousand suns) single precision would not hold squares and sums of it.
    if strength * f64::from(emissive.iter().fold(0.0_f32, |m, &e| m.max(e))) > 1e12 {
        faults.error(&place, format!("emits more than 1e12 cd/m²: emissiveStrength {strength:e}"), "correct it");
    } else {
        out.emissive = emissive.map(|e| (f64::from(e) * strength) as f32);
    }
    if out.emits() {
        out.emissive_texture = pictures.used(json.get("emissiveTexture"), &place, faults);
    }

    // Alpha.
    out.alpha_mode = match text(json, "alphaMode") {
        "MASK" => {
            let cutoff = json.get("alphaCutoff").map_or(Some(0.5), number);
            AlphaMode::Mask { cutoff: cutoff.unwrap_or(0.5) as f32 }
        }
        "BLEND" => AlphaMode::Blend,
        "" | "OPAQUE" => AlphaMode::Opaque,
        other => {
            faults.warning(&place, format!("alphaMode '{other}'; taken as OPAQUE"), "use OPAQUE, MASK or BLEND");
            AlphaMode::Opaque
        }
    };

    if extension("KHR_materials_unlit").is_some() {
        (out.metallic, out.metallic_texture) = (0.0, None);
        (out.emissive, out.emissive_texture) = ([0.0; 3], None);
        faults.note(&place, "is unlit; its base colour reflects diffusely and it gives no light", "");
    }
    pass_light(&mut out, json, &place, pictures, faults);
    out
}

/// Adds how light passes through the surface, and says what of it is not computed.
fn pass_light(out: &mut Material, json: &Value, place: &str, pictures: &mut Pictures<'_>, faults: &mut Faults) {
    let extension = |name: &str| json.get("extensions").and_then(|all| all.get(name));
    if let Some(diffuse) = extension("KHR_materials_diffuse_transmission") {
        let is_unlit = extension("KHR_materials_unlit").is_some();
        out.transmission = transmission(diffuse, place, pictures, faults).filter(|_| !is_unlit);
        out.check_transmission(place, faults);
    }
    if out.transmits() && extension("KHR_materials_volume").is_some() {
        let what = "KHR_materials_volume is not computed; light passes the surface as a sheet without thickness";
        faults.note(place, what, "");
    }
    if extension("KHR_materials_transmission").is_some() {
        let (opaque, hint) = match out.transmits() {
            true => ("", ""),
            false => ("; the surface is opaque", "use alphaMode BLEND or KHR_materials_diffuse_transmission"),
        };
        faults.note(place, format!("KHR_materials_transmission is not computed{opaque}"), hint);
    }
}

/// What KHR_materials_diffuse_transmission says; `None` where it lets nothing through.
fn transmission(json: &Value, place: &str, pictures: &mut Pictures<'_>, faults: &mut Faults) -> Option<Transmission> {
    let name = "diffuseTransmissionFactor";
    // Not clamped: what is more than arrives is refused with the reflectance that it adds to.
    let [replaced] = given(&wrapped(json, name), name, place, faults).unwrap_or([0.0]);
    let color: [f64; 3] = given(json, "diffuseTransmissionColorFactor", place, faults).unwrap_or([1.0; 3]);
    if replaced == 0.0 {
        return None;
    }
    let replaced = replaced as f32;
    Some(Transmission {
        transmittance: color.map(|c| c as f32 * replaced),
        texture: pictures.used(json.get("diffuseTransmissionColorTexture"), place, faults),
        replaced,
        share_texture: pictures.used(json.get("diffuseTransmissionTexture"), place, faults),
    })
}

/// A lone number as a list of one, so that [`factor`] reads it like the others.
fn wrapped(json: &Value, name: &str) -> Value {
    match json.get(name) {
        Some(value) => serde_json::json!({ name: [value] }),
        None => Value::Null,
    }
}

/// `N` numbers, if they are there; what is not `N` numbers is reported.
fn given<const N: usize>(json: &Value, name: &str, place: &str, faults: &mut Faults) -> Option<[f64; N]> {
    let value = json.get(name)?;
    let given = numbers::<N>(value);
    if given.is_none() {
        faults.warning(place, format!("{name} is {}, not {N} numbers; ignored", shown(Some(value))), "correct it");
    }
    given
}

/// `N` factors in 0..1; what is not is reported and clamped.
fn factor<const N: usize>(json: &Value, name: &str, default: [f32; N], place: &str, faults: &mut Faults) -> [f32; N] {
    let Some(given) = given(json, name, place, faults) else { return default };
    if given.iter().any(|x| !(0.0..=1.0).contains(x)) {
        let what = format!("{name} is {given:?}; clamped to 0..1");
        faults.warning(place, what, "no surface reflects more light than it gets; emission has emissiveStrength");
    }
    given.map(|x| x.clamp(0.0, 1.0) as f32)
}

/// Pictures, decoded when the first material uses them.
struct Pictures<'a> {
    document: &'a Document,
    file: &'a str,
    /// By place of the encoded bytes, since several images may name the same: the texture that came of them.
    decoded: BTreeMap<(*const u8, usize), Option<usize>>,
    textures: Vec<Texture>,
    budget: u64,
}

impl Pictures<'_> {
    /// A material's reference to a picture; `None`, with a warning, where it cannot be used.
    fn used(&mut self, info: Option<&Value>, place: &str, faults: &mut Faults) -> Option<TextureRef> {
        let info = info?;
        let index = info.get("index").and_then(whole);
        let textures = list(&self.document.json, "textures");
        let Some(json) = index.and_then(|index| textures.get(index)) else {
            let what = format!("texture {} of {}; the picture is ignored", shown(info.get("index")), textures.len());
            faults.warning(place, what, "export the model again");
            return None;
        };

        let transform = info.get("extensions").and_then(|all| all.get("KHR_texture_transform"));
        let set = transform.and_then(|t| t.get("texCoord")).or_else(|| info.get("texCoord"));
        let uv_set = set.map_or(Some(0), whole).filter(|set| *set < 2);
        let Some(uv_set) = uv_set else {
            let what = format!("texture coordinates {}; the picture is ignored", shown(set));
            faults.warning(place, what, "only sets 0 and 1 are read");
            return None;
        };
        let sampler = json.get("sampler").and_then(whole).and_then(|i| list(&self.document.json, "samplers").get(i));
        let nearest = sampler.and_then(|s| s.get("magFilter")).and_then(whole) == Some(9728);
        let texture = self.decode(json, place, faults)?;
        let transform = transform.map_or(DAffine2::IDENTITY, uv_transform);
        Some(TextureRef { texture, uv_set, transform, wrap: wrap(sampler), nearest })
    }

    fn decode(&mut self, texture: &Value, place: &str, faults: &mut Faults) -> Option<usize> {
        let Some(source) = texture.get("source").and_then(whole) else {
            let other = texture.get("extensions").and_then(Value::as_object).and_then(|all| all.keys().next());
            let what = match other {
                Some(extension) => format!("its picture is only there as {extension}; ignored"),
                None => "its texture names no picture; ignored".to_owned(),
            };
            faults.warning(place, what, "export with PNG or JPEG pictures");
            return None;
        };
        let Some(loaded) = self.document.images.get(source) else {
            faults.warning(place, format!("image {source} does not exist; ignored"), "export the model again");
            return None;
        };
        // What could not be loaded was reported when the document was read.
        let encoded = loaded.as_ref()?;
        if let Some(known) = self.decoded.get(&encoded.bytes.place()) {
            return *known;
        }
        let json = list(&self.document.json, "images").get(source).unwrap_or(&Value::Null);
        let name = match (text(json, "name"), text(json, "uri")) {
            ("", uri) if uri.is_empty() || uri.starts_with("data:") => format!("image {source}"),
            ("", uri) => uri.to_owned(),
            (name, _) => name.to_owned(),
        };
        let index = match picture::decode(&name, &encoded.bytes, &mut self.budget) {
            Ok(texture) => {
                self.textures.push(texture);
                Some(self.textures.len() - 1)
            }
            Err(what) => {
                let place = format!("{}: images[{source}] '{name}'", self.file);
                faults.warning(place, format!("cannot be decoded: {what}; ignored"), "export it as PNG or JPEG");
                None
            }
        };
        self.decoded.insert(encoded.bytes.place(), index);
        index
    }
}

fn wrap(sampler: Option<&Value>) -> [Wrap; 2] {
    ["wrapS", "wrapT"].map(|name| match sampler.and_then(|s| s.get(name)).and_then(whole) {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    })
}

/// KHR_texture_transform: scale, then turn, then move.
fn uv_transform(json: &Value) -> DAffine2 {
    let offset = json.get("offset").and_then(numbers::<2>).map_or(DVec2::ZERO, DVec2::from);
    let scale = json.get("scale").and_then(numbers::<2>).map_or(DVec2::ONE, DVec2::from);
    let rotation = json.get("rotation").and_then(number).unwrap_or(0.0);
    let (sin, cos) = rotation.sin_cos();
    // The turn is counter-clockwise as seen, with v pointing down: the reverse of one with v pointing up.
    let turn = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    DAffine2::from_mat2_translation(turn * DMat2::from_diagonal(scale), offset)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read_one(material: Value) -> (Material, Faults) {
        let mut faults = Faults::default();
        let document = Document { json: json!({ "materials": [material] }), ..Document::default() };
        let mut read = read(&document, "t", &mut faults);
        (read.materials.swap_remove(0), faults)
    }

    #[test]
    fn reads_factors_and_strength() {
        let (material, faults) = read_one(json!({
            "name": "lamp", "doubleSided": true, "alphaMode": "MASK", "emissiveFactor": [1, 0.5, 0.25],
            "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.75},
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 400}}}));
        assert_eq!(material.base_color, [0.1, 0.2, 0.3, 0.4]);
        assert_eq!(material.metallic, 0.75);
        assert_eq!(material.emissive, [400.0, 200.0, 100.0]);
        assert_eq!(material.alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
        assert!(material.double_sided && faults.0.is_empty(), "{faults}");
    }

    #[test]
    fn a_picture_that_many_images_name_is_decoded_once() {
        let mut png = std::io::Cursor::new(Vec::new());
        image::RgbaImage::new(8, 8).write_to(&mut png, image::ImageFormat::Png).unwrap();
        let bytes = crate::Bytes::from(png.into_inner());
        let image = crate::gltf::EncodedImage { mime: "image/png".to_owned(), bytes };
        let indices: Vec<usize> = (0..50).collect();
        let textures: Vec<Value> = indices.iter().map(|i| json!({ "source": i })).collect();
        let materials: Vec<Value> =
            indices.iter().map(|i| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": i } } })).collect();
        let document = Document {
            json: json!({ "materials": materials, "textures": textures, "images": vec![json!({}); 50] }),
            images: vec![Some(image); 50],
            ..Document::default()
        };
        let mut faults = Faults::default();
        let read = read(&document, "t", &mut faults);
        assert_eq!((read.textures.len(), read.materials.len(), faults.0.len()), (1, 51, 0), "{faults}");
        assert!(read.materials[..50].iter().all(|m| m.base_color_texture.as_ref().is_some_and(|t| t.texture == 0)));
    }

    #[test]
    fn colours_outside_0_to_1_are_clamped_with_a_warning() {
        let (material, faults) = read_one(json!({"pbrMetallicRoughness": {"baseColorFactor": [1.5, -0.1, 1.0, 1]}}));
        assert_eq!(material.base_color, [1.0, 0.0, 1.0, 1.0]);
        assert!(faults.to_string().contains("clamped"), "{faults}");
    }

    #[test]
    fn unlit_gives_no_light_and_is_no_metal() {
        let (material, faults) =
            read_one(json!({"emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_unlit": {}}}));
        assert_eq!((material.metallic, material.emissive), (0.0, [0.0; 3]));
        assert!(faults.to_string().contains("unlit"), "{faults}");
    }

    #[test]
    fn catalogue_13_diffuse_transmission_is_read() {
        let mut png = std::io::Cursor::new(Vec::new());
        let texel = image::Rgba([255, 0, 0, 128]);
        image::RgbaImage::from_pixel(2, 2, texel).write_to(&mut png, image::ImageFormat::Png).unwrap();
        let bytes = crate::Bytes::from(png.into_inner());
        let document = Document {
            json: json!({ "textures": [{ "source": 0 }], "images": [{}], "materials": [
                { "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.5, 0.2, 1], "metallicFactor": 0.5 },
                  "extensions": { "KHR_materials_volume": {}, "KHR_materials_diffuse_transmission": {
                    "diffuseTransmissionFactor": 0.25, "diffuseTransmissionColorFactor": [1, 0.5, 0],
                    "diffuseTransmissionTexture": { "index": 0 }, "diffuseTransmissionColorTexture": { "index": 0 } } } },
                { "extensions": { "KHR_materials_diffuse_transmission": {} } } ] }),
            images: vec![Some(crate::gltf::EncodedImage { mime: "image/png".to_owned(), bytes })],
            ..Document::default()
        };
        let mut faults = Faults::default();
        let Materials { materials, textures } = read(&document, "t", &mut faults);
        let first = materials[0].transmission.clone().unwrap();
        assert_eq!((first.transmittance, first.replaced), ([0.25, 0.125, 0.0], 0.25));
        assert!(first.texture.is_some() && first.share_texture.is_some() && materials[0].has_two_sides());
        assert_eq!(materials[1].transmission, None);
        assert!(faults.to_string().contains("KHR_materials_volume") && !faults.has_errors(), "{faults}");

        // ρ = (1 − f a) base (1 − m) and τ = f a colour (1 − m), with a = 128/255.
        let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]].map(glam::DVec3::from);
        let mut scene = radiosity_scene::Scene { materials, textures, ..Default::default() };
        scene.add_triangles("sheet", 0, &[corners]);
        let at = radiosity_scene::Surface { triangle: 0, uv: DVec2::splat(0.25) };
        let share = 0.25 * 128.0 / 255.0;
        let (rho, tau) = (scene.reflectance(at), scene.transmittance(at));
        for (band, base) in [0.8, 0.5, 0.2].into_iter().enumerate() {
            assert!((rho[band] - 0.5 * (1.0 - share) * base).abs() < 1e-6, "{rho:?}");
        }
        assert!((tau[0] - 0.5 * share).abs() < 1e-6 && tau[1..] == [0.0; 2], "{tau:?}");
    }

    /// All of them at once, each by the name of its material.
    #[test]
    fn catalogue_12_more_light_than_arrives_is_refused() {
        let sheet = |name: &str, base: f64, factor: f64, color: f64| {
            json!({ "name": name, "pbrMetallicRoughness": { "baseColorFactor": [0, base, 0, 1], "metallicFactor": 0 },
                "extensions": { "KHR_materials_diffuse_transmission": {
                    "diffuseTransmissionFactor": factor, "diffuseTransmissionColorFactor": [0, color, 0] } } })
        };
        let materials = [
            sheet("all of it", 1.0, 0.3, 1.0),
            sheet("bright", 0.9, 0.5, 1.2),
            sheet("brighter", 0.5, 1.5, 0.5),
            sheet("odd", 0.5, -0.1, 1.0),
        ];
        let document = Document { json: json!({ "materials": materials }), ..Document::default() };
        let mut faults = Faults::default();
        read(&document, "t.gltf", &mut faults);
        let said: Vec<String> = faults.0.iter().map(ToString::to_string).collect();
        let expected = [
            "error: t.gltf: materials[1] 'bright': reflectance and transmittance sum to [0.0, 1.05, 0.0], above 1",
            "error: t.gltf: materials[2] 'brighter': transmittance [0.0, 0.75, 0.0], which takes the place of 1.5",
            "error: t.gltf: materials[3] 'odd': transmittance",
        ];
        assert_eq!(said.len(), expected.len(), "{faults}");
        for (said, expected) in said.iter().zip(expected) {
            assert!(said.starts_with(expected), "{said}");
        }
    }

    #[test]
    fn emission_beyond_single_precision_is_an_error() {
        let (material, faults) = read_one(json!({"emissiveFactor": [1, 1, 1],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 1e300}}}));
        assert!(faults.has_errors() && !material.emits());
    }
}
