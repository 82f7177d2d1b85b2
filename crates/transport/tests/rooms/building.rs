//! Office buildings: floors of two rows of rooms along a corridor, with doors, furniture and stairwells; and how a
//! person would part them.

use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};

/// A building, facet by facet with its room.
pub struct Building {
    pub enclosure: Enclosure,
    /// The room of each facet; what is in the thickness of a wall belongs to one of its rooms.
    pub room_of: Vec<u32>,
    /// Lower and upper corner of each room; corridors come last.
    pub rooms: Vec<[DVec3; 2]>,
    /// Doors and stairwells: the rooms they join, and the box that they are in the wall.
    pub doors: Vec<([u32; 2], [DVec3; 2])>,
    /// Width of facets, about, m.
    pub element: f64,
}

/// What is built.
#[derive(Clone, Copy)]
pub struct Plan {
    /// Rooms on either side of a corridor; 0: one room and no corridor.
    pub columns: usize,
    pub floors: usize,
    /// Of walls and floors, m; 0: sheets with a facet on either side.
    pub thickness: f64,
    /// Width of facets, about, m.
    pub element: f64,
}

impl Plan {
    /// 1, 4, 20 or 100 rooms.
    pub fn of_rooms(rooms: usize, thickness: f64, element: f64) -> Plan {
        let (columns, floors) = match rooms {
            1 => (0, 1),
            4 => (2, 1),
            20 => (5, 2),
            100 => (10, 5),
            _ => panic!("{rooms} rooms are not planned"),
        };
        Plan { columns, floors, thickness, element }
    }
}

/// Width, depth and height of a room, m.
const ROOM: DVec3 = DVec3::new(5.0, 4.0, 3.0);
/// Width of the corridor, m.
const CORRIDOR: f64 = 2.0;

impl Building {
    pub fn new(plan: Plan) -> Building {
        let mut building = Building {
            enclosure: Enclosure { is_closed: true, ..Enclosure::default() },
            room_of: Vec::new(),
            rooms: Vec::new(),
            doors: Vec::new(),
            element: plan.element,
        };
        building.lay_out(plan);
        for room in 0..building.rooms.len() as u32 {
            building.add_room(room);
        }
        for door in building.doors.clone() {
            building.add_reveal(door);
        }
        let rooms = (2 * plan.columns * plan.floors).max(1);
        for room in (0..rooms as u32).filter(|room| room % 2 == 0) {
            building.furnish(room);
        }
        building
    }

    /// Rooms, corridors, doors and stairwells.
    fn lay_out(&mut self, plan: Plan) {
        let t = plan.thickness;
        if plan.columns == 0 {
            self.rooms.push([DVec3::ZERO, ROOM]);
            return;
        }
        for floor in 0..plan.floors {
            let z = floor as f64 * (ROOM.z + t);
            for column in 0..plan.columns {
                let x = column as f64 * (ROOM.x + t);
                for y in [0.0, ROOM.y + CORRIDOR + 2.0 * t] {
                    let low = DVec3::new(x, y, z);
                    self.rooms.push([low, low + ROOM]);
                }
            }
        }
        let offices = self.rooms.len() as u32;
        let length = plan.columns as f64 * (ROOM.x + t) - t;
        for floor in 0..plan.floors {
            let low = DVec3::new(0.0, ROOM.y + t, floor as f64 * (ROOM.z + t));
            self.rooms.push([low, low + DVec3::new(length, CORRIDOR, ROOM.z)]);
            let corridor = offices + floor as u32;
            if floor > 0 {
                // The stairwell in the corridor's floor.
                let [from, to] = [DVec3::new(0.7, 0.5, -t), DVec3::new(2.7, 1.5, 0.0)].map(|p| low + p);
                self.doors.push(([corridor - 1, corridor], [from, to]));
            }
        }
        let per_floor = 2 * plan.columns as u32;
        for room in 0..offices {
            let [low, high] = self.rooms[room as usize];
            let corridor = offices + room / per_floor;
            // Doors of a metre by 2.1 m, each a little farther along its wall.
            let x = low.x + 1.0 + 0.31 * f64::from(room % 7);
            let y = if room % 2 == 0 { high.y } else { low.y - t };
            self.doors.push(([room, corridor], [DVec3::new(x, y, low.z), DVec3::new(x + 1.0, y + t, low.z + 2.1)]));
            let next = room + 2;
            if room % 3 == 0 && room % per_floor + 2 < per_floor {
                let from = DVec3::new(high.x, low.y + 1.4, low.z);
                self.doors.push(([room, next], [from, from + DVec3::new(t, 0.9, 2.1)]));
            }
        }
    }

    /// The six sides of a room, without its doors.
    fn add_room(&mut self, room: u32) {
        let [low, high] = self.rooms[room as usize];
        for axis in 0..3 {
            // Doors stand side by side along u.
            let (u, v) = [(1, 2), (0, 2), (0, 1)][axis];
            for (is_high, at) in [(false, low[axis]), (true, high[axis])] {
                let is_here = |(rooms, [from, to]): &&([u32; 2], [DVec3; 2])| {
                    let edge = if is_high { from[axis] } else { to[axis] };
                    let wide = to[u] - from[u] > 0.5 && to[v] - from[v] > 0.5;
                    rooms.contains(&room) && wide && (edge - at).abs() < 1e-9
                };
                let mut holes: Vec<[DVec3; 2]> = self.doors.iter().filter(is_here).map(|door| door.1).collect();
                holes.sort_by(|a, b| a[0][u].total_cmp(&b[0][u]));
                let mut side = |[u0, v0]: [f64; 2], [u1, v1]: [f64; 2]| {
                    let (mut from, mut to) = (DVec3::splat(at), DVec3::splat(at));
                    (from[u], from[v], to[u], to[v]) = (u0, v0, u1, v1);
                    self.add_side(room, axis, !is_high, [from, to]);
                };
                let mut begun = low[u];
                for [from, to] in holes {
                    side([begun, low[v]], [from[u], high[v]]);
                    side([from[u], low[v]], [to[u], from[v]]);
                    side([from[u], to[v]], [to[u], high[v]]);
                    begun = to[u];
                }
                side([begun, low[v]], [high[u], high[v]]);
            }
        }
    }

    /// The four sides of a door within its wall, its sill among them.
    fn add_reveal(&mut self, ([room, _], [low, high]): ([u32; 2], [DVec3; 2])) {
        for axis in 0..3 {
            // Across the wall there is nothing; a door in a wall without thickness has no reveal.
            if high[axis] - low[axis] > 0.5 {
                self.add_box_sides(room, axis, true, [low, high]);
            }
        }
    }

    /// A table and a cupboard.
    fn furnish(&mut self, room: u32) {
        let low = self.rooms[room as usize][0];
        for (from, to) in [([2.6, 1.2, 0.7], [4.2, 2.0, 0.75]), ([4.3, 2.6, 0.02], [4.9, 3.8, 1.9])] {
            let [from, to] = [from, to].map(|p| low + DVec3::from(p));
            for axis in 0..3 {
                self.add_box_sides(room, axis, false, [from, to]);
            }
        }
    }

    /// The two sides of a box across `axis`, active inwards or outwards.
    fn add_box_sides(&mut self, room: u32, axis: usize, inwards: bool, [low, high]: [DVec3; 2]) {
        let (mut lower, mut upper) = (high, low);
        (lower[axis], upper[axis]) = (low[axis], high[axis]);
        self.add_side(room, axis, inwards, [low, lower]);
        self.add_side(room, axis, !inwards, [upper, high]);
    }

    /// A rectangle across `axis` between two of its corners, cut into facets; it looks up the axis or down.
    fn add_side(&mut self, room: u32, axis: usize, up: bool, [from, to]: [DVec3; 2]) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let size = [to[u] - from[u], to[v] - from[v]];
        if size.iter().any(|s| *s < 1e-9) {
            return;
        }
        let [nu, nv] = size.map(|s| (s / self.element).round().max(1.0) as usize);
        let point = |i: usize, j: usize| {
            let mut p = DVec3::ZERO;
            p[axis] = from[axis];
            p[u] = from[u] + size[0] * i as f64 / nu as f64;
            p[v] = from[v] + size[1] * j as f64 / nv as f64;
            p
        };
        for (i, j) in (0..nu * nv).map(|k| (k % nu, k / nu)) {
            let mut corners = vec![point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            if !up {
                corners.reverse();
            }
            self.enclosure.add(format!("room {room}"), Facet::new(corners).unwrap());
            self.room_of.push(room);
        }
    }

    /// Σ(p + q)² of the partition by hand: a region for each room, and the doors cut into patches as wide as the
    /// elements.
    pub fn cost_by_hand(&self) -> f64 {
        let mut sizes = vec![0.0; self.rooms.len()];
        for room in &self.room_of {
            sizes[*room as usize] += 1.0;
        }
        let areas: f64 = self.enclosure.facets.iter().map(Facet::area).sum();
        let size = (areas / self.enclosure.facets.len() as f64).sqrt();
        for (rooms, [low, high]) in &self.doors {
            let sides = (*high - *low).to_array().into_iter().filter(|side| *side > 0.5);
            let patches: f64 = sides.map(|side| (side / size).round().max(1.0)).product();
            rooms.iter().for_each(|room| sizes[*room as usize] += patches);
        }
        sizes.iter().map(|size| size * size).sum()
    }
}
