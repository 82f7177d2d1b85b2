//! The ends of narrow beams as a light: what surfaces give back there of what lamps without area light through small openings.
//!
//! Rows of rays meet a sun spot of a hand's breadth in a hall too seldom, and all the light of the hall may come from it. So it is what a small bright
//! lamp is: its light goes to all receivers directly, and no row has it as well.

use super::{Light, Luminaires, Piece, area_light};
use crate::one_light::{geometry, luminance_of};
use crate::parts::Parts;
use glam::DVec3;
use radiosity_scene::{Bands, Elements, Mesh, luminance};
use radiosity_trace::Cell;
use radiosity_trace::sampling::hash;
use radiosity_trace::{Beam, Place, Rectangle, Tracer};
use rayon::prelude::*;

/// They are none where more than this part of their cells is lit: elements tell that themselves, and are exact from nearby, too.
const LEAST_LIT: f64 = 0.7;

/// Nor, of many, the weakest, which give this part of what all of them do. Among shelves there are dozens of slivers of light.
const LEFT: f64 = 0.03;

/// Rectangles that they are all together, if that leaves one for each. More would be a light with a tree, which takes longer, and gathers could not glance at all lamps.
const RECTANGLES: usize = 24;

/// Nor where they give less than this part of what other lights give to what they light.
const NEGLIGIBLE: f64 = 0.02;

/// Places of a receiver at which light of narrow beams is looked at, and others that are tried for one where there is none.
const BEAM_ENDS: f64 = 16.0;
const SPARE: usize = 64;

impl Luminaires {
    /// With the ends of narrow beams as one more light, the last, if there are any.
    pub fn with_beams(mut self, tracer: &Tracer, elements: &Elements) -> Luminaires {
        let beams = tracer.beams().all();
        let flux = |beam: &Beam| -> f64 {
            let is_light = share_of_cells(beam, tracer.mesh, elements) < LEAST_LIT && self.stands_out(tracer, beam);
            if is_light { flux_of(tracer, beam) } else { 0.0 }
        };
        let flux: Vec<f64> = beams.par_iter().map(flux).collect();
        let mut strongest: Vec<usize> = (0..beams.len()).filter(|number| flux[*number] > 0.0).collect();
        strongest.sort_by(|a, b| flux[*b].total_cmp(&flux[*a]));
        let mut left = (1.0 - LEFT) * flux.iter().sum::<f64>();
        let mut is_light = vec![false; beams.len()];
        for number in strongest {
            if left > 0.0 {
                is_light[number] = true;
                left -= flux[number];
            }
        }
        let own = beams.iter().zip(&is_light).filter(|(_, is_light)| **is_light);
        let most = (RECTANGLES / own.clone().count().max(1)).max(1);
        let pieces: Vec<Piece> = own.flat_map(|(beam, _)| pieces(tracer, beam, most)).collect();
        if pieces.is_empty() {
            return self;
        }
        self.beams = is_light;
        let mut lights = std::mem::take(&mut self.lights);
        lights.push(area_light(String::new(), pieces));
        self.with(lights)
    }

    /// Whether the end of a beam is not outshone by other lights where its own light goes.
    fn stands_out(&self, tracer: &Tracer, beam: &Beam) -> bool {
        let end = beam.middle();
        let flux = flux_of(tracer, beam);
        let mut parts = Parts::default();
        let (mut own, mut others) = (0.0, 0.0);
        for (k, (_, place)) in (0..).zip(beam.sights(tracer)) {
            own += flux * geometry(&place, &end);
            let of_light = |light: usize| luminance_of(self.sample(light, tracer, &place, hash(k), &mut parts));
            others += (0..self.lights.len()).map(of_light).sum::<f64>();
        }
        own > NEGLIGIBLE * others
    }

    /// All lights but the ends of beams.
    pub fn lamps(&self) -> &[Light] {
        &self.lights[..self.lights.len() - usize::from(!self.beams.is_empty())]
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

    /// Adds places where beams end to those of a receiver, which then stand for the rest of it; one of some to spare does where none of them is left. The
    /// sum over what is lit begins at an offset in [0, 1).
    pub(crate) fn add_ends(
        &self,
        (tracer, spare): (&Tracer, impl Iterator<Item = Place>),
        (ends, offset): (&[(Place, f64)], f32),
        nodes: &mut Vec<(Place, f64)>,
    ) {
        let is_free = |place: &Place| !self.beams_on(tracer, place.triangle).any(|beam| beam.holds(place));
        nodes.retain(|(place, _)| is_free(place));
        if nodes.is_empty() {
            nodes.extend(spare.take(SPARE).find(is_free).map(|place| (place, 0.0)));
        }
        let lit: f64 = ends.iter().map(|(_, share)| share).sum();
        let rest = nodes.len() as f64;
        let share = if nodes.is_empty() { 1.0 } else { lit.min(1.0) };
        nodes.iter_mut().for_each(|(_, weight)| *weight = (1.0 - share) / rest);
        // Of cells by what is lit of them, as many places as are to be.
        let (mut reached, step) = (f64::from(offset), BEAM_ENDS / lit);
        for (place, own) in ends {
            let before = f64::floor(reached);
            reached += own * step;
            let count = reached.floor() - before;
            if count > 0.0 {
                nodes.push((*place, count * share / BEAM_ENDS));
            }
        }
    }
}

/// What the end of a beam gives back, lm.
fn flux_of(tracer: &Tracer, beam: &Beam) -> f64 {
    let power = |piece: &Piece| piece.area * f64::from(luminance(piece.exitance));
    pieces(tracer, beam, 1).iter().map(power).sum()
}

/// The end of a beam as triangles that shine by what the surface gives back.
fn pieces(tracer: &Tracer, beam: &Beam, most: usize) -> Vec<Piece> {
    let (scene, mesh, triangle) = (tracer.scene, tracer.mesh, beam.triangle as usize);
    let light = &scene.lights[beam.light as usize];
    let given = |cell: &Cell| -> Bands {
        let at = mesh.surface(triangle, mesh.barycentric(triangle, cell.point));
        let (towards, _, arriving) = light.arrival(cell.point);
        let falling = scene.opacity(at) * cell.share * towards.dot(beam.normal).max(0.0) as f32;
        let reflectance = scene.reflectance(at);
        std::array::from_fn(|band| falling * reflectance[band] * arriving[band])
    };
    let of_rectangle = |Rectangle { corners, cells, count }: Rectangle| {
        let sum = cells.iter().map(given).fold([0f64; 3], |sum, m| std::array::from_fn(|k| sum[k] + f64::from(m[k])));
        let [a, b, c, d] = corners;
        [[a, b, c], [a, c, d]].map(|corners| Piece {
            triangle: beam.triangle,
            side: beam.side,
            corners,
            normal: beam.normal,
            exitance: sum.map(|m| (m / count) as f32),
            area: 0.5 * (b - a).cross(d - a).length(),
            varied: false,
        })
    };
    beam.end.rectangles(most).into_iter().flat_map(of_rectangle).collect()
}

/// Which part is lit of the cells that a beam ends on.
fn share_of_cells(beam: &Beam, mesh: &Mesh, elements: &Elements) -> f64 {
    let cell_of = |point: DVec3| {
        let uv = mesh.barycentric(beam.triangle as usize, point).as_vec2();
        elements.at(beam.triangle, uv.x, uv.y, beam.side).map(|element| elements.cell(element))
    };
    let mut cells: Vec<usize> = beam.end.cells().iter().filter_map(|cell| cell_of(cell.point)).collect();
    cells.sort_unstable();
    cells.dedup();
    let area = |cell: &usize| {
        let [a, b, c] = elements.cell_corners(*cell).map(|uv| mesh.point(beam.triangle as usize, uv));
        0.5 * (b - a).cross(c - a).length()
    };
    beam.lit() / cells.iter().map(area).sum::<f64>().max(f64::MIN_POSITIVE)
}
