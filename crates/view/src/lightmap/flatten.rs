//! Laying a region flat: projection along its axis, turned to fill the smallest rectangle, cut apart where it
//! overlaps itself.

use super::charts::{COPLANAR, Region, neighbours, segment};
use super::{LightmapError, SharedEdge, UnwrapInput, UnwrapParams, shared_edges};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Charts in metres, before a density is chosen.
#[derive(Clone, Debug)]
pub struct Charts {
    pub(super) charts: Vec<Chart>,
    /// By chart, its texels per metre over those asked for: 1 but where [`Charts::allot`] gave more.
    pub finer: Vec<f64>,
    /// By chart, the same where it is part of a place of a smaller scale, which counts by as much more ([`Charts::narrow`]).
    pub(super) narrow: Vec<f64>,
    pub(super) triangles: usize,
}

/// A chart laid flat.
#[derive(Clone, Debug)]
pub(super) struct Chart {
    pub triangles: Vec<u32>,
    /// Corners of the triangles, metres; the smallest coordinates are 0.
    pub local: Vec<[DVec2; 3]>,
    /// Largest coordinates.
    pub extent: DVec2,
    /// Sum of the triangles' areas, m².
    pub area: f64,
    /// Sum of |Δx| + |Δy| along the border, metres.
    pub outline: f64,
    /// Whether the chart fills its bounding box.
    pub rectangle: bool,
}

/// Share of its bounding box that a rectangle fills: lost digits of f32 positions, not missing corners.
const RECTANGLE: f64 = 0.999_99;

/// Triangles that reach into each other by less than this share of the chart's extent only touch.
const TOUCH: f64 = 1e-6;

/// Longest sides of the convex hull that are tried as the side of the rectangle. A round outline of more sides
/// gains less than 1 % of area by the others.
const HULL_SIDES: usize = 64;

impl Charts {
    /// Cuts into charts and lays them flat. Only the angles of `params` matter here.
    pub fn new(input: &UnwrapInput, params: &UnwrapParams) -> Result<Charts, LightmapError> {
        params.check()?;
        check(input)?;
        let mut edges = shared_edges(input.triangles, Some(input.group));
        edges.retain(|edge| !is_below_a_wall(input, edge));
        let across = neighbours(input.triangles.len(), &edges);
        let regions = segment(input, &edges, &across, params);
        let mut charts: Vec<Chart> =
            regions.par_iter().flat_map_iter(|region| flatten(input, &across, region)).collect();
        charts.sort_by_key(|chart| chart.triangles[0]);
        let ones = vec![1.0; charts.len()];
        Ok(Charts { finer: ones.clone(), narrow: ones, charts, triangles: input.triangles.len() })
    }

    /// Finer texels where the scale of triangles is below 1; where light is rough they become finer from there on.
    pub fn narrow(&mut self, scale: impl Fn(usize) -> f64) {
        for (chart, narrow) in self.charts.iter().zip(&mut self.narrow) {
            let (mut area, mut scaled) = (0.0, 0.0);
            for (&triangle, [a, b, c]) in chart.triangles.iter().zip(&chart.local) {
                let own = (*b - *a).perp_dot(*c - *a).abs();
                area += own;
                scaled += own / scale(triangle as usize).powi(2);
            }
            if area > 0.0 {
                *narrow = (scaled / area).sqrt();
            }
        }
    }

    /// Number of charts.
    pub fn len(&self) -> usize {
        self.charts.len()
    }

    /// Whether there is no chart.
    pub fn is_empty(&self) -> bool {
        self.charts.is_empty()
    }
}

/// Whether light breaks at an edge within a plane. A look-up between texels would mix the light of two rooms.
fn is_below_a_wall(input: &UnwrapInput, edge: &SharedEdge) -> bool {
    let [s, t] = edge.triangles.map(|t| t as usize);
    let [i, j] = edge.sides.map(usize::from);
    let (Some(here), Some(there)) = (input.smooth.get(s), input.smooth.get(t)) else { return false };
    let normal = |t: usize| {
        let [a, b, c] = input.triangles[t].map(|v| input.positions[v as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    here[i] != there[(j + 1) % 3] && here[(i + 1) % 3] != there[j] && normal(s).dot(normal(t)) >= COPLANAR
}

fn check(input: &UnwrapInput) -> Result<(), LightmapError> {
    if input.group.len() != input.triangles.len() {
        return Err(LightmapError::Groups { groups: input.group.len(), triangles: input.triangles.len() });
    }
    let vertices = input.positions.len();
    for (triangle, corners) in input.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
            return Err(LightmapError::Vertex { triangle, vertex, vertices });
        }
    }
    for (vertex, &position) in input.positions.iter().enumerate() {
        if !position.is_finite() || position.abs().max_element() > 1e9 {
            return Err(LightmapError::Position { vertex, position });
        }
    }
    Ok(())
}

/// Projects a region; more than one chart where it overlaps itself.
fn flatten(input: &UnwrapInput, across: &[[u32; 3]], region: &Region) -> Vec<Chart> {
    let axis = region.axis.try_normalize().unwrap_or(DVec3::Z);
    let (right, up) = axis.any_orthonormal_pair();
    let origin = input.positions[input.triangles[region.triangles[0] as usize][0] as usize];
    let project = |v: u32| {
        let p = input.positions[v as usize] - origin;
        DVec2::new(p.dot(right), p.dot(up))
    };
    let corners: Vec<[DVec2; 3]> = region.triangles.iter().map(|&t| input.triangles[t as usize].map(project)).collect();
    cut(&region.triangles, &corners, across)
        .into_iter()
        .map(|part| turn(&part, &region.triangles, &corners, across))
        .collect()
}

/// Turns a part of a region (indices into its triangles) to its smallest bounding box.
fn turn(part: &[usize], triangles: &[u32], corners: &[[DVec2; 3]], across: &[[u32; 3]]) -> Chart {
    let points: Vec<DVec2> = part.iter().flat_map(|&i| corners[i]).collect();
    let hull = hull(&points);
    let mut sides: Vec<DVec2> = (0..hull.len()).map(|i| hull[(i + 1) % hull.len()] - hull[i]).collect();
    sides.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    sides.truncate(HULL_SIDES);
    let mut best = (f64::INFINITY, DVec2::X);
    for side in sides {
        let Some(along) = side.try_normalize() else { continue };
        let (low, high) = bounds(hull.iter().map(|&p| turned(p, along)));
        // A shorter side must be better by a thousandth: equal boxes of a rectangle keep its longest side.
        let size = (high - low).x * (high - low).y;
        if size < best.0 * 0.999 {
            best = (size, along);
        }
    }

    let along = best.1;
    let (low, high) = bounds(hull.iter().map(|&p| turned(p, along)));
    let local: Vec<[DVec2; 3]> =
        part.iter().map(|&i| corners[i].map(|p| (turned(p, along) - low).max(DVec2::ZERO))).collect();
    let triangles: Vec<u32> = part.iter().map(|&i| triangles[i]).collect();
    let extent = (high - low).max(DVec2::ZERO);
    let area: f64 = local.iter().map(|&[a, b, c]| 0.5 * (b - a).perp_dot(c - a).abs()).sum();
    let mut outline = 0.0;
    for (&t, corners) in triangles.iter().zip(&local) {
        for side in 0..3 {
            let other = across[t as usize][side];
            if other == u32::MAX || triangles.binary_search(&other).is_err() {
                outline += (corners[(side + 1) % 3] - corners[side]).abs().element_sum();
            }
        }
    }
    let rectangle = area > 0.0 && area >= RECTANGLE * extent.x * extent.y;
    Chart { triangles, local, extent, area, outline, rectangle }
}

/// Coordinates of `p` along the unit direction `along` and across it.
fn turned(p: DVec2, along: DVec2) -> DVec2 {
    DVec2::new(p.dot(along), along.perp_dot(p))
}

fn bounds(points: impl Iterator<Item = DVec2>) -> (DVec2, DVec2) {
    points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// Convex hull, counter-clockwise (Andrew's monotone chain); all points where there are fewer than three.
fn hull(points: &[DVec2]) -> Vec<DVec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut sorted.iter().copied());
    hull.extend(half(&mut sorted.iter().rev().copied()));
    hull
}

/// Connected parts (ascending indices) that do not overlap themselves.
///
/// Each round keeps the triangles reached from the first one, leaving out those that overlap a kept one; what is left
/// out goes round again. Every round keeps at least one, so this ends.
fn cut(triangles: &[u32], corners: &[[DVec2; 3]], across: &[[u32; 3]]) -> Vec<Vec<usize>> {
    let all: Vec<usize> = (0..triangles.len()).collect();
    // Two triangles on the two sides of one edge that face the same way cannot overlap.
    if triangles.len() <= 2 {
        return vec![all];
    }
    let clashes = overlaps(corners);
    if clashes.iter().all(Vec::is_empty) {
        return vec![all];
    }
    const LEFT: u8 = 0;
    const KEPT: u8 = 1;
    const DONE: u8 = 2;
    let mut state = vec![LEFT; triangles.len()];
    let mut parts = Vec::new();
    for seed in 0..triangles.len() {
        if state[seed] != LEFT {
            continue;
        }
        let mut part = vec![seed];
        state[seed] = KEPT;
        let mut next = 0;
        while next < part.len() {
            for &other in &across[triangles[part[next]] as usize] {
                let Ok(i) = triangles.binary_search(&other) else { continue };
                if state[i] == LEFT && clashes[i].iter().all(|&j| state[j as usize] != KEPT) {
                    state[i] = KEPT;
                    part.push(i);
                }
            }
            next += 1;
        }
        for &i in &part {
            state[i] = DONE;
        }
        part.sort_unstable();
        parts.push(part);
    }
    parts
}

/// For each triangle those that it overlaps, found through a grid of about one cell for each triangle.
fn overlaps(corners: &[[DVec2; 3]]) -> Vec<Vec<u32>> {
    let (low, high) = bounds(corners.iter().flatten().copied());
    let extent = (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
    let touch = TOUCH * extent.max_element();
    let cell = (extent.x * extent.y / corners.len() as f64).sqrt().max(extent.max_element() / 1024.0);
    let cells = (extent / cell).floor().as_usizevec2() + glam::USizeVec2::ONE;
    let mut grid: Vec<Vec<u32>> = vec![Vec::new(); cells.x * cells.y];
    let mut clashes = vec![Vec::new(); corners.len()];
    for (i, triangle) in corners.iter().enumerate() {
        let (a, b) = bounds(triangle.iter().copied());
        let first = ((a - low) / cell).floor().as_usizevec2().min(cells - 1);
        let last = ((b - low) / cell).floor().as_usizevec2().min(cells - 1);
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let here = &mut grid[y * cells.x + x];
                for &j in here.iter() {
                    let known = clashes[i].contains(&j);
                    if !known && overlap(triangle, &corners[j as usize], touch) {
                        clashes[i].push(j);
                        clashes[j as usize].push(i as u32);
                    }
                }
                here.push(i as u32);
            }
        }
    }
    clashes
}

/// Whether two triangles reach into each other by more than `touch`: no side of either separates them.
fn overlap(a: &[DVec2; 3], b: &[DVec2; 3], touch: f64) -> bool {
    let separated = |a: &[DVec2; 3], b: &[DVec2; 3]| {
        (0..3).any(|side| {
            let from = a[side];
            let Some(along) = (a[(side + 1) % 3] - from).try_normalize() else { return false };
            // Left of the side is inside when the triangle is counter-clockwise.
            let inside = along.perp_dot(a[(side + 2) % 3] - from).signum();
            let height = inside * along.perp_dot(a[(side + 2) % 3] - from);
            height <= touch || b.iter().all(|&p| inside * along.perp_dot(p - from) <= touch)
        })
    };
    !separated(a, b) && !separated(b, a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlap_is_more_than_touching() {
        let a = [DVec2::ZERO, DVec2::X, DVec2::Y];
        let beside = [DVec2::X, DVec2::ONE, DVec2::Y];
        assert!(!overlap(&a, &beside, 1e-9));
        assert!(overlap(&a, &a, 1e-9));
        assert!(overlap(&a, &beside.map(|p| p - 0.1), 1e-9));
        assert!(!overlap(&a, &a.map(|p| p + DVec2::X), 1e-9));
    }

    #[test]
    fn hull_keeps_the_corners_of_a_square() {
        let mut points = vec![DVec2::new(0.5, 0.5), DVec2::new(0.5, 0.0)];
        points.extend([DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]);
        assert_eq!(hull(&points), [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]);
        assert_eq!(hull(&[DVec2::X; 4]), [DVec2::X]);
    }
}
