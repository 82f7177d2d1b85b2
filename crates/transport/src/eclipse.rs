//! What of a lamp a place sees past triangles, exactly.
//!
//! Seen from a place, a triangle hides of the lamp's plane what lies within the planes through the place and its edges, and
//! beyond its own: a convex polygon. What these leave of the lamp is cut into convex pieces, whose form factors are known
//! (Nishita and Nakamae 1985, "Continuous tone representation of three-dimensional objects taking account of shadows and
//! interreflection"; Hart, Dutré and Greenberg 1999 find the blockers by rays). Two triangles that share an edge cut along
//! the same line, so nothing shines through between them.
//!
//! What stands just before a lamp, nearer than where shadow rays end (some four millionths of their length), is cut out here and not met by rays:
//! an audit by rays takes a cover there for none.

use crate::luminaires::Panel;
use crate::polygon::{self, point_to_polygon_above};
use crate::{Luminaires, Site};
use glam::{DVec2, DVec3};
use radiosity_trace::{Blocker, Place, Tracer};
use smallvec::SmallVec;
use std::ops::Range;

/// Blockers between a receiver and a panel at most: pieces grow with their number, and with fifty of them a place takes some 30 µs.
const MOST_BLOCKERS: usize = 48;

/// So many blockers are cut for each ray that a panel would have at a place. They take several times as long as the rays, which leave
/// noise.
const FOR_A_RAY: f64 = 8.0;

/// Fewest rays, over all places of a receiver, for which blockers are looked for: to find none takes as long as some six rays.
const LEAST_RAYS: f64 = 8.0;

/// Distance of panels from the middle of an element over its longest edge from which on three places tell the mean: next to it that is off by a twentieth, at twice by up to
/// a thousandth, and by half a percent where the lamp is seen at a grazing angle. With twice a ceiling of elements of 3 mm missed 0.28 % of what a strip 1 cm below sends there, with three times 0.05 %. (Of a sliver the width says nothing: its three places miss a lamp above its middle.)
const FAR: f64 = 3.0;

/// Height above a plane over that edge up to which an element or a lamp lies in it: from there no light comes.
const BESIDE: f64 = 1e-6;

/// Pieces that are left of a lamp at most: of fifty blockers in an office there are sixteen on average.
const MOST_PIECES: usize = 64;

/// Cosine of normals that are the same.
const FLAT: f64 = 1.0 - 1e-9;

/// Heights below this are taken for zero, relative to the largest of the polygon: cuts along an edge leave no slivers.
const ROUNDING: f64 = 1e-12;

/// Shares this near to none and all are that: what rounding leaves of pieces that vanish is no light.
const SLIVER: f64 = 1e-9;

/// Corners of a piece at most: two registers of four.
const MOST_CORNERS: usize = 8;

/// A convex polygon on the plane of the lamp. Behind its corners the last one is repeated, so that all are looked at alike.
#[derive(Clone, Copy)]
struct Polygon {
    len: usize,
    x: [f64; MOST_CORNERS],
    y: [f64; MOST_CORNERS],
}

impl Polygon {
    const NONE: Polygon = Polygon { len: 0, x: [0.0; MOST_CORNERS], y: [0.0; MOST_CORNERS] };

    #[inline(always)]
    fn push(&mut self, x: f64, y: f64) {
        if self.len < MOST_CORNERS {
            (self.x[self.len], self.y[self.len]) = (x, y);
        }
        self.len += 1;
    }

    /// Repeats the last corner; none without an inside, or with too many corners.
    #[inline(always)]
    fn closed(mut self) -> Option<Polygon> {
        if self.len < 3 || self.len > MOST_CORNERS {
            return None;
        }
        for k in self.len..MOST_CORNERS {
            (self.x[k], self.y[k]) = (self.x[self.len - 1], self.y[self.len - 1]);
        }
        Some(self)
    }
}

/// What of a polygon lies below and above a line.
struct Halves {
    below: Polygon,
    above: Polygon,
}

/// Room to cut polygons in.
#[derive(Default)]
pub struct Cuts {
    pieces: Vec<Polygon>,
    shadows: Vec<(f64, Shadow)>,
}

/// What stands between the places of one receiver and the panels of all lights.
#[derive(Default)]
pub struct Sights {
    site: Option<Site>,
    places: f64,
    /// By light and panel.
    between: Vec<Vec<Between>>,
    blockers: Vec<Blocker>,
    cuts: Cuts,
}

/// What stands between a receiver and a panel.
#[derive(Clone)]
enum Between {
    /// More than so many blockers, or what is not cut at all.
    More(usize),
    /// Some of those that were found.
    All(Range<usize>),
}

impl Sights {
    /// At another receiver, of so many places.
    pub fn go_to(&mut self, site: Site, luminaires: &Luminaires, places: u32) {
        (self.site, self.places) = (Some(site), f64::from(places));
        self.blockers.clear();
        self.between.resize_with(luminaires.panels.len(), Vec::new);
        for (between, panels) in self.between.iter_mut().zip(&luminaires.panels) {
            between.clear();
            between.resize(panels.len(), Between::More(0));
        }
    }

    /// The share of what a panel, by its light and number, gives to a place of the receiver that reaches it; none where so many `rays`
    /// at each place are a better way to tell.
    pub(crate) fn share(
        &mut self,
        (light, panel, k): (usize, &Panel, usize),
        tracer: &Tracer,
        place: &Place,
        rays: f64,
    ) -> Option<f64> {
        let range = self.between((light, panel, k), tracer, rays)?;
        if range.is_empty() {
            return Some(1.0);
        }
        self.cuts.visible(place, panel, tracer.offset(), &self.blockers[range])
    }

    /// Whether all there is are panels, and nothing stands before any; without looking where so many `rays` at each place are a better way to
    /// tell.
    pub fn are_clear(&mut self, luminaires: &Luminaires, tracer: &Tracer, rays: u32) -> bool {
        let panels = || luminaires.lights.iter().zip(&luminaires.panels).map(|(_, panels)| panels);
        if panels().any(Vec::is_empty) {
            return false;
        }
        let rays = f64::from(rays) / panels().map(Vec::len).sum::<usize>() as f64;
        let mut is_clear = |of| self.between(of, tracer, rays).is_some_and(|found| found.is_empty());
        panels()
            .enumerate()
            .all(|(light, panels)| panels.iter().enumerate().all(|(k, panel)| is_clear((light, panel, k))))
    }

    /// Which blockers stand before a panel, if they are few for so many rays.
    fn between(
        &mut self,
        (light, panel, k): (usize, &Panel, usize),
        tracer: &Tracer,
        rays: f64,
    ) -> Option<Range<usize>> {
        let Sights { site, places, between, blockers, .. } = self;
        let known = &mut between[light][k];
        let most = MOST_BLOCKERS.min((rays * FOR_A_RAY) as usize);
        if let Between::More(looked_for) = *known
            && looked_for < most
            && rays * *places >= LEAST_RAYS
        {
            let found = find(site.as_ref()?, panel, tracer, most, blockers);
            *known = found.map_or(Between::More(most), Between::All);
        }
        match known {
            Between::More(_) => None,
            Between::All(range) => Some(range.clone()),
        }
    }
}

/// Whether what panels give is smooth over a part of a site with such a normal: all that give it light are far from it.
pub(crate) fn is_smooth<'p>(panels: impl IntoIterator<Item = &'p Panel>, part: [DVec3; 3], normal: DVec3) -> bool {
    let [a, b, c] = part;
    let (centre, longest) = ((a + b + c) / 3.0, a.distance(b).max(b.distance(c)).max(c.distance(a)));
    let faces = |corners: &[DVec3], from: DVec3, normal: DVec3| {
        corners.iter().any(|corner| (corner - from).dot(normal) > BESIDE * longest)
    };
    panels.into_iter().all(|panel| {
        !faces(&panel.corners, centre, normal)
            || !faces(&part, panel.corners[0], -panel.axes[2])
            || panel.distance(centre) > FAR * longest
    })
}

/// Adds what stands between a receiver and a panel to `blockers`, and answers which these are; none where there is too much, or it
/// lies across the plane of the panel.
fn find(site: &Site, panel: &Panel, tracer: &Tracer, most: usize, blockers: &mut Vec<Blocker>) -> Option<Range<usize>> {
    let offset = tracer.offset();
    let from = site.outline()?;
    let from: SmallVec<[DVec3; 3]> = from.into_iter().map(|p| p + offset * site.normal).collect();
    let [.., towards] = panel.axes;
    let to: SmallVec<[DVec3; 8]> = panel.corners.iter().map(|p| *p - offset * towards).collect();
    let heights: SmallVec<[f64; 8]> = to.iter().map(|p| site.normal.dot(*p - from[0])).collect();
    let is_behind = |p: &DVec3| towards.dot(to[0] - *p) <= 0.0;
    let has_area = site.point().is_none();
    if from.iter().all(is_behind) || has_area && heights.iter().all(|h| *h <= 0.0) {
        // It gives nothing, whatever stands between.
        return Some(0..0);
    }
    // Where the normal is not that of the triangle, this hides what lies below it.
    let triangle = site.triangle() as usize;
    let flat = if triangle < tracer.mesh.triangles.len() { tracer.mesh.normal(triangle) } else { site.normal };
    let turned = flat.dot(site.normal);
    let is_hidden = |p: &DVec3| turned.abs() < FLAT && turned.signum() * flat.dot(*p - from[0]) < 0.0;
    if from.iter().any(is_behind) || to.iter().any(is_hidden) {
        return None;
    }
    let to = if heights.iter().any(|h| *h < 0.0) { polygon::above(&to, &heights).into() } else { to };
    if to.len() < 3 {
        return None;
    }
    let first = blockers.len();
    tracer.blockers((&from, site.triangle()), &to, most, blockers).then_some(first..blockers.len())
}

/// A line a + b · x = 0 on the plane of the lamp.
#[derive(Clone, Copy, Default)]
struct Line {
    offset: f64,
    slope: DVec2,
}

/// What a triangle hides: all that lies above some lines.
type Shadow = SmallVec<[Line; 5]>;

/// Axes along a lamp and towards it, from a place.
struct View {
    axes: [DVec3; 3],
    from: DVec3,
    /// The unit normal of the place.
    up: DVec3,
    /// Distance of the lamp's plane.
    distance: f64,
}

/// How a convex polygon lies to a shadow.
#[derive(PartialEq)]
enum Lies {
    Outside,
    Across,
    Inside,
}

impl Cuts {
    /// The share of what a panel gives to a place that comes past blockers; none where it takes too many cuts. Place and panel
    /// count as `offset` off their surfaces.
    fn visible(&mut self, place: &Place, panel: &Panel, offset: f64, blockers: &[Blocker]) -> Option<f64> {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has it.
            return unsafe { self.visible_avx2(place, panel, offset, blockers) };
        }
        self.cut_out(place, panel, offset, blockers)
    }

    /// Four lanes of a double are one register there.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn visible_avx2(&mut self, place: &Place, panel: &Panel, offset: f64, blockers: &[Blocker]) -> Option<f64> {
        self.cut_out(place, panel, offset, blockers)
    }

    #[inline(always)]
    fn cut_out(&mut self, place: &Place, panel: &Panel, offset: f64, blockers: &[Blocker]) -> Option<f64> {
        let view = View::new(place, panel, offset);
        let mut target = Polygon::NONE;
        for p in &panel.corners {
            let p = view.of(*p);
            target.push(p.x, p.y);
        }
        let mut target = target.closed()?;
        let heights = view.line(view.up, 0.0).heights(&target);
        let [low, _, reach] = range(&heights);
        if low < -reach {
            target = halves(&heights, reach, &target).above.closed()?;
        }
        self.shadows.clear();
        for blocker in blockers {
            let Some(shadow) = view.shadow(blocker.corners()) else { continue };
            match lies(&target, &shadow) {
                (Lies::Outside, _) => {}
                (Lies::Inside, _) => return Some(0.0),
                (Lies::Across, share) => self.shadows.push((share, shadow)),
            }
        }
        if self.shadows.is_empty() {
            return Some(1.0);
        }
        // Large ones first: what they hide need not be cut by small ones.
        self.shadows.sort_by(|a, b| b.0.total_cmp(&a.0));
        let whole = view.factor(&target);
        if whole <= 0.0 {
            return None;
        }
        self.pieces.clear();
        self.pieces.push(target);
        for (_, shadow) in &self.shadows {
            cut(&mut self.pieces, shadow)?;
            match self.pieces.len() {
                0 => return Some(0.0),
                many if many > MOST_PIECES => return None,
                _ => {}
            }
        }
        let left: f64 = self.pieces.iter().map(|piece| view.factor(piece)).sum();
        Some(match left / whole {
            share if share > SLIVER && share < 1.0 - SLIVER => share,
            share if share >= 0.5 => 1.0,
            _ => 0.0,
        })
    }
}

/// Takes a shadow away from some pieces; none where one has too many corners.
#[inline(always)]
fn cut(pieces: &mut Vec<Polygon>, shadow: &[Line]) -> Option<()> {
    let mut k = 0;
    let mut end = pieces.len();
    while k < end {
        match lies(&pieces[k], shadow).0 {
            Lies::Outside => {
                k += 1;
                continue;
            }
            Lies::Inside => {}
            // Line by line: what lies below one is left, what lies above all is hidden.
            Lies::Across => {
                let mut rest = pieces[k];
                for line in shadow {
                    let heights = line.heights(&rest);
                    let [low, high, reach] = range(&heights);
                    if low >= -reach {
                        continue;
                    }
                    if high <= reach {
                        pieces.push(rest);
                        break;
                    }
                    let Halves { below, above } = halves(&heights, reach, &rest);
                    if below.len >= 3 {
                        pieces.push(below.closed()?);
                    }
                    if above.len < 3 {
                        break;
                    }
                    rest = above.closed()?;
                }
            }
        }
        // What was left of it lies behind all others, and need not be looked at again.
        end -= 1;
        pieces.swap(k, end);
        pieces.swap_remove(end);
    }
    Some(())
}

impl Line {
    /// Heights of the corners of a polygon.
    #[inline(always)]
    fn heights(self, polygon: &Polygon) -> [f64; MOST_CORNERS] {
        std::array::from_fn(|k| self.slope.x * polygon.x[k] + self.slope.y * polygon.y[k] + self.offset)
    }
}

/// Cuts a polygon in two, by heights of its corners of which those up to `reach` count as none.
#[inline(always)]
fn halves(heights: &[f64; MOST_CORNERS], reach: f64, polygon: &Polygon) -> Halves {
    let mut halves = Halves { below: Polygon::NONE, above: Polygon::NONE };
    let last = polygon.len - 1;
    let (mut x, mut y, mut h) = (polygon.x[last], polygon.y[last], heights[last]);
    for (k, &height) in heights.iter().enumerate().take(polygon.len) {
        let (to_x, to_y) = (polygon.x[k], polygon.y[k]);
        if (h > reach && height < -reach) || (h < -reach && height > reach) {
            let t = h / (h - height);
            let (x, y) = (x + t * (to_x - x), y + t * (to_y - y));
            halves.below.push(x, y);
            halves.above.push(x, y);
        }
        if height >= -reach {
            halves.above.push(to_x, to_y);
        }
        if height <= reach {
            halves.below.push(to_x, to_y);
        }
        (x, y, h) = (to_x, to_y, height);
    }
    halves
}

/// Least and greatest height, and what counts as none.
#[inline(always)]
fn range(heights: &[f64; MOST_CORNERS]) -> [f64; 3] {
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for four in heights.chunks_exact(4) {
        for k in 0..4 {
            low[k] = if four[k] < low[k] { four[k] } else { low[k] };
            high[k] = if four[k] > high[k] { four[k] } else { high[k] };
        }
    }
    let low = low[0].min(low[1]).min(low[2].min(low[3]));
    let high = high[0].max(high[1]).max(high[2].max(high[3]));
    [low, high, ROUNDING * high.max(-low)]
}

impl View {
    fn new(place: &Place, panel: &Panel, offset: f64) -> View {
        let from = place.point + offset * place.normal;
        let up = DVec3::from_array(panel.axes.map(|axis| axis.dot(place.normal)));
        let distance = panel.axes[2].dot(panel.corners[0] - from) - offset;
        View { axes: panel.axes, from, up, distance }
    }

    #[inline(always)]
    fn of(&self, p: DVec3) -> DVec3 {
        let p = p - self.from;
        DVec3::new(self.axes[0].dot(p), self.axes[1].dot(p), self.axes[2].dot(p))
    }

    /// Where a plane meets that of the lamp.
    #[inline(always)]
    fn line(&self, normal: DVec3, offset: f64) -> Line {
        Line { offset: normal.z * self.distance - offset, slope: normal.truncate() }
    }

    /// What a triangle hides, if anything.
    #[inline(always)]
    fn shadow(&self, corners: &[DVec3]) -> Option<Shadow> {
        let mut seen = [DVec3::ZERO; 4];
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (seen, corner) in seen.iter_mut().zip(corners) {
            *seen = self.of(*corner);
            (low, high) = (low.min(seen.z), high.max(seen.z));
        }
        if low >= self.distance || high <= 0.0 {
            return None;
        }
        let seen = &seen[..corners.len()];
        let mut normals = [DVec3::ZERO; 4];
        let mut before = seen[seen.len() - 1];
        for (normal, corner) in normals.iter_mut().zip(seen) {
            *normal = before.cross(*corner);
            before = *corner;
        }
        let normals = &normals[..seen.len()];
        // Twice the area along the normal of the polygon.
        let normal: DVec3 = normals.iter().sum();
        let height = normal.dot(seen[0]);
        // Seen edge on it hides nothing.
        if height == 0.0 {
            return None;
        }
        let turn = height.signum();
        let mut shadow: Shadow = normals.iter().map(|normal| self.line(turn * *normal, 0.0)).collect();
        if high > self.distance {
            shadow.push(self.line(turn * normal, turn * height));
        }
        Some(shadow)
    }

    /// Form factor of a polygon that faces the place.
    fn factor(&self, polygon: &Polygon) -> f64 {
        let corners: [DVec3; MOST_CORNERS] =
            std::array::from_fn(|k| DVec3::new(polygon.x[k], polygon.y[k], self.distance));
        point_to_polygon_above(DVec3::ZERO, self.up, &corners[..polygon.len])
    }
}

/// How a polygon lies to a shadow, and about which share of it is hidden.
#[inline(always)]
fn lies(polygon: &Polygon, shadow: &[Line]) -> (Lies, f64) {
    let (mut lies, mut share) = (Lies::Inside, 1.0);
    for line in shadow {
        let [low, high, reach] = range(&line.heights(polygon));
        if high <= reach {
            return (Lies::Outside, 0.0);
        }
        if low < -reach {
            lies = Lies::Across;
            share *= high / (high - low);
        }
    }
    (lies, share)
}
