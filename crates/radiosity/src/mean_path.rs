//! How far surfaces see: the scale of a scene's rooms, whatever its size, and how many cells it takes.

use crate::solution::scaled_area;
use crate::{Solution, SolveOptions};
use glam::DVec2;
use radiosity_scene::Side;
use radiosity_scene::elements::triangle_from_square;
use radiosity_trace::sampling::{Sequence, cosine_direction, frame, hash, unit};
use radiosity_trace::{Found, Place, Tracer};
use rayon::prelude::*;

/// Rays that look. Their mean is right within some percent.
const RAYS: u32 = 8192;

/// The stream of sample points that they use.
const PATHS: u32 = 0x0d15;

/// Most cells that a scene of many rooms is given without being asked.
const MOST_CELLS: usize = 1_000_000;

impl SolveOptions {
    /// More cells where rooms are many: so many along the mean path of light at least, up to a million and what the memory
    /// holds. As many for all rooms together as one of them has would leave each a few.
    pub(crate) fn cells_on_path(&mut self, tracer: &Tracer, count: f64) {
        let size = mean_path(tracer) / count;
        let mut wanted = ((2.0 * scaled_area(tracer.mesh, tracer.scales()) / (size * size)) as usize).min(MOST_CELLS);
        while wanted > self.cells && Solution::memory(tracer, &SolveOptions { cells: wanted, ..*self }) > self.memory {
            wanted /= 2;
        }
        self.cells = self.cells.max(wanted);
    }
}

/// Mean distance from a place on a surface to what it sees, metres: 4 V/A in an empty room of volume V and area A (the mean
/// chord). Rays that leave the scene, and those within solids, do not count; infinite where there are no others. Where scales differ
/// distances are those of the widest place: relative to the scale of the place.
fn mean_path(tracer: &Tracer) -> f64 {
    let mesh = tracer.mesh;
    let below: Vec<f64> = (0..mesh.triangles.len())
        .scan(0.0, |sum, triangle| {
            *sum += mesh.area(triangle) / tracer.scale(triangle).powi(2);
            Some(*sum)
        })
        .collect();
    let Some(&total) = below.last() else { return f64::INFINITY };
    let sequence = Sequence::new(0, PATHS);
    let found: Vec<Option<f64>> = (0..RAYS)
        .into_par_iter()
        .map(|index| {
            let [u, v, x, y] = sequence.point(index).map(f64::from);
            let wanted = (f64::from(index) + f64::from(unit(hash(index)))) / f64::from(RAYS) * total;
            let triangle = below.partition_point(|sum| *sum <= wanted).min(below.len() - 1);
            let (scale, (x, y)) = (tracer.scale(triangle), triangle_from_square(x, y));
            let normal = mesh.normal(triangle);
            let place = Place { point: mesh.point(triangle, DVec2::new(x, y)), normal, triangle: triangle as u32 };
            let ray = tracer.ray(&place, cosine_direction(&frame(normal), u, v), f64::INFINITY);
            match tracer.first(&ray, hash(index)) {
                Found::Surface { triangle, side, distance, .. } => {
                    let material = tracer.scene.material(mesh.source[triangle as usize] as usize);
                    (side == Side::Front || material.has_two_sides()).then_some(f64::from(distance) / scale)
                }
                _ => None,
            }
        })
        .collect();
    let count = found.iter().flatten().count();
    if count == 0 { f64::INFINITY } else { found.iter().flatten().sum::<f64>() / count as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use radiosity_scene::{Material, Mesh, Scene};

    /// The mean chord of a box is 4 V/A (Cauchy).
    #[test]
    fn mean_path_of_a_box_is_its_mean_chord() {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        let sides = DVec3::new(4.0, 3.0, 2.0);
        for axis in 0..3 {
            let [x, y, z] = [axis, (axis + 1) % 3, (axis + 2) % 3].map(|k| DVec3::AXES[k] * sides[k]);
            scene.add_quad("near", 0, [DVec3::ZERO, x, x + y, y]);
            scene.add_quad("far", 0, [z, z + y, z + x + y, z + x]);
        }
        let mesh = Mesh::new(&scene);
        let chord = 4.0 * 24.0 / 52.0;
        let found = mean_path(&Tracer::new(&scene, &mesh));
        assert!((found - chord).abs() < 0.02 * chord, "{found} for {chord}");
    }
}
