//! Where bodies touch: what of a facet lies in the face of another body sees nothing.
//!
//! Facets that lie in one plane and face away from each other are the two sides of a sheet, or faces of two bodies that touch. Where they
//! touch, each looks into the other body and sees the backs of its faces. But where that touches a third one, faces lie in one plane again, and which
//! of them comes first is a matter of rounding: a book would light the bracket through the board that it stands on. So what is covered is left out. That it is, and
//! no sheet, rays tell: all that do not end on such faces meet backs.

use super::panel::{Planes, convex_pieces};
use crate::row::around::Around;
use crate::row::points::is_coplanar;
use glam::DVec3;
use i_triangle::i_overlay::core::fill_rule::FillRule;
use i_triangle::i_overlay::core::overlay_rule::OverlayRule;
use i_triangle::i_overlay::float::single::SingleFloatOverlay;
use radiosity_scene::{Enclosure, Facet};
use radiosity_trace::sampling::{Sequence, cosine_direction, frame};

/// Overlap that counts as none, relative to the facet's area.
const SLIVER: f64 = 1e-6;

/// Rays that tell whether an overlap is covered.
const RAYS: u32 = 32;

/// The stream of their directions.
const STREAM: u32 = 0x0203;

/// A polygon in a plane's own coordinates, and polygons with holes.
type Contour = Vec<[f64; 2]>;
type Shapes = Vec<Vec<Contour>>;

/// What is not covered of facets, as convex polygons; none of those that are exposed as a whole.
pub fn exposed(enclosure: &Enclosure, planes: &mut Planes, touch: f64) -> Vec<Option<Vec<Facet>>> {
    let mut sides: Vec<[Vec<usize>; 2]> = Vec::new();
    for (k, facet) in enclosure.facets.iter().enumerate() {
        let (plane, along) = planes.find(facet);
        sides.resize_with(planes.len(), Default::default);
        sides[plane as usize][usize::from(along)].push(k);
    }
    let mut overlaps: Vec<(usize, Flat, Shapes)> = Vec::new();
    let both = |[against, along]: &[Vec<usize>; 2]| !against.is_empty() && !along.is_empty();
    for (plane, [against, along]) in sides.iter().enumerate().filter(|(_, sides)| both(sides)) {
        for (own, others) in [(against, along), (along, against)] {
            let flat = Flat::new(planes.plane(plane as u32));
            let outlines = |of: &[usize]| of.iter().map(|k| flat.outline(&enclosure.facets[*k])).collect::<Vec<_>>();
            let (outlines, others) = (outlines(own), outlines(others));
            for (facet, (outline, bounds)) in own.iter().zip(&outlines) {
                let near = others.iter().filter(|(_, other)| meet(*bounds, *other));
                let near: Vec<Contour> = near.map(|(outline, _)| outline.clone()).collect();
                if near.is_empty() {
                    continue;
                }
                let mut shapes = outline.overlay_as::<i64>(&near, OverlayRule::Intersect, FillRule::NonZero);
                shapes.retain(|shape| area(shape) > SLIVER * enclosure.facets[*facet].area());
                if !shapes.is_empty() {
                    overlaps.push((*facet, flat, shapes));
                }
            }
        }
    }
    let mut exposed = vec![None; enclosure.facets.len()];
    if overlaps.is_empty() {
        return exposed;
    }
    let around = Around::new(enclosure);
    let mut has_twin = vec![false; enclosure.facets.len()];
    overlaps.iter().for_each(|(facet, ..)| has_twin[*facet] = true);
    for (facet, flat, mut shapes) in overlaps {
        let own = &enclosure.facets[facet];
        shapes.retain(|shape| {
            let pieces = convex_pieces(vec![shape.clone()], touch);
            let largest = pieces.iter().max_by(|a, b| twice_area(a).total_cmp(&twice_area(b)));
            largest.is_some_and(|piece| looks_into_a_body(&around, &has_twin, own, flat.middle(piece)))
        });
        if !shapes.is_empty() {
            let (outline, _) = flat.outline(own);
            let left = outline.overlay_as::<i64>(&shapes, OverlayRule::Difference, FillRule::NonZero);
            let pieces = convex_pieces(left, touch).into_iter().filter(|p| twice_area(p) > 2.0 * SLIVER * own.area());
            exposed[facet] = Some(pieces.filter_map(|piece| flat.facet(&piece, own.normal())).collect());
        }
    }
    exposed
}

/// Whether all that rays from a place on a facet tell is that they meet backs.
fn looks_into_a_body(around: &Around, has_twin: &[bool], own: &Facet, place: DVec3) -> bool {
    let is_own = |facet: usize| is_coplanar(own, around.enclosure.facets[facet].corners().iter().copied());
    let frame = frame(own.normal());
    let sequence = Sequence::new(0, STREAM);
    let mut backs = 0;
    for index in 0..RAYS {
        let [u, v, ..] = sequence.point(index).map(f64::from);
        match around.first(place, cosine_direction(&frame, u, v), is_own) {
            Some((_, hit)) if hit.back => backs += 1,
            Some((facet, _)) if has_twin.get(facet).copied().unwrap_or(false) => {}
            _ => return false,
        }
    }
    backs > 0
}

/// Coordinates in a plane.
#[derive(Clone, Copy)]
struct Flat {
    origin: DVec3,
    axes: [DVec3; 2],
}

impl Flat {
    fn new((normal, offset): (DVec3, f64)) -> Flat {
        let (x, y) = normal.any_orthonormal_pair();
        Flat { origin: offset * normal, axes: [x, y] }
    }

    /// A facet's corners, counter-clockwise, and the box around them.
    fn outline(&self, facet: &Facet) -> (Contour, [[f64; 2]; 2]) {
        let flat = |p: &DVec3| self.axes.map(|axis| axis.dot(*p - self.origin));
        let mut outline: Contour = facet.corners().iter().map(flat).collect();
        if twice_area(&outline) < 0.0 {
            outline.reverse();
        }
        let bounds = outline.iter().fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
            [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
        });
        (outline, bounds)
    }

    fn place(&self, [x, y]: [f64; 2]) -> DVec3 {
        self.origin + x * self.axes[0] + y * self.axes[1]
    }

    fn middle(&self, polygon: &Contour) -> DVec3 {
        polygon.iter().map(|p| self.place(*p)).sum::<DVec3>() / polygon.len() as f64
    }

    /// A polygon as a facet with this normal; none if it has no area.
    fn facet(&self, polygon: &Contour, normal: DVec3) -> Option<Facet> {
        let facet = Facet::new(polygon.iter().map(|p| self.place(*p)).collect()).ok()?;
        Some(if facet.normal().dot(normal) < 0.0 { facet.flipped() } else { facet })
    }
}

fn meet([low, high]: [[f64; 2]; 2], [other_low, other_high]: [[f64; 2]; 2]) -> bool {
    (0..2).all(|axis| low[axis] < other_high[axis] && other_low[axis] < high[axis])
}

/// Twice the area of a polygon, negative if it goes clockwise.
fn twice_area(polygon: &Contour) -> f64 {
    let n = polygon.len();
    (0..n).map(|i| (polygon[i], polygon[(i + 1) % n])).map(|([a, b], [c, d])| a * d - b * c).sum()
}

/// The area of an outline less its holes.
fn area(shape: &[Contour]) -> f64 {
    0.5 * shape.iter().map(twice_area).sum::<f64>()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::view_factors::{ViewFactorOptions, view_factors};

    /// A closed box, faces outwards.
    pub fn add_box(enclosure: &mut Enclosure, low: DVec3, high: DVec3) {
        let size = high - low;
        let [x, y, z] = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
        for [corner, u, v] in [[low, y, x], [low + z, x, y], [low, z, y], [low + x, y, z], [low, x, z], [low + y, z, x]]
        {
            enclosure.add("", Facet::new(vec![corner, corner + u, corner + u + v, corner + v]).unwrap());
        }
    }

    fn found(enclosure: &Enclosure) -> Vec<Option<Vec<Facet>>> {
        exposed(enclosure, &mut Planes::new(10.0, 5e-6), 5e-6)
    }

    /// A book on a board, whose end touches a wall: the book's base and what of the wall the board's end covers see nothing, and what the
    /// book covers of the board.
    #[test]
    fn what_bodies_cover_is_left_out() {
        let mut enclosure = Enclosure::default();
        add_box(&mut enclosure, DVec3::ZERO, DVec3::new(2.0, 0.5, 0.1));
        add_box(&mut enclosure, DVec3::new(0.5, 0.1, 0.1), DVec3::new(1.0, 0.4, 0.6));
        add_box(&mut enclosure, DVec3::new(2.0, -1.0, -1.0), DVec3::new(3.0, 1.0, 1.0));
        let exposed = found(&enclosure);
        let area = |k: usize| exposed[k].as_ref().map(|pieces| pieces.iter().map(Facet::area).sum::<f64>());
        let covered: Vec<usize> = (0..18).filter(|k| exposed[*k].is_some()).collect();
        assert_eq!(covered, [1, 3, 6, 14], "the board's top and end, the book's base, the wall");
        for (k, left) in [(1, 1.0 - 0.15), (3, 0.0), (6, 0.0), (14, 4.0 - 0.05)] {
            assert!((area(k).unwrap() - left).abs() < 1e-9, "{k}: {:?}", area(k));
        }
        let factors = view_factors(&enclosure, &ViewFactorOptions::default(), &()).unwrap();
        assert_eq!((factors.factor(6, 14).value, factors.row_sums()[6]), (0.0, 0.0));
        assert!(factors.factor(10, 14).value > 0.0 || factors.factor(9, 14).value > 0.0);
    }

    /// Both sides of a sheet in a room see it, and are seen.
    #[test]
    fn sheets_are_not_covered() {
        let mut enclosure = Enclosure::default();
        add_box(&mut enclosure, DVec3::ZERO, DVec3::splat(3.0));
        enclosure.facets.iter_mut().for_each(|facet| *facet = facet.flipped());
        let sheet = [[1., 1.], [2., 1.], [2., 2.], [1., 2.]].map(|[x, y]| DVec3::new(x, y, 1.5));
        let sheet = Facet::new(sheet.to_vec()).unwrap();
        enclosure.add("", sheet.clone());
        enclosure.add("", sheet.flipped());
        assert!(found(&enclosure).iter().all(Option::is_none));
    }
}
