//! Graphics hardware against the item buffer, catalogue 92. They need an adapter, if only one in software, and fail without.
#![expect(clippy::print_stdout, reason = "measured, for docs/catalogue.md")]

use super::HemicubeGpu;
use crate::row::face::Face;
use crate::row::glance::Scratch;
use crate::row::look::Gaze;
use crate::row::surface::{Atlas, Projection};
use crate::row::tests::{box_of, l_shaped_room, room_with_block};
use crate::row::view::View;
use crate::row::{Hemicube, Look, Row};
use crate::{FormFactorMethod, FormFactorOptions, FormFactors};
use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};

/// Hardware puts corners on a lattice of 1/256 of a cell, so that an edge may be off by as much; twice that is within.
const LATTICE: f64 = 1.0 / 128.0;

/// A hemicube whose faces look a part of a cell aside.
struct Shifted {
    look: Look,
    by: [f64; 2],
}

impl Projection for Shifted {
    fn look(&self) -> Look {
        self.look
    }

    fn faces(&self, n: usize) -> Vec<Face> {
        let mut faces = Projection::faces(&Hemicube::default(), n);
        for face in &mut faces {
            let [x, y] = [0, 1].map(|k| self.by[k] * face.pitch()[k]);
            let [left, right, low, high] = face.window;
            face.window = [left + x, right + x, low + y, high + y];
        }
        faces
    }
}

/// The buffers of a row, and the weights of all their cells.
fn buffers(projection: &dyn Projection, from: usize, room: &Enclosure) -> (Vec<u32>, Vec<f64>) {
    let (atlas, view) = (Atlas::new(projection), View::new(room));
    let (mut all, mut weights) = (Vec::new(), Vec::new());
    Gaze::new(&atlas, &view, from, &mut Scratch::default()).average(
        projection.look().points,
        1,
        &mut |_, items, weigh, share| {
            all.extend_from_slice(items);
            weights.extend(weigh.iter().map(|w| w * share));
        },
    );
    (all, weights)
}

/// Compares the buffers of a row: cells in all, cells that differ. Each that differs must lie on an edge; factors may differ
/// by one delta form factor for each cell on an edge of the facet's image, and no more.
fn compare(gpu: &HemicubeGpu, from: usize, room: &Enclosure) -> [usize; 2] {
    let look = gpu.look();
    let (found, weights) = buffers(gpu, from, room);
    let (wanted, _) = buffers(&Hemicube { look, ..Hemicube::default() }, from, room);
    let by = (0..9).filter(|k| *k != 4).map(|k| [k % 3, k / 3].map(|x| (f64::from(x) - 1.0) * LATTICE));
    let around: Vec<_> = by.map(|by| buffers(&Shifted { look, by }, from, room).0).collect();
    let n = room.facets.len() + 1;
    let (mut off, mut allowed, mut differ) = (vec![0.0; n], vec![1e-12; n], 0);
    for cell in 0..wanted.len() {
        let (a, b, weight) = (wanted[cell], found[cell], weights[cell]);
        let is_edge = around.iter().any(|items| items[cell] != a);
        // What is behind shows too, where edges of neighbours that meet in a T part on the lattice.
        let mut near: Vec<u32> = around.iter().map(|items| items[cell]).chain([a, b]).collect();
        near.sort_unstable();
        near.dedup();
        near.iter().filter(|_| is_edge).for_each(|item| allowed[*item as usize] += weight);
        if a != b {
            assert!(is_edge, "from {from}, cell {cell}: {b} instead of {a}, and no edge is near; {near:?}");
            off[a as usize] -= weight;
            off[b as usize] += weight;
            differ += 1;
        }
    }
    for j in 0..n {
        assert!(f64::abs(off[j]) <= allowed[j], "{from} to {j}: {} of {}", off[j], allowed[j]);
    }
    [wanted.len(), differ]
}

/// Rooms, with facets small and large, concave, hidden, that reach past the eye.
fn rooms() -> [Enclosure; 4] {
    [box_of(DVec3::ONE, 1), box_of(DVec3::new(3.0, 2.0, 1.0), 4), room_with_block(2), l_shaped_room()]
}

#[test]
fn catalogue_92_cells_show_what_the_item_buffer_shows() {
    for look in [
        Look { resolution: 128, spin: Some(3), ..Look::default() },
        Look { resolution: 100, points: 2, spin: Some(1), ..Look::default() },
        Look { resolution: 256, ..Look::default() },
    ] {
        let gpu = HemicubeGpu::open(look).unwrap();
        for (number, room) in rooms().iter().enumerate() {
            let rows = (0..room.facets.len()).step_by(11).map(|from| compare(&gpu, from, room));
            let [cells, differ] = rows.fold([0; 2], |sum, row| [sum[0] + row[0], sum[1] + row[1]]);
            println!("{}, {} cells, room {number}: {differ} of {cells} differ", gpu.adapter(), look.resolution);
            assert!(differ * 500 < cells, "room {number}: {differ} of {cells}");
        }
    }
}

/// Rows are those of the hemicube within both errors, their own among them, and the method has its name in the table.
#[test]
fn catalogue_92_rows_are_those_of_the_hemicube() {
    let options =
        FormFactorOptions { look: Look { resolution: 128, points: 2, ..Look::default() }, ..Default::default() };
    for room in rooms() {
        let [a, b] = ["hemicube", "hemicube-gpu"].map(|name| {
            let method: FormFactorMethod = name.parse().unwrap();
            FormFactors::new(method, &room, &options, &()).unwrap()
        });
        for i in 0..a.len() {
            for (j, value, error) in b.row(i) {
                assert!((value - a.value(i, j)).abs() <= error.max(1e-12), "{i} {j}: {value} {}", a.value(i, j));
            }
        }
        // Rooms are closed, but for a few cells at edges that part on the lattice; one on the top weighs 8e-5 at most.
        let lost = b.row_sums().into_iter().map(|sum| (sum - 1.0).abs()).fold(0.0, f64::max);
        println!("rows lose {lost:.1e}");
        assert!(lost < 1e-3, "{lost}");
    }
}

/// Of a wall without thickness the front is seen, at any angle; nothing is seen of nothing.
#[test]
fn of_a_wall_without_thickness_hardware_shows_the_front() {
    let rectangle = |at: DVec3, u: DVec3, v: DVec3| Facet::new(vec![at, at + u, at + u + v, at + v]).unwrap();
    let mut walls = Enclosure::default();
    walls.add("floor", rectangle(DVec3::ZERO, DVec3::X, DVec3::Y));
    for k in 0..8 {
        let (sine, cosine) = (f64::from(k) * 0.4 + 0.1).sin_cos();
        let wall =
            rectangle(DVec3::new(0.5 + cosine, 0.5 + sine, 0.1), DVec3::new(0.7 * cosine, 0.9 * sine, 0.0), DVec3::Z);
        walls.add("back", wall.flipped());
        walls.add("front", wall);
    }
    let look = Look { resolution: 128, points: 2, spin: Some(1), ..Look::default() };
    let gpu = HemicubeGpu::open(look).unwrap();
    compare(&gpu, 0, &walls);
    let mut empty = Enclosure::default();
    empty.add("floor", rectangle(DVec3::ZERO, DVec3::X, DVec3::Y));
    let row = gpu.row(0, &empty);
    assert!((row.lost - 1.0).abs() < 1e-9 && row.factors[0].value == 0.0, "{row:?}");
}
