//! Objects that are added to a scene while it is watched: boxes and rectangles, such as furniture and lamps.

use super::MOST_INTENSITY;
use glam::DVec3;
use radiosity_scene::elements::division_of;
use radiosity_scene::material::MAX_REFLECTANCE;
use radiosity_scene::{Bands, Material, Scene};
use radiosity_transport::live::REACH;
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;

/// Least exitance of a band of a lamp, lm/m²: in every form that it may get, it is a lamp in single precision.
const LEAST_EXITANCE: f32 = 1e-12;

/// Least length of an object that is added, as a share of half the extent of the scene: a hundred times what rays begin off
/// a surface, so that few of them end within what is thin.
const LEAST_LENGTH: f64 = 1e-4;

/// Most length, likewise: from one end to the other of where objects may be.
const MOST_LENGTH: f64 = 2.0 * REACH;

/// What is wrong with the name of what is added.
pub fn name_fault(name: &str) -> Option<&'static str> {
    (name.chars().count() > 200).then_some("its name is longer than 200 letters")
}

/// A form, about its middle, in its own axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Form {
    /// A closed box.
    Box {
        /// Metres along x, y and z.
        size: [f64; 3],
    },
    /// A rectangle in the plane of x and y. Its front, which gives back light and shines, is that of +z; its back is black.
    Rectangle {
        /// Metres along x and y.
        size: [f64; 2],
    },
}

/// What is wrong with lengths.
const LENGTHS: &str =
    "a length is no number, below a ten thousandth of half the scene's extent, or above eight times that";

impl Form {
    /// What is wrong with it in a scene of half such an extent, metres.
    pub fn fault(&self, half: f64) -> Option<&'static str> {
        // Written so that what is no number is refused, too.
        let is_sound = |length: &f64| (LEAST_LENGTH * half..=MOST_LENGTH * half).contains(length);
        (!self.lengths().iter().all(is_sound)).then_some(LENGTHS)
    }

    /// Elements that it is cut into.
    pub fn elements(&self, size: f64) -> usize {
        self.triangles().into_iter().map(|corners| (division_of(corners, size) as usize).pow(2)).sum()
    }

    /// Its area, m².
    pub fn area(&self) -> f64 {
        self.triangles().into_iter().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
    }

    /// Metres along its axes.
    fn lengths(&self) -> &[f64] {
        match self {
            Form::Box { size } => size,
            Form::Rectangle { size } => size,
        }
    }

    /// Its triangles, counter-clockwise from the front.
    pub fn triangles(&self) -> Vec<[DVec3; 3]> {
        let halves = |quad: [DVec3; 4]| [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]];
        match self {
            Form::Rectangle { size: [x, y] } => {
                let corner = |i: f64, j: f64| 0.5 * DVec3::new(i * x, j * y, 0.0);
                halves([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]).to_vec()
            }
            Form::Box { size } => {
                let faces = (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]);
                let face = |(axis, side): (usize, f64)| {
                    // Around +z for the side of +z; the other way around on the other side.
                    [[-1.0, -1.0], [side, -side], [1.0, 1.0], [-side, side]].map(|[u, v]| {
                        let mut at = [0.0; 3];
                        (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (side, u, v);
                        0.5 * DVec3::from(at) * DVec3::from(*size)
                    })
                };
                faces.flat_map(|side| halves(face(side))).collect()
            }
        }
    }
}

/// An object that is to be added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NewObject {
    /// Name for people; may be empty.
    #[serde(default)]
    pub name: String,
    /// Its form.
    pub form: Form,
    /// Diffuse reflectance per band, 0 to 0.99.
    pub reflectance: Bands,
    /// Exitance, lm/m² per band; none unless it is a lamp.
    #[serde(default)]
    pub emission: Bands,
    /// From its own axes to the world, by columns: turned and moved, lengths as they are.
    pub matrix: [f64; 16],
}

impl NewObject {
    /// What is wrong with it in a scene of half such an extent, metres, but for its place.
    pub fn fault(&self, half: f64) -> Option<&'static str> {
        // Written so that what is no number is refused, too.
        if !self.reflectance.iter().all(|rho| (0.0..=MAX_REFLECTANCE).contains(rho)) {
            return Some("its reflectance is not within 0 and 0.99");
        }
        let is_sound = |exitance: &f32| *exitance == 0.0 || (LEAST_EXITANCE..=MOST_INTENSITY).contains(exitance);
        if !self.emission.iter().all(is_sound) {
            return Some("its emission is no number, negative, above 1e12 lm/m², or above 0 and below 1e-12");
        }
        name_fault(&self.name).or_else(|| self.form.fault(half))
    }

    /// Whether it is a lamp.
    pub fn shines(&self) -> bool {
        self.material().emits()
    }

    /// Its material.
    pub fn material(&self) -> Material {
        let [r, g, b] = self.reflectance;
        Material {
            name: self.name.clone(),
            base_color: [r, g, b, 1.0],
            emissive: self.emission.map(|exitance| exitance / PI),
            ..Material::default()
        }
    }
}

/// Puts a form last into a scene, in its own axes; answers its number.
pub fn add_to(scene: &mut Scene, name: &str, material: Material, form: &Form) -> usize {
    scene.materials.push(material);
    scene.add_triangles(name, scene.materials.len() - 1, &form.triangles())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every triangle of a box looks away from its middle, its area is that of a box, and each edge is one of two triangles.
    #[test]
    fn boxes_are_closed_and_look_outwards() {
        let size = [0.5, 2.0, 3.0];
        let triangles = Form::Box { size }.triangles();
        let mut area = 0.0;
        let mut edges = std::collections::BTreeMap::<_, i32>::new();
        for [a, b, c] in &triangles {
            let cross = (*b - *a).cross(*c - *a);
            assert!(cross.dot(*a + *b + *c) > 0.0);
            area += 0.5 * cross.length();
            let key = |p: &DVec3| p.to_array().map(|x| (8.0 * x) as i64);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((key(from), key(to))).or_default() += 1;
                *edges.entry((key(to), key(from))).or_default() -= 1;
            }
        }
        assert_eq!((triangles.len(), area), (12, 2.0 * (0.5 * 2.0 + 2.0 * 3.0 + 3.0 * 0.5)));
        assert!(edges.values().all(|sum| *sum == 0), "{edges:?}");
        for [a, b, c] in (Form::Rectangle { size: [1.0, 2.0] }).triangles() {
            assert_eq!((b - a).cross(c - a), DVec3::new(0.0, 0.0, 2.0));
        }
    }
}
