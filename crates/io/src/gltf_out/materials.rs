//! Copies of materials that carry the light: one for each page of the lightmap, one for the unlit style, one for the
//! single-sided layers of a double-sided surface. The first takes the place of its original where nothing uses that any more.

use super::glb::{Builder, Target};
use super::rewrite::{indices, keep, renumber};
use super::vertices::Glow;
use super::{Encoding, Light, LitPrimitive, PageImage, Style};
use radiosity_scene::Scene;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// What a copy depends on.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    /// Material in the file; `None` where the primitive has none.
    source: Option<usize>,
    /// Material in the scene.
    material: usize,
    /// Page and texture coordinate set.
    lightmap: Option<(usize, usize)>,
    unlit: bool,
    single_sided: bool,
}

/// The copies made so far.
pub(super) struct Materials<'a> {
    scene: &'a Scene,
    style: &'a Style,
    /// Texture of each page of the lightmap.
    textures: Vec<usize>,
    known: BTreeMap<Key, usize>,
}

impl<'a> Materials<'a> {
    /// Writes the pages of the lightmap.
    pub fn new(scene: &'a Scene, style: &'a Style, builder: &mut Builder) -> Materials<'a> {
        let mut textures = Vec::new();
        if let Style::Lightmap { pages, encoding, .. } = style {
            // Bilinear without mip-maps and clamped: the charts' own texels are all that is read.
            let sampler = json!({ "magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071 });
            let sampler = builder.push("samplers", sampler);
            textures =
                pages.iter().enumerate().map(|(i, page)| texture(builder, i, page, *encoding, sampler)).collect();
        }
        Materials { scene, style, textures, known: BTreeMap::new() }
    }

    /// How unlit vertices of an object make their colour.
    pub fn glow_of(&self, object: usize) -> Glow {
        self.glow(self.scene.objects.get(object).map_or(0, |object| object.material))
    }

    /// How unlit vertices of a scene's material make their colour.
    pub fn glow(&self, material: usize) -> Glow {
        let Some(m) = self.scene.materials.get(material) else { return Glow { tint: [1.0; 3], emissive: [0.0; 3] } };
        let plain = m.base_color_texture.is_none();
        match m.emits() {
            // A picture stays the material's and multiplies; a plain colour moves into the vertices, where light that
            // is brighter than white on white can still be seen on grey.
            false if !plain => Glow { tint: [1.0; 3], emissive: [0.0; 3] },
            // The picture of a lamp shows its emission; without pictures the reflected light fits in as well.
            true if !plain || m.emissive_texture.is_some() => Glow { tint: [0.0; 3], emissive: m.emissive },
            _ => Glow { tint: [m.base_color[0], m.base_color[1], m.base_color[2]], emissive: m.emissive },
        }
    }

    /// The material for a primitive whose own is `source`; `None` where it has none and needs none.
    pub fn lit(
        &mut self,
        builder: &mut Builder,
        source: Option<usize>,
        primitive: &LitPrimitive,
        set: Option<usize>,
        single_sided: bool,
    ) -> Option<usize> {
        let material = self.scene.objects.get(primitive.object).map_or(0, |object| object.material);
        let lightmap = match primitive.light {
            Light::Lightmap { page, .. } => set.map(|set| (page, set)),
            _ => None,
        };
        let unlit = matches!((self.style, &primitive.light), (Style::Unlit { .. }, Light::Vertex { .. }));
        let key = Key { source, material, lightmap, unlit, single_sided };
        if lightmap.is_none() && !unlit && !single_sided {
            return source;
        }
        if let Some(&known) = self.known.get(&key) {
            return Some(known);
        }
        let own = source.and_then(|index| builder.list("materials").get(index).cloned());
        let mut json = match own {
            Some(Value::Object(json)) => json,
            _ => self.unnamed(material),
        };
        if single_sided {
            json.remove("doubleSided");
        }
        if let (Some((page, set)), Style::Lightmap { pages, exposure, .. }) = (lightmap, self.style) {
            let intensity = pages.get(page).map_or(0.0, |page| page.intensity) * exposure;
            let intensity = if intensity.is_finite() { intensity } else { 0.0 };
            let texture = self.textures.get(page).copied().unwrap_or(0);
            let value = json!({ "index": texture, "texCoord": set, "intensity": intensity });
            extensions(&mut json).insert("MOZ_lightmap".into(), value);
            builder.uses("MOZ_lightmap");
        }
        if unlit {
            self.unlit(&mut json, material);
            builder.uses("KHR_materials_unlit");
        }
        let index = builder.push("materials", Value::Object(json));
        self.known.insert(key, index);
        Some(index)
    }

    /// Puts the first copy of a material in its place where nothing uses the original any more. Unlit copies stand beside
    /// originals that are an author's: they have lost the colours that are in the vertices now.
    pub fn settle(self, builder: &mut Builder, are_authors: bool) {
        let mut used = vec![false; builder.list("materials").len()];
        uses(builder, &mut |index| {
            if let Some(used) = used.get_mut(*index) {
                *used = true;
            }
        });
        let mut copies: Vec<(usize, usize)> = self
            .known
            .iter()
            .filter(|(key, _)| !(key.unlit && are_authors))
            .filter_map(|(key, &copy)| Some((copy, key.source?)))
            .collect();
        copies.sort_unstable();
        let (mut place, mut kept): (Vec<usize>, _) = ((0..used.len()).collect(), vec![true; used.len()]);
        for (copy, source) in copies {
            if used.get(source) == Some(&false) {
                builder.list("materials").swap(source, copy);
                (place[copy], kept[copy], used[source]) = (source, false, true);
            }
        }
        let new = renumber(&kept);
        uses(builder, &mut |index| {
            if let Some(&place) = place.get(*index) {
                *index = new[place];
            }
        });
        keep(builder.list("materials"), &kept);
    }

    /// The material that the scene gave to primitives without one.
    fn unnamed(&self, material: usize) -> Map<String, Value> {
        let color = self.scene.materials.get(material).map_or([1.0; 4], |m| m.base_color);
        let pbr = json!({ "baseColorFactor": color.map(unit), "metallicFactor": 0.0 });
        Map::from_iter([("pbrMetallicRoughness".to_owned(), pbr)])
    }

    fn unlit(&self, json: &mut Map<String, Value>, material: usize) {
        // The strength of an emission that is not shown would only be a contradiction.
        let own = extensions(json);
        own.remove("KHR_materials_emissive_strength");
        own.insert("KHR_materials_unlit".into(), json!({}));
        let lamp = self.scene.materials.get(material).is_some_and(|m| m.emits());
        if !lamp && self.scene.materials.get(material).is_none_or(|m| m.base_color_texture.is_some()) {
            return;
        }
        // The vertices carry the colour, a lamp's its emission; the picture of the emission takes the place of the base
        // colour's.
        let picture = json.get("emissiveTexture").filter(|_| lamp).cloned();
        let pbr = json.entry("pbrMetallicRoughness").or_insert_with(|| json!({}));
        if let Some(pbr) = pbr.as_object_mut() {
            let alpha = pbr.get("baseColorFactor").and_then(|c| c.get(3)).and_then(Value::as_f64).unwrap_or(1.0);
            pbr.insert("baseColorFactor".into(), json!([1.0, 1.0, 1.0, alpha]));
            match picture {
                Some(picture) => pbr.insert("baseColorTexture".into(), picture),
                None => pbr.remove("baseColorTexture"),
            };
        }
    }
}

/// Visits every index of a material, in primitives and their variants.
fn uses(builder: &mut Builder, visit: &mut dyn FnMut(&mut usize)) {
    builder.list("meshes").iter_mut().for_each(|mesh| indices(mesh, "material", visit));
}

/// A number that a factor of 0..1 may hold.
pub(super) fn unit(value: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 }
}

fn extensions(json: &mut Map<String, Value>) -> &mut Map<String, Value> {
    let slot = json.entry("extensions").or_insert_with(|| json!({}));
    if !slot.is_object() {
        *slot = json!({});
    }
    match slot {
        Value::Object(map) => map,
        _ => unreachable!("an object was just put there"),
    }
}

fn texture(builder: &mut Builder, index: usize, page: &PageImage, encoding: Encoding, sampler: usize) -> usize {
    let view = builder.view(&page.png, Target::None);
    let name = format!("lightmap {index}");
    let image = builder.push("images", json!({ "bufferView": view, "mimeType": "image/png", "name": name }));
    let encoding = match encoding {
        Encoding::Srgb => "srgb",
        Encoding::Linear => "linear",
    };
    let scale = if page.intensity.is_finite() { page.intensity } else { 0.0 };
    let extras = json!({ "quantity": "irradiance", "unit": "lx", "encoding": encoding, "scale": scale });
    builder.push("textures", json!({ "source": image, "sampler": sampler, "name": name, "extras": extras }))
}
