//! Places on surfaces: spread by area, as it counts, for audits, snapped to the surface for measuring points.

use crate::Solution;
use crate::answer::Station;
use glam::{DVec2, DVec3};
use radiosity_scene::Side;
use radiosity_trace::sampling::{Sequence, hash, unit};
use radiosity_trace::{Found, Place, Tracer};
use radiosity_transport::exposure::{is_buried, open_place};
use radiosity_view::picture::shading_normal;

/// `count` stations spread evenly over the exposed area as it counts, one in each of as many equal shares of it, less those that turn
/// out to lie inside a solid. They receive with the shading normal, as pictures and lightmaps do.
pub fn spread(solution: &Solution, count: usize, seed: u32) -> Vec<Station> {
    let weight = solution.counted_area();
    let total: f64 = weight.iter().sum();
    let mut stations = Vec::with_capacity(count);
    let (mut element, mut below) = (0usize, 0.0);
    for i in 0..count {
        let jitter = f64::from(unit(hash(seed ^ hash(i as u32))));
        let wanted = (i as f64 + jitter) / count as f64 * total;
        while element + 1 < weight.len() && below + weight[element] < wanted {
            below += weight[element];
            element += 1;
        }
        let [x, y, _, _] = Sequence::new(seed ^ hash(i as u32), 0x0a0d).point(0);
        let mask = solution.exposure.mask(element as u32);
        if mask == 0 {
            continue;
        }
        let (x, y) = open_place(mask, x, y);
        let (triangle, side) = solution.elements.place(element as u32);
        let uv = solution.elements.sample(element as u32, x, y);
        let station = station(solution.tracer(), triangle, uv, side);
        // Nobody sees the light inside a solid, and nothing is written there.
        if !is_buried(solution.tracer(), &station.place, hash(seed ^ i as u32)) {
            stations.push(station);
        }
    }
    stations
}

/// The station at barycentric coordinates of a triangle's side.
pub fn station(tracer: &Tracer, triangle: usize, uv: DVec2, side: Side) -> Station {
    let normal = shading_normal(tracer, triangle, uv, side);
    let place = Place { point: tracer.mesh.point(triangle, uv), normal, triangle: triangle as u32 };
    Station { place, uv, side }
}

/// A point as a user gave it: on the surface that passes within [`Tracer::reach`] and faces the same way, if there is one;
/// free in space otherwise. Rounded coordinates would start rays behind the surface that is meant.
pub fn snap(tracer: &Tracer, point: DVec3, normal: DVec3) -> Place {
    let free = Place { point, normal, triangle: u32::MAX };
    let reach = tracer.reach();
    let ray = tracer.free_ray(point + reach * normal, -normal);
    match tracer.first(&ray, 0) {
        Found::Surface { triangle, side, distance, .. } if f64::from(distance) <= 2.0 * reach => {
            let flat = tracer.mesh.normal(triangle as usize) * if side == Side::Front { 1.0 } else { -1.0 };
            if flat.dot(normal) < 0.7 {
                return free;
            }
            // Along the normal onto the triangle's plane, in double precision.
            let corner = tracer.mesh.corners(triangle as usize)[0];
            let point = point - (point - corner).dot(flat) / flat.dot(normal) * normal;
            Place { point, normal, triangle }
        }
        _ => free,
    }
}
