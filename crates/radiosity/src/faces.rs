//! The faces that carry light in a lit model, and what of them nobody ever sees.

use crate::Solution;
use crate::answer::Station;
use glam::DVec2;
use radiosity_io::gltf_out::LitVertex;
use radiosity_scene::{Side, luminance};
use radiosity_trace::Tracer;

/// A side of a double-sided object that gets less than this share of the other side's light is not written as a layer
/// of its own: it is the inside of a solid.
const FORGOTTEN_SIDE: f64 = 1e-3;

/// One side of a mesh triangle that gets light written on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    pub triangle: usize,
    pub side: Side,
    pub object: usize,
}

impl Face {
    /// Corners in the order in which they run counter-clockwise seen from the face's side.
    pub fn order(self) -> [usize; 3] {
        if self.side == Side::Front { [0, 1, 2] } else { [0, 2, 1] }
    }

    /// Mesh barycentric coordinates of the face's own.
    pub fn mesh_uv(self, uv: DVec2) -> DVec2 {
        if self.side == Side::Front { uv } else { DVec2::new(uv.y, uv.x) }
    }
}

/// The faces that carry light: every front, and backs of double-sided objects that are not the inside of a solid. Both
/// sides of a sheet that transmits light, for the light of the one leaves the other.
pub(crate) fn faces(solution: &Solution) -> Vec<Face> {
    let (scene, mesh) = (solution.tracer().scene, solution.tracer().mesh);
    let mut flux = vec![[0f64; 2]; scene.objects.len()];
    let exposed = solution.exposed_area();
    for (e, h) in solution.irradiance().iter().enumerate() {
        let (triangle, side) = solution.elements.place(e as u32);
        let object = scene.triangle_object[mesh.source[triangle] as usize] as usize;
        flux[object][side as usize] += exposed[e] * f64::from(luminance(*h));
    }
    let mut faces = Vec::new();
    for triangle in 0..mesh.triangles.len() {
        let object = scene.triangle_object[mesh.source[triangle] as usize] as usize;
        let [front, back] = flux[object];
        let transmits = scene.materials[scene.objects[object].material].transmits();
        if transmits || !solution.elements.has(triangle, Side::Back) || front >= FORGOTTEN_SIDE * back {
            faces.push(Face { triangle, side: Side::Front, object });
        }
        if solution.elements.has(triangle, Side::Back) && (transmits || back > FORGOTTEN_SIDE * front) {
            faces.push(Face { triangle, side: Side::Back, object });
        }
    }
    faces.sort_by_key(|f| (f.object, f.side));
    faces
}

/// The source vertices and weights of a corner of a mesh triangle.
pub(crate) fn lit_vertex(tracer: &Tracer, triangle: usize, uv: DVec2) -> LitVertex {
    let at = tracer.mesh.surface(triangle, uv);
    let object = tracer.scene.triangle_object[at.triangle] as usize;
    let first = tracer.scene.objects[object].vertices.start as u32;
    let corners = tracer.scene.triangles[at.triangle].map(|v| v - first);
    let weights = [1.0 - at.uv.x - at.uv.y, at.uv.x, at.uv.y];
    // A corner of the source is copied, not interpolated.
    match weights.iter().position(|w| *w > 1.0 - 1e-9) {
        Some(k) => LitVertex { corners: [corners[k]; 3], weights: [1.0, 0.0, 0.0] },
        None => LitVertex { corners, weights: weights.map(|w| w as f32) },
    }
}

/// Whether a part of the element that a station lies on is known to be seen, and another to lie inside a solid.
pub(crate) fn is_shown_in_part(solution: &Solution, station: &Station) -> bool {
    let (u, v) = (station.uv.x as f32, station.uv.y as f32);
    let share = |element| solution.exposure.share(element);
    solution.elements.at(station.place.triangle, u, v, station.side).map(share).is_some_and(|s| s > 0.0 && s < 1.0)
}

/// Whether a station lies inside a solid, so that nobody ever sees its light.
pub(crate) fn is_hidden(solution: &Solution, station: &Station) -> bool {
    let (u, v) = (station.uv.x as f32, station.uv.y as f32);
    let Some(element) = solution.elements.at(station.place.triangle, u, v, station.side) else { return true };
    solution.exposure.is_buried(element)
        || (solution.exposure.is_partial(element)
            && radiosity_transport::exposure::is_buried(solution.tracer(), &station.place, element))
}
