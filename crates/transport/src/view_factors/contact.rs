//! Where bodies touch: what of a facet lies in the face of another body sees nothing.
//!
//! Facets that lie in one plane and face away from each other are the two sides of a sheet, or faces of two bodies that touch. Where they
//! touch, each looks into the other body and sees the backs of its faces. But where that touches a third one, faces lie in one plane again, and
//! which of them comes first is a matter of rounding: a book would light the bracket through the board that it stands on. So what is covered is
//! left out. That it is, and no sheet, rays tell: all that do not end where faces lie in one plane meet backs. Bodies with gaps cover
//! nothing, nor do those that others go through. A plane with n facets on either side takes n² comparisons of boxes at worst.

use super::panel::{Planes, convex_pieces};
use crate::flat::{Contour, Flat, Shape, shape_area, twice_area};
use crate::pair::blockers::is_inside;
use crate::row::around::Around;
use crate::row::points::is_coplanar;
use glam::DVec3;
use i_triangle::i_overlay::core::fill_rule::FillRule;
use i_triangle::i_overlay::core::overlay_rule::OverlayRule;
use i_triangle::i_overlay::float::single::SingleFloatOverlay;
use radiosity_scene::{Enclosure, Facet};
use radiosity_trace::sampling::{Sequence, cosine_direction, frame};
use rayon::prelude::*;

/// Overlap that counts as none, relative to the facet's area: what rounding leaves of edges that meet, and far below any accuracy.
const SLIVER: f64 = 1e-6;

/// Rays from each place that tell whether an overlap is covered, and its convex pieces, the largest first, from whose middles they start. A
/// sheet in a room sees a front with nearly all of them.
const LOOKS: u32 = 32;
const PIECES: usize = 3;

/// The stream of their directions.
const STREAM: u32 = 0x0203;

/// What is not covered of facets, as convex polygons; none of those that are exposed as a whole.
pub fn exposed(enclosure: &Enclosure, planes: &mut Planes, touch: f64) -> Vec<Option<Vec<Facet>>> {
    let facets = &enclosure.facets;
    let opposed = opposed(enclosure, planes);
    if opposed.iter().all(Vec::is_empty) {
        return vec![None; facets.len()];
    }
    let around = Around::new(enclosure);
    let left = |(own, others): (&Facet, &Vec<usize>)| {
        let flat = Flat::new(own.normal(), own.corners()[0]);
        let outline = outline_of(&flat, own).0;
        let (mut covered, mut before): (Vec<Shape>, Vec<Outline>) = (Vec::new(), Vec::new());
        for (other, bounds) in others.iter().map(|other| outline_of(&flat, &facets[*other])) {
            // What several lie over is judged by the smallest: below a box that stands on a rug by the box.
            let smaller = before.iter().filter(|(_, smaller)| overlap(*smaller, bounds));
            let smaller: Vec<Contour> = smaller.map(|(outline, _)| outline.clone()).collect();
            let mut shapes = outline.overlay_as::<i64>(&other, OverlayRule::Intersect, FillRule::NonZero);
            if !smaller.is_empty() {
                shapes = shapes.overlay_as::<i64>(&smaller, OverlayRule::Difference, FillRule::NonZero);
            }
            before.push((other, bounds));
            let is_covered = |shape: &Shape| {
                let mut pieces = convex_pieces(vec![shape.clone()], touch);
                pieces.sort_by(|a, b| twice_area(b).total_cmp(&twice_area(a)));
                let middle = |piece: &Contour| piece.iter().map(|p| flat.back(*p)).sum::<DVec3>() / piece.len() as f64;
                let mut middles = pieces.iter().take(PIECES).map(middle).peekable();
                middles.peek().is_some() && middles.all(|place| looks_into_a_body(&around, &opposed, own, place))
            };
            covered.extend(shapes.into_iter().filter(|s| shape_area(s) > SLIVER * own.area()).filter(is_covered));
        }
        if covered.is_empty() {
            return None;
        }
        let left = outline.overlay_as::<i64>(&covered, OverlayRule::Difference, FillRule::NonZero);
        let pieces = convex_pieces(left, touch).into_iter().filter(|p| twice_area(p) > 2.0 * SLIVER * own.area());
        let facet = |piece: Contour| Facet::new(piece.iter().map(|p| flat.back(*p)).collect()).ok();
        let along = |facet: Facet| if facet.normal().dot(own.normal()) < 0.0 { facet.flipped() } else { facet };
        Some(pieces.filter_map(facet).map(along).collect())
    };
    facets.par_iter().zip(&opposed).map(left).collect()
}

/// Of each facet those of its plane that face the other way and lie over a part of it, the smallest first.
fn opposed(enclosure: &Enclosure, planes: &mut Planes) -> Vec<Vec<usize>> {
    let facets = &enclosure.facets;
    let mut sides: Vec<[Vec<usize>; 2]> = Vec::new();
    for (k, facet) in facets.iter().enumerate() {
        let (plane, along) = planes.find(facet);
        sides.resize_with(planes.len(), Default::default);
        sides[plane as usize][usize::from(along)].push(k);
    }
    let mut opposed = vec![Vec::new(); facets.len()];
    for (plane, sides) in sides.iter().enumerate() {
        if sides.iter().any(Vec::is_empty) {
            continue;
        }
        let flat = Flat::new(planes.plane(plane as u32).0, facets[sides[0][0]].corners()[0]);
        let [own, mut others] = sides
            .each_ref()
            .map(|side| side.iter().map(|facet| (*facet, outline_of(&flat, &facets[*facet]))).collect::<Vec<_>>());
        others.sort_by(|(_, (_, [a, _])), (_, (_, [b, _]))| a[0].total_cmp(&b[0]));
        for (facet, (outline, bounds)) in own {
            let near = others.iter().take_while(|(_, (_, [low, _]))| low[0] < bounds[1][0]);
            for (other, (contour, _)) in near.filter(|(_, (_, other))| overlap(bounds, *other)) {
                let shapes = outline.overlay_as::<i64>(contour, OverlayRule::Intersect, FillRule::NonZero);
                let area: f64 = shapes.iter().map(shape_area).sum();
                if area > SLIVER * facets[facet].area().min(facets[*other].area()) {
                    opposed[facet].push(*other);
                    opposed[*other].push(facet);
                }
            }
        }
    }
    for others in &mut opposed {
        others.sort_by(|a, b| facets[*a].area().total_cmp(&facets[*b].area()).then(a.cmp(b)));
    }
    opposed
}

/// Whether all that rays from a place on a facet tell is that they meet backs.
fn looks_into_a_body(around: &Around, opposed: &[Vec<usize>], own: &Facet, place: DVec3) -> bool {
    let facets = &around.enclosure.facets;
    let is_own = |facet: usize| is_coplanar(own, facets[facet].corners().iter().copied());
    let (frame, sequence) = (frame(own.normal()), Sequence::new(0, STREAM));
    let mut backs = 0;
    for index in 0..LOOKS {
        let [u, v, ..] = sequence.point(index).map(f64::from);
        let direction = cosine_direction(&frame, u, v);
        let Some((facet, hit)) = around.first(place, direction, is_own) else { return false };
        let end = place + f64::from(hit.t) * direction;
        let lies_over =
            || opposed.get(facet).is_some_and(|over| over.iter().any(|other| is_inside(&facets[*other], end)));
        match hit.back {
            true => backs += 1,
            false if lies_over() => {}
            false => return false,
        }
    }
    backs > 0
}

/// A polygon, counter-clockwise, and the lowest and highest coordinates of its corners.
type Outline = (Contour, [[f64; 2]; 2]);

fn outline_of(flat: &Flat, facet: &Facet) -> Outline {
    let mut outline: Contour = facet.corners().iter().map(|corner| flat.flat(*corner)).collect();
    if twice_area(&outline) < 0.0 {
        outline.reverse();
    }
    let bounds = outline.iter().fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
        [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
    });
    (outline, bounds)
}

fn overlap([low, high]: [[f64; 2]; 2], [other_low, other_high]: [[f64; 2]; 2]) -> bool {
    (0..2).all(|axis| low[axis] < other_high[axis] && other_low[axis] < high[axis])
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

    /// Both sides of a sheet in a room see it, but for what a box covers that stands on its middle.
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
        add_box(&mut enclosure, DVec3::new(1.3, 1.3, 1.5), DVec3::new(1.7, 1.7, 2.0));
        let exposed = found(&enclosure);
        let cut: Vec<usize> = (0..14).filter(|k| exposed[*k].is_some()).collect();
        assert_eq!(cut, [6], "the box's base looks at the room through the sheet");
        let area: f64 = exposed[6].iter().flatten().map(Facet::area).sum();
        assert!((area - (1.0 - 0.16)).abs() < 1e-9, "{area}");
    }

    /// A wall without thickness between two rooms, and a body that stands at its middle on one side.
    #[test]
    fn walls_between_rooms_are_not_covered() {
        let mut enclosure = Enclosure::default();
        add_box(&mut enclosure, DVec3::ZERO, DVec3::splat(3.0));
        add_box(&mut enclosure, DVec3::X * 3.0, DVec3::new(6.0, 3.0, 3.0));
        enclosure.facets.iter_mut().for_each(|facet| *facet = facet.flipped());
        add_box(&mut enclosure, DVec3::new(2.5, 1.0, 1.0), DVec3::new(3.0, 2.0, 2.0));
        let exposed = found(&enclosure);
        let cut: Vec<usize> = (0..18).filter(|k| exposed[*k].is_some()).collect();
        assert_eq!(cut, [3]);
        let area: f64 = exposed[3].iter().flatten().map(Facet::area).sum();
        assert!((area - 8.0).abs() < 1e-9, "{area}");
    }
}
