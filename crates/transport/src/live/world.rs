//! All objects, and who is met first among them.
//!
//! One tree of boxes has all objects as they were when it was built; those that were moved since are taken out of it and
//! have trees of their own, and many of them one more together. Which hit counts depends on the triangles alone: the smallest key, of equal ones the lowest
//! number. So hits do not depend on how the objects are shared out among the trees.

use super::body::{Body, Bounds, Shape};
use glam::{DAffine3, DVec2, DVec3, Vec3};
use radiosity_scene::{Scene, SkyPatches, Surface};
use radiosity_trace::sampling::{hash, unit};
use radiosity_trace::{Hit, Place, Ray, Tree};
use std::sync::Arc;

/// How far from the middle objects may be, in half extents of the scene as it was handed in.
pub const REACH: f64 = 4.0;

/// Objects with trees of their own beyond which one tree is built for all: each costs every ray a look at its box. While rays are
/// traced it is one for these alone, as in large scenes nobody waits for one of all.
const MOST_APART: usize = 6;

/// Backs that one sees through along a line: of more, as in a stack of one-sided sheets, what is behind is not told.
const MOST_BACKS: u32 = 64;

/// All objects.
pub struct World {
    /// The scene as handed in, with what was added since: numbers of triangles refer to it.
    pub scene: Arc<Scene>,
    /// Width of an element, metres.
    pub element_size: f64,
    /// The objects; those taken away too.
    pub bodies: Vec<Body>,
    /// The sky's patches, which have the first ids.
    pub sky: SkyPatches,
    /// Middle of the scene as handed in.
    pub middle: DVec3,
    /// Half its extent, metres.
    pub half: f64,
    /// By how much ray origins are moved off their surface, metres.
    pub offset: f64,
    /// Object of each triangle.
    body_of: Vec<u32>,
    common: Tree,
    /// Whether each object is not where the common tree has it.
    is_away: Vec<bool>,
    /// Objects that are met in trees of their own, in their order.
    apart: Vec<u32>,
    /// One tree for all of these, if there is one.
    joint: Option<Joint>,
    is_opaque: bool,
    /// Next free id.
    ids: u32,
}

/// A tree of several objects.
struct Joint {
    tree: Tree,
    /// The number of each of its triangles among all, which grow.
    triangles: Vec<u32>,
}

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// The distance by which hits compete.
    pub key: f32,
    /// Number of the triangle among all.
    pub triangle: u32,
    /// Weights of its corners 1 and 2.
    pub uv: [f32; 2],
    /// Whether its back was met.
    pub back: bool,
}

impl World {
    /// All objects of a scene, cut into elements about `size` wide.
    pub fn new(scene: Arc<Scene>, size: f64) -> World {
        let [low, high] = scene.bounding_box().unwrap_or([DVec3::ZERO; 2]);
        let half = (0.5 * (high - low)).max_element().max(f64::MIN_POSITIVE);
        let sky = SkyPatches::new(&scene.sky, scene.up.direction());
        let mut world = World {
            bodies: Vec::new(),
            sky,
            middle: 0.5 * (low + high),
            half,
            // That of batch work (2^-21 of half the extent), twice since objects may be moved to where single precision
            // is coarser.
            offset: half * 2f64.powi(-20),
            body_of: Vec::new(),
            common: Tree::new(&[]),
            is_away: Vec::new(),
            apart: Vec::new(),
            joint: None,
            is_opaque: true,
            ids: sky.len() as u32,
            scene,
            element_size: size,
        };
        for object in 0..world.scene.objects.len() {
            world.add(world.shape(object), DAffine3::IDENTITY);
        }
        world.gather_trees();
        world
    }

    /// Number of ids: the sky's patches, then for each object its elements and its black backs.
    pub fn ids(&self) -> usize {
        self.ids as usize
    }

    /// An object of the scene, cut into elements.
    pub fn shape(&self, object: usize) -> Arc<Shape> {
        Arc::new(Shape::new(&self.scene, object, self.element_size))
    }

    /// Adds an object, without a tree; answers its number.
    pub fn add(&mut self, shape: Arc<Shape>, matrix: DAffine3) -> usize {
        let body = self.bodies.len();
        let first_triangle = self.body_of.len() as u32;
        self.body_of.extend(std::iter::repeat_n(body as u32, shape.corners.len()));
        self.is_opaque &= !shape.is_see_through;
        let first = self.ids;
        self.ids += shape.elements() + 1;
        let mut added = Body {
            shape,
            key: hash(body as u32 ^ 0x0b0d_1e55),
            first_triangle,
            first,
            matrix,
            is_present: true,
            corners: Vec::new(),
            normals: Vec::new(),
            bounds: Bounds { low: DVec3::ZERO, high: DVec3::ZERO },
            tree: None,
        };
        added.place_at(matrix, self.middle);
        self.bodies.push(added);
        self.is_away.push(true);
        body
    }

    /// Puts an object elsewhere, or brings it back, with a tree of its own.
    pub fn place(&mut self, body: usize, matrix: DAffine3) {
        self.take_out(body);
        let own = &mut self.bodies[body];
        own.place_at(matrix, self.middle);
        own.is_present = true;
        own.tree = Some(Tree::new(&single(&own.corners)).as_part((REACH * self.half) as f32));
        if let Err(at) = self.apart.binary_search(&(body as u32)) {
            self.apart.insert(at, body as u32);
        }
    }

    /// Takes an object away.
    pub fn remove(&mut self, body: usize) {
        self.take_out(body);
        self.bodies[body].is_present = false;
        self.bodies[body].tree = None;
        self.apart.retain(|other| *other != body as u32);
    }

    /// Takes an object out of the trees of several.
    fn take_out(&mut self, body: usize) {
        self.joint = None;
        if !std::mem::replace(&mut self.is_away[body], true) {
            let own = &self.bodies[body];
            let last = own.first_triangle + own.corners.len() as u32;
            self.common.take_out(own.first_triangle..last, [own.bounds.low, own.bounds.high].map(|p| p.as_vec3()));
        }
    }

    /// Whether so many objects have trees of their own that one for all is better.
    pub fn is_scattered(&self) -> bool {
        self.apart.len() > MOST_APART
    }

    /// Before rays are traced: sees to it that they look at few trees. Objects keep those of their own.
    pub fn join_trees(&mut self) {
        if !self.is_scattered() || self.joint.is_some() {
            return;
        }
        let count: usize = self.apart.iter().map(|body| self.bodies[*body as usize].corners.len()).sum();
        if 2 * count > self.body_of.len() {
            // One for all takes as long, and rays need not pass the most of the common one.
            return self.gather_trees();
        }
        let (mut corners, mut triangles) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for body in self.apart.iter().map(|body| &self.bodies[*body as usize]) {
            corners.extend(single(&body.corners));
            triangles.extend((body.first_triangle..).take(body.corners.len()));
        }
        self.joint = Some(Joint { tree: Tree::new(&corners).as_part((REACH * self.half) as f32), triangles });
    }

    /// Drops trees of objects that are met in the common one.
    pub fn drop_trees(&mut self) {
        for (body, _) in self.bodies.iter_mut().zip(&self.is_away).filter(|(_, is_away)| !**is_away) {
            body.tree = None;
        }
    }

    /// Builds one tree for all objects, which keep those of their own.
    pub fn gather_trees(&mut self) {
        let mut corners = Vec::with_capacity(self.body_of.len());
        for body in &self.bodies {
            if body.is_present {
                corners.extend(single(&body.corners));
            } else {
                corners.extend(std::iter::repeat_n([Vec3::NAN; 3], body.corners.len()));
            }
        }
        self.joint = None;
        self.common = Tree::new(&corners).as_part((REACH * self.half) as f32);
        self.is_away.fill(false);
        self.apart.clear();
    }

    /// How far outside its box a ray may meet an object: each coordinate of a corner may be off by 2^-21 of the distance to the far side
    /// of the scene, which is eight half extents at the most; all three together by less than twice as much.
    pub fn margin(&self) -> f64 {
        8.0 * self.offset
    }

    /// The object of a triangle.
    pub fn body_of(&self, triangle: u32) -> usize {
        self.body_of[triangle as usize] as usize
    }

    /// The object that an id belongs to; none for the sky.
    pub fn body_of_id(&self, id: u32) -> Option<usize> {
        self.bodies.partition_point(|body| body.first <= id).checked_sub(1)
    }

    /// The ray that leaves a place. It does not meet the triangle of the place.
    #[inline]
    pub fn ray(&self, from: &Place, direction: DVec3, length: f64) -> Ray {
        let origin = from.point + self.offset * from.normal;
        Ray { origin: origin.as_vec3(), direction: direction.as_vec3(), t_max: length as f32, skip: from.triangle }
    }

    /// What a ray meets first.
    #[inline]
    pub fn first(&self, ray: &Ray, salt: u32) -> Option<Met> {
        let mut first: Option<Met> = None;
        let mut compete = |met: Option<Met>| {
            if let Some(met) = met
                && first.is_none_or(|best| (met.key, met.triangle) < (best.key, best.triangle))
            {
                first = Some(met);
            }
            first.map_or(f32::INFINITY, |best| best.key)
        };
        let mut key = f32::INFINITY;
        match &self.joint {
            Some(joint) => key = compete(self.first_of_joint(joint, ray, salt, key)),
            None => {
                let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
                for body in self.apart.iter().map(|body| *body as usize) {
                    let length = f64::from(key.min(ray.t_max));
                    if self.bodies[body].bounds.may_meet(origin, direction, length, self.margin()) {
                        key = compete(self.first_of(body, ray, salt, key));
                    }
                }
            }
        }
        // The large tree last: by now rays are as short as they get.
        let ray = Ray { t_max: ray.t_max.min(key.next_up()), ..*ray };
        let hit = if self.is_opaque {
            self.common.closest(&ray)
        } else {
            self.common.closest_where(&ray, |t, u, v, _| self.stops(t, u, v, salt))
        };
        compete(hit.map(|hit| self.met(&self.common, &hit, 0)));
        first
    }

    /// What a ray meets first of the objects of one tree, if its key is no more than `key`.
    fn first_of_joint(&self, joint: &Joint, ray: &Ray, salt: u32, key: f32) -> Option<Met> {
        let ray = Ray { t_max: ray.t_max.min(key.next_up()), skip: self.skip_of_joint(joint, ray.skip), ..*ray };
        let hit = if self.is_opaque {
            joint.tree.closest(&ray)
        } else {
            joint.tree.closest_where(&ray, |t, u, v, _| self.stops(joint.triangles[t as usize], u, v, salt))
        };
        let met =
            hit.map(|hit| Met { triangle: joint.triangles[hit.triangle as usize], ..self.met(&joint.tree, &hit, 0) });
        met.filter(|met| met.key <= key)
    }

    /// What the number of a triangle among all is in the tree of several objects.
    fn skip_of_joint(&self, joint: &Joint, skip: u32) -> u32 {
        let is_away = self.body_of.get(skip as usize).is_some_and(|body| self.is_away[*body as usize]);
        let place = if is_away { joint.triangles.binary_search(&skip).ok() } else { None };
        place.map_or(u32::MAX, |place| place as u32)
    }

    /// What a ray meets first of an object with a tree of its own, if its key is no more than `key`.
    #[inline]
    pub fn first_of(&self, body: usize, ray: &Ray, salt: u32, key: f32) -> Option<Met> {
        let own = &self.bodies[body];
        let tree = own.tree.as_ref()?;
        let first = own.first_triangle;
        let ray = Ray { t_max: ray.t_max.min(key.next_up()), skip: ray.skip.wrapping_sub(first), ..*ray };
        let hit = if own.shape.is_see_through {
            tree.closest_where(&ray, |t, u, v, _| self.stops(first + t, u, v, salt))
        } else {
            tree.closest(&ray)
        };
        hit.map(|hit| self.met(tree, &hit, first)).filter(|met| met.key <= key)
    }

    fn met(&self, tree: &Tree, hit: &Hit, first: u32) -> Met {
        Met { key: tree.key(hit), triangle: first + hit.triangle, uv: [hit.u, hit.v], back: hit.back }
    }

    /// Whether anything stops a ray before its end.
    #[inline]
    pub fn blocked(&self, ray: &Ray, salt: u32) -> bool {
        let common = if self.is_opaque {
            self.common.blocked(ray)
        } else {
            self.common.blocked_where(ray, |t, u, v, _| self.stops(t, u, v, salt))
        };
        common
            || match &self.joint {
                Some(joint) => {
                    let ray = Ray { skip: self.skip_of_joint(joint, ray.skip), ..*ray };
                    joint.tree.blocked_where(&ray, |t, u, v, _| self.stops(joint.triangles[t as usize], u, v, salt))
                }
                None => self.apart.iter().any(|body| self.blocked_by(*body as usize, ray, salt)),
            }
    }

    /// Calls back with the object of each surface that stops a ray before its end, in any order, more than once for some.
    pub fn all_in_the_way(&self, ray: &Ray, salt: u32, mut visit: impl FnMut(usize)) {
        self.common.blocked_where(ray, |t, u, v, _| {
            if self.stops(t, u, v, salt) {
                visit(self.body_of(t));
            }
            false
        });
        self.apart.iter().map(|body| *body as usize).filter(|body| self.blocked_by(*body, ray, salt)).for_each(visit);
    }

    /// Whether one of some objects stops a ray before its end.
    pub fn blocked_by_any(&self, ray: &Ray, salt: u32, is_one: impl Fn(usize) -> bool) -> bool {
        let common = self.common.blocked_where(ray, |t, u, v, _| is_one(self.body_of(t)) && self.stops(t, u, v, salt));
        common || self.apart.iter().any(|body| is_one(*body as usize) && self.blocked_by(*body as usize, ray, salt))
    }

    /// Whether an object with a tree of its own stops a ray before its end.
    #[inline]
    pub fn blocked_by(&self, body: usize, ray: &Ray, salt: u32) -> bool {
        let own = &self.bodies[body];
        let Some(tree) = &own.tree else { return false };
        let first = own.first_triangle;
        let ray = Ray { skip: ray.skip.wrapping_sub(first), ..*ray };
        if own.shape.is_see_through {
            tree.blocked_where(&ray, |t, u, v, _| self.stops(first + t, u, v, salt))
        } else {
            tree.blocked(&ray)
        }
    }

    /// The id of what was met.
    #[inline]
    pub fn id(&self, met: Option<Met>, direction: DVec3) -> u32 {
        let Some(met) = met else { return self.sky.at(direction) as u32 };
        let body = &self.bodies[self.body_of(met.triangle)];
        let element = body.shape.at(met.triangle - body.first_triangle, met.uv[0], met.uv[1], met.back);
        body.first + element.unwrap_or(body.elements())
    }

    /// The id of what is seen from a point that need not be on a surface: backs of one-sided surfaces are seen through. None if
    /// there is nothing, or the sky.
    pub fn seen(&self, from: DVec3, direction: DVec3) -> Option<u32> {
        let mut place = Place { point: from, normal: direction, triangle: u32::MAX };
        for _ in 0..MOST_BACKS {
            let met = self.first(&self.ray(&place, direction, f64::INFINITY), 0)?;
            let id = self.id(Some(met), direction);
            if self.body_of_id(id).is_none_or(|body| self.bodies[body].dark() != id) {
                return Some(id);
            }
            place.point += (self.offset + f64::from(met.key)) * direction;
            place.triangle = met.triangle;
        }
        None
    }

    /// Whether a surface stops a ray, as the picture on it and chance have it.
    fn stops(&self, triangle: u32, u: f32, v: f32, salt: u32) -> bool {
        let body = &self.bodies[self.body_of(triangle)];
        if !body.shape.is_see_through {
            return true;
        }
        let at = Surface {
            triangle: body.shape.triangles.start + (triangle - body.first_triangle) as usize,
            uv: DVec2::new(f64::from(u), f64::from(v)),
        };
        let opacity = self.scene.opacity(at);
        opacity >= 1.0 || (opacity > 0.0 && unit(hash(salt ^ hash(triangle))) < opacity)
    }
}

fn single(corners: &[[DVec3; 3]]) -> Vec<[Vec3; 3]> {
    corners.iter().map(|c| c.map(|p| p.as_vec3())).collect()
}
