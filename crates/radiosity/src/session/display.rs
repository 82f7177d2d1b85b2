//! The mesh of an object that is drawn: its elements as triangles, with light at their corners.
//!
//! Elements around a vertex on the same smooth surface of the object share one value, their mean by area: light is
//! continuous across them and most of the noise of their rays averages out.

use glam::{DVec2, DVec3, Vec3};
use radiosity_scene::{Bands, Scene, Side, Surface};
use radiosity_transport::live::Shape;
use std::collections::HashMap;

/// Vertices nearer than this part of the scene's half extent are one, as far as light goes: exporters' single precision.
const SAME_PLACE: f64 = 4e-6;

/// Cosine between normals up to which a surface is smooth: 30°, the usual auto-smooth angle of modelling programs.
const SMOOTH: f32 = 0.866;

/// The drawn mesh of a shape. In the coordinates of the file's world.
#[derive(Clone, Debug, Default)]
pub struct Display {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    /// Three for each element.
    pub indices: Vec<u32>,
    /// Vertices that share light have the same spot.
    spot: Vec<u32>,
    /// Elements around each spot: those of spot s are `starts[s]..starts[s + 1]`, with their weights.
    starts: Vec<u32>,
    around: Vec<(u32, f32)>,
}

struct Spot {
    normal: Vec3,
    around: Vec<(u32, f32)>,
    /// Vertices at the spot, by the bits of their texture coordinates.
    vertices: Vec<([u32; 2], u32)>,
}

impl Display {
    /// The mesh of a shape of a scene whose half extent is `half`.
    pub fn new(scene: &Scene, object: usize, shape: &Shape, half: f64) -> Display {
        let material = &scene.materials[scene.objects[object].material];
        let texture = material.base_color_texture;
        let mut display = Display::default();
        let mut spots: Vec<Spot> = Vec::new();
        let mut at_place: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let grain = SAME_PLACE * half.max(f64::MIN_POSITIVE);
        for element in 0..shape.elements() {
            let (t, side, corners) = shape.place(element);
            let [a, b, c] = shape.corners[t];
            let triangle = shape.triangles.start + t;
            let flat = (b - a).cross(c - a);
            let area = 0.5 * flat.length() / f64::from(shape.division[t].pow(2));
            let sign = if side == Side::Front { 1.0 } else { -1.0 };
            let mut own = corners.map(|uv| {
                let point = a + uv.x * (b - a) + uv.y * (c - a);
                let surface = Surface { triangle, uv };
                let normal = sign * scene.shading_normal(surface).unwrap_or_else(|| flat.normalize_or_zero());
                let coordinates = texture.map(|texture| texture.coordinates(mesh_uv(scene, texture.uv_set, surface)));
                let uv = coordinates.map(|uv| uv.as_vec2().to_array());
                vertex(&mut display, &mut spots, &mut at_place, (point, grain), normal.as_vec3(), uv, (element, area))
            });
            if side == Side::Back {
                own.swap(1, 2);
            }
            display.indices.extend(own);
        }
        display.starts.push(0);
        for spot in &spots {
            let whole: f32 = spot.around.iter().map(|(_, weight)| weight).sum();
            display.around.extend(spot.around.iter().map(|(element, weight)| (*element, weight / whole)));
            display.starts.push(display.around.len() as u32);
        }
        display
    }

    /// Light at the vertices, from that of the elements; what is buried does not count.
    pub fn light(&self, light: impl Fn(u32) -> Bands, is_buried: impl Fn(u32) -> bool) -> Vec<Bands> {
        let spots: Vec<Bands> = self
            .starts
            .windows(2)
            .map(|ends| {
                let (mut sum, mut whole) = ([0f32; 3], 0f32);
                for (element, weight) in &self.around[ends[0] as usize..ends[1] as usize] {
                    if !is_buried(*element) {
                        let own = light(*element);
                        whole += weight;
                        (0..3).for_each(|band| sum[band] += weight * own[band]);
                    }
                }
                sum.map(|s| if whole > 0.0 { (s / whole).max(0.0) } else { 0.0 })
            })
            .collect();
        self.spot.iter().map(|spot| spots[*spot as usize]).collect()
    }
}

/// The vertex at a place, which is made if there is none; it gets the element around it.
fn vertex(
    display: &mut Display,
    spots: &mut Vec<Spot>,
    at_place: &mut HashMap<[i64; 3], Vec<u32>>,
    (point, grain): (DVec3, f64),
    normal: Vec3,
    uv: Option<[f32; 2]>,
    (element, area): (u32, f64),
) -> u32 {
    let here = at_place.entry((point / grain).round().to_array().map(|x| x as i64)).or_default();
    let known = here.iter().find(|spot| spots[**spot as usize].normal.dot(normal) >= SMOOTH).copied();
    let spot = known.unwrap_or_else(|| {
        spots.push(Spot { normal, around: Vec::new(), vertices: Vec::new() });
        here.push(spots.len() as u32 - 1);
        spots.len() as u32 - 1
    });
    let own = &mut spots[spot as usize];
    own.around.push((element, area as f32));
    let bits = uv.unwrap_or_default().map(f32::to_bits);
    if let Some((_, vertex)) = own.vertices.iter().find(|(other, _)| *other == bits) {
        return *vertex;
    }
    let vertex = display.positions.len() as u32;
    own.vertices.push((bits, vertex));
    display.positions.push(point.as_vec3().to_array());
    display.normals.push(normal.to_array());
    display.uvs.extend(uv);
    display.spot.push(spot);
    vertex
}

fn mesh_uv(scene: &Scene, set: usize, at: Surface) -> DVec2 {
    let set = &scene.uvs[set.min(1)];
    if set.is_empty() {
        return DVec2::ZERO;
    }
    let [a, b, c] = scene.triangles[at.triangle].map(|v| set[v as usize].as_dvec2());
    a + at.uv.x * (b - a) + at.uv.y * (c - a)
}
