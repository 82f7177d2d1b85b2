//! Where light is asked for: elements while the equation is solved, points when an answer is read.

use crate::exposure::{is_buried, open_place};
use crate::gather::near;
use crate::{Exposure, Luminaires};
use glam::{DVec2, DVec3};
use radiosity_scene::elements::triangle_from_square;
use radiosity_scene::{Elements, Mesh};
use radiosity_trace::{Beam, Place, Tracer};
use smallvec::SmallVec;

/// Places keep off the border of their element by about this many welding tolerances (millionths of the scene).
const BORDER: f64 = 4.0;

/// Points in full light get this part of the shadow rays. What these miss they miss at random, as the rays that said
/// so were others.
const IN_LIGHT: u32 = 8;

/// But not fewer than this.
const LEAST: u32 = 8;

/// How often an element is quartered next to a lamp, at most: into parts a thirty-second as long. Those of 30 cm have all the light of a strip 1 cm away; what is
/// much nearer keeps an error that no rays mend. Nor is a cell cut into smaller elements: once more would be four times as many, of two rays each at least.
pub const QUARTERED: usize = 5;

/// Where a receiver lies: all that its places need, worked out once.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    origin: DVec3,
    edges: [DVec3; 2],
    /// Unit normal.
    pub normal: DVec3,
    /// Where it receives with other normals than its own: that at the origin, and by how much it changes along the edges.
    normals: Option<[DVec3; 3]>,
    triangle: u32,
    mask: u64,
}

impl Site {
    /// A part of an element's triangle, on the element's side, by its barycentric corners.
    pub(crate) fn new(mesh: &Mesh, elements: &Elements, element: u32, corners: [DVec2; 3], mask: u64) -> Site {
        let (triangle, _) = elements.place(element);
        let [a, b, c] = corners.map(|uv| mesh.point(triangle, uv));
        // Away from the border by more than rounding moves a ray's origin: a place within a billionth of a wall's foot
        // would let rays start inside the wall.
        let width = (b - a).cross(c - a).length().sqrt();
        let inset = (BORDER * mesh.tolerance / width).min(0.25);
        Site {
            origin: a + inset * ((a + b + c) / 3.0 - a),
            edges: [b - a, c - a].map(|edge| (1.0 - inset) * edge),
            normal: elements.normal(mesh, element),
            normals: None,
            triangle: triangle as u32,
            mask,
        }
    }

    /// The mesh triangle that it lies on; no number of one for places in the open.
    pub fn triangle(&self) -> u32 {
        self.triangle
    }

    /// The middle of it.
    pub(crate) fn middle(&self) -> DVec3 {
        self.origin + (self.edges[0] + self.edges[1]) / 3.0
    }

    /// Its area, m².
    pub(crate) fn area(&self) -> f64 {
        0.5 * self.edges[0].cross(self.edges[1]).length()
    }

    /// Its only place, where it has no area.
    pub fn point(&self) -> Option<Place> {
        let Site { origin, normal, triangle, .. } = *self;
        (self.edges == [DVec3::ZERO; 2]).then_some(Place { point: origin, normal, triangle })
    }

    /// The corners of the triangle that its places lie on, or its only place; none where it has normals of its own all over.
    pub(crate) fn outline(&self) -> Option<SmallVec<[DVec3; 3]>> {
        let Site { origin, edges: [along, across], .. } = *self;
        if self.point().is_some() {
            return Some(SmallVec::from_slice(&[origin]));
        }
        self.normals.is_none().then(|| SmallVec::from_slice(&[origin, origin + along, origin + across]))
    }

    /// Its corners, where it is a flat triangle all of which is exposed.
    pub(crate) fn part(&self) -> Option<[DVec3; 3]> {
        let Site { origin, edges: [along, across], mask, .. } = *self;
        let is_whole = mask == u64::MAX && self.normals.is_none() && self.point().is_none();
        is_whole.then_some([origin, origin + along, origin + across])
    }

    /// Where beams end on it that are lights: a place in each of their cells that is lit, and the lit part of the site that it stands for. What two
    /// of them light is told once.
    pub(crate) fn beam_ends(&self, tracer: &Tracer, luminaires: &Luminaires) -> Vec<(Place, f64)> {
        if self.point().is_some() {
            return Vec::new();
        }
        let exposed = self.area() * f64::from(self.mask.count_ones()) / 64.0;
        let corners = [DVec3::ZERO, self.edges[0], self.edges[1]].map(|edge| self.origin + edge);
        let bounds = corners[1..].iter().fold([corners[0]; 2], |[low, high], p| [low.min(*p), high.max(*p)]);
        let is_about = |beam: &&Beam| {
            let [low, high] = beam.end.bounds();
            low.cmple(bounds[1]).all() && high.cmpge(bounds[0]).all()
        };
        let beams = luminaires.beams_on(tracer, self.triangle).filter(is_about);
        let mut ends = Vec::new();
        for (k, beam) in beams.clone().enumerate() {
            let place = |point| Place { point, normal: self.normal_at(point), triangle: self.triangle };
            let is_own = |place: &Place| beam.holds(place) && !beams.clone().take(k).any(|other| other.holds(place));
            for cell in beam.end.cells().iter().filter(|cell| self.contains(cell.point)) {
                let place = place(cell.point);
                if is_own(&place) {
                    ends.push((place, f64::from(cell.share) * beam.end.area() / exposed));
                }
            }
        }
        ends
    }

    /// How far along its edges a point of its plane lies.
    fn along(&self, point: DVec3) -> [f64; 2] {
        let ([along, across], from) = (self.edges, point - self.origin);
        let normal = along.cross(across);
        let square = normal.length_squared();
        [from.cross(across).dot(normal) / square, along.cross(from).dot(normal) / square]
    }

    fn contains(&self, point: DVec3) -> bool {
        let [u, v] = self.along(point);
        u >= 0.0 && v >= 0.0 && u + v <= 1.0
    }

    /// The normal at a point of its plane.
    fn normal_at(&self, point: DVec3) -> DVec3 {
        self.normals.map_or(self.normal, |[n, along, across]| {
            let [u, v] = self.along(point);
            (n + u * along + v * across).normalize()
        })
    }

    /// Places with weights that add up to one, over which a function has the mean that it has over a whole site: three to each part of it where it is
    /// smooth, to the second degree. Other parts are quartered, a few times at most.
    pub(crate) fn cubature(&self, is_smooth: impl Fn([DVec3; 3]) -> bool, nodes: &mut Vec<(Place, f64)>) {
        let Site { origin, edges: [along, across], normal, triangle, .. } = *self;
        let mut parts = vec![([origin, origin + along, origin + across], 0usize)];
        while let Some(([a, b, c], depth)) = parts.pop() {
            if depth < QUARTERED && !is_smooth([a, b, c]) {
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| 0.5 * (from + to));
                parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]].map(|part| (part, depth + 1)));
                continue;
            }
            let weight = 0.25f64.powi(depth as i32) / 3.0;
            let at = |point| (Place { point, normal, triangle }, weight);
            nodes.extend([(a, b, c), (b, c, a), (c, a, b)].map(|(near, p, q)| at((4.0 * near + p + q) / 6.0)));
        }
    }

    /// The place that (x, y) in the unit square maps to.
    #[inline]
    pub fn place(&self, x: f32, y: f32) -> Place {
        let (x, y) = open_place(self.mask, x, y);
        let (u, v) = triangle_from_square(x, y);
        let point = self.origin + u * self.edges[0] + v * self.edges[1];
        let normal = self.normals.map_or(self.normal, |[n, along, across]| (n + u * along + v * across).normalize());
        Place { point, normal, triangle: self.triangle }
    }
}

/// A list of places that receive light.
pub trait Receivers: Sync {
    /// How many.
    fn len(&self) -> usize;
    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Where receiver `i` lies; `None` if nothing of it is exposed.
    fn site(&self, i: usize) -> Option<Site>;
    /// Whether a place of the receiver lies inside a solid and must not be counted. Asked only where a ray from the
    /// place met a back, or none of its shadow rays came through.
    fn buried(&self, _tracer: &Tracer, _place: &Place, _seed: u32) -> bool {
        false
    }
    /// How many places to look at where a whole cell would get `wanted`.
    fn places(&self, i: usize, wanted: u32) -> u32;
    /// How many shadow rays to send from each place where a receiver of which nothing is known would get `wanted`.
    fn rays(&self, _i: usize, wanted: u32) -> u32 {
        wanted
    }
    /// The distance up to which the receiver is not looked up as a whole, metres; `None` for points.
    fn near(&self, i: usize) -> Option<f64>;
    /// A number that fixes the receiver's random choices: the same for the same place whatever else is asked.
    fn seed(&self, i: usize) -> u32;
}

/// Elements, sampled over the part of them that is not buried in other solids.
pub struct ElementReceivers<'a> {
    /// Their mesh.
    pub mesh: &'a Mesh,
    /// The elements.
    pub elements: &'a Elements,
    /// What of them is exposed.
    pub exposure: &'a Exposure,
}

impl Receivers for ElementReceivers<'_> {
    fn len(&self) -> usize {
        self.elements.len()
    }

    fn site(&self, i: usize) -> Option<Site> {
        let element = i as u32;
        let mask = self.exposure.mask(element);
        if mask == 0 {
            return None;
        }
        Some(Site::new(self.mesh, self.elements, element, self.elements.corners(element), mask))
    }

    fn buried(&self, tracer: &Tracer, place: &Place, seed: u32) -> bool {
        is_buried(tracer, place, seed)
    }

    /// Elements of a divided cell share its places; two are the least that can average over an element.
    fn places(&self, i: usize, wanted: u32) -> u32 {
        ((f64::from(wanted) * self.elements.share(self.mesh, i as u32)).ceil() as u32).max(2)
    }

    fn near(&self, i: usize) -> Option<f64> {
        Some(near(self.elements.area(self.mesh, i as u32)))
    }

    fn seed(&self, i: usize) -> u32 {
        i as u32
    }
}

/// Elements that receive with given normals, those of the smooth surface that they stand for, as points of it do.
pub struct ShadedReceivers<'a> {
    /// All elements.
    pub all: &'a ElementReceivers<'a>,
    /// Those that receive, and the unit normals at their corners.
    pub shaded: &'a [(u32, [DVec3; 3])],
    /// Another number makes other random choices.
    pub salt: u32,
}

impl Receivers for ShadedReceivers<'_> {
    fn len(&self) -> usize {
        self.shaded.len()
    }

    fn site(&self, i: usize) -> Option<Site> {
        let (element, [a, b, c]) = self.shaded[i];
        self.all.site(element as usize).map(|site| Site { normals: Some([a, b - a, c - a]), ..site })
    }

    fn buried(&self, tracer: &Tracer, place: &Place, seed: u32) -> bool {
        is_buried(tracer, place, seed)
    }

    fn places(&self, i: usize, wanted: u32) -> u32 {
        self.all.places(self.shaded[i].0 as usize, wanted)
    }

    fn near(&self, i: usize) -> Option<f64> {
        self.all.near(self.shaded[i].0 as usize)
    }

    fn seed(&self, i: usize) -> u32 {
        self.shaded[i].0 ^ radiosity_trace::sampling::hash(self.salt)
    }
}

/// Points with normals.
pub struct PointReceivers<'a> {
    /// The places.
    pub places: &'a [Place],
    /// Whether any light may be hidden from each, as shadow rays of its surroundings say; empty if nothing is known.
    pub shaded: &'a [bool],
    /// Another number makes other random choices at the same places.
    pub salt: u32,
}

impl Receivers for PointReceivers<'_> {
    fn len(&self) -> usize {
        self.places.len()
    }

    fn site(&self, i: usize) -> Option<Site> {
        let Place { point, normal, triangle } = self.places[i];
        let site = Site { origin: point, edges: [DVec3::ZERO; 2], normal, normals: None, triangle, mask: u64::MAX };
        (normal != DVec3::ZERO).then_some(site)
    }

    fn places(&self, _i: usize, _wanted: u32) -> u32 {
        1
    }

    fn rays(&self, i: usize, wanted: u32) -> u32 {
        if self.shaded.get(i).is_none_or(|shaded| *shaded) {
            wanted
        } else {
            (wanted / IN_LIGHT).max(LEAST).min(wanted)
        }
    }

    fn near(&self, _i: usize) -> Option<f64> {
        None
    }

    fn seed(&self, i: usize) -> u32 {
        // From the position, so that a point's answer does not depend on its number in the list.
        let p = self.places[i].point;
        [p.x, p.y, p.z].iter().fold(0x51ed_270b ^ self.salt, |seed, x| {
            let bits = x.to_bits();
            radiosity_trace::sampling::hash(seed ^ bits as u32 ^ (bits >> 32) as u32)
        })
    }
}
