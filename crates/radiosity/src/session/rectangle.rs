//! The rectangle that a measuring grid has around a level surface, and the cells in it.
//!
//! The smallest rectangle around a surface has a side along an edge of its convex hull (Freeman and Shapira 1975); directions a
//! tenth of a degree apart are taken for one.

use glam::{DVec2, DVec3};
use std::collections::BTreeSet;

/// Largest cell of the standard, metres.
const LARGEST: f64 = 10.0;

/// Most cells: more take seconds, and nobody reads them. Halls of 100 m have 400.
const MOST_CELLS: f64 = 4000.0;

/// How many cells a plane with these sides has each way, and whether they are larger than the standard's.
pub fn cells(size: DVec2) -> ([usize; 2], bool) {
    let (longer, shorter) = (size.max_element(), size.min_element());
    let d = if longer >= 2.0 * shorter { shorter } else { longer };
    let p = (0.2 * 5f64.powf(d.log10())).min(LARGEST);
    // What is a whole number but for rounding is that number.
    let wanted = (size / p - 1e-9).ceil().max(DVec2::ONE);
    let share = (MOST_CELLS / (wanted.x * wanted.y)).sqrt().min(1.0);
    let counts = (share * wanted).floor().max(DVec2::ONE);
    // A sliver has one row, however many cells it may have along it.
    let counts = counts.min((MOST_CELLS / DVec2::new(counts.y, counts.x)).floor().max(DVec2::ONE));
    ([counts.x as usize, counts.y as usize], share < 1.0)
}

/// Axes of the smallest rectangle around a level surface.
pub fn axes_along(surface: &[[DVec3; 3]], normal: DVec3) -> [DVec3; 2] {
    let right = normal.any_orthonormal_vector();
    let sideways = [right, normal.cross(right)];
    let flat = |p: &DVec3| DVec2::new(p.dot(sideways[0]), p.dot(sideways[1]));
    let corners = hull(surface.iter().flatten().map(flat).collect());
    let mut tried = BTreeSet::new();
    let mut best = (f64::INFINITY, DVec2::X);
    for (k, from) in corners.iter().enumerate() {
        let u = (corners[(k + 1) % corners.len()] - *from).normalize_or_zero();
        // Edges that are a quarter turn apart have the same rectangle.
        let degrees = u.to_angle().to_degrees().rem_euclid(90.0);
        if u == DVec2::ZERO || !tried.insert((10.0 * degrees) as u32) {
            continue;
        }
        let [low, high] = extent(corners.iter().map(|p| DVec2::new(p.dot(u), u.perp_dot(*p))));
        let area = (high - low).x * (high - low).y;
        // By more than rounding.
        if area < (1.0 - 1e-9) * best.0 {
            best = (area, u);
        }
    }
    // Rows run as the first edge does, or as the next side to its right, so that a surface that is turned has the same rows.
    let first = surface.first().map_or(DVec2::X, |[a, b, _]| flat(&(*b - *a)));
    let mut u = best.1;
    let quarters = (u.angle_to(first) / std::f64::consts::FRAC_PI_2 + 0.25).floor();
    for _ in 0..quarters.rem_euclid(4.0) as u32 {
        u = u.perp();
    }
    [u, u.perp()].map(|axis| axis.x * sideways[0] + axis.y * sideways[1])
}

/// Corners of the convex hull, counter-clockwise (Andrew 1979).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let chain = |along: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in along {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(*p - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(*p);
        }
        // The other chain begins there.
        chain.pop();
        chain
    };
    let mut corners = chain(&mut points.iter());
    corners.extend(chain(&mut points.iter().rev()));
    corners
}

/// Lower and upper corner of what is around points.
pub fn extent(points: impl Iterator<Item = DVec2>) -> [DVec2; 2] {
    points.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

/// Whether a point lies in a triangle, whichever way that goes round.
pub fn is_within(p: DVec2, [a, b, c]: &[DVec2; 3]) -> bool {
    let sides = [(*b - *a).perp_dot(p - *a), (*c - *b).perp_dot(p - *b), (*a - *c).perp_dot(p - *c)];
    sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left between two zones may be a sliver, even one of rounding.
    #[test]
    fn slivers_have_no_more_cells_than_halls() {
        let lengths = || (-1600..=300).step_by(7).map(|tenths| 10f64.powf(f64::from(tenths) / 100.0));
        for x in lengths() {
            for y in lengths() {
                let ([columns, rows], is_coarse) = cells(DVec2::new(x, y));
                assert!((1..=MOST_CELLS as usize).contains(&(columns * rows)), "{x} m × {y} m: {columns} × {rows}");
                let cell = DVec2::new(x / columns as f64, y / rows as f64).max_element();
                let d = if x.max(y) >= 2.0 * x.min(y) { x.min(y) } else { x.max(y) };
                let p = (0.2 * 5f64.powf(d.log10())).min(LARGEST);
                assert!(is_coarse || cell <= p * (1.0 + 1e-6), "{x} m × {y} m: {cell} m, at most {p} m");
            }
        }
        assert_eq!(cells(DVec2::new(99.0, 1e-3)), ([4000, 1], true));
        assert_eq!(cells(DVec2::new(4e-16, 10.0)), ([1, 4000], true));
    }

    /// Points of many triangles within a rectangle that stands askew, two corners of it cut off: its axes, from the side along
    /// which the first edge runs.
    #[test]
    fn the_smallest_rectangle_is_that_of_the_hull() {
        let normal = DVec3::new(0.3, 1.0, -0.2).normalize();
        let right = normal.any_orthonormal_vector();
        for (k, angle) in [0.0, 0.3, 1.2, 2.9, 4.0, 6.0].into_iter().enumerate() {
            let (sine, cosine) = f64::sin_cos(angle);
            let axes = [cosine * right + sine * normal.cross(right), cosine * normal.cross(right) - sine * right];
            let at = |x: f64, y: f64| 5.0 * normal + x * axes[0] + y * axes[1];
            let mut surface = vec![[at(1.0, 0.0), at(7.0, 0.0), at(7.0, 2.5)]];
            surface.push([at(1.0, 0.0), at(7.0, 2.5), at(6.0, 3.0)]);
            surface.push([at(1.0, 0.0), at(6.0, 3.0), at(0.0, 3.0)]);
            surface.push([at(1.0, 0.0), at(0.0, 3.0), at(0.0, 0.5)]);
            // Edges within have directions of their own.
            let inner =
                |j: u32| (0.1 + 0.8 * f64::from(j * 37 % 101) / 101.0, 0.1 + 0.8 * f64::from(j * 53 % 97) / 97.0);
            let place = |j| at(6.0 * inner(j).0 + 0.3, 2.7 * inner(j).1 + 0.2);
            surface.extend((0..300).map(|j| [place(j), place(j + 1), place(j + 2)]));
            let found = axes_along(&surface, normal);
            assert!((0..2).all(|k| found[k].distance(axes[k]) < 1e-12), "{k}: {found:?}, not {axes:?}");
        }
    }
}
