//! A measuring grid on a working plane: points in the air at one height over a level surface, with the light that falls on them
//! from above, as EN 12464-1 asks for it.
//!
//! The plane reaches as far as the surface, less a zone along the border and along walls, and no further than one comes from the
//! picked place without going through a wall. Cells are no longer than p = 0.2 · 5^lg d, d the longer side, or the shorter one
//! where that is half of it or less. Points have rays of their own ([`Live::receive`](radiosity_transport::live::Live::receive)),
//! so their light is as fine as that of elements is, without the average over one; what the rays find is what is shown.
//!
//! Fails where walls and furniture are one object: that is a wall then. Doors wider than twice the zone let the plane through.

use super::rectangle::{axes_along, cells, extent, is_within};
use super::survey::Meter;
use super::{ObjectId, Session};
use crate::Levels;
use glam::{DVec2, DVec3};
use radiosity_scene::{Bands, Side, luminance};
use radiosity_trace::Place;
use radiosity_transport::live::Bounds;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Cosine up to which a surface is level: one degree.
const LEVEL: f64 = 0.99985;

/// Farthest from the plane of the picked triangle, as a share of the object's size.
const FLAT: f64 = 1e-3;

/// What rises so far above the floor is a wall, even if it could be moved; a cupboard, and no desk.
const WALL: f64 = 2.0;

/// Walls are looked for as high as the plane, and above skirtings and thresholds.
const SKIRTING: f64 = 0.1;

/// Directions in which walls are looked for: at half a metre they are a hand's breadth apart.
const AROUND: u32 = 32;

/// Winding number from which a place is inside. Half of the sphere is that of what stands on the floor without a bottom, seen from
/// there.
const INSIDE: f64 = 0.4;

/// Which plane is measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneQuestion {
    /// The object above which it lies.
    pub object: ObjectId,
    /// A triangle of it that is level and looks up, and the place on it, as [`Session::probe`] takes them.
    pub triangle: u32,
    /// Weights of its corners 1 and 2.
    pub uv: [f32; 2],
    /// Metres above the surface: 0.75 is that of desks, 0 the floor itself.
    pub height: f64,
    /// Width of the zone along the border and along walls that is left out, metres: 0.5 where nothing else is agreed.
    pub border: f64,
}

/// Why there is no such plane.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlaneError {
    /// There is no such triangle, or its object was taken away.
    #[error("there is no such surface any more")]
    NoSurface,
    /// A number that is none.
    #[error("height and zone are metres, 0 or more and at most 1000")]
    NotALength,
    /// A wall, a ceiling, or a slope.
    #[error("the picked surface is no floor: it is not level, or looks down")]
    NotLevel,
    /// Nothing is left.
    #[error(
        "the surface is {:.2} m × {:.2} m: nothing is left within the zone of {border} m (pick a floor, or make the zone smaller)",
        size[0],
        size[1]
    )]
    TooNarrow {
        /// Sides of the surface, metres.
        size: [f64; 2],
        /// The zone.
        border: f64,
    },
    /// Everything is in the way.
    #[error(
        "no point of the plane is free: all are within things, in the zone along walls, or behind walls and ceilings"
    )]
    NoPoint,
}

/// A point of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PlanePoint {
    /// Where it is in the world.
    pub position: [f64; 3],
    /// Irradiance, lux per band.
    pub irradiance: Bands,
    /// Illuminance, lx.
    pub lux: f32,
    /// One standard error of it by the rays of this point, lx.
    pub error: f32,
}

/// What was measured on a plane.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaneReading {
    /// Its points, row by row.
    pub points: Vec<PlanePoint>,
    /// What they are together.
    pub figures: PlaneFigures,
}

/// A plane as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PlaneFigures {
    /// Sides of the plane without the zone along its border, metres.
    pub size: [f64; 2],
    /// Sides of a cell, metres.
    pub cell: [f64; 2],
    /// Unit vectors along the sides.
    pub axes: [[f64; 3]; 2],
    /// Whether there would be more points than can be measured, so that cells are larger than the standard's.
    pub is_coarse: bool,
    /// Least illuminance, lx.
    pub least: f32,
    /// Mean illuminance, lx.
    pub mean: f32,
    /// Most, lx.
    pub most: f32,
    /// Least over mean.
    pub uniformity: f32,
    /// Points that are left out as they are within things.
    pub covered: usize,
    /// Points above the surface that are left out as they lie in the zone along the walls of this room; things of 2 m, and what cannot be moved, are
    /// walls.
    pub walled: usize,
    /// All other points above the surface: of other rooms, or within what is taken for walls.
    pub beyond: usize,
    /// One standard error of a point, in the root mean square, over the mean: by rays alone, the elements' size is not in it.
    pub error: f32,
}

/// A plane on its way. It belongs to the session that works on it: from another's cells it would not begin anew.
#[derive(Clone, Debug)]
pub struct Plane {
    question: PlaneQuestion,
    /// Of which state of the light it is.
    revision: u64,
    layout: Option<Layout>,
    cells: Vec<Cell>,
}

/// A cell's middle, once it has been looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cell {
    /// Not above the surface.
    Outside,
    /// In the zone along a wall, or above a ceiling.
    Walled,
    /// Within a thing: there is no light, but the room goes on behind it.
    Inside,
    /// To be measured, by the halves of its rays.
    Free([Bands; 2]),
}

/// Where the cells are, about the middle of the scene.
#[derive(Clone, Debug)]
struct Layout {
    /// Triangles of the surface along the axes.
    surface: Vec<[DVec2; 3]>,
    origin: DVec3,
    axes: [DVec3; 2],
    normal: DVec3,
    low: DVec2,
    cell: DVec2,
    counts: [usize; 2],
    is_coarse: bool,
    /// Whether each object is a wall.
    is_wall: Vec<bool>,
    /// Things that points may be inside of.
    things: Vec<(Bounds, Vec<usize>)>,
}

impl Layout {
    /// The middle of a cell along the axes.
    fn middle(&self, cell: usize) -> DVec2 {
        let at = DVec2::new((cell % self.counts[0]) as f64, (cell / self.counts[0]) as f64);
        self.low + (at + 0.5) * self.cell
    }

    /// A point so high above the surface.
    fn point(&self, at: DVec2, height: f64) -> DVec3 {
        self.origin + at.x * self.axes[0] + at.y * self.axes[1] + height * self.normal
    }

    /// The cells beside one.
    fn beside(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let [columns, rows] = self.counts;
        let (i, j) = (cell % columns, cell / columns);
        let beside = [
            (i > 0).then(|| cell - 1),
            (i + 1 < columns).then(|| cell + 1),
            (j > 0).then(|| cell - columns),
            (j + 1 < rows).then(|| cell + columns),
        ];
        beside.into_iter().flatten()
    }
}

impl Plane {
    /// That is to be measured.
    pub fn new(question: PlaneQuestion) -> Plane {
        Plane { question, revision: 0, layout: None, cells: Vec::new() }
    }
}

impl Session {
    /// Works on a plane for about `budget`, at least on a few points. Answers nothing yet until all of it is measured in the light
    /// that is shown now, nor while there is none or an edit is not seen; when light changes meanwhile it begins anew.
    ///
    /// # Errors
    /// [`PlaneError`]: there is no such plane in the scene as it is now.
    pub fn measure_plane(&self, plane: &mut Plane, budget: Duration) -> Result<Option<PlaneReading>, PlaneError> {
        let deadline = Instant::now() + budget;
        let Some(meter) = self.meter() else { return Ok(None) };
        if plane.layout.is_none() || plane.revision != self.state.revision {
            plane.layout = None;
            plane.cells.clear();
        }
        let layout = match plane.layout.take() {
            Some(layout) => layout,
            None => self.lay(&plane.question)?,
        };
        plane.revision = self.state.revision;
        let (all, batch) = (layout.counts[0] * layout.counts[1], 2 * rayon::current_num_threads());
        while plane.cells.len() < all {
            let next = plane.cells.len()..all.min(plane.cells.len() + batch);
            let look = |cell| self.look(&layout, cell, &plane.question, &meter);
            let looked: Vec<Cell> = next.into_par_iter().map(look).collect();
            plane.cells.extend(looked);
            if Instant::now() >= deadline {
                break;
            }
        }
        let reading = (plane.cells.len() == all).then(|| self.read_plane(&layout, plane));
        plane.layout = Some(layout);
        reading.transpose()
    }

    fn lay(&self, question: &PlaneQuestion) -> Result<Layout, PlaneError> {
        let PlaneQuestion { object, triangle, uv, height, border } = *question;
        if [height, border].iter().any(|length| !(0.0..=1000.0).contains(length)) {
            return Err(PlaneError::NotALength);
        }
        let world = self.live.world();
        let body = world.bodies.get(object.0 as usize);
        let body =
            body.filter(|body| body.is_present && triangle < body.elements() && uv.iter().all(|x| x.is_finite()));
        let body = body.ok_or(PlaneError::NoSurface)?;
        let (picked, side, _) = body.shape.place(triangle);
        let up = self.scene().up.direction();
        let towards = if side == Side::Front { 1.0 } else { -1.0 };
        let normal = towards * body.normals[picked];
        if normal.dot(up) < LEVEL {
            return Err(PlaneError::NotLevel);
        }
        let origin = body.corners[picked][0];
        let thick = FLAT * (body.bounds.high - body.bounds.low).max_element();
        let is_own = |(corners, n): &(&[DVec3; 3], &DVec3)| {
            towards * n.dot(normal) >= LEVEL && corners.iter().all(|p| (*p - origin).dot(normal).abs() <= thick)
        };
        let own: Vec<[DVec3; 3]> = body.corners.iter().zip(&body.normals).filter(is_own).map(|(c, _)| *c).collect();
        let axes = axes_along(&own, normal);
        let flat = |p: DVec3| DVec2::new((p - origin).dot(axes[0]), (p - origin).dot(axes[1]));
        let surface: Vec<[DVec2; 3]> = own.iter().map(|corners| corners.map(flat)).collect();
        let [low, high] = extent(surface.iter().flatten().copied());
        let size = high - low - 2.0 * border;
        if size.min_element() <= 0.0 {
            return Err(PlaneError::TooNarrow { size: (high - low).to_array(), border });
        }
        let (counts, is_coarse) = cells(size);
        let cell = size / DVec2::new(counts[0] as f64, counts[1] as f64);

        let floor = origin.dot(up);
        let is_wall =
            |index: usize| !self.objects[index].is_movable || world.bodies[index].bounds.high.dot(up) > floor + WALL;
        let mut things: BTreeMap<u32, (Bounds, Vec<usize>)> = BTreeMap::new();
        for (index, other) in world.bodies.iter().enumerate().filter(|(_, other)| other.is_present) {
            let (bounds, bodies) =
                things.entry(self.objects[index].group).or_insert_with(|| (other.bounds, Vec::new()));
            bounds.low = bounds.low.min(other.bounds.low);
            bounds.high = bounds.high.max(other.bounds.high);
            bodies.push(index);
        }
        // What is around the picked place is the room, or the house that it is in.
        let on = body.point(triangle, uv).2 + world.offset * normal;
        things.retain(|_, (_, bodies)| self.winding(bodies, on).abs() <= INSIDE);
        Ok(Layout {
            surface,
            origin,
            axes,
            normal,
            low: low + border,
            cell,
            counts,
            is_coarse,
            is_wall: (0..world.bodies.len()).map(is_wall).collect(),
            things: things.into_values().collect(),
        })
    }

    /// How many times some objects together go around a point.
    fn winding(&self, bodies: &[usize], point: DVec3) -> f64 {
        bodies.iter().map(|body| self.live.world().bodies[*body].winding(point)).sum()
    }

    /// Whether a wall stands between two points.
    fn is_walled(&self, layout: &Layout, from: DVec3, to: DVec3) -> bool {
        let world = self.live.world();
        let along = to - from;
        let length = along.length();
        if length <= 0.0 {
            return false;
        }
        let place = Place { point: from, normal: layout.normal, triangle: u32::MAX };
        let ray = world.ray(&place, along / length, length);
        world.blocked_by_any(&ray, 0, |body| layout.is_wall[body])
    }

    /// What is at the middle of a cell, and the light there.
    fn look(&self, layout: &Layout, cell: usize, question: &PlaneQuestion, meter: &Meter) -> Cell {
        let world = self.live.world();
        let at = layout.middle(cell);
        if !layout.surface.iter().any(|corners| is_within(at, corners)) {
            return Cell::Outside;
        }
        let point = layout.point(at, question.height);
        let beside = layout.point(at, question.height.max(SKIRTING));
        let is_near_wall = (0..AROUND).any(|k| {
            let (sine, cosine) = (f64::from(k) / f64::from(AROUND) * std::f64::consts::TAU).sin_cos();
            let end = beside + question.border * (cosine * layout.axes[0] + sine * layout.axes[1]);
            self.is_walled(layout, beside, end)
        });
        if is_near_wall || self.is_walled(layout, layout.point(at, 0.0), point) {
            return Cell::Walled;
        }
        // Where rays begin: a point on a table is not inside it.
        let origin = point + world.offset * layout.normal;
        let is_inside = layout.things.iter().any(|(bounds, bodies)| {
            let may_be = origin.cmpge(bounds.low).all() && origin.cmple(bounds.high).all();
            may_be && self.winding(bodies, origin) > INSIDE
        });
        if is_inside {
            return Cell::Inside;
        }
        Cell::Free(self.receive(meter, point + world.middle, layout.normal))
    }

    /// How many cells lie along the walls of the cells that were reached: from these on, as far as the zone is wide in a corner.
    fn zone(&self, layout: &Layout, plane: &Plane, is_reached: &[bool]) -> usize {
        let PlaneQuestion { height, border, .. } = plane.question;
        let seen = |cell: usize| layout.point(layout.middle(cell), height.max(SKIRTING));
        let width = std::f64::consts::SQRT_2 * border + layout.cell.length();
        let mut is_known = is_reached.to_vec();
        let mut waiting: VecDeque<(usize, usize)> =
            (0..is_known.len()).filter(|cell| is_known[*cell]).map(|cell| (cell, cell)).collect();
        let mut count = 0;
        while let Some((cell, from)) = waiting.pop_front() {
            for next in layout.beside(cell).filter(|next| plane.cells[*next] == Cell::Walled) {
                let is_near = layout.middle(next).distance(layout.middle(from)) <= width;
                if !is_known[next] && is_near && !self.is_walled(layout, seen(cell), seen(next)) {
                    (is_known[next], count) = (true, count + 1);
                    waiting.push_back((next, from));
                }
            }
        }
        count
    }

    /// The points that are in the room of the picked place, and what they say together.
    fn read_plane(&self, layout: &Layout, plane: &Plane) -> Result<PlaneReading, PlaneError> {
        let PlaneQuestion { object, triangle, uv, height, .. } = plane.question;
        let world = self.live.world();
        let body = &world.bodies[object.0 as usize];
        let picked = body.point(triangle, uv).2 - layout.origin;
        let picked = DVec2::new(picked.dot(layout.axes[0]), picked.dot(layout.axes[1]));

        // From the nearest cell that is seen from there, over all to which no wall bars the way.
        let seen = |at: DVec2| layout.point(at, height.max(SKIRTING));
        let open = |cell: usize| !matches!(plane.cells[cell], Cell::Outside | Cell::Walled);
        let far = |cell: &usize| layout.middle(*cell).distance_squared(picked);
        let mut near: Vec<usize> = (0..plane.cells.len()).filter(|cell| open(*cell)).collect();
        near.sort_by(|a, b| far(a).total_cmp(&far(b)));
        let is_seen = |cell: &&usize| !self.is_walled(layout, seen(picked), seen(layout.middle(**cell)));
        let first = *near.iter().find(is_seen).or(near.first()).ok_or(PlaneError::NoPoint)?;
        let mut is_reached = vec![false; plane.cells.len()];
        let mut waiting = vec![first];
        is_reached[first] = true;
        while let Some(cell) = waiting.pop() {
            for next in layout.beside(cell).filter(|next| open(*next)) {
                let [from, to] = [cell, next].map(|cell| seen(layout.middle(cell)));
                if !is_reached[next] && !self.is_walled(layout, from, to) {
                    is_reached[next] = true;
                    waiting.push(next);
                }
            }
        }

        let walled = self.zone(layout, plane, &is_reached);

        let point = |(cell, of): (usize, &Cell)| match of {
            Cell::Free(halves) if is_reached[cell] => {
                let [a, b] = halves.map(luminance);
                Some(PlanePoint {
                    position: (layout.point(layout.middle(cell), height) + world.middle).to_array(),
                    irradiance: std::array::from_fn(|band| 0.5 * (halves[0][band] + halves[1][band])),
                    lux: 0.5 * (a + b),
                    error: 0.5 * (a - b).abs(),
                })
            }
            _ => None,
        };
        let points: Vec<PlanePoint> = plane.cells.iter().enumerate().filter_map(point).collect();
        if points.is_empty() {
            return Err(PlaneError::NoPoint);
        }
        let count = points.len() as f64;
        let square = points.iter().map(|point| f64::from(point.error).powi(2)).sum::<f64>() / count;
        let Levels { mean, least, largest, uniformity } = Levels::of(points.iter().map(|point| point.lux));
        let covered = plane.cells.iter().zip(&is_reached).filter(|of| of == &(&Cell::Inside, &true)).count();
        let above = plane.cells.iter().filter(|cell| **cell != Cell::Outside).count();
        let figures = PlaneFigures {
            size: [0, 1].map(|k| layout.cell[k] * layout.counts[k] as f64),
            cell: layout.cell.to_array(),
            axes: layout.axes.map(|axis| axis.to_array()),
            is_coarse: layout.is_coarse,
            least: least as f32,
            mean: mean as f32,
            most: largest as f32,
            uniformity: uniformity as f32,
            covered,
            walled,
            beyond: above - points.len() - covered - walled,
            error: if mean > 0.0 { (square.sqrt() / mean) as f32 } else { 0.0 },
        };
        Ok(PlaneReading { points, figures })
    }
}
