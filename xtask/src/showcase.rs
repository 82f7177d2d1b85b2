//! `cargo xtask showcase`: a furnished living room to be lit, as one GLB.
//!
//! Metres, +Y up, the origin on the floor in the middle of the room; the window looks along −Z. Every surface is the
//! outside of a closed solid (the room itself is the inside of one with thick walls), and what stands or hangs is
//! sunk a few millimetres into what carries it, so that no two faces coincide and no light creeps underneath.

mod furniture;
mod garden;
mod kit;
mod paint;
mod pictures;
mod room;
pub mod solid;

use crate::fault::{Fault, options};
use crate::glb::{Glb, Head};
use glam::{DAffine3, DVec3};
use paint::Paint;
use solid::{Shaded, Solid};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// How deep things are sunk into what carries them: far above the rounding of f32 (2e-7 m at 3 m), far below sight.
const SUNK: f64 = 0.004;

/// Elevation of the sun (radians) and its drift towards +X for every metre towards +Z: chosen so that the patch of
/// sun lies across the rug and the table. Its illuminance is a seventh of a real summer sun's, which keeps lamps and
/// room in one picture's range.
const SUN_ELEVATION: f64 = 35.0 * std::f64::consts::PI / 180.0;
const SUN_DRIFT: f64 = 0.32;
const SUN_LUX: [f64; 3] = [13_500.0, 12_000.0, 9_600.0];

/// A named surface of one paint.
struct Piece {
    name: &'static str,
    paint: Paint,
    shape: Shape,
}

enum Shape {
    /// A closed solid and the angle (radians) above which its edges stay sharp.
    Solid(Solid, f64),
    /// Part of a surface that only closes together with others: the shell of the room.
    Sheet(Solid),
    /// A model from the kit, with its own normals.
    Kit(Shaded),
}

/// A solid with sharp edges.
fn sharp(name: &'static str, paint: Paint, solid: Solid) -> Piece {
    Piece { name, paint, shape: Shape::Solid(solid, 0.3) }
}

/// A solid whose curved parts are smooth; edges above 40° stay sharp.
fn smooth(name: &'static str, paint: Paint, solid: Solid) -> Piece {
    Piece { name, paint, shape: Shape::Solid(solid, 0.7) }
}

/// Everything there is to see.
fn pieces() -> Result<Vec<Piece>, Fault> {
    let mut pieces = room::pieces();
    pieces.extend(furniture::pieces());
    pieces.extend(garden::pieces());
    pieces.extend(kit_pieces()?);
    Ok(pieces)
}

/// The kit's furniture. Its models are one and a half times life-size; 2/3 makes the couch 2 m wide and 0.82 m high.
fn kit_pieces() -> Result<Vec<Piece>, Fault> {
    let placed = |scale: [f64; 3], turn: f64, at: [f64; 3]| {
        DAffine3::from_translation(DVec3::from_array(at))
            * DAffine3::from_rotation_y(turn)
            * DAffine3::from_scale(DVec3::from_array(scale))
    };
    let life = [2.0 / 3.0; 3];
    let piece = |name, paint, shape| Piece { name, paint, shape: Shape::Kit(shape) };
    let whole = |name, model, to| -> Result<Piece, Fault> {
        Ok(piece(name, Paint::Kit, kit::together(kit::parts(model, to)?)))
    };
    let mut lamp = kit::parts("lamp_standing", placed(life, 0.0, [-2.42, -SUNK, 1.70]))?.into_iter();
    // The lamp's parts: bulb, stand, shade.
    let [bulb, stand, shade] = std::array::from_fn(|_| lamp.next().unwrap_or_default());
    Ok(vec![
        whole("couch", "couch_pillows", placed(life, 2.0 * FRAC_PI_2, [-0.3, -SUNK, 1.70]))?,
        whole("armchair", "armchair", placed(life, 1.22, [-2.05, -SUNK, -0.42]))?,
        whole("table", "table_medium_long", placed([0.40, 0.41, 0.34], 0.0, [-0.3, -SUNK, 0.30]))?,
        whole("wall shelf", "shelf_B_large_decorated", placed(life, FRAC_PI_2, [-3.0 - SUNK, 1.42, 0.12]))?,
        piece("lamp bulb", Paint::LampBulb, bulb),
        piece("lamp stand", Paint::Kit, stand),
        piece("lamp shade", Paint::LampShade, shade),
    ])
}

/// The whole scene.
fn living_room() -> Result<Glb, Fault> {
    let mut glb = Glb::default();
    let mut palette = paint::Palette::new(&mut glb)?;
    for piece in pieces()? {
        let shape = match piece.shape {
            Shape::Solid(solid, crease) => solid.shaded(crease, piece.paint.map()),
            Shape::Sheet(sheet) => sheet.shaded(0.3, piece.paint.map()),
            Shape::Kit(shape) => shape,
        };
        let material = palette.material(&mut glb, piece.paint);
        glb.object(piece.name, material, &shape);
    }
    glb.sun("sun", sun_direction(), SUN_LUX);
    for (name, eye, target) in [
        ("living", [2.78, 1.45, 0.62], [-1.60, 1.00, 0.02]),
        ("window", [1.16, 1.45, 1.98], [-0.85, 1.00, -1.75]),
        ("corner", [2.74, 1.55, -1.98], [-0.80, 0.88, 1.15]),
    ] {
        glb.camera(name, DVec3::from_array(eye), DVec3::from_array(target), 0.9);
    }
    Ok(glb)
}

/// The direction in which sunlight travels.
fn sun_direction() -> DVec3 {
    let level = DVec3::new(SUN_DRIFT, 0.0, 1.0).normalize();
    level * SUN_ELEVATION.cos() - DVec3::Y * SUN_ELEVATION.sin()
}

/// `showcase [-o FILE]`.
pub fn command(arguments: &[&str]) -> Result<String, Fault> {
    let found = options(arguments, &["-o"])?;
    let path = Path::new(found.last().map_or("out/showcase.glb", |o| o.1));
    let glb = living_room()?;
    let triangles = glb.triangles;
    let file = glb.finish("living room").map_err(Head::at(path))?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(Fault::at(folder))?;
    }
    std::fs::write(path, &file).map_err(Fault::at(path))?;
    Ok(format!("{}: {triangles} triangles, {} bytes", path.display(), file.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::glb;

    #[test]
    fn everything_is_closed_and_right_side_out() {
        for piece in pieces().expect("the kit is in order") {
            if let Shape::Solid(solid, _) = &piece.shape {
                assert_eq!(solid.open_edges(), 0, "{}", piece.name);
                assert!(solid.volume() > 0.0, "{}: {}", piece.name, solid.volume());
            }
        }
        let shell = pieces().expect("the kit is in order").into_iter().filter_map(|p| match p.shape {
            Shape::Sheet(sheet) => Some(sheet),
            _ => None,
        });
        let shell = Solid::all(shell);
        assert_eq!(shell.open_edges(), 0, "the room's shell");
        // The shell's volume is that of its walls: outer box less room less window opening.
        let walls = 6.6 * 3.4 * 5.1 - 6.0 * 2.8 * 4.5 - 3.0 * 1.85 * 0.3;
        assert!((shell.volume() - walls).abs() < 1e-9, "{} is not {walls}", shell.volume());
    }

    #[test]
    fn normals_are_unit_and_on_the_front() {
        let glb = living_room().expect("the kit is in order");
        let file = glb.finish("test").expect("it fits");
        let (json, binary) = glb::parts(&file);
        let rows = |accessor: &serde_json::Value| -> Vec<[f32; 3]> {
            let accessor = &json["accessors"][accessor.as_u64().expect("an index") as usize];
            let view = &json["bufferViews"][accessor["bufferView"].as_u64().expect("an index") as usize];
            let at = view["byteOffset"].as_u64().expect("an offset") as usize;
            let length = view["byteLength"].as_u64().expect("a length") as usize;
            let words = binary[at..at + length].as_chunks::<4>().0;
            words.as_chunks().0.iter().map(|row| row.map(f32::from_le_bytes)).collect()
        };
        for mesh in json["meshes"].as_array().expect("meshes") {
            let primitive = &mesh["primitives"][0];
            let points = rows(&primitive["attributes"]["POSITION"]);
            let normals = rows(&primitive["attributes"]["NORMAL"]);
            let indices: Vec<usize> =
                rows(&primitive["indices"]).iter().flatten().map(|x| x.to_bits() as usize).collect();
            for normal in &normals {
                let length: f32 = normal.iter().map(|x| x * x).sum();
                assert!((length - 1.0).abs() < 1e-5, "{}: |n|² = {length}", mesh["name"]);
            }
            for triangle in indices.as_chunks::<3>().0 {
                let [a, b, c] = triangle.map(|i| glam::Vec3::from(points[i]).as_dvec3());
                let face = (b - a).cross(c - a);
                assert!(face.length() > 1e-10, "{}: a triangle without area", mesh["name"]);
                let mean: DVec3 = triangle.iter().map(|&i| glam::Vec3::from(normals[i]).as_dvec3()).sum();
                assert!(face.dot(mean) > 0.0, "{}: a normal on the back", mesh["name"]);
            }
        }
    }

    #[test]
    fn size_and_bytes_are_as_promised() {
        let [a, b] = [(); 2].map(|()| living_room().expect("the kit is in order"));
        assert!((10_000..40_000).contains(&a.triangles), "{}", a.triangles);
        assert!(a.finish("x").expect("it fits") == b.finish("x").expect("it fits"), "two runs differ");
    }

    /// The middle of the window, followed along the sun, meets the floor inside the room and in front of the couch.
    #[test]
    fn the_sun_falls_on_the_floor() {
        let (from, along) = (DVec3::new(-0.5, 1.42, -2.40), sun_direction());
        assert!((along.y.asin().to_degrees() + 35.0).abs() < 1e-9);
        let floor = from - along * (from.y / along.y);
        assert!(floor.x.abs() < 2.0 && (-1.5..1.0).contains(&floor.z), "{floor}");
    }
}
