//! The best view of a room from inside: from many places at eye height, what would a picture in each direction show?
//! Good is much surface of the room, edges of things rather than blank walls, and nothing close before the lens.

use super::{ASPECTS, Room, Site};
use glam::DVec3;
use radiosity_scene::{Camera, Side};
use radiosity_trace::Found;
use radiosity_trace::sampling::Sequence;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Vertical angle of view, radians: a wide lens, 21 mm on 35 mm film.
const ANGLE: f64 = 1.05;

/// What the camera looks down by, radians, so that floors show more than ceilings.
const DOWN: f64 = 0.14;

/// Places that are tried; with half as many, furnished rooms are seen from clearly worse ones.
const PLACES: u32 = 600;

/// Directions around the horizon, and rows from 45° below it to 45° above.
const COLUMNS: usize = 48;
const ROWS: usize = 13;

/// Eye height, metres; in rooms of other scales within these parts of their height.
const EYE: f64 = 1.5;
const EYE_SHARES: [f64; 2] = [0.2, 0.55];

/// Parts of the eye's height: nothing is nearer to it than the first, and what is nearer than the second is in the way.
const NEAR: [f64; 2] = [0.15, 0.9];

/// A view from inside: how good it is, the eye, the azimuth.
type Rated = (f64, DVec3, f64);

/// The front that one ray met.
#[derive(Clone, Copy)]
struct Met {
    distance: f64,
    cosine: f64,
    normal: DVec3,
    /// Distance of its plane from the origin.
    offset: f64,
}

impl Site<'_> {
    /// The best view of a room from inside it, if anybody can stand there.
    pub(super) fn inside(&self, room: &Room) -> Option<Camera> {
        let better = |a: Rated, b: Rated| if b.0 > a.0 { b } else { a };
        let views: Vec<Rated> = (0..PLACES).into_par_iter().filter_map(|i| self.view_from(i, room)).collect();
        let (_, eye, azimuth) = views.into_iter().reduce(better)?;
        let camera = Camera::look_at("inside", eye, eye + self.direction(azimuth, -DOWN), self.axes[1], ANGLE);
        Some(Camera { aspect: self.aspect.or(Some(ASPECTS[0])), ..camera })
    }

    /// The best view from one place.
    fn view_from(&self, i: u32, room: &Room) -> Option<Rated> {
        let up = self.axes[1];
        let [low, high] = room.bounds;
        let [u, v, w, _] = Sequence::new(7, 6).point(i).map(f64::from);
        let place = low + (high - low) * DVec3::new(u, v, w);
        let (below, above) = (self.front(place, -up, i)?, self.front(place, up, i)?);
        let height = below + above;
        // Not under a table.
        if height < 0.7 * room.height {
            return None;
        }
        let level = EYE.clamp(EYE_SHARES[0] * height, EYE_SHARES[1] * height);
        let eye = place + (level - below) * up;
        // Not on a table: the floor around is no lower.
        let steep = -0.9f64;
        let is_lower = |k: u32| {
            let distance = self.front(eye, self.direction(TAU * f64::from(k) / 8.0, steep), k);
            distance.is_some_and(|d| -d * steep.sin() > 1.05 * level)
        };
        if (0..8).any(is_lower) {
            return None;
        }

        // Look around. What lies outside of the windows does not count.
        let elevation = |row: usize| (row as f64 / (ROWS - 1) as f64 - 0.5) * 0.25 * TAU;
        let [low, high] = [low - 0.5 * height, high + 0.5 * height];
        let look = |at: usize| {
            let direction = self.direction(TAU * (at % COLUMNS) as f64 / COLUMNS as f64, elevation(at / COLUMNS));
            let Found::Surface { triangle, distance, side: Side::Front, .. } = self.first(eye, direction, i) else {
                return None;
            };
            let (distance, normal) = (f64::from(distance), self.tracer.mesh.normal(triangle as usize));
            let point = eye + distance * direction;
            let is_in = point.cmpge(low).all() && point.cmple(high).all();
            is_in.then(|| Met { distance, cosine: -normal.dot(direction), normal, offset: normal.dot(point) })
        };
        let met: Vec<Option<Met>> = (0..ROWS * COLUMNS).map(look).collect();
        if met.iter().flatten().any(|m| m.distance < NEAR[0] * level) {
            return None;
        }

        // Add up what a picture in each direction would show, by solid angle.
        let is_edge = |a: &Met, b: &Option<Met>| {
            b.is_none_or(|b| a.normal.dot(b.normal) < 0.99 || (a.offset - b.offset).abs() > 0.02 * height)
        };
        let half_width = ((0.5 * ANGLE).tan() * self.aspect.unwrap_or(ASPECTS[0])).atan();
        let beside = ((half_width / TAU * COLUMNS as f64) as usize).min(COLUMNS / 2 - 1);
        let rate = |heading: usize| {
            let (mut all, mut shown, mut area, mut edges, mut near) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for row in (0..ROWS - 1).filter(|&row| (elevation(row) + DOWN).abs() < 0.5 * ANGLE) {
                let weight = elevation(row).cos();
                for column in (0..=2 * beside).map(|step| (heading + COLUMNS + step - beside) % COLUMNS) {
                    all += weight;
                    let Some(m) = met[row * COLUMNS + column] else { continue };
                    shown += weight;
                    // Grazing surfaces show less than they have.
                    area += weight * m.distance * m.distance / m.cosine.max(0.25);
                    near += if m.distance < NEAR[1] * level { weight } else { 0.0 };
                    let others = [row * COLUMNS + (column + 1) % COLUMNS, (row + 1) * COLUMNS + column];
                    edges += others.iter().filter(|&&other| is_edge(&m, &met[other])).count() as f64 * 0.5 * weight;
                }
            }
            let extent = (area / all).sqrt() / height;
            extent * (0.35 + edges / all) * (shown / all).powi(2) * (1.0 - 3.0 * near / all).max(0.01)
        };
        let views = (0..COLUMNS).map(|heading| (rate(heading), eye, TAU * heading as f64 / COLUMNS as f64));
        views.reduce(|a, b| if b.0 > a.0 { b } else { a }).filter(|(score, ..)| *score > 0.0)
    }
}
