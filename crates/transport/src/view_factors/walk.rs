//! The walk of one block of parts through the tree: pairs are judged in clusters, then leaf by leaf, then by a leaf and a
//! part, and one by one only where something may stand between these.

use super::body::Setting;
use super::cell::{List as Chosen, Sights};
use super::clear::{Exchange, clear};
use super::cluster::{Cluster, Clusters, LEAF};
use super::gallery::{Between, Gallery, Kept};
use super::mixed::{Stage, above, distance};
use super::moments::{Far, Four, Moments};
use super::panel::Panel;
use super::part::Part;
use super::shaft::{Look, Shaft, Stands};
use super::solid::{Obstacles, Outside, Solid};
use super::store::Entry;
use super::visible::Shadows;
use super::{Choices, ViewFactorOptions};

use glam::DVec3;
use radiosity_scene::Enclosure;
use smallvec::SmallVec;
use std::ops::Range;

/// Error of the unoccluded factor relative to that of the visible one, where it only serves to find that.
const WHOLE: f64 = 0.05;

/// Least share of the accuracy that a pair of parts is asked for, where facets have many: their errors hardly add up.
const LEAST: f64 = 0.1;

/// Share of the accuracy that the errors of pairs of facets may have in squares, where surfaces have several. What is left is for what
/// they have alike, and enough if 25 pairs take all of theirs; of thousands nearly all take far less.
const IN_SQUARES: f64 = 0.5;

/// Panels, by index.
type List = SmallVec<[u32; 16]>;

/// What light goes from or to: a cluster or a part.
#[derive(Clone, Copy)]
struct End<'a> {
    /// Corners of a convex hull.
    corners: &'a [DVec3],
    /// Normal and offset of the plane it lies in.
    plane: Option<(DVec3, f64)>,
}

impl<'a> End<'a> {
    fn of_part(part: &'a Part) -> End<'a> {
        let normal = part.shape.normal();
        End { corners: part.shape.corners(), plane: Some((normal, normal.dot(part.shape.corners()[0]))) }
    }

    fn of_cluster(cluster: &'a Cluster) -> End<'a> {
        End { corners: &cluster.hull, plane: cluster.plane }
    }

    /// Least and greatest height of places above its plane; no bounds if it does not lie in one.
    fn heights(&self, places: &[DVec3]) -> [f64; 2] {
        let Some((normal, offset)) = self.plane else { return [f64::NEG_INFINITY, f64::INFINITY] };
        let heights = places.iter().map(|p| normal.dot(*p) - offset);
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| [low.min(h), high.max(h)])
    }
}

/// How two ends face each other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Facing {
    /// One is behind the other.
    Away,
    /// The plane of one may cross the other.
    Partly,
    Whole,
}

impl Facing {
    fn of([a, b]: [End; 2], touch: f64) -> Facing {
        let ([low, high], [low_a, high_a]) = (a.heights(b.corners), b.heights(a.corners));
        match (high.min(high_a), low.min(low_a)) {
            (high, _) if high <= touch => Facing::Away,
            (_, low) if low < -touch => Facing::Partly,
            _ => Facing::Whole,
        }
    }
}

/// One block of parts on its way through the tree.
pub struct Walk<'a> {
    pub enclosure: &'a Enclosure,
    /// Areas of the surfaces, m².
    pub areas: &'a [f64],
    pub clusters: &'a Clusters,
    pub panels: &'a [Panel],
    pub solids: &'a [Solid],
    pub options: &'a ViewFactorOptions,
    pub touch: f64,
    pub shadows: Shadows,
    pub sights: Sights,
    pub kept: Kept,
    pub choices: Choices,
    pub entries: Vec<Entry>,
}

/// What the parts of a leaf look at.
struct Target<'a> {
    inner: &'a Part,
    facing: Facing,
    /// What may stand before it; of solids the faces that look towards the leaf.
    panels: &'a [&'a Panel],
    /// None if nothing does, or too little of it is seen to tell how much.
    stage: Option<Stage<'a>>,
    /// What the parts of the leaf, from this one on, exchange with it as far as their moments tell.
    far: Far,
    first: usize,
}

impl<'a> Walk<'a> {
    /// All pairs of parts of `a` with later ones of `b`, past the panels `between`.
    pub fn visit(&mut self, a: u32, b: u32, between: &[u32]) {
        let clusters = self.clusters;
        let (from, to) = (&clusters.nodes[a as usize], &clusters.nodes[b as usize]);
        // Every pair once: the second part comes after the first.
        if to.parts.end <= from.parts.start + 1 {
            return;
        }
        let pairs = || pairs(from.parts.clone(), to.parts.clone());
        let ends = [from, to].map(End::of_cluster);
        if Facing::of(ends, self.touch) == Facing::Away {
            self.choices.facing_away += pairs();
            return;
        }
        let are_leaves = from.halves.is_none() && to.halves.is_none();
        let Some(left) = self.standing(ends, between, if are_leaves { Look::Close } else { Look::Rough }) else {
            self.choices.blocked += pairs();
            return;
        };
        match (from.halves, to.halves) {
            (None, None) => self.leaves([from, to], &left),
            (Some(halves), other) if other.is_none() || from.extent > to.extent => {
                halves.into_iter().for_each(|half| self.visit(half, b, &left));
            }
            (_, Some(halves)) => halves.into_iter().for_each(|half| self.visit(a, half, &left)),
            (Some(_), None) => {}
        }
    }

    /// The panels of a list that may stand between two ends; none if one hides all.
    fn standing(&self, ends: [End; 2], between: &[u32], look: Look) -> Option<List> {
        let normals = ends.map(|end| end.plane.map_or(DVec3::ZERO, |(normal, _)| normal));
        let mut shaft = Shaft::new(ends.map(|end| end.corners), normals, self.touch);
        let mut left = List::new();
        for &panel in between {
            let standing = &self.panels[panel as usize];
            if ends.iter().any(|end| end.heights(&standing.corners)[1] <= self.touch) {
                continue;
            }
            match shaft.stands(standing, look) {
                Stands::Aside => {}
                Stands::Between => left.push(panel),
                Stands::Across => return None,
            }
        }
        Some(left)
    }

    /// All pairs between two leaves. Those of a leaf with itself are done: it lies in a plane.
    fn leaves(&mut self, leaves: [&'a Cluster; 2], between: &[u32]) {
        let distance = |leaf: &Cluster| {
            let middle = leaf.hull.iter().sum::<DVec3>() / leaf.hull.len() as f64;
            let panels = between.iter().map(|panel| &self.panels[*panel as usize]);
            distance(middle, panels) / self.clusters.parts[leaf.parts.start].moments.radius
        };
        let is_turned = !between.is_empty() && distance(leaves[0]) < distance(leaves[1]);
        let [outer, inner] = if is_turned { [leaves[1], leaves[0]] } else { leaves };
        let moments: SmallVec<[&Moments; LEAF]> =
            self.clusters.parts[outer.parts.clone()].iter().map(|part| &part.moments).collect();
        let fours: SmallVec<[Four; LEAF / 4]> = moments.chunks(4).map(Four::new).collect();
        if between.is_empty() || !self.gallery((outer, &fours), inner, between) {
            for target in inner.parts.clone() {
                self.target((outer, &fours), target, outer.parts.clone(), between);
            }
        }
    }

    /// All pairs of two leaves, of whose first the moments are given, past panels that all of them share; whether that could be.
    fn gallery(&mut self, (outer, fours): (&'a Cluster, &[Four]), inner: &'a Cluster, between: &[u32]) -> bool {
        let (clusters, obstacles) = (self.clusters, Obstacles { panels: self.panels, solids: self.solids });
        let Some(lattice) = &outer.lattice else { return false };
        if lattice.of.iter().all(Option::is_none) {
            return false;
        }
        let panels = self.facing(between, &outer.hull);
        let (parts, targets) = (&clusters.parts[outer.parts.clone()], &clusters.parts[inner.parts.clone()]);
        let setting = Setting { panels: &panels, obstacles, target: &[], touch: self.touch };
        let mut kept = std::mem::take(&mut self.kept);
        let gallery =
            Gallery::new((lattice, parts), (&outer.hull, parts[0].shape.normal()), targets, setting, &mut kept);
        let is_done = gallery.is_some();
        if let Some(mut gallery) = gallery {
            for target in inner.parts.clone() {
                self.in_gallery(&mut gallery, (outer, fours), (target, target - inner.parts.start), between);
            }
        }
        self.kept = kept;
        is_done
    }

    /// Of panels those that may hide something from a region: of solids outside of it the faces that look towards it.
    fn facing(&self, panels: &[u32], region: &[DVec3]) -> SmallVec<[&'a Panel; 16]> {
        let obstacles = Obstacles { panels: self.panels, solids: self.solids };
        let mut outside = Outside::new(obstacles, region, self.touch);
        let panels = panels.iter().map(|panel| &self.panels[*panel as usize]);
        panels.filter(|panel| !outside.looks_away(panel)).collect()
    }

    /// All pairs of a leaf with one part, by index and its number in the gallery.
    fn in_gallery(
        &mut self,
        gallery: &mut Gallery,
        (outer, fours): (&'a Cluster, &[Four]),
        (target, number): (usize, usize),
        between: &[u32],
    ) {
        let b = &self.clusters.parts[target];
        let facing = Facing::of([End::of_cluster(outer), End::of_part(b)], self.touch);
        if facing == Facing::Away {
            self.choices.facing_away += outer.parts.len();
            return;
        }
        let far = Far::of(fours, &b.moments);
        let mut left: SmallVec<[usize; LEAF]> = SmallVec::new();
        for (k, part) in outer.parts.clone().enumerate() {
            let a = &self.clusters.parts[part];
            let facing =
                if facing == Facing::Partly { Facing::of([a, b].map(End::of_part), self.touch) } else { facing };
            let between = match facing {
                Facing::Away => {
                    self.choices.facing_away += 1;
                    continue;
                }
                Facing::Partly => None,
                Facing::Whole => gallery.between(k, number),
            };
            let far = far.exchange(k);
            match between {
                Some(Between::Nothing) => self.clear((a, b), far, false),
                Some(Between::All) => self.choices.blocked += 1,
                Some(Between::Some(bodies)) => {
                    let (whole, tolerance) = self.whole((a, b), far, false);
                    match gallery.mixed((k, number), bodies, whole, tolerance) {
                        Some(found) => {
                            self.choices.clipped += 1;
                            self.add((a, b), found);
                        }
                        None => left.push(part),
                    }
                }
                None => left.push(part),
            }
        }
        if !left.is_empty() {
            self.target((outer, fours), target, left.into_iter(), between);
        }
    }

    /// Parts of a leaf, of whose parts the moments are given, with one part.
    fn target(
        &mut self,
        (outer, fours): (&'a Cluster, &[Four]),
        target: usize,
        parts: impl ExactSizeIterator<Item = usize>,
        between: &[u32],
    ) {
        let clusters = self.clusters;
        let inner = &clusters.parts[target];
        let ends = [End::of_cluster(outer), End::of_part(inner)];
        let facing = Facing::of(ends, self.touch);
        if facing == Facing::Away {
            self.choices.facing_away += parts.len();
            return;
        }
        let left = if between.is_empty() { Some(List::new()) } else { self.standing(ends, between, Look::Close) };
        let Some(between) = left else {
            self.choices.blocked += parts.len();
            return;
        };
        let far = Far::of(fours, &inner.moments);
        let mut target = Target { inner, facing, panels: &[], stage: None, far, first: outer.parts.start };
        if between.is_empty() {
            parts.for_each(|part| self.pair(part, &mut target));
            return;
        }
        let obstacles = Obstacles { panels: self.panels, solids: self.solids };
        let first = End::of_part(&clusters.parts[outer.parts.start]);
        let (region, shape) = (above(&outer.hull, ends[1].plane), above(inner.shape.corners(), first.plane));
        let from = region.as_deref().unwrap_or(&outer.hull);
        let panels = self.facing(&between, from);
        target.panels = &panels;
        if let (Some(shape), Some((normal, _))) = (&shape, first.plane) {
            let setting = Setting { panels: &panels, obstacles, target: shape, touch: self.touch };
            target.stage = Stage::new(from, normal, inner, setting, &mut self.sights);
        }
        parts.for_each(|part| self.pair(part, &mut target));
    }

    /// Error of A_i F_ij that two parts may have, m²: their share of what their facets may. Those may as much as if they were surfaces of their
    /// own, or their share in squares of what their surfaces may, if that is less ([`Errors`](super::store::Errors)).
    fn tolerance(&self, a: &Part, b: &Part) -> f64 {
        let area = |part: &Part| self.enclosure.facets[part.facet as usize].area();
        let (facets, parts) = ([area(a), area(b)], [a.shape.area(), b.shape.area()]);
        let [i, j] = [a, b].map(|part| self.enclosure.surface_of[part.facet as usize]);
        let surfaces = [i, j].map(|surface| self.areas[surface as usize]);
        let product = |of: [f64; 2]| of[0] * of[1];
        let times = if i == j { 2.0 } else { 1.0 };
        let in_squares = (product(facets) / (times * product(surfaces))).sqrt() * smaller(surfaces);
        let of_facets = if facets == surfaces { in_squares } else { IN_SQUARES * in_squares };
        let share = product(parts) / product(facets);
        self.options.accuracy * (share * of_facets).max(LEAST * smaller(parts))
    }

    /// What two parts exchange if nothing stands between, and the error that what is left of it past panels may have: the whole is asked
    /// for little more exactly than that.
    fn whole(&self, (a, b): (&Part, &Part), far: Exchange, is_cut: bool) -> (Exchange, f64) {
        let tolerance = self.tolerance(a, b);
        let (whole, _) = clear(a, b, far, WHOLE * tolerance, is_cut);
        (whole, (tolerance - whole.error).max(0.5 * tolerance))
    }

    /// A part and what it looks at.
    fn pair(&mut self, part: usize, target: &mut Target) {
        let (a, b) = (&self.clusters.parts[part], target.inner);
        let ends = [a, b].map(End::of_part);
        let facing = if target.facing == Facing::Partly { Facing::of(ends, self.touch) } else { target.facing };
        if facing == Facing::Away {
            self.choices.facing_away += 1;
            return;
        }
        let mut list = Chosen::new();
        if !target.panels.is_empty() {
            let mut shaft = Shaft::new(ends.map(|end| end.corners), [a, b].map(|part| part.shape.normal()), self.touch);
            for (k, panel) in target.panels.iter().enumerate() {
                match shaft.stands(panel, Look::Close) {
                    Stands::Aside => {}
                    Stands::Between => list.push(k as u16),
                    Stands::Across => {
                        self.choices.blocked += 1;
                        return;
                    }
                }
            }
        }
        let (far, is_cut) = (target.far.exchange(part - target.first), facing == Facing::Partly);
        if list.is_empty() {
            return self.clear((a, b), far, is_cut);
        }
        self.choices.clipped += 1;
        let (whole, tolerance) = self.whole((a, b), far, is_cut);
        let scratch = (&mut self.shadows, &mut self.sights);
        let found = target.stage.as_mut().and_then(|stage| stage.mixed(scratch, a, &list, whole, tolerance));
        // Too thin a strip sees the other, or too much stands between for a list.
        self.add(
            (a, b),
            found.unwrap_or(Exchange { value: 0.5 * whole.value, error: 0.5 * whole.value + whole.error }),
        );
    }

    /// Two parts that see each other whole, where they face each other at all.
    fn clear(&mut self, (a, b): (&Part, &Part), far: Exchange, is_cut: bool) {
        let least = a.moments.area.min(b.moments.area);
        let (whole, order) = clear(a, b, far, self.options.clear_accuracy * least, is_cut);
        match order {
            0 => self.choices.clear_closed_form += 1,
            order => self.choices.clear_cubature[order - 1] += 1,
        }
        self.add((a, b), whole);
    }

    fn add(&mut self, (a, b): (&Part, &Part), exchange: Exchange) {
        if exchange.value > 0.0 || exchange.error > 0.0 {
            self.entries.push(Entry::new(a.facet, b.facet, exchange));
        }
    }
}

fn smaller([a, b]: [f64; 2]) -> f64 {
    a.min(b)
}

/// Pairs (i, j) with i < j from two ranges, of which the first is not after the second.
fn pairs(from: Range<usize>, to: Range<usize>) -> usize {
    from.map(|i| to.end.saturating_sub(to.start.max(i + 1))).sum()
}
