//! Sillion's single plane: one square parallel to the facet at height h, half as wide as w = d h (Sillion and Puech 1989,
//! "A general two-pass method integrating specular and diffuse reflection", SIGGRAPH; catalogue 25).
//!
//! ΔF = ΔA/(π(1 + x² + y²)²), x and y in units of h. What lies below the rim is missed: the plane captures
//! (4/π)(d/√(1+d²)) atan(d/√(1+d²)) of the hemisphere, 99 % with d = 9. The published remark that grazing facets
//! contribute little becomes a number here, and is repaired by dividing by it (right if what lies below the rim is like
//! the rest), or by four sides below the rim, which make the plane a flat hemicube. Cells are as wide at the rim as in
//! the middle; the outer ones weigh d⁻⁴ of the inner ones, so most are wasted on a plane of uniform cells. One that adapts
//! (as published) divides its cells down to the same size only where polygons differ (`warnock`): the same row, but for
//! rounding, of fewer looks.

use super::face::Face;
use super::glance::Scratch;
use super::hemicube::side;
use super::look::{Gaze, Look};
use super::surface::{Atlas, Fill, Projection};
use super::view::View;
use super::warnock::LookUps;
use glam::DVec3;
use radiosity_scene::Enclosure;

/// The single plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SinglePlane {
    /// How it is looked at; `resolution` is that of the plane.
    pub look: Look,
    /// d: half the width over the height above the facet, finite and above zero.
    half_width: f64,
    /// Sides close the gap between rim and horizon.
    pub sides: bool,
    /// Factors are divided by the share of the hemisphere that is captured.
    pub renormalise: bool,
    /// Cells are divided where polygons differ, down to `resolution`, instead of everywhere: the same row, but for rounding.
    pub adaptive: bool,
}

/// A half width that makes no plane.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("a single plane is not {0} times as wide as it is high: use a finite number above 0")]
pub struct HalfWidthError(pub f64);

/// Half a width of 9 captures 99.0 %; twice that 99.8 %, at a quarter of the cells per solid angle.
impl Default for SinglePlane {
    fn default() -> SinglePlane {
        SinglePlane { look: Look::default(), half_width: 9.0, sides: false, renormalise: false, adaptive: false }
    }
}

impl SinglePlane {
    /// The default plane, looked at in a way.
    pub fn new(look: Look) -> SinglePlane {
        SinglePlane { look, ..SinglePlane::default() }
    }

    /// The same with cells that adapt.
    pub fn adapting(self) -> SinglePlane {
        SinglePlane { adaptive: true, ..self }
    }

    /// The same with another d: half the width over the height above the facet.
    ///
    /// # Errors
    /// [`HalfWidthError`] for what makes no plane: zero, less, or no finite number.
    pub fn with_half_width(self, half_width: f64) -> Result<SinglePlane, HalfWidthError> {
        let is_plane = half_width.is_finite() && half_width > 0.0;
        if is_plane { Ok(SinglePlane { half_width, ..self }) } else { Err(HalfWidthError(half_width)) }
    }

    /// d: half the width over the height above the facet.
    pub fn half_width(&self) -> f64 {
        self.half_width
    }

    /// How much looking the row of facet `from` takes, its predicted errors included.
    pub fn look_ups(&self, from: usize, enclosure: &Enclosure) -> LookUps {
        let (atlas, view, mut scratch) = (Atlas::new(self), View::new(enclosure), Scratch::default());
        Gaze::new(&atlas, &view, from, &mut scratch).row();
        scratch.look_ups
    }

    /// Share of the hemisphere that the plane alone takes in.
    pub fn captured_by_plane(&self) -> f64 {
        // d/√(1+d²), written so that no square overflows.
        let s = 1.0 / (1.0 / self.half_width).hypot(1.0);
        4.0 / std::f64::consts::PI * s * s.atan()
    }
}

impl Projection for SinglePlane {
    fn look(&self) -> Look {
        self.look
    }

    fn faces(&self, n: usize) -> Vec<Face> {
        let d = self.half_width;
        let mut faces = vec![Face { frame: [DVec3::X, DVec3::Y, DVec3::Z], window: [-d, d, -d, d], cells: [n, n] }];
        if self.sides {
            let rows = ((n as f64 / (2.0 * d)).ceil() as usize).clamp(2, 4 * n);
            faces.extend([DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y].map(|forward| Face {
                frame: side(forward),
                window: [-1.0, 1.0, 0.0, 1.0 / d],
                cells: [n, rows],
            }));
        }
        faces
    }

    fn fill(&self) -> Fill<'_> {
        if self.adaptive { Fill::Windows } else { Fill::Cells }
    }

    fn captured(&self) -> f64 {
        if self.sides { 1.0 } else { self.captured_by_plane() }
    }

    fn renormalises(&self) -> bool {
        self.renormalise && !self.sides
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Row;
    use crate::row::tests::{ADJACENT, box_of, l_shaped_room, room_with_block};

    /// Catalogue 25: the share that is captured, by the formula and by the cells.
    #[test]
    fn catalogue_25_the_plane_says_what_it_captures() {
        let shares =
            [(1.0, 0.5541), (2.0, 0.8310), (4.0, 0.9514), (7.0, 0.9836), (9.0, 0.9900), (10.0, 0.9919), (14.0, 0.9958)];
        for (half_width, share) in shares.into_iter().chain([(28.6, 0.9990)]) {
            let plane = SinglePlane { half_width, ..SinglePlane::default() };
            let face = &plane.faces(64)[0];
            let cells: f64 = face.weights(&face.vectors(Default::default()), DVec3::Z).iter().sum();
            assert!((plane.captured_by_plane() - share).abs() < 1e-4, "{half_width}");
            assert!((plane.captured_by_plane() - cells).abs() < 1e-12, "{half_width}");
        }
    }

    /// Zero and what is no number were taken for the default.
    #[test]
    fn widths_that_make_no_plane_are_refused() {
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(SinglePlane::default().with_half_width(wrong).is_err(), "{wrong}");
        }
        assert_eq!(SinglePlane::default().with_half_width(3.0).map(|plane| plane.half_width()), Ok(3.0));
    }

    /// In a cube the plane misses only what lies below its rim, says so, and may be completed in either way.
    #[test]
    fn catalogue_25_what_is_missed_is_reported_and_repaired() {
        let cube = box_of(DVec3::ONE, 1);
        let look = Look { resolution: 256, points: 4, ..Look::default() };
        let plane = SinglePlane { look, half_width: 2.0, ..SinglePlane::default() };
        let row = plane.row(0, &cube);
        let sum: f64 = row.factors.iter().map(|f| f.value).sum();
        assert!((row.captured - 0.8310).abs() < 1e-4 && (sum - row.captured).abs() < 1e-9 && row.lost == 0.0);
        // What is missed is missed at the walls.
        let off = |row: &crate::RowFactors| (row.factors[2].value - ADJACENT).abs();
        assert!(off(&row) > 0.03 && off(&row) < row.factors[2].error, "{row:?}");

        let scaled = SinglePlane { renormalise: true, ..plane }.row(0, &cube);
        let sum: f64 = scaled.factors.iter().map(|f| f.value).sum();
        assert!((sum - 1.0).abs() < 1e-9 && off(&scaled) < scaled.factors[2].error, "{scaled:?}");
        let closed = SinglePlane { sides: true, ..plane }.row(0, &cube);
        let sum: f64 = closed.factors.iter().map(|f| f.value).sum();
        assert!((sum - 1.0).abs() < 1e-9 && closed.captured > 0.999_999, "{closed:?}");
        assert!(off(&closed) < 0.01 && off(&closed) < closed.factors[2].error, "{closed:?}");
    }

    /// Every cell shows the same with windows as with uniform cells, so rows are the same but for rounding, errors included,
    /// of facets large and small, concave, hidden, with the edges of walls through the centres of cells.
    #[test]
    fn catalogue_25_cells_that_adapt_give_the_same_rows() {
        let look = Look { resolution: 256, ..Look::default() };
        let turned = Look { resolution: 100, points: 2, spin: Some(1), ..Look::default() };
        let rooms = [box_of(DVec3::ONE, 1), box_of(DVec3::new(3.0, 2.0, 1.0), 4), room_with_block(2), l_shaped_room()];
        for (look, sides) in [(look, false), (look, true), (turned, false)] {
            let plane = SinglePlane { sides, ..SinglePlane::new(look) };
            for (number, room) in rooms.iter().enumerate() {
                for from in (0..room.facets.len()).step_by(7) {
                    let [cells, adapted] = [plane, plane.adapting()].map(|plane| plane.row(from, room));
                    for (j, (a, b)) in cells.factors.iter().zip(&adapted.factors).enumerate() {
                        let off = (a.value - b.value).abs().max((a.error - b.error).abs());
                        assert!(off < 1e-12, "room {number}, {from} to {j}: {a:?} {b:?}");
                    }
                    assert!((cells.lost - adapted.lost).abs() < 1e-12 && cells.captured == adapted.captured);
                }
            }
        }
    }

    /// What is saved grows with the resolution, as windows are as many as cells along edges: past a block in a room, 10 times
    /// fewer places are looked at with 256² cells, and 38 times fewer with 1024²; questions are 4 and 17 times fewer.
    #[test]
    fn catalogue_25_cells_that_adapt_look_less_often() {
        let room = room_with_block(2);
        let looks = |resolution: usize| {
            let plane = SinglePlane::new(Look { resolution, ..Look::default() });
            [plane, plane.adapting()].map(|plane| plane.look_ups(0, &room))
        };
        let mut before = looks(128)[1].places;
        for (resolution, fewer, questions) in [(256, 10.0, 4.0), (512, 19.0, 8.0), (1024, 37.0, 17.0)] {
            let [cells, adapted] = looks(resolution);
            let ratio = |a: u64, b: u64| a as f64 / b as f64;
            assert!(ratio(cells.places, adapted.places) > fewer, "{resolution}: {cells:?} {adapted:?}");
            assert!(ratio(cells.tests, adapted.tests) > questions, "{resolution}: {cells:?} {adapted:?}");
            assert!(ratio(adapted.places, before) < 2.3, "{resolution}: {adapted:?}");
            before = adapted.places;
        }
    }
}
