//! What a plane is within a cell: wall, opening, or nobody's place.
//!
//! Panels that go through the plane part its cross-section into *fields*, as the outlines of rooms part a plan. In each
//! field the panels that lie in the plane are wall, the rest is open. Space from which no front of a facet is seen
//! (solid walls, furniture, the outside of a building) is nobody's, and an opening needs somebody on both sides.

use super::polygon::{Place, Plane, area, middle};
use crate::flat::{Contour, Flat, Shape, shape_area, twice_area};
use crate::view_factors::convex_pieces;
use glam::{DVec2, DVec3, Vec3};
use i_triangle::i_overlay::core::fill_rule::FillRule;
use i_triangle::i_overlay::core::overlay_rule::OverlayRule;
use i_triangle::i_overlay::float::single::SingleFloatOverlay;
use radiosity_scene::Enclosure;
use radiosity_trace::{Ray, Tree};

/// Rays to either side of an opening that look for a front of a facet. A place that sees none with 64 sees fronts in
/// some 5 % of its directions at most; in what is not sealed it sees half its surroundings, and more rays find no more.
const LOOKS: usize = 64;

/// An opening of a plane, in convex polygons, counter-clockwise about the plane's normal.
#[derive(Clone, Debug)]
pub struct Opening {
    pub polygons: Vec<Vec<DVec3>>,
    /// More of its field is open than wall: here the plane only goes through a room.
    pub is_soft: bool,
}

/// A plane within a cell.
#[derive(Clone, Debug, Default)]
pub struct Section {
    pub openings: Vec<Opening>,
    /// Area of the openings, m².
    pub open: f64,
    /// Area of the walls, m².
    pub wall: f64,
}

/// What is seen from a place: fronts of facets, or none.
pub struct Space {
    tree: Tree,
    /// Triangles from this on belong to obstructions.
    fronts: u32,
    is_closed: bool,
    pub touch: f64,
    /// The box around everything.
    pub bounds: [DVec3; 2],
}

impl Space {
    pub fn new(enclosure: &Enclosure, bounds: [DVec3; 2], touch: f64) -> Space {
        let mut triangles: Vec<[Vec3; 3]> = Vec::new();
        let mut fronts = 0;
        for (i, facet) in enclosure.facets.iter().chain(&enclosure.obstructions).enumerate() {
            triangles.extend(facet.triangles().into_iter().map(|t| t.map(|c| c.as_vec3())));
            if i < enclosure.facets.len() {
                fronts = triangles.len() as u32;
            }
        }
        Space { tree: Tree::new(&triangles), fronts, is_closed: enclosure.is_closed, touch, bounds }
    }

    /// Whether a front is seen, or may be, for what looks past everything in an open scene proves nothing, from `point`, looking to the side of `normal`.
    fn sees_a_front(&self, point: DVec3, normal: DVec3) -> bool {
        let (x, y) = normal.any_orthonormal_pair();
        let origin = (point + 2.0 * self.touch * normal).as_vec3();
        (0..LOOKS).any(|k| {
            // A spiral of equal steps in height and the golden angle: even over the hemisphere.
            let z = (k as f64 + 0.5) / LOOKS as f64;
            let (sin, cos) = (2.399_963_229_728_653 * k as f64).sin_cos();
            let direction = (z * normal + (1.0 - z * z).sqrt() * (cos * x + sin * y)).normalize().as_vec3();
            let ray = Ray { origin, direction, t_max: f32::INFINITY, skip: u32::MAX };
            match self.tree.closest(&ray) {
                Some(hit) => !hit.back && hit.triangle < self.fronts,
                None => !self.is_closed,
            }
        })
    }
}

/// Coordinates in a plane about the place on it that is nearest to another.
fn on(plane: &Plane, near: DVec3) -> Flat {
    Flat::new(plane.normal, near - plane.height(near) * plane.normal)
}

/// Panels as a plane meets them.
#[derive(Default)]
struct Met {
    /// Those that lie in it, counter-clockwise.
    walls: Vec<Contour>,
    /// Lines along which others go through it.
    through: Vec<Contour>,
    /// Lines along which others end at it.
    ends: Vec<Contour>,
}

impl Met {
    fn new<'a>(plane: &Plane, flat: &Flat, panels: impl Iterator<Item = &'a [DVec3]>, touch: f64) -> Met {
        let mut met = Met::default();
        for corners in panels {
            match plane.place(corners, touch) {
                Place::Within => {
                    let mut contour: Contour = corners.iter().map(|c| flat.flat(*c)).collect();
                    if twice_area(&contour) < 0.0 {
                        contour.reverse();
                    }
                    met.walls.push(contour);
                }
                Place::Across => met.through.extend(line(plane, flat, corners, touch)),
                _ => met.ends.extend(line(plane, flat, corners, touch)),
            }
        }
        met
    }
}

/// The line in which a polygon meets a plane; a little longer, so that lines that meet in a corner do.
fn line(plane: &Plane, flat: &Flat, corners: &[DVec3], touch: f64) -> Option<Contour> {
    let n = corners.len();
    let mut points: Vec<DVec3> = Vec::new();
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % n];
        let (at, next) = (plane.height(*a), plane.height(b));
        if at.abs() <= touch {
            points.push(*a);
        } else if next.abs() > touch && at * next < 0.0 {
            points.push(*a + (b - *a) * (at / (at - next)));
        }
    }
    let start = *points.first()?;
    let farthest = |from: DVec3| {
        points
            .iter()
            .copied()
            .fold(from, |far, p| if p.distance_squared(from) > far.distance_squared(from) { p } else { far })
    };
    let a = farthest(start);
    let b = farthest(a);
    let along = (b - a).normalize_or_zero() * (4.0 * touch);
    (a.distance(b) > touch).then(|| vec![flat.flat(a - along), flat.flat(b + along)])
}

/// Half the width of a line, relative to `touch`: far above the rounding of coordinates, far below what is known of
/// them.
const LINE: f64 = 0.01;

/// The shapes between lines, which are given a width and cut out: slicing by lines would lose loops that do not reach
/// the rim of a shape.
fn between(shapes: Vec<Shape>, lines: &[Contour], touch: f64) -> Vec<Shape> {
    let near: Vec<&Contour> = lines.iter().filter(|line| shapes.iter().any(|shape| overlap(shape, line))).collect();
    if near.is_empty() || shapes.is_empty() {
        return shapes;
    }
    let width = LINE * touch;
    let strip = |line: &&Contour| -> Contour {
        let [a, b] = [line[0], line[1]].map(DVec2::from);
        let beside = width * (b - a).normalize_or_zero().perp();
        [a - beside, b - beside, b + beside, a + beside].map(|p| p.to_array()).into()
    };
    let strips: Vec<Contour> = near.iter().map(strip).collect();
    let mut left = shapes.overlay_as::<i64>(&strips, OverlayRule::Difference, FillRule::NonZero);
    for shape in &mut left {
        shape.iter_mut().for_each(|contour| tidy(contour, 8.0 * width));
        shape.retain(|contour| contour.len() >= 3);
    }
    left.retain(|shape| !shape.is_empty());
    left
}

/// Closes slits narrower than `width`, which lines leave that end within a shape.
fn tidy(contour: &mut Contour, width: f64) {
    let is_near = |a: [f64; 2], b: [f64; 2]| DVec2::from(a).distance(DVec2::from(b)) <= width;
    // Twice, from different corners, for a slit may lie where the contour begins.
    for _ in 0..2 {
        let mut kept: Contour = Vec::with_capacity(contour.len());
        for &point in contour.iter() {
            if kept.len() >= 2 && is_near(kept[kept.len() - 2], point) {
                kept.pop();
            } else if !kept.last().is_some_and(|last| is_near(*last, point)) {
                kept.push(point);
            }
        }
        let half = kept.len() / 2;
        kept.rotate_left(half);
        *contour = kept;
    }
}

/// The polygon that a plane cuts out of a convex cell, the intersection of half-spaces n · x ≤ d.
fn outline(plane: &Plane, cell: &[Plane], bounds: [DVec3; 2], touch: f64) -> Vec<DVec3> {
    let (middle, reach) = (0.5 * (bounds[0] + bounds[1]), bounds[0].distance(bounds[1]));
    let flat = on(plane, middle);
    let mut corners: Vec<DVec3> =
        [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]].map(|[x, y]: [f64; 2]| flat.back([x * reach, y * reach])).into();
    for side in cell {
        if corners.len() < 3 || side.heights(&corners)[1] <= touch {
            continue;
        }
        let [inside, _] = side.split(&corners, touch);
        corners = inside;
    }
    if corners.len() < 3 { Vec::new() } else { corners }
}

/// What a plane is within a cell that holds these panels. Fields of which more than `most_open` is open are soft.
pub fn section<'a>(
    plane: &Plane,
    cell: &[Plane],
    panels: impl Iterator<Item = &'a [DVec3]>,
    space: &Space,
    most_open: f64,
) -> Section {
    let corners = outline(plane, cell, space.bounds, space.touch);
    let mut found = Section::default();
    if corners.is_empty() {
        return found;
    }
    let flat = on(plane, middle(&corners));
    let met = Met::new(plane, &flat, panels, space.touch);
    // Lines that end in a field part it only together with those that end at the plane.
    let lines: Vec<Contour> = met.through.iter().chain(&met.ends).cloned().collect();
    let mut whole: Contour = corners.iter().map(|c| flat.flat(*c)).collect();
    if twice_area(&whole) < 0.0 {
        whole.reverse();
    }
    for field in between(vec![vec![whole]], &met.through, space.touch) {
        let near: Vec<Contour> = met.walls.iter().filter(|wall| overlap(&field, wall)).cloned().collect();
        let free = match near.is_empty() {
            true => vec![field.clone()],
            false => field.overlay_as::<i64>(&near, OverlayRule::Difference, FillRule::NonZero),
        };
        let wall = (shape_area(&field) - free.iter().map(shape_area).sum::<f64>()).max(0.0);
        let (mut polygons, mut open) = (Vec::new(), 0.0);
        for opening in between(free, &lines, space.touch) {
            let pieces = openings(plane, &flat, opening, space);
            open += pieces.iter().map(|piece| area(piece)).sum::<f64>();
            polygons.extend(pieces);
        }
        found.wall += wall;
        if !polygons.is_empty() {
            found.open += open;
            found.openings.push(Opening { polygons, is_soft: open > most_open * (open + wall) });
        }
    }
    found
}

/// Whether the boxes around a shape and a contour have a part in common.
fn overlap(shape: &Shape, contour: &Contour) -> bool {
    let bounds = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        points.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
            [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
        })
    };
    let [low, high] = bounds(&mut shape.iter().flatten().copied());
    let [from, to] = bounds(&mut contour.iter().copied());
    (0..2).all(|k| low[k] <= to[k] && from[k] <= high[k])
}

/// The convex pieces of an open shape, if somebody is on both sides of it. What is narrower than `touch` is no opening.
fn openings(plane: &Plane, flat: &Flat, shape: Shape, space: &Space) -> Vec<Vec<DVec3>> {
    let around: f64 = shape.iter().flatten().map(|p| p[0].abs().max(p[1].abs())).fold(0.0, f64::max);
    if shape_area(&shape) <= space.touch * around {
        return Vec::new();
    }
    let pieces: Vec<Vec<DVec3>> = convex_pieces(vec![shape], 0.01 * space.touch)
        .into_iter()
        .map(|piece| piece.into_iter().map(|p| flat.back(p)).collect())
        .collect();
    let largest = pieces.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
    let is_somebodys = largest.is_some_and(|piece| {
        let point = middle(piece);
        space.sees_a_front(point, plane.normal) && space.sees_a_front(point, -plane.normal)
    });
    if is_somebodys { pieces } else { Vec::new() }
}
