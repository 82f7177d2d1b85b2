//! The ends of narrow beams as a light: what surfaces give back there of what lamps without area light through small openings.
//!
//! Rows of rays meet a sun spot of a hand's breadth in a hall too seldom, and all the light of the hall may come from it. So it is what a small bright
//! lamp is: its light goes to all receivers directly, and no row has it as well.

use super::{Luminaires, Piece, area_light};
use crate::one_light::{geometry, luminance_of};
use crate::parts::Parts;
use glam::{DVec2, DVec3};
use radiosity_scene::{Elements, Mesh, luminance};
use radiosity_trace::sampling::hash;
use radiosity_trace::{Beam, Place, Tracer};
use rayon::prelude::*;

/// Name of the light that they are.
pub const BEAMS: &str = "ends of narrow beams";

/// They are none where more than this part of their cells is lit: elements tell that themselves, and are exact from nearby, too.
const LEAST_LIT: f64 = 0.7;

/// Nor where they give less than this part of what other lights give to what they light.
const NEGLIGIBLE: f64 = 0.05;

impl Luminaires {
    /// With the ends of narrow beams as one more light, the last, if there are any.
    pub fn with_beams(mut self, tracer: &Tracer, elements: &Elements) -> Luminaires {
        let beams = tracer.beams().all();
        let is_light =
            |beam: &Beam| share_of_cells(beam, tracer.mesh, elements) < LEAST_LIT && self.stands_out(tracer, beam);
        let is_light: Vec<bool> = beams.par_iter().map(is_light).collect();
        let own = beams.iter().zip(&is_light).filter(|(_, is_light)| **is_light);
        let pieces: Vec<Piece> = own.flat_map(|(beam, _)| pieces(tracer, beam)).collect();
        if pieces.is_empty() {
            return self;
        }
        self.beams = is_light;
        let mut lights = std::mem::take(&mut self.lights);
        lights.push(area_light(BEAMS.to_owned(), pieces));
        self.with(lights)
    }

    /// Whether the end of a beam is not outshone by other lights where its own light goes.
    fn stands_out(&self, tracer: &Tracer, beam: &Beam) -> bool {
        let end = beam.middle();
        let power = |piece: &Piece| piece.area * f64::from(luminance(piece.exitance));
        let flux: f64 = pieces(tracer, beam).iter().map(power).sum();
        let mut parts = Parts::default();
        let (mut own, mut others) = (0.0, 0.0);
        for (k, (_, place)) in (0..).zip(beam.sights(tracer)) {
            own += flux * geometry(&place, &end);
            let of_light = |light: usize| luminance_of(self.sample(light, tracer, &place, hash(k), &mut parts));
            others += (0..self.lights.len()).map(of_light).sum::<f64>();
        }
        own > NEGLIGIBLE * others
    }

    /// The ends of beams that are a light, of those on a triangle.
    pub(crate) fn beams_on<'b>(
        &self,
        tracer: &'b Tracer,
        triangle: u32,
    ) -> impl Iterator<Item = &'b Beam> + Clone + use<'b, '_> {
        let numbers = if self.beams.is_empty() { 0..0 } else { tracer.beams().on(triangle) };
        numbers.filter(|number| self.beams[*number]).map(|number| &tracer.beams().all()[number])
    }

    /// Whether what a light gives to a place is given back there as that of another one, the ends of beams.
    pub(crate) fn carries_on(&self, tracer: &Tracer, light: usize, place: &Place) -> bool {
        if self.beams.is_empty() {
            return false;
        }
        // Lights without area are the last but that.
        let end = self.lights.len() - 1;
        let first = end - tracer.scene.lights.len();
        (first..end).contains(&light) && self.is_end(tracer, light - first, place)
    }

    /// Whether a beam that is a light ends at a place, of one of the scene's lights without area.
    pub(crate) fn is_end(&self, tracer: &Tracer, light: usize, place: &Place) -> bool {
        self.beams_on(tracer, place.triangle).any(|beam| beam.light as usize == light && beam.holds(place))
    }
}

/// The end of a beam as triangles that shine by what the surface gives back.
fn pieces(tracer: &Tracer, beam: &Beam) -> Vec<Piece> {
    let (scene, mesh) = (tracer.scene, tracer.mesh);
    let light = &scene.lights[beam.light as usize];
    let of_rectangle = |(corners, lit): ([DVec3; 4], f64)| {
        let middle = 0.5 * (corners[0] + corners[2]);
        let uv = mesh.barycentric(beam.triangle as usize, middle).clamp(DVec2::ZERO, DVec2::ONE);
        let at = mesh.surface(beam.triangle as usize, uv);
        let reflectance = scene.reflectance(at);
        let (towards, _, arriving) = light.arrival(middle);
        let falling = f64::from(scene.opacity(at)) * lit * towards.dot(beam.normal).max(0.0);
        let exitance = std::array::from_fn(|band| (falling * f64::from(reflectance[band] * arriving[band])) as f32);
        let [a, b, c, d] = corners;
        [[a, b, c], [a, c, d]].map(|corners| Piece {
            triangle: beam.triangle,
            side: beam.side,
            corners,
            normal: beam.normal,
            exitance,
            area: 0.5 * (b - a).cross(d - a).length(),
            varied: false,
        })
    };
    beam.rectangles().into_iter().flat_map(of_rectangle).collect()
}

/// Which part is lit of the cells that a beam ends on.
fn share_of_cells(beam: &Beam, mesh: &Mesh, elements: &Elements) -> f64 {
    let cell_of = |point: DVec3| {
        let uv = mesh.barycentric(beam.triangle as usize, point).as_vec2();
        elements.at(beam.triangle, uv.x, uv.y, beam.side).map(|element| elements.cell(element))
    };
    let mut cells: Vec<usize> = beam.cells().iter().filter_map(|cell| cell_of(cell.lit)).collect();
    cells.sort_unstable();
    cells.dedup();
    let area = |cell: &usize| {
        let [a, b, c] = elements.cell_corners(*cell).map(|uv| mesh.point(beam.triangle as usize, uv));
        0.5 * (b - a).cross(c - a).length()
    };
    beam.lit() / cells.iter().map(area).sum::<f64>().max(f64::MIN_POSITIVE)
}
