//! MTL material libraries: `Kd`, `Ke`, `d`/`Tr`, `map_Kd`, `map_Ke`.
//!
//! Kd and Ke are linear values as they stand, Ke in cd/m²; pictures are sRGB. `d` below 1 lets that share of the light
//! pass (alpha blend). `Tf` and the glass of `illum` are not computed, and told where they would matter. Where a picture
//! comes without its factor the factor is 1; a material without either is grey.

use super::bare;
use crate::{Source, picture};
use glam::{DAffine2, DMat2, DVec2};
use radiosity_scene::{AlphaMode, Faults, Material, Texture, TextureRef, Wrap};
use std::collections::BTreeMap;

/// Reflectance of faces without a material, or whose material has no Kd.
pub(crate) const GREY: f32 = 0.5;

/// What `illum` says of surfaces that light passes through, by glass or by refraction.
const GLASS: [&str; 4] = ["4", "6", "7", "9"];

/// Materials by name, gathered from all libraries of an OBJ.
pub(crate) struct Library<'a> {
    source: &'a dyn Source,
    pub materials: Vec<Material>,
    pub by_name: BTreeMap<String, usize>,
    pub textures: Vec<Texture>,
    /// Texture by path; `None` where it could not be used.
    known: BTreeMap<String, Option<usize>>,
    budget: u64,
    /// Whether a library that the file names could not be read.
    pub is_missing: bool,
}

impl<'a> Library<'a> {
    pub fn new(source: &'a dyn Source) -> Library<'a> {
        let (materials, by_name, textures) = (Vec::new(), BTreeMap::new(), Vec::new());
        let (known, budget) = (BTreeMap::new(), picture::MAX_TEXELS);
        Library { source, materials, by_name, textures, known, budget, is_missing: false }
    }

    /// Index of the material for faces that have none.
    pub fn grey(&mut self) -> usize {
        self.named("no material", Material { base_color: [GREY, GREY, GREY, 1.0], ..Material::default() })
    }

    fn named(&mut self, name: &str, mut material: Material) -> usize {
        if let Some(&known) = self.by_name.get(name) {
            return known;
        }
        name.clone_into(&mut material.name);
        self.materials.push(material);
        self.by_name.insert(name.to_owned(), self.materials.len() - 1);
        self.materials.len() - 1
    }

    /// Reads the library at `path` as the OBJ names it.
    pub fn read(&mut self, path: &str, place: &str, faults: &mut Faults) {
        let bytes = match self.source.read(&escaped(path)) {
            Ok(bytes) => bytes,
            Err(error) => {
                let what = format!("material library {error}; its materials are grey");
                faults.warning(place, what, error.hint());
                self.is_missing = true;
                return;
            }
        };
        let folder = path.rfind(['/', '\\']).map_or("", |at| &path[..=at]);
        let text = String::from_utf8_lossy(&bytes);
        let mut current: Option<Draft> = None;
        for (number, line) in bare(&text).lines().enumerate() {
            let line = line.split('#').next().unwrap_or_default().trim();
            let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let (rest, place) = (rest.trim(), || format!("{path}:{}", number + 1));
            if keyword == "newmtl" {
                if let Some(draft) = current.take() {
                    self.keep(draft, faults);
                }
                current = Some(Draft { name: rest.to_owned(), place: place(), ..Draft::default() });
                continue;
            }
            let Some(draft) = &mut current else { continue };
            match keyword {
                "Kd" => draft.kd = color(rest, keyword, &place, faults).or(draft.kd),
                "Ke" => draft.ke = color(rest, keyword, &place, faults).or(draft.ke),
                "d" => draft.opacity = one(rest.trim_start_matches("-halo"), keyword, &place, faults).or(draft.opacity),
                "Tr" => draft.opacity = one(rest, keyword, &place, faults).map(|t| 1.0 - t).or(draft.opacity),
                "Tf" => draft.filter = color(rest, keyword, &place, faults).or(draft.filter),
                "illum" => draft.is_glass = GLASS.contains(&rest),
                "map_Kd" => draft.map_kd = self.map(rest, folder, &place, faults),
                "map_Ke" => draft.map_ke = self.map(rest, folder, &place, faults),
                "map_d" => {
                    self.mention(rest, folder);
                    faults.note(place(), "map_d is not read", "put alpha into the picture of map_Kd");
                }
                "bump" | "disp" | "decal" | "refl" | "norm" => self.mention(rest, folder),
                _ if keyword.starts_with("map_") => self.mention(rest, folder),
                _ => {}
            }
        }
        if let Some(draft) = current.take() {
            self.keep(draft, faults);
        }
    }

    /// A picture that is not read, named behind its options.
    fn mention(&self, rest: &str, folder: &str) {
        if let Some(name) = rest.split_whitespace().last() {
            self.source.mention(&escaped(&format!("{folder}{name}")));
        }
    }

    fn keep(&mut self, draft: Draft, faults: &mut Faults) {
        if self.by_name.contains_key(&draft.name) {
            faults.warning(
                &draft.place,
                format!("material '{}' is there already; the first counts", draft.name),
                "rename it",
            );
            return;
        }
        let kd = draft.kd.unwrap_or(if draft.map_kd.is_some() { [1.0; 3] } else { [f64::from(GREY); 3] });
        let kd = limited(kd, 1.0, "Kd", "no surface reflects more light than it gets", &draft.place, faults);
        // Beyond 1e12 cd/m² (a thousand suns) single precision would not hold squares and sums of it.
        let ke = draft.ke.unwrap_or([if draft.map_ke.is_some() { 1.0 } else { 0.0 }; 3]);
        let ke = limited(ke, 1e12, "Ke", "check the unit of luminance", &draft.place, faults);
        let [opacity, ..] = limited([draft.opacity.unwrap_or(1.0); 3], 1.0, "d", "use 0 to 1", &draft.place, faults);
        draft.tell_transmission(opacity, faults);
        let material = Material {
            base_color: [kd[0], kd[1], kd[2], opacity],
            base_color_texture: draft.map_kd,
            emissive: ke,
            emissive_texture: draft.map_ke,
            alpha_mode: if opacity < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            ..Material::default()
        };
        self.named(&draft.name, material);
    }

    /// A picture with its options (`-s`, `-o`, `-clamp`; others say nothing about diffuse light).
    fn map(&mut self, text: &str, folder: &str, place: &dyn Fn() -> String, faults: &mut Faults) -> Option<TextureRef> {
        let (mut scale, mut offset, mut wrap) = (DVec2::ONE, DVec2::ZERO, Wrap::Repeat);
        let mut rest = text;
        while rest.starts_with('-') {
            let (option, after) = rest.split_once(char::is_whitespace)?;
            rest = after.trim_start();
            // -s and -o take one to three numbers; a following word that is no number is the file already.
            let (least, most) = match option {
                "-s" | "-o" | "-t" => (1, 3),
                "-mm" => (2, 2),
                _ => (1, 1),
            };
            let mut given = [""; 3];
            for (i, slot) in given.iter_mut().enumerate().take(most) {
                let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                if i >= least && word.parse::<f64>().is_err() {
                    break;
                }
                *slot = word;
                rest = after.trim_start();
            }
            let number = |i: usize, default: f64| {
                given.get(i).and_then(|word| word.parse().ok()).filter(|x: &f64| x.is_finite()).unwrap_or(default)
            };
            match option {
                "-s" => scale = DVec2::new(number(0, 1.0), number(1, 1.0)),
                "-o" => offset = DVec2::new(number(0, 0.0), number(1, 0.0)),
                "-clamp" if given[0] == "on" => wrap = Wrap::Clamp,
                _ => {}
            }
        }
        let path = format!("{folder}{rest}");
        let texture = match self.known.get(&path) {
            Some(known) => *known,
            None => {
                let read = self.source.read(&escaped(&path)).map_err(|error| (error.to_string(), error.hint()));
                let decoded = read.and_then(|bytes| {
                    picture::decode(&path, &bytes, &mut self.budget)
                        .map_err(|what| (format!("'{path}' cannot be decoded: {what}"), "use PNG or JPEG"))
                });
                let index = match decoded {
                    Ok(texture) => {
                        self.textures.push(texture);
                        Some(self.textures.len() - 1)
                    }
                    Err((what, hint)) => {
                        faults.warning(place(), format!("picture {what}; ignored"), hint);
                        None
                    }
                };
                self.known.insert(path, index);
                index
            }
        }?;
        // v points up in OBJ and down here, so the scaling is about v = 1.
        let moved = DVec2::new(offset.x, 1.0 - scale.y - offset.y);
        let transform = DAffine2::from_mat2_translation(DMat2::from_diagonal(scale), moved);
        Some(TextureRef { texture, uv_set: 0, transform, wrap: [wrap; 2], nearest: false })
    }
}

/// A material while its lines are read.
#[derive(Default)]
struct Draft {
    name: String,
    place: String,
    kd: Option<[f64; 3]>,
    ke: Option<[f64; 3]>,
    opacity: Option<f64>,
    /// `Tf`: what of the light that passes.
    filter: Option<[f64; 3]>,
    is_glass: bool,
    map_kd: Option<TextureRef>,
    map_ke: Option<TextureRef>,
}

impl Draft {
    /// Says what of the light that would pass is lost. A filter of all or nothing on a surface that is opaque otherwise is
    /// what exporters write where nobody meant any.
    fn tell_transmission(&self, opacity: f32, faults: &mut Faults) {
        let name = &self.name;
        let hint = "d below 1 lets light pass unscattered; KHR_materials_diffuse_transmission of glTF scatters it";
        let filter = self.filter.unwrap_or([1.0; 3]);
        let is_usual = filter == [1.0; 3] || filter == [0.0; 3];
        let what = match opacity < 1.0 {
            true if filter != [1.0; 3] => format!("Tf {filter:?} is not computed; what passes by d keeps its colour"),
            false if self.is_glass => "illum 4, 6, 7 or 9 (glass) is not computed; the surface is opaque".to_owned(),
            false if !is_usual => format!("Tf {filter:?} is not computed; the surface is opaque"),
            _ => return,
        };
        faults.warning(&self.place, format!("material '{name}': {what}"), hint);
    }
}

/// A file name as an address: a percent sign in it is meant as one.
fn escaped(path: &str) -> String {
    path.replace('%', "%25")
}

fn limited(values: [f64; 3], most: f64, name: &str, hint: &str, place: &str, faults: &mut Faults) -> [f32; 3] {
    if values.iter().any(|v| !(0.0..=most).contains(v)) {
        let most = if most < 1e6 { most.to_string() } else { format!("{most:e}") };
        let nan = if values.iter().any(|v| v.is_nan()) { ", what is no number counts as 0" } else { "" };
        let hint = if values.iter().all(|v| *v >= 0.0) { hint } else { "write numbers from 0 on" };
        faults.warning(place, format!("{name} is {values:?}; clamped to 0..{most}{nan}"), hint);
    }
    values.map(|v| if v.is_nan() { 0.0 } else { v.clamp(0.0, most) as f32 })
}

/// Three numbers, or one for all three.
fn color(text: &str, keyword: &str, place: &dyn Fn() -> String, faults: &mut Faults) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[all]) => Some([all; 3]),
        Some(&[r, g, b, ..]) => Some([r, g, b]),
        _ => {
            faults.warning(
                place(),
                format!("{keyword} '{text}' is not three numbers; ignored"),
                "write red green blue",
            );
            None
        }
    }
}

fn one(text: &str, keyword: &str, place: &dyn Fn() -> String, faults: &mut Faults) -> Option<f64> {
    let number = text.trim().parse().ok();
    if number.is_none() {
        faults.warning(place(), format!("{keyword} '{text}' is not a number; ignored"), "write a number from 0 to 1");
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Memory;

    #[test]
    fn reads_colours_opacity_and_pictures_beside_the_library() {
        let mut png = std::io::Cursor::new(Vec::new());
        image::RgbaImage::new(2, 1).write_to(&mut png, image::ImageFormat::Png).unwrap();
        let mtl = "newmtl a\nKd .1 .2 .3 # c\nKe 7\nd 0.25\nnewmtl b c\nmap_Kd -s 2 3 -o 0.5 .25 -clamp on my tex 5%.png\n\
                   map_Ke gone.png\nnewmtl bad\nKd 2 nan x\nKd 2 nan 0\nTr 0.5\n";
        let files = [("m/l.mtl", mtl.as_bytes().to_vec()), ("m/my tex 5%.png", png.into_inner())];
        let memory = Memory(files.map(|(name, bytes)| (name.to_owned(), bytes)).into());
        let (mut library, mut faults) = (Library::new(&memory), Faults::default());
        library.read("m/l.mtl", "t.obj:1", &mut faults);

        let [a, b, bad] = &library.materials[..] else { panic!("{:?}", library.materials) };
        assert_eq!((a.base_color, a.emissive, a.alpha_mode), ([0.1, 0.2, 0.3, 0.25], [7.0; 3], AlphaMode::Blend));
        let picture = b.base_color_texture.unwrap();
        assert_eq!((b.name.as_str(), b.base_color, b.emissive), ("b c", [1.0; 4], [0.0; 3]));
        assert_eq!(picture.wrap, [Wrap::Clamp; 2]);
        // In OBJ's own frame: (0.1, 0.2) → (2·0.1 + 0.5, 3·0.2 + 0.25).
        assert!((picture.coordinates(DVec2::new(0.1, 0.8)) - DVec2::new(0.7, 0.15)).length() < 1e-12);
        assert_eq!((bad.base_color, bad.alpha_mode), ([1.0, 0.0, 0.0, 0.5], AlphaMode::Blend));
        let text = faults.to_string();
        for expected in ["'m/gone.png' does not exist", "m/l.mtl:9: Kd '2 nan x'", "clamped"] {
            assert!(text.contains(expected), "{text}");
        }
    }

    /// What is wrong with numbers out of range, and what to write, by how they are out of it.
    #[test]
    fn numbers_out_of_range_are_told_as_they_are_taken() {
        for (values, most, taken, told, hint) in [
            ([2.0, 0.5, 0.5], 1.0, [1.0, 0.5, 0.5], "clamped to 0..1 ", "no more"),
            ([-1.0, 0.5, 0.5], 1.0, [0.0, 0.5, 0.5], "clamped to 0..1 ", "from 0 on"),
            ([f64::NAN, 0.5, 0.5], 1.0, [0.0, 0.5, 0.5], "0..1, what is no number counts as 0", "from 0 on"),
            ([1e30, 1.0, 1.0], 1e12, [1e12, 1.0, 1.0], "0..1e12", "no more"),
        ] {
            let mut faults = Faults::default();
            assert_eq!(limited(values, most, "Kd", "no more", "a.mtl:2", &mut faults), taken);
            let text = format!("{} ", faults.to_string().replace('\n', " "));
            assert!(text.contains(told) && text.contains(hint), "{text}");
        }
    }

    /// They were passed over in silence.
    #[test]
    fn light_that_would_pass_is_told() {
        let mtl = "newmtl usual\nTf 1 1 1\nillum 2\nnewmtl off\nTf 0 0 0\nnewmtl glass\nillum 7\nnewmtl pane\nillum 4\nd 0.5\n\
                   newmtl silk\nTf 0.2 0.3 0.4\nnewmtl tinted\nTf 1 0 0\nd 0.5\nnewmtl odd\nTf spectral a.rfl\n";
        let memory = Memory([("l.mtl".to_owned(), mtl.as_bytes().to_vec())].into());
        let (mut library, mut faults) = (Library::new(&memory), Faults::default());
        library.read("l.mtl", "t.obj:1", &mut faults);
        let said: Vec<String> = faults.0.iter().map(ToString::to_string).collect();
        let expected = [
            "warning: l.mtl:6: material 'glass': illum 4, 6, 7 or 9 (glass) is not computed; the surface is opaque",
            "warning: l.mtl:11: material 'silk': Tf [0.2, 0.3, 0.4] is not computed; the surface is opaque",
            "warning: l.mtl:17: Tf 'spectral a.rfl' is not three numbers",
            "warning: l.mtl:13: material 'tinted': Tf [1.0, 0.0, 0.0] is not computed; what passes by d",
        ];
        assert_eq!(said.len(), expected.len(), "{faults}");
        assert!(expected.iter().all(|line| said.iter().any(|said| said.starts_with(line))), "{faults}");
        assert_eq!(library.materials[4].alpha_mode, AlphaMode::Opaque);
    }
}
