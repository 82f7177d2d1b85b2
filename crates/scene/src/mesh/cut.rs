//! A triangle cut along lines: what lies within the welding distance of each other is made one, lines are split where they
//! meet, and the pieces are the constrained Delaunay triangles of the lines and the outline (Chew 1989).

use super::edges::ordered;
use super::weld::Weld;
use glam::{DVec2, DVec3};
use rustc_hash::{FxHashMap, FxHashSet};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// Pairs of lines that are compared in all. Those that overlap along one axis are; the limit is a second or so, or ten
/// thousand that all cross. Triangles beyond it stay whole.
const MOST_PAIRS: u64 = 1 << 26;

/// Vertices where lines cross, in all; each brings two triangles or so. A real scene of a million triangles has fewer.
/// Triangles beyond it stay whole.
const MOST_CROSSINGS: usize = 1 << 20;

type Edge = (u32, u32);

/// Cuts triangles; two that share an edge get the same vertices on it.
pub(super) struct Cutter<'a> {
    vertices: &'a mut Vec<DVec3>,
    weld: &'a mut Weld,
    crossings: FxHashMap<(Edge, Edge), u32>,
    pairs: u64,
}

/// A line in the plane of the triangle, and the vertices on it by their place along it.
struct Line {
    edge: Edge,
    ends: [DVec2; 2],
    on: Vec<(f64, u32)>,
}

impl<'a> Cutter<'a> {
    pub(super) fn new(vertices: &'a mut Vec<DVec3>, weld: &'a mut Weld) -> Cutter<'a> {
        Cutter { vertices, weld, crossings: FxHashMap::default(), pairs: 0 }
    }

    /// Whether triangles stayed whole because there were too many lines.
    pub(super) fn gave_up(&self) -> bool {
        self.pairs > MOST_PAIRS || self.crossings.len() > MOST_CROSSINGS
    }

    /// The vertex at a place.
    pub(super) fn vertex(&mut self, place: DVec3) -> u32 {
        self.weld.vertex(self.vertices, place)
    }

    /// The pieces of a triangle along lines that lie on it, and in `met` the vertices on these; `None` where no line
    /// enters it.
    pub(super) fn cut(&mut self, corners: [u32; 3], feet: &[Edge], met: &mut Vec<u32>) -> Option<Vec<[u32; 3]>> {
        let [a, b, c] = corners.map(|v| self.vertices[v as usize]);
        let x = (b - a).normalize_or_zero();
        let y = (b - a).cross(c - a).cross(x).normalize_or_zero();
        let flat = |p: DVec3| DVec2::new((p - a).dot(x), (p - a).dot(y));
        let outline = [a, b, c].map(flat);
        // How far a point lies inside.
        let depth = |p: DVec2| {
            let side = |i: usize| (outline[(i + 1) % 3] - outline[i]).normalize_or_zero().perp_dot(p - outline[i]);
            side(0).min(side(1)).min(side(2))
        };
        let near = 2.0 * self.weld.tolerance;

        let sides = (0..3).map(|i| (corners[i], corners[(i + 1) % 3]));
        let mut lines: Vec<Line> = sides
            .chain(feet.iter().copied())
            .map(|edge| {
                let ends = [edge.0, edge.1].map(|v| flat(self.vertices[v as usize]));
                Line { edge, ends, on: vec![(0.0, edge.0), (1.0, edge.1)] }
            })
            .collect();
        if !self.meet(&mut lines, |p| depth(p) > -near) {
            return None;
        }
        let parts = |line: &Line| line.on.windows(2).map(|w| (w[0].1, w[1].1)).collect::<Vec<Edge>>();
        let place = |v: u32| flat(self.vertices[v as usize]);
        let border: Vec<Edge> = lines[..3].iter().flat_map(parts).collect();
        let mut inside: Vec<Edge> = lines[3..]
            .iter()
            .flat_map(parts)
            .map(|(p, q)| ordered(p, q))
            .filter(|&(p, q)| {
                p != q && [place(p), place(q), 0.5 * (place(p) + place(q))].map(depth).iter().all(|d| *d >= -near)
            })
            .collect();
        inside.sort_unstable();
        inside.dedup();
        met.extend(inside.iter().flat_map(|&(p, q)| [p, q]));
        if border.len() == 3 && inside.iter().all(|(p, q)| corners.contains(p) && corners.contains(q)) {
            return None;
        }
        let pieces = triangulate(&border, &inside, place)?;

        // Should rounding have lost a piece, the triangle stays whole.
        let area = |[a, b, c]: [DVec2; 3]| 0.5 * (b - a).perp_dot(c - a);
        let sum: f64 = pieces.iter().map(|piece| area(piece.map(place))).sum();
        let length: f64 = (0..3).map(|i| outline[i].distance(outline[(i + 1) % 3])).sum();
        ((sum - area(outline)).abs() <= near * length).then_some(pieces)
    }

    /// Finds the vertices of lines on others, and those where they cross inside; the first three are the outline. False
    /// if there are too many.
    fn meet(&mut self, lines: &mut [Line], is_inside: impl Fn(DVec2) -> bool) -> bool {
        let near = self.weld.tolerance;
        let low: Vec<f64> = lines.iter().map(|line| line.ends[0].x.min(line.ends[1].x)).collect();
        let mut order: Vec<usize> = (0..lines.len()).collect();
        order.sort_by(|&i, &j| low[i].total_cmp(&low[j]).then(i.cmp(&j)));
        for (n, &i) in order.iter().enumerate() {
            let high = lines[i].ends[0].x.max(lines[i].ends[1].x) + 2.0 * near;
            for &j in order[n + 1..].iter().take_while(|&&j| low[j] <= high) {
                self.pairs += 1;
                if self.gave_up() {
                    return false;
                }
                if i.max(j) < 3 {
                    continue;
                }
                let [on_j, on_i] = [(i, j), (j, i)].map(|(i, j)| lines[i].ends_on(&lines[j], near));
                let touch = !on_i.is_empty() || !on_j.is_empty() || lines[i].shares_end(&lines[j]);
                lines[i].on.extend(on_i);
                lines[j].on.extend(on_j);
                let crossing = cross(lines[i].ends, lines[j].ends).filter(|_| !touch);
                let Some((s, t)) = crossing else { continue };
                if is_inside(lines[i].ends[0].lerp(lines[i].ends[1], s)) {
                    let v = self.crossing(lines[i].edge, lines[j].edge);
                    lines[i].on.push((s, v));
                    lines[j].on.push((t, v));
                }
            }
        }
        for line in lines {
            // The first of a name stays, which for an end is the end.
            line.on.sort_by_key(|on| on.1);
            line.on.dedup_by_key(|on| on.1);
            line.on.sort_by(|p, q| p.0.total_cmp(&q.0));
        }
        true
    }

    /// The vertex where two edges cross.
    fn crossing(&mut self, e: Edge, f: Edge) -> u32 {
        let (e, f) = (ordered(e.0, e.1), ordered(f.0, f.1));
        let (e, f) = (e.min(f), e.max(f));
        if let Some(&v) = self.crossings.get(&(e, f)) {
            return v;
        }
        let [p, q, a, b] = [e.0, e.1, f.0, f.1].map(|v| self.vertices[v as usize]);
        let normal = (q - p).cross(b - a);
        let share = (a - p).cross(b - a).dot(normal) / normal.length_squared();
        let point = p + share.clamp(0.0, 1.0) * (q - p);
        let near = 2.0 * self.weld.tolerance;
        let end = [(e.0, p), (e.1, q), (f.0, a), (f.1, b)].into_iter().find(|(_, end)| end.distance(point) <= near);
        let v = end.map_or_else(|| self.weld.vertex(self.vertices, point), |(v, _)| v);
        self.crossings.insert((e, f), v);
        v
    }
}

impl Line {
    fn shares_end(&self, other: &Line) -> bool {
        [other.edge.0, other.edge.1].iter().any(|v| *v == self.edge.0 || *v == self.edge.1)
    }

    /// Which of the ends lie on another line, between its ends, and where.
    fn ends_on(&self, other: &Line, near: f64) -> Vec<(f64, u32)> {
        let [start, end] = other.ends;
        let along = end - start;
        let length = along.length();
        let place = |p: DVec2| (p - start).dot(along) / (length * length);
        let lies_on = |p: DVec2| {
            let share = place(p);
            let between = share * length > 2.0 * near && (1.0 - share) * length > 2.0 * near;
            between && p.distance(start + share * along) <= near
        };
        let ends = [(self.edge.0, self.ends[0]), (self.edge.1, self.ends[1])];
        ends.into_iter().filter(|(_, p)| lies_on(*p)).map(|(v, p)| (place(p), v)).collect()
    }
}

/// Where two lines cross, as shares of their lengths.
fn cross([a, b]: [DVec2; 2], [p, q]: [DVec2; 2]) -> Option<(f64, f64)> {
    let area = (b - a).perp_dot(q - p);
    let (s, t) = ((p - a).perp_dot(q - p) / area, (p - a).perp_dot(b - a) / area);
    let between = |x: f64| x > 0.0 && x < 1.0;
    (between(s) && between(t)).then_some((s, t))
}

/// The triangles within a closed border, along lines where these do not cross. Where the border crosses itself they do not
/// add up to its area.
fn triangulate(border: &[Edge], lines: &[Edge], place: impl Fn(u32) -> DVec2) -> Option<Vec<[u32; 3]>> {
    let mut triangles = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = FxHashMap::default();
    let mut names: Vec<u32> = Vec::new();
    for v in border.iter().chain(lines).flat_map(|&(p, q)| [p, q]) {
        if let std::collections::hash_map::Entry::Vacant(entry) = handles.entry(v) {
            // Numbers next to nothing are refused.
            let [x, y] = place(v).to_array().map(|x| if x.abs() < 1e-42 { 0.0 } else { x });
            let handle = triangles.insert(Point2::new(x, y)).ok()?;
            entry.insert(handle);
            if handle.index() == names.len() {
                names.push(v);
            }
        }
    }
    let mut walls = FxHashSet::default();
    for (p, q) in border {
        let (p, q) = (handles[p], handles[q]);
        for edge in triangles.try_add_constraint(p, q) {
            walls.insert(edge.as_undirected());
        }
    }
    for (p, q) in lines {
        triangles.try_add_constraint(handles[p], handles[q]);
    }

    // The border's vertices lie on a straight line within rounding only: what the hull has outside of it goes.
    let mut outside = FxHashSet::default();
    let mut stack: Vec<_> = triangles.directed_edges().filter(|edge| edge.face().is_outer()).collect();
    while let Some(edge) = stack.pop() {
        let beyond = edge.rev().face().as_inner().filter(|_| !walls.contains(&edge.as_undirected().fix()));
        if let Some(face) = beyond.filter(|face| outside.insert(face.fix())) {
            stack.extend(face.adjacent_edges());
        }
    }
    let inner = triangles.inner_faces().filter(|face| !outside.contains(&face.fix()));
    Some(inner.map(|face| face.vertices().map(|v| names[v.index()])).collect())
}
