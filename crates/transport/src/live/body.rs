//! One object that can be moved: its triangles as the file has them, cut into elements, and where it is now.
//!
//! What is in the world follows from the file's triangles and the matrix alone, so that an object that comes back to a
//! place has the same bits there.

use crate::gather::near;
use glam::{DAffine3, DVec2, DVec3};
use radiosity_scene::elements::{corners, division_of, locate, places_over, triangle_from_square};
use radiosity_scene::{AlphaMode, Bands, Scene, Side, Surface};
use radiosity_trace::{Place, Tree};
use std::ops::Range;
use std::sync::Arc;

/// Places keep off the border of their element by about this many offsets, as ray origins are moved by rounding.
const BORDER: f64 = 8.0;

/// What objects and their copies have in common.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Triangles of the scene.
    pub triangles: Range<usize>,
    /// Corners in the world of the file.
    pub corners: Vec<[DVec3; 3]>,
    /// Cells along an edge of each triangle.
    pub division: Vec<u32>,
    /// First element of each triangle's front.
    pub base: Vec<u32>,
    /// Elements of all fronts; those of backs, if they take part, follow in the same order.
    pub fronts: u32,
    /// Whether backs take part in the exchange of light.
    pub has_two_sides: bool,
    /// Whether rays may pass through.
    pub is_see_through: bool,
    /// Mean exitance of each triangle, lm/m² per band: π L times the opacity. Empty where nothing shines.
    pub exitance: Vec<Bands>,
    /// Whether emission or opacity vary over a triangle.
    pub is_varied: bool,
    /// Triangle of each front element.
    triangle_of: Vec<u32>,
}

/// Places that emission is averaged over, where it is a picture.
const PLACES: u32 = 64;

impl Shape {
    /// An object of a scene, cut into elements about `size` wide.
    pub fn new(scene: &Scene, object: usize, size: f64) -> Shape {
        let triangles = scene.objects[object].triangles.clone();
        let material = &scene.materials[scene.objects[object].material];
        let all: Vec<[DVec3; 3]> = triangles.clone().map(|t| scene.corners(t)).collect();
        let division: Vec<u32> = all.iter().map(|c| division_of(*c, size)).collect();
        let (mut base, mut triangle_of) = (Vec::with_capacity(all.len()), Vec::new());
        for (t, k) in division.iter().enumerate() {
            base.push(triangle_of.len() as u32);
            triangle_of.extend(std::iter::repeat_n(t as u32, (k * k) as usize));
        }
        let is_see_through = material.alpha_mode != AlphaMode::Opaque
            && (material.base_color[3] < 1.0
                || !scene.colors.is_empty()
                || material.base_color_texture.is_some_and(|t| !scene.textures[t.texture].is_opaque()));
        let is_varied = material.emissive_texture.is_some()
            || is_see_through && (material.base_color_texture.is_some() || !scene.colors.is_empty());
        let exitance = |triangle: usize| -> Bands {
            let count = if is_varied { PLACES } else { 1 };
            let mut sum = [0.0; 3];
            for uv in places_over([DVec2::ZERO, DVec2::X, DVec2::Y], count, triangle as u32) {
                let given = given_at(scene, Surface { triangle, uv });
                (0..3).for_each(|band| sum[band] += given[band] / count as f32);
            }
            sum
        };
        let exitance = if material.emits() { triangles.clone().map(exitance).collect() } else { Vec::new() };
        Shape {
            exitance,
            is_varied,
            triangles,
            corners: all,
            division,
            base,
            fronts: triangle_of.len() as u32,
            has_two_sides: material.has_two_sides(),
            is_see_through,
            triangle_of,
        }
    }

    /// Number of elements, of backs too.
    pub fn elements(&self) -> u32 {
        self.fronts * (1 + u32::from(self.has_two_sides))
    }

    /// Triangle, side and barycentric corners of an element.
    pub fn place(&self, element: u32) -> (usize, Side, [DVec2; 3]) {
        let (front, side) =
            if element < self.fronts { (element, Side::Front) } else { (element - self.fronts, Side::Back) };
        let triangle = self.triangle_of[front as usize] as usize;
        (triangle, side, corners(front - self.base[triangle], self.division[triangle]))
    }

    /// The element on the other side of an element.
    pub fn opposite(&self, element: u32) -> Option<u32> {
        let front = element < self.fronts;
        self.has_two_sides.then(|| if front { element + self.fronts } else { element - self.fronts })
    }

    /// The element at a place; none on backs that take no part.
    #[inline]
    pub fn at(&self, triangle: u32, u: f32, v: f32, back: bool) -> Option<u32> {
        let t = triangle as usize;
        let element = self.base[t] + locate(u, v, self.division[t]).0;
        match (back, self.has_two_sides) {
            (false, _) => Some(element),
            (true, true) => Some(element + self.fronts),
            (true, false) => None,
        }
    }
}

/// Exitance of a place of the scene, lm/m² per band, as far as it is opaque.
pub fn given_at(scene: &Scene, at: Surface) -> Bands {
    let opacity = scene.opacity(at);
    scene.emitted_luminance(at).map(|l| opacity * l * std::f32::consts::PI)
}

/// Where an element lies: all that its places need.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    origin: DVec3,
    edges: [DVec3; 2],
    /// Unit normal of its side.
    pub normal: DVec3,
    /// Middle of a ball around it.
    pub centre: DVec3,
    /// Radius of the ball.
    pub radius: f64,
    /// Number of the triangle among all.
    pub triangle: u32,
}

impl Site {
    /// A point in the air with a unit normal.
    pub fn in_the_air(point: DVec3, normal: DVec3) -> Site {
        Site { origin: point, edges: [DVec3::ZERO; 2], normal, centre: point, radius: 0.0, triangle: u32::MAX }
    }

    /// The distance below which what looks at it sees more than its mean, metres.
    pub fn near(&self) -> f64 {
        near(0.5 * self.edges[0].cross(self.edges[1]).length())
    }

    /// The place that (x, y) in the unit square maps to.
    #[inline]
    pub fn place(&self, x: f32, y: f32) -> Place {
        let (u, v) = triangle_from_square(f64::from(x), f64::from(y));
        let point = self.origin + u * self.edges[0] + v * self.edges[1];
        Place { point, normal: self.normal, triangle: self.triangle }
    }
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub low: DVec3,
    /// Upper corner.
    pub high: DVec3,
}

impl Bounds {
    /// The ball around it.
    pub fn ball(&self) -> (DVec3, f64) {
        (0.5 * (self.low + self.high), 0.5 * self.low.distance(self.high))
    }

    /// Whether a ray up to `length` may meet it; never wrong where it says no.
    #[inline]
    pub fn may_meet(&self, origin: DVec3, direction: DVec3, length: f64, margin: f64) -> bool {
        let inverse = 1.0 / direction;
        let (a, b) = ((self.low - margin - origin) * inverse, (self.high + margin - origin) * inverse);
        // Where a direction is zero and a face goes through the origin, 0 · ∞ is no number and cuts nothing off: that is within the
        // margin of the box.
        let (near, far) = (a.min(b), a.max(b));
        let enter = near.x.max(near.y).max(near.z).max(0.0);
        let leave = far.x.min(far.y).min(far.z).min(length + margin);
        enter <= leave
    }
}

/// An object in the world. Coordinates are about the middle of the scene.
#[derive(Clone, Debug)]
pub struct Body {
    /// What it shares with its copies.
    pub shape: Arc<Shape>,
    /// Fixes its random choices.
    pub key: u32,
    /// Number of its first triangle among all.
    pub first_triangle: u32,
    /// Id of its first element; after the last one comes that of its black backs.
    pub first: u32,
    /// From the file's world to its place.
    pub matrix: DAffine3,
    /// Whether it is there.
    pub is_present: bool,
    /// Corners about the middle of the scene.
    pub corners: Vec<[DVec3; 3]>,
    /// Unit normals of fronts.
    pub normals: Vec<DVec3>,
    /// The box around it.
    pub bounds: Bounds,
    /// Its own tree, where it is not where the common one has it.
    pub tree: Option<Tree>,
}

impl Body {
    /// Number of elements.
    pub fn elements(&self) -> u32 {
        self.shape.elements()
    }

    /// Id of its black backs.
    pub fn dark(&self) -> u32 {
        self.first + self.elements()
    }

    /// Whether an id is one of its own.
    #[inline]
    pub fn has(&self, id: u32) -> bool {
        id.wrapping_sub(self.first) <= self.elements()
    }

    /// Puts it somewhere.
    pub fn place_at(&mut self, matrix: DAffine3, middle: DVec3) {
        self.matrix = matrix;
        self.corners = self.shape.corners.iter().map(|c| c.map(|p| matrix.transform_point3(p) - middle)).collect();
        self.normals = self.corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).normalize_or_zero()).collect();
        self.bounds = bounds_of(&self.corners);
    }

    /// A place on an element by the weights of its corners 1 and 2, which change places on backs: triangle, side, and the point
    /// about the middle of the scene.
    pub fn point(&self, element: u32, uv: [f32; 2]) -> (usize, Side, DVec3) {
        let (t, side, mut corners) = self.shape.place(element);
        if side == Side::Back {
            corners.swap(1, 2);
        }
        let weights = DVec2::from(uv.map(f64::from));
        let on = corners[0] + weights.x * (corners[1] - corners[0]) + weights.y * (corners[2] - corners[0]);
        let [a, b, c] = self.corners[t];
        (t, side, a + on.x * (b - a) + on.y * (c - a))
    }

    /// That point, and the unit normal of its side.
    pub fn facing(&self, element: u32, uv: [f32; 2]) -> (DVec3, DVec3) {
        let (t, side, point) = self.point(element, uv);
        (point, self.normal(t, side))
    }

    fn normal(&self, t: usize, side: Side) -> DVec3 {
        if side == Side::Front { self.normals[t] } else { -self.normals[t] }
    }

    /// Where a line of sight crosses the plane of an element, as [`Body::point`] takes it; none along the plane.
    pub fn towards(&self, element: u32, from: DVec3, direction: DVec3) -> Option<[f32; 2]> {
        let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|uv| self.point(element, uv).2);
        let normal = (b - a).cross(c - a);
        let along = direction.dot(normal);
        let at = from + (a - from).dot(normal) / along * direction - a;
        let uv = DVec2::new(at.cross(c - a).dot(normal), (b - a).cross(at).dot(normal)) / normal.length_squared();
        uv.is_finite().then(|| uv.as_vec2().to_array())
    }

    /// Area of an element, m².
    pub fn area(&self, element: u32) -> f64 {
        let (t, _, _) = self.shape.place(element);
        let [a, b, c] = self.corners[t];
        0.5 * (b - a).cross(c - a).length() / f64::from(self.shape.division[t].pow(2))
    }

    /// What it shines with, lm per band, both sides together.
    pub fn flux(&self) -> Bands {
        let sides = if self.shape.has_two_sides { 2.0 } else { 1.0 };
        let mut sum = [0f64; 3];
        for ([a, b, c], exitance) in self.corners.iter().zip(&self.shape.exitance) {
            let area = 0.5 * (*b - *a).cross(*c - *a).length();
            (0..3).for_each(|band| sum[band] += sides * area * f64::from(exitance[band]));
        }
        sum.map(|flux| flux as f32)
    }

    /// How many times the surface goes around a point, fronts outwards: the solid angle that it fills over 4π (van Oosterom and
    /// Strackee 1983; Jacobson, Kavan and Sorkine-Hornung 2013). 1 inside a closed solid, 0 outside, and near to that where
    /// the solid has small holes.
    pub fn winding(&self, point: DVec3) -> f64 {
        let half_angle = |corners: &[DVec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner - point);
            let [la, lb, lc] = [a, b, c].map(DVec3::length);
            let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            a.dot(b.cross(c)).atan2(denominator)
        };
        self.corners.iter().map(half_angle).sum::<f64>() / std::f64::consts::TAU
    }

    /// Where an element lies; `offset` is that of ray origins.
    pub fn site(&self, element: u32, offset: f64) -> Site {
        let (t, side, uv) = self.shape.place(element);
        let [p, q, r] = self.corners[t];
        let [a, b, c] = uv.map(|uv| p + uv.x * (q - p) + uv.y * (r - p));
        let width = (b - a).cross(c - a).length().sqrt();
        let inset = (BORDER * offset / width).min(0.25);
        let centre = (a + b + c) / 3.0;
        Site {
            origin: a + inset * (centre - a),
            edges: [b - a, c - a].map(|edge| (1.0 - inset) * edge),
            normal: self.normal(t, side),
            centre,
            radius: a.distance(centre).max(b.distance(centre)).max(c.distance(centre)),
            triangle: self.first_triangle + t as u32,
        }
    }
}

/// The box around triangles.
pub fn bounds_of(corners: &[[DVec3; 3]]) -> Bounds {
    let empty = Bounds { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
    corners.iter().flatten().fold(empty, |b, p| Bounds { low: b.low.min(*p), high: b.high.max(*p) })
}
