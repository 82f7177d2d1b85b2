//! What the surfaces look like: linear reflectances, pictures, and the luminance of lamps.

use super::{furniture, kit, pictures, room};
use crate::fault::Fault;
use crate::glb::Glb;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// The surfaces of the room by what they are painted with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Paint {
    Floor,
    Rug,
    Hills,
    Discs,
    Kit,
    LampBulb,
    LampShade,
    Globe,
    Wall,
    Accent,
    Ceiling,
    White,
    Facade,
    Linen,
    Brass,
    Black,
    Oak,
    Ceramic,
    Rust,
    Mustard,
    Navy,
    Sage,
    Leaf,
    Soil,
    Grass,
    Hedge,
    Bark,
}

/// Pictures a material can carry.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Picture {
    Floor,
    Rug,
    Hills,
    Discs,
    Kit,
}

/// How a paint is written down: its name, its linear reflectance (or the factor of its picture), its picture, and its
/// luminance, cd/m² per band.
struct Look {
    name: &'static str,
    color: [f64; 3],
    picture: Option<Picture>,
    luminance: [f64; 3],
}

const fn plain(name: &'static str, color: [f64; 3]) -> Look {
    Look { name, color, picture: None, luminance: [0.0; 3] }
}

const fn drawn(name: &'static str, picture: Picture) -> Look {
    Look { name, color: [1.0; 3], picture: Some(picture), luminance: [0.0; 3] }
}

/// The kit's picture holds pure white; this factor keeps the brightest fabric at the reflectance of good white paint.
const KIT: Look = Look { color: [0.82; 3], ..drawn("furniture", Picture::Kit) };

impl Paint {
    /// Bands of lamps are those of light near 2700 K; luminances (weights of Rec. 709) are 4000 cd/m² for the bulb,
    /// 1500 for the opal globe and 240 for the cloth shade: about 1200, 1700 and 700 lm.
    fn look(self) -> Look {
        match self {
            Paint::Floor => drawn("oak planks", Picture::Floor),
            Paint::Rug => drawn("rug", Picture::Rug),
            Paint::Hills => drawn("picture of hills", Picture::Hills),
            Paint::Discs => drawn("picture of discs", Picture::Discs),
            Paint::Kit => KIT,
            Paint::LampBulb => Look { luminance: [5200.0, 3900.0, 1450.0], ..plain("lamp bulb", [0.8; 3]) },
            Paint::LampShade => Look { name: "lamp shade", luminance: [330.0, 226.0, 92.0], ..KIT },
            Paint::Globe => Look { luminance: [1880.0, 1460.0, 720.0], ..plain("opal globe", [0.8; 3]) },
            Paint::Wall => plain("wall paint", [0.78, 0.75, 0.70]),
            Paint::Accent => plain("accent wall paint", [0.06, 0.24, 0.32]),
            Paint::Ceiling => plain("ceiling paint", [0.86, 0.85, 0.83]),
            Paint::White => plain("white lacquer", [0.80, 0.79, 0.77]),
            Paint::Facade => plain("facade", [0.55, 0.52, 0.47]),
            Paint::Linen => plain("linen", [0.68, 0.61, 0.50]),
            Paint::Brass => plain("brass", [0.52, 0.36, 0.14]),
            Paint::Black => plain("black iron", [0.035, 0.035, 0.04]),
            Paint::Oak => plain("oak", [0.42, 0.27, 0.15]),
            Paint::Ceramic => plain("ceramic", [0.74, 0.72, 0.68]),
            Paint::Rust => plain("rust", [0.56, 0.15, 0.07]),
            Paint::Mustard => plain("mustard", [0.64, 0.40, 0.08]),
            Paint::Navy => plain("navy", [0.04, 0.09, 0.20]),
            Paint::Sage => plain("sage", [0.28, 0.38, 0.26]),
            Paint::Leaf => plain("leaf", [0.08, 0.26, 0.06]),
            Paint::Soil => plain("soil", [0.06, 0.04, 0.03]),
            Paint::Grass => plain("grass", [0.065, 0.12, 0.035]),
            Paint::Hedge => plain("hedge", [0.04, 0.095, 0.03]),
            Paint::Bark => plain("bark", [0.16, 0.11, 0.07]),
        }
    }

    /// Texture coordinates of a point, for the paints that are pictures drawn here.
    pub fn map(self) -> Option<&'static dyn Fn(DVec3) -> DVec2> {
        match self {
            Paint::Floor => Some(&room::planks),
            Paint::Rug => Some(&furniture::on_rug),
            Paint::Hills => Some(&|p| furniture::on_canvas(furniture::HILLS, p)),
            Paint::Discs => Some(&|p| furniture::on_canvas(furniture::DISCS, p)),
            _ => None,
        }
    }
}

/// The pictures of a document, and its materials so far.
pub struct Palette {
    pictures: HashMap<Picture, usize>,
    materials: HashMap<Paint, usize>,
}

impl Palette {
    /// Draws and embeds every picture.
    pub fn new(glb: &mut Glb) -> Result<Palette, Fault> {
        let pictures = HashMap::from([
            (Picture::Floor, glb.texture("oak planks", &pictures::planks()?)),
            (Picture::Rug, glb.texture("rug", &pictures::rug()?)),
            (Picture::Hills, glb.texture("hills", &pictures::hills()?)),
            (Picture::Discs, glb.texture("discs", &pictures::discs()?)),
            (Picture::Kit, glb.texture("KayKit Furniture Bits", kit::PICTURE)),
        ]);
        Ok(Palette { pictures, materials: HashMap::new() })
    }

    /// Index of a paint's material, which is added when first asked for.
    pub fn material(&mut self, glb: &mut Glb, paint: Paint) -> usize {
        *self.materials.entry(paint).or_insert_with(|| {
            let look = paint.look();
            let texture = look.picture.and_then(|picture| self.pictures.get(&picture).copied());
            glb.material(look.name, look.color, texture, look.luminance)
        })
    }
}
