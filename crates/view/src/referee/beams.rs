//! The ends of narrow beams, seen as lamps: light of lamps without area that has met one surface.

use super::balance;
use glam::DVec2;
use radiosity_scene::luminance;
use radiosity_trace::sampling::Random;
use radiosity_trace::{Beams, Emitter, EmitterTree, Place, Tracer};
use std::f64::consts::PI;

/// Which of their cells to sample from where.
#[derive(Clone)]
pub(super) struct BeamEnds {
    tree: EmitterTree,
    /// Beam and cell of each emitter of the tree.
    cells: Vec<(u32, u32)>,
    /// The number of the first of each beam.
    first: Vec<u32>,
}

impl BeamEnds {
    pub fn new(tracer: &Tracer) -> BeamEnds {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        let (mut emitters, mut cells, mut first) = (Vec::new(), Vec::new(), Vec::new());
        for (number, beam) in (0..).zip(tracer.beams().all()) {
            first.push(cells.len() as u32);
            for (k, cell) in (0..).zip(beam.cells()) {
                let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
                let [a, b, c, d] = corners.map(|[x, y]| beam.point(k as usize, x, y));
                let bounds = [a.min(b).min(c.min(d)), a.max(b).max(c.max(d))];
                let at = mesh.surface(beam.triangle as usize, mesh.barycentric(beam.triangle as usize, cell.lit));
                let arriving = luminance(scene.lights[beam.light as usize].arrival(cell.lit).2);
                // Black cells are sampled as well, now and then: what a picture shows elsewhere in them is not known.
                let share = cell.share.max(0.05) * (luminance(scene.reflectance(at)) + 0.01);
                let power = beam.area() * f64::from(arriving * share);
                emitters.push(Emitter { bounds, normal: beam.normal, power });
                cells.push((number, k));
            }
        }
        BeamEnds { tree: EmitterTree::new(&emitters, 1), cells, first }
    }

    /// Irradiance of a place from a point of some beam's end, weighted.
    pub fn sample(&self, tracer: &Tracer, place: &Place, random: &mut Random) -> [f64; 3] {
        if self.cells.is_empty() {
            return [0.0; 3];
        }
        let beams = tracer.beams();
        let Some((leaf, _)) = self.tree.pick(0, place.point, place.normal, &mut random.next_unit()) else {
            return [0.0; 3];
        };
        let (number, cell) = self.cells[self.tree.order()[leaf] as usize];
        let beam = &beams.all()[number as usize];
        let point = beam.point(cell as usize, random.next_unit(), random.next_unit());
        let end = Place { point, normal: beam.normal, triangle: beam.triangle };
        let uv = tracer.mesh.barycentric(beam.triangle as usize, point);
        let light = &tracer.scene.lights[beam.light as usize];
        let (towards, distance, arriving) = light.arrival(point);
        let falling = towards.dot(end.normal);
        let edge = density(place, &end);
        let is_before = (place.point - point).dot(end.normal) > 0.0;
        if !is_before || uv.min_element() < 0.0 || uv.x + uv.y > 1.0 || falling <= 0.0 || edge <= 0.0 {
            return [0.0; 3];
        }
        let length = if distance.is_finite() { distance - tracer.offset() } else { f64::INFINITY };
        let is_lit = length <= 0.0 || !tracer.blocked(&tracer.ray(&end, towards, length), random.next_bits());
        if !is_lit || !tracer.mutually_visible(place, &end, random.next_bits()) {
            return [0.0; 3];
        }
        let at = tracer.mesh.surface(beam.triangle as usize, uv.clamp(DVec2::ZERO, DVec2::ONE));
        let reflectance = tracer.scene.reflectance(at);
        let sampled = self.density(beams, place, &end, beam.light);
        let opacity = f64::from(tracer.scene.opacity(at));
        let weight = opacity * falling * edge / (sampled + edge);
        std::array::from_fn(|band| weight * f64::from(reflectance[band]) * f64::from(arriving[band]))
    }

    /// Weight of what a lamp gives to a place that a path met by chance.
    pub fn weight(&self, tracer: &Tracer, from: &Place, place: &Place, light: u32) -> f64 {
        let sampled = self.density(tracer.beams(), from, place, light);
        if sampled > 0.0 { balance(density(from, place), sampled) } else { 1.0 }
    }

    /// Density, by area, with which an end of some beam of a lamp is sampled from a place.
    fn density(&self, beams: &Beams, from: &Place, end: &Place, light: u32) -> f64 {
        let own = beams.on(end.triangle).map(|number| (number, &beams.all()[number]));
        let lit = own.filter(|(_, beam)| beam.light == light && beam.holds(end));
        let of_cell = |(number, cell): (usize, usize)| {
            self.tree.probability(self.first[number] + cell as u32, from.point, from.normal) / beams.all()[number].area()
        };
        lit.filter_map(|(number, beam)| Some((number, beam.cell(end.point)?))).map(of_cell).sum()
    }
}

/// Density, by area, with which a ray by cosine from one place meets the other.
fn density(from: &Place, to: &Place) -> f64 {
    let along = to.point - from.point;
    let square = along.length_squared();
    let cosines = along.dot(from.normal).max(0.0) * along.dot(to.normal).abs();
    if square > 0.0 { cosines / (PI * square * square) } else { 0.0 }
}
