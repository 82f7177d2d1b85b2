//! A closed, lamp-lit building on one floor: a square of rooms, walls with doors between them, the same few pieces of
//! furniture in hashed places. No two faces coincide: slabs end inside the walls, walls end inside posts.

use super::{BLUE, BOX, FLOOR, LAMP, PLASTER, Part, RED, Visit, WOOD, corners};
use crate::hash::lattice;
use glam::{Vec3, vec3};

/// Distance between the middles of neighbouring rooms, along x and z; clear height; half the walls' thickness, of a
/// post's width, and of the gap between slabs.
const PITCH: [f32; 2] = [4.4, 3.8];
const HEIGHT: f32 = 2.6;
const HALF_WALL: f32 = 0.06;
const HALF_POST: f32 = 0.10;
const HALF_GAP: f32 = 0.03;

/// How deep things are sunk into one another. At 10^4 m, f32 still resolves half of it.
const SUNK: f32 = 0.004;

/// A building of a given number of rooms.
pub struct Building {
    rooms: i64,
    columns: i64,
}

impl Building {
    /// A building of `rooms` rooms, as square as can be.
    pub fn new(rooms: u32) -> Building {
        Building { rooms: rooms.into(), columns: f64::from(rooms).sqrt().ceil() as i64 }
    }

    fn is_room(&self, column: i64, row: i64) -> bool {
        (0..self.columns).contains(&column) && row >= 0 && row * self.columns + column < self.rooms
    }
}

/// Takes boxes and frames to the sink.
struct Mason<'a> {
    sink: &'a mut dyn FnMut(Part),
}

impl Mason<'_> {
    fn cuboid(&mut self, material: usize, lo: Vec3, hi: Vec3) {
        (self.sink)(Part { material, points: &corners(lo, hi), triangles: &BOX });
    }

    /// A wall from `from` along `axis` (0: x, 2: z), with a doorway in its middle if asked. The doorway's threshold
    /// lies a little above the floor, so that it covers the gap between the slabs.
    fn wall(&mut self, middle: Vec3, axis: usize, half_length: f32, door: bool) {
        let along = if axis == 0 { Vec3::X } else { Vec3::Z };
        let across = if axis == 0 { Vec3::Z } else { Vec3::X } * HALF_WALL;
        let (low, high) = (-0.1, HEIGHT + 0.1);
        if !door {
            let half = along * half_length + across;
            return self.cuboid(PLASTER, middle - half + Vec3::Y * low, middle + half + Vec3::Y * high);
        }
        let rectangle = |half: f32, y0: f32, y1: f32| [(-half, y0), (half, y0), (half, y1), (-half, y1)];
        let (outer, inner) = (rectangle(half_length, low, high), rectangle(0.45, 0.008, 2.05));
        // Counter-clockwise from +across, which is along × up for x and up × along for z.
        let turned = axis == 2;
        let mut points = [Vec3::ZERO; 16];
        for (i, &(a, y)) in outer.iter().chain(&inner).enumerate() {
            points[i] = middle + along * if turned { -a } else { a } + Vec3::Y * y + across;
            points[i + 8] = points[i] - 2.0 * across;
        }
        let mut triangles = [[0; 3]; 32];
        for i in 0..4 {
            let j = (i + 1) % 4;
            let quads = [
                [i, j, j + 4, i + 4],
                [i + 8, i + 12, j + 12, j + 8],
                [i + 8, j + 8, j, i],
                [i + 4, j + 4, j + 12, i + 12],
            ];
            for (k, [a, b, c, d]) in quads.into_iter().enumerate() {
                triangles[(8 * i) as usize + 2 * k] = [a, b, c];
                triangles[(8 * i) as usize + 2 * k + 1] = [a, c, d];
            }
        }
        (self.sink)(Part { material: PLASTER, points: &points, triangles: &triangles });
    }

    /// A board on four legs.
    fn table(&mut self, material: usize, middle: Vec3, half: [f32; 2], top: f32, leg: f32) {
        let board = vec3(half[0], 0.0, half[1]);
        self.cuboid(material, middle - board + Vec3::Y * (top - 0.04), middle + board + Vec3::Y * top);
        for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let at = middle + vec3(x * (half[0] - leg - 0.02), 0.0, z * (half[1] - leg - 0.02));
            let half = vec3(leg, 0.0, leg);
            self.cuboid(material, at - half - Vec3::Y * SUNK, at + half + Vec3::Y * (top - 0.02));
        }
    }

    fn chair(&mut self, material: usize, middle: Vec3, back: f32) {
        self.table(material, middle, [0.21, 0.21], 0.45, 0.02);
        let (near, far) = (middle.z + back * 0.155, middle.z + back * 0.185);
        let lo = vec3(middle.x - 0.20, 0.42, near.min(far));
        self.cuboid(material, lo, vec3(middle.x + 0.20, 0.90, near.max(far)));
    }

    /// A case of four shelves with books on them, its back to the wall at −x.
    fn shelf(&mut self, middle: Vec3, seed: [i64; 2]) {
        let (lo, hi) = (middle - vec3(0.15, SUNK, 0.45), middle + vec3(0.15, 1.8, 0.45));
        self.cuboid(WOOD, lo, vec3(hi.x, hi.y, lo.z + 0.02));
        self.cuboid(WOOD, vec3(lo.x, lo.y, hi.z - 0.02), hi);
        for level in 0..4 {
            let y = 0.10 + 0.5 * level as f32;
            self.cuboid(WOOD, vec3(lo.x + 0.005, y, lo.z + 0.01), vec3(hi.x - 0.005, y + 0.02, hi.z - 0.01));
            for book in 0..6 {
                let number = lattice([seed[0], seed[1], 100 + 10 * level + book]) as f32;
                let z = lo.z + 0.05 + 0.13 * book as f32;
                let material = RED + (number * 97.0) as usize % 3;
                let top = vec3(lo.x + 0.22, y + 0.22 + 0.12 * number, z + 0.05 + 0.07 * number);
                self.cuboid(material, vec3(lo.x + 0.04, y + 0.018, z), top);
            }
        }
    }
}

impl Visit for Building {
    fn visit(&self, sink: &mut dyn FnMut(Part)) {
        let mut mason = Mason { sink };
        let rows = (self.rooms + self.columns - 1) / self.columns;
        let place = |column: f32, row: f32| vec3(column * PITCH[0], 0.0, row * PITCH[1]);
        for (row, column) in (0..=rows).flat_map(|row| (0..=self.columns).map(move |column| (row, column))) {
            let here = self.is_room(column, row);
            let [west, north, corner] =
                [(column - 1, row), (column, row - 1), (column - 1, row - 1)].map(|(c, r)| self.is_room(c, r));
            let (x, z) = (column as f32, row as f32);
            if here || west || north || corner {
                let (at, half) = (place(x - 0.5, z - 0.5), vec3(HALF_POST, 0.0, HALF_POST));
                mason.cuboid(PLASTER, at - half - Vec3::Y * 0.15, at + half + Vec3::Y * (HEIGHT + 0.15));
            }
            // Every room opens to the west; one wall in two, and all of the first column's, to the north: so all
            // rooms can be reached.
            if here || west {
                let half_length = PITCH[1] / 2.0 - HALF_POST + 0.02;
                mason.wall(place(x - 0.5, z), 2, half_length, here && west);
            }
            if here || north {
                let open = column == 0 || lattice([column, row, 1]) < 0.5;
                let half_length = PITCH[0] / 2.0 - HALF_POST + 0.02;
                mason.wall(place(x, z - 0.5), 0, half_length, here && north && open);
            }
            if here {
                furnish(&mut mason, place(x, z), [column, row]);
            }
        }
    }

    fn camera(&self) -> [Vec3; 2] {
        [vec3(-1.7, 1.6, 1.5), vec3(0.5, 0.9, -0.6)]
    }
}

/// Slabs, lamp and furniture of one room.
fn furnish(mason: &mut Mason, middle: Vec3, seed: [i64; 2]) {
    let number = |k: i64| lattice([seed[0], seed[1], k]) as f32;
    let half = vec3(PITCH[0] / 2.0 - HALF_GAP, 0.0, PITCH[1] / 2.0 - HALF_GAP);
    mason.cuboid(FLOOR, middle - half - Vec3::Y * 0.2, middle + half);
    mason.cuboid(PLASTER, middle - half + Vec3::Y * HEIGHT, middle + half + Vec3::Y * (HEIGHT + 0.2));
    let lamp = middle + Vec3::Y * HEIGHT;
    mason.cuboid(LAMP, lamp - vec3(0.3, 0.05, 0.3), lamp + vec3(0.3, SUNK, 0.3));

    let table = middle + vec3(number(2) - 0.3, 0.0, 0.5 * number(3) - 0.25);
    mason.table(WOOD, table, [0.7, 0.4], 0.74, 0.03);
    for (k, (x, back)) in [(-0.35, -1.0), (0.35, -1.0), (-0.35, 1.0), (0.35, 1.0)].into_iter().enumerate() {
        let material = RED + (number(10 + k as i64) * 97.0) as usize % (BLUE - RED + 1);
        mason.chair(material, table + vec3(x, 0.0, back * 0.55), back);
    }
    // Against the west wall, clear of its door.
    let shelf = middle + vec3(HALF_WALL + 0.15 - SUNK - PITCH[0] / 2.0, 0.0, -1.15 + 0.1 * number(4));
    mason.shelf(shelf, seed);
    let cupboard = middle + vec3(PITCH[0] / 2.0 - 0.7, 0.0, 1.84 - HALF_WALL);
    let high = 0.8 + 0.8 * number(5);
    mason.cuboid(WOOD, cupboard - vec3(0.4, SUNK, 0.4), cupboard + vec3(0.4, high, 0.06 + SUNK));
}
