//! The ends of narrow beams, seen as lamps: light of lamps without area that has met one surface.

use super::balance;
use glam::DVec2;
use radiosity_scene::luminance;
use radiosity_trace::sampling::Random;
use radiosity_trace::{Beams, Emitter, EmitterTree, Place, Tracer};
use std::f64::consts::PI;

/// Which of their cells to sample from where.
#[derive(Clone, Default)]
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
            for (k, cell) in (0..).zip(beam.end.cells()) {
                let bounds = beam.end.around(k as usize);
                let at = mesh.surface(beam.triangle as usize, mesh.barycentric(beam.triangle as usize, cell.point));
                let arriving = luminance(scene.lights[beam.light as usize].arrival(cell.point).2);
                // Black cells are sampled as well, now and then: what a picture shows elsewhere in them is not known.
                let share = cell.share.max(0.05) * (luminance(scene.reflectance(at)) + 0.01);
                let power = beam.end.area() * f64::from(arriving * share);
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
        let point = beam.end.point(cell as usize, random.next_unit(), random.next_unit());
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
        let is_lit = tracer.sees_lamp(&end, (towards, distance), random.next_bits());
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
        if self.cells.is_empty() {
            return 1.0;
        }
        let sampled = self.density(tracer.beams(), from, place, light);
        if sampled > 0.0 { balance(density(from, place), sampled) } else { 1.0 }
    }

    /// Density, by area, with which an end of some beam of a lamp is sampled from a place.
    fn density(&self, beams: &Beams, from: &Place, end: &Place, light: u32) -> f64 {
        let own = beams.on(end.triangle).map(|number| (number, &beams.all()[number]));
        let lit = own.filter(|(_, beam)| beam.light == light && beam.holds(end));
        let of_cell = |(number, cell): (usize, usize)| {
            self.tree.probability(self.first[number] + cell as u32, from.point, from.normal)
                / beams.all()[number].end.area()
        };
        lit.filter_map(|(number, beam)| Some((number, beam.end.cell(end.point)?))).map(of_cell).sum()
    }
}

/// Density, by area, with which a ray by cosine from one place meets the other.
fn density(from: &Place, to: &Place) -> f64 {
    let along = to.point - from.point;
    let square = along.length_squared();
    let cosines = along.dot(from.normal).max(0.0) * along.dot(to.normal).abs();
    if square > 0.0 { cosines / (PI * square * square) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Referee;
    use crate::referee::tests::{opal, seen};
    use glam::DVec3;
    use radiosity_scene::{Material, Mesh, PointLight, PointLightKind, Scene};

    /// A room of 4 × 3 × 2.5 m with a hole of 15 cm in its ceiling, the sun above, and maybe a sheet on which the spot falls.
    fn room(sheet: Option<Material>) -> Scene {
        let grey = Material { base_color: [0.7, 0.7, 0.7, 1.0], ..Material::default() };
        let mut scene = Scene { materials: vec![grey], ..Scene::default() };
        let corner = |k: usize| DVec3::new([0.0, 4.0][k & 1], [0.0, 3.0][k >> 1 & 1], [0.0, 2.5][k >> 2]);
        for face in [[0, 1, 3, 2], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
            scene.add_quad("room", 0, face.map(corner));
        }
        let mut flat = |material, [x, end]: [f64; 2], [y, top]: [f64; 2], z| {
            let corners = [[x, y], [x, top], [end, top], [end, y]].map(|[x, y]| DVec3::new(x, y, z));
            scene.add_quad("flat", material, corners);
        };
        flat(0, [0.0, 2.0], [0.0, 3.0], 2.5);
        flat(0, [2.15, 4.0], [0.0, 3.0], 2.5);
        flat(0, [2.0, 2.15], [0.0, 1.5], 2.5);
        flat(0, [2.0, 2.15], [1.65, 3.0], 2.5);
        if let Some(sheet) = sheet {
            flat(1, [1.0, 3.0], [0.5, 2.5], 0.6);
            scene.materials.push(sheet);
        }
        scene.lights.push(PointLight {
            name: "sun".to_owned(),
            kind: PointLightKind::Directional,
            position: DVec3::ZERO,
            direction: DVec3::new(0.1, 0.2, -1.0).normalize(),
            intensity: [1e5; 3],
            range: None,
        });
        scene
    }

    /// What is sampled where beams end changes what is found by chance, and nothing else, on a sheet and behind it, too.
    #[test]
    fn ends_of_beams_are_the_light_that_paths_find() {
        // With how much more variance at least light is found by chance; what passes a sheet is found by chance alone.
        let cases = [
            (None, DVec3::new(0.5, 1.0, 2.0), -DVec3::Z, 20.0),
            (Some(opal()), DVec3::new(0.5, 1.0, 2.0), -DVec3::Z, 0.0),
            (Some(opal()), DVec3::new(1.5, 1.0, 0.01), DVec3::Z, 0.0),
        ];
        for (sheet, point, normal, times) in cases {
            let scene = room(sheet);
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            let referee = Referee::new(&tracer);
            let plain = Referee { beams: BeamEnds::default(), ..referee.clone() };
            assert!(!tracer.beams().all().is_empty());
            let place = Place { point, normal, triangle: u32::MAX };
            let ([by_chance, plain_error, variance], [mean, error, less]) =
                (seen(&plain, &place, 512), seen(&referee, &place, 64));
            let off = (mean - by_chance).abs() / plain_error.hypot(error);
            assert!(off < 3.0, "{by_chance} ± {plain_error}, {mean} ± {error}");
            assert!(variance > times * less, "{variance}, {less}");
        }
    }
}
