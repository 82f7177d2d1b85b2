//! Rays in, surfaces out: the tree of boxes together with what the scene says of its triangles.
//!
//! A ray sees the front of every surface, the back of double-sided ones, passes cut-out parts and, with probability
//! 1 − α, blended ones. The back of a one-sided surface stops the ray and is black: light must not enter a room
//! through the outside of its walls. Ray origins are moved off their surface by a few units in the last place of the
//! scene's coordinates, and segments end a few millionths of their length before where they go to, which is all the
//! bias there is.

use crate::sampling::{hash, unit};
use crate::shaft::Shaft;
use crate::{Beams, Hit, Openings, Ray, Tree};
use glam::{DVec2, DVec3, Vec3};
use radiosity_scene::{AlphaMode, EdgeSide, Mesh, Scene, Side};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::ops::ControlFlow;
use std::sync::OnceLock;

/// Hits are at an edge when they lie within so many offsets of it; distances of what meets there are told apart no better
/// (backs are set back by two offsets).
const REACH: f64 = 4.0;

/// Segments between two places end this part of their length and so many offsets before the further one: about twice what boxes are widened by
/// (head of `intersect`), so that the box of the surface there is not entered. In a Cornell box half as many again a second are told, of bundles twice as many.
const SHORT: f64 = 1.0 / (1 << 18) as f64;
const CLEAR: f64 = 3.0;

/// Less than this part of a view is not looked for behind what fills the rest.
const LEAST_SEEN: f32 = 1.0 / 256.0;

/// Cosine above which surfaces lie flat on each other.
const FLAT: f32 = 0.999;

/// Cosine below which depths below a surface are not told from distances along it.
const LEAST_COSINE: f32 = 0.05;

/// Hits with weights above this are not looked at more closely. Triangles less high than a ten-thousandth of the scene
/// may be at an edge all over.
const EDGE: f32 = 0.02;

/// What a ray met first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// A surface that takes part in the exchange of light.
    Surface {
        /// Mesh triangle.
        triangle: u32,
        /// Barycentric coordinates of its corners 1 and 2.
        uv: [f32; 2],
        /// The side that was hit.
        side: Side,
        /// Distance, metres.
        distance: f32,
    },
    /// The back of a one-sided surface: black.
    Back,
    /// Nothing: the ray left the scene.
    Escaped,
}

/// A place that rays start from or end at: a point with the unit normal of the side that is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// World position.
    pub point: DVec3,
    /// Unit normal; rays leave into its half space.
    pub normal: DVec3,
    /// Mesh triangle that the point lies on, `u32::MAX` if none is known.
    pub triangle: u32,
}

/// What all rays from a place have in common.
#[derive(Clone, Copy, Debug)]
pub struct Fan {
    origin: Vec3,
    /// Normal of the place's triangle on the side of the place's own; none where nothing is known of it.
    flat: Vec3,
    triangle: u32,
}

impl Fan {
    /// The ray in a direction that ends after `length` metres. It does not meet the triangle of the place, unless it goes
    /// through it: a normal that is not the triangle's has directions that do, and whoever is inside of a smooth solid sees
    /// nothing outside.
    #[inline]
    pub fn ray(&self, direction: Vec3, length: f32) -> Ray {
        let skip = if self.flat.dot(direction) < 0.0 { u32::MAX } else { self.triangle };
        Ray { origin: self.origin, direction, t_max: length, skip }
    }
}

/// Who sees whom in one scene.
pub struct Tracer<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its welded triangles, which hits refer to.
    pub mesh: &'a Mesh,
    tree: Tree,
    centre: DVec3,
    offset: f64,
    /// Per triangle, whether it is more than an opaque one-sided surface.
    kind: Vec<Kind>,
    /// Per triangle, the first one of its [`sheets`]; empty where nothing lets light pass.
    sheet: Vec<u32>,
    /// Unit normals of the triangles' fronts.
    normals: Vec<Vec3>,
    /// Per triangle, the weight above which no hit is at an edge.
    edge: Vec<f32>,
    all_opaque: bool,
    /// How wide cells are to be.
    scales: Vec<f32>,
    /// From where light is looked at.
    eyes: Vec<DVec3>,
    beams: OnceLock<Beams>,
    openings: OnceLock<Openings>,
}

#[derive(Clone, Copy, PartialEq)]
struct Kind {
    double_sided: bool,
    see_through: bool,
    joins: Joins,
}

/// Whether a triangle makes a flat convex quadrilateral with one beside it in the list.
#[derive(Clone, Copy, PartialEq)]
enum Joins {
    None,
    /// With the one that follows.
    First,
    /// With the one before.
    Last,
}

/// A convex polygon of three or four corners that stops light.
#[derive(Clone, Copy, Debug)]
pub struct Blocker {
    number: u32,
    count: u32,
    corners: [DVec3; 4],
}

impl Blocker {
    /// A triangle, with the next one if the two make a quadrilateral.
    fn new(mesh: &Mesh, number: u32, is_joined: bool) -> Blocker {
        let [a, b, c] = mesh.corners(number as usize);
        let alone = Blocker { number, count: 3, corners: [a, b, c, c] };
        if !is_joined {
            return alone;
        }
        flat_quadrilateral(mesh, number as usize, f64::INFINITY).map_or(alone, |corners| Blocker {
            number,
            count: 4,
            corners,
        })
    }

    /// Its corners.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count as usize]
    }
}

/// The corners of the convex quadrilateral that two triangles make which face the same way, if they have an edge in common.
pub fn quadrilateral(first: [DVec3; 3], second: [DVec3; 3]) -> Option<[DVec3; 4]> {
    let shares = |&(i, j): &(usize, usize)| first[i] == second[(j + 1) % 3] && first[(i + 1) % 3] == second[j];
    let (i, j) = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).find(shares)?;
    let corners = [first[i], second[(j + 2) % 3], first[(i + 1) % 3], first[(i + 2) % 3]];
    let normal = (first[1] - first[0]).cross(first[2] - first[0]);
    let turns = |k: usize| {
        let [p, q, r] = [k, k + 1, k + 2].map(|k| corners[k % 4]);
        (q - p).cross(r - q).dot(normal) > 0.0
    };
    (0..4).all(turns).then_some(corners)
}

/// That of a triangle and the next one, if it is flat to within a distance.
fn flat_quadrilateral(mesh: &Mesh, triangle: usize, flat: f64) -> Option<[DVec3; 4]> {
    let (first, second) = (mesh.triangles[triangle], mesh.triangles.get(triangle + 1)?);
    let common = first.iter().filter(|v| second.contains(v)).count();
    let corners = (common == 2).then(|| quadrilateral(mesh.corners(triangle), mesh.corners(triangle + 1))).flatten()?;
    ((corners[1] - corners[0]).dot(mesh.normal(triangle)).abs() <= flat).then_some(corners)
}

impl<'a> Tracer<'a> {
    /// Builds the tree of boxes over a mesh.
    pub fn new(scene: &'a Scene, mesh: &'a Mesh) -> Tracer<'a> {
        let (mut low, mut high) = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
        for &v in &mesh.vertices {
            (low, high) = (low.min(v), high.max(v));
        }
        // Around the origin single precision is finest, so the tree lives in coordinates about the scene's centre.
        let centre = if mesh.vertices.is_empty() { DVec3::ZERO } else { 0.5 * (low + high) };
        let half = if mesh.vertices.is_empty() { 1.0 } else { (0.5 * (high - low)).max_element() };
        // Rounding a coordinate to single precision moves it by at most 2^-25 of its binade; interpolation and
        // the intersection test add about as much again. Eight times that clears the surface with certainty and
        // is still a few micrometres in a room.
        let offset = half * 2f64.powi(-21);
        let mut kind: Vec<Kind> = mesh
            .source
            .par_iter()
            .map(|&source| {
                let material = scene.material(source as usize);
                let see_through = match material.alpha_mode {
                    AlphaMode::Opaque => false,
                    AlphaMode::Mask { .. } | AlphaMode::Blend => {
                        material.base_color[3] < 1.0
                            || !scene.colors.is_empty()
                            || material.base_color_texture.is_some_and(|t| !scene.textures[t.texture].is_opaque())
                    }
                };
                Kind { double_sided: material.has_two_sides(), see_through, joins: Joins::None }
            })
            .collect();
        join(&mut kind, mesh, offset);
        let all_opaque = kind.iter().all(|k| !k.see_through);
        Tracer {
            scene,
            mesh,
            tree: Tree::over(mesh.triangles.len(), |t| mesh.corners(t).map(|p| (p - centre).as_vec3())),
            centre,
            offset,
            all_opaque,
            sheet: if all_opaque { Vec::new() } else { sheets(&kind, mesh, offset) },
            kind,
            normals: (0..mesh.triangles.len()).into_par_iter().map(|t| mesh.normal(t).as_vec3()).collect(),
            edge: (0..mesh.triangles.len()).into_par_iter().map(|t| edge_weight(mesh.corners(t), offset)).collect(),
            scales: Vec::new(),
            eyes: Vec::new(),
            beams: OnceLock::new(),
            openings: OnceLock::new(),
        }
    }

    /// The same for light that is looked at from some places: what is more important to them than its area tells is cut into smaller
    /// elements. Without it a room on a wide site has a few, whatever is asked.
    pub fn seen_from(mut self, eyes: &[DVec3]) -> Tracer<'a> {
        self.scales = crate::importance::scales(&self, eyes);
        self.eyes = eyes.to_vec();
        self.beams = OnceLock::new();
        self
    }

    /// The places from which light is looked at, if that was told.
    pub fn eyes(&self) -> &[DVec3] {
        &self.eyes
    }

    /// For each triangle how wide its cells are to be, relative to those of most of the scene and at most 1; empty where all are as wide.
    pub fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// That of a triangle.
    pub fn scale(&self, triangle: usize) -> f64 {
        self.scales.get(triangle).map_or(1.0, |scale| f64::from(*scale))
    }

    /// Memory that it takes beside the scene and the mesh, bytes.
    pub fn bytes(&self) -> usize {
        self.tree.memory()
            + size_of_val(&*self.kind)
            + size_of_val(&*self.sheet)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.edge)
            + size_of_val(&*self.scales)
            + size_of_val(&*self.eyes)
            + self.beams.get().map_or(0, Beams::bytes)
            + self.openings.get().map_or(0, Openings::bytes)
    }

    /// Whether a triangle is cut out or lets light pass somewhere.
    pub(crate) fn is_see_through(&self, triangle: usize) -> bool {
        self.kind[triangle].see_through
    }

    /// Whether anything lets a part of the light pass, by chance for each ray.
    pub(crate) fn has_panes(&self) -> bool {
        let is_pane = |t: usize| {
            let material = self.scene.material(self.mesh.source[t] as usize);
            self.kind[t].see_through && material.alpha_mode == AlphaMode::Blend
        };
        !self.all_opaque && (0..self.kind.len()).any(is_pane)
    }

    /// What lamps without area light through small openings, looked for when it is first asked for: not from within parallel work, which would wait for
    /// itself.
    pub fn beams(&self) -> &Beams {
        self.beams.get_or_init(|| Beams::find(self))
    }

    /// Small openings through which the sky shines in, looked for when they are first asked for, as beams are.
    pub fn openings(&self) -> &Openings {
        self.openings.get_or_init(|| Openings::find(self))
    }

    /// The tree of boxes (its coordinates are relative to the scene's centre).
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Whether nothing is cut out or partly transparent.
    pub fn is_opaque(&self) -> bool {
        self.all_opaque
    }

    /// The distance by which origins are moved off their surface, metres.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// The rays that leave a place.
    #[inline]
    pub fn fan(&self, from: &Place) -> Fan {
        let origin = from.point - self.centre + self.offset * from.normal;
        let flat = self.normals.get(from.triangle as usize).map_or(Vec3::ZERO, |flat| {
            let side = flat.dot(from.normal.as_vec3());
            if side > 0.0 {
                *flat
            } else if side < 0.0 {
                -*flat
            } else {
                Vec3::ZERO
            }
        });
        Fan { origin: origin.as_vec3(), flat, triangle: from.triangle }
    }

    /// The ray that leaves a place in a direction and ends after `length` metres ([`Fan::ray`]).
    #[inline]
    pub fn ray(&self, from: &Place, direction: DVec3, length: f64) -> Ray {
        self.fan(from).ray(direction.as_vec3(), length as f32)
    }

    /// A ray that does not start on a surface: a camera's.
    pub fn free_ray(&self, from: DVec3, direction: DVec3) -> Ray {
        let origin = (from - self.centre).as_vec3();
        Ray { origin, direction: direction.as_vec3(), t_max: f32::INFINITY, skip: u32::MAX }
    }

    /// The first surface along a ray. `seed` decides, ray by ray, whether a blended surface stops it.
    #[inline]
    pub fn first(&self, ray: &Ray, seed: u32) -> Found {
        let hit = if self.all_opaque {
            self.tree.closest(ray)
        } else {
            self.tree.closest_where(ray, |t, u, v, _| self.stops(t, u, v, seed))
        };
        let Some(hit) = hit else { return Found::Escaped };
        // Two calls, or the hit is copied as a whole before its parts have reached memory, and waits.
        if self.is_at_edge(&hit) { self.found(self.nearest_at_edge(ray, hit, seed)) } else { self.found(hit) }
    }

    /// Whether a hit is so near an edge of its triangle that rounding decides what is met there.
    #[inline]
    fn is_at_edge(&self, hit: &Hit) -> bool {
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        if weights[0].min(weights[1]).min(weights[2]) > self.edge[hit.triangle as usize] {
            return false;
        }
        let (doubled, opposite) = extent(self.mesh.corners(hit.triangle as usize));
        (0..3).any(|i| f64::from(weights[i]) * doubled <= REACH * self.offset * opposite[i])
    }

    /// At the foot of a wall its distance and that of the floor behind it are the same but for rounding. Then what lies on
    /// the other side of another surface there has not been met.
    #[cold]
    fn nearest_at_edge(&self, ray: &Ray, hit: Hit, seed: u32) -> Hit {
        let reach = REACH * self.offset;
        let within = Ray { t_max: hit.t + reach as f32, ..*ray };
        let mut met: Vec<Hit> = Vec::new();
        self.tree.closest_where(&within, |triangle, u, v, back| {
            if self.stops(triangle, u, v, seed) {
                met.push(Hit { triangle, u, v, back, t: hit.t });
            }
            false
        });
        met.sort_unstable_by_key(|hit| hit.triangle);
        let origin = ray.origin.as_dvec3() + self.centre;
        let is_behind = |hit: &Hit, wall: &Hit| {
            let [a, b, c] = self.mesh.corners(hit.triangle as usize);
            let corner = self.mesh.corners(wall.triangle as usize)[0];
            let height = |p: DVec3| (p - corner).dot(self.mesh.normal(wall.triangle as usize));
            let (from, to) = (height(origin), height((a + b + c) / 3.0));
            from.abs().min(to.abs()) > reach && (from < 0.0) != (to < 0.0)
        };
        let is_met = |hit: &&Hit| met.iter().all(|wall| wall.triangle == hit.triangle || !is_behind(hit, wall));
        if is_met(&&hit) { hit } else { met.iter().find(is_met).copied().unwrap_or(hit) }
    }

    /// What a viewer sees along a ray, one surface behind the other as far as they let light through, and the part of the view that each fills: all parts
    /// are one together. Backs of one-sided surfaces are passed, as viewers cull them.
    pub fn seen(&self, ray: &Ray, mut visit: impl FnMut(Found, f32)) {
        let mut left = 1.0;
        let mut passed: SmallVec<[u32; 4]> = SmallVec::new();
        loop {
            let hit = self.tree.closest_where(ray, |t, u, v, back| {
                let Kind { double_sided, see_through, .. } = self.kind[t as usize];
                let is_left = || !passed.contains(&self.sheet[t as usize]) && self.opacity(t, u, v) > 0.0;
                (!back || double_sided) && (!see_through || is_left())
            });
            let Some(hit) = hit else { return visit(Found::Escaped, left) };
            let Hit { triangle, u, v, .. } = hit;
            let see_through = self.kind[triangle as usize].see_through;
            let opacity = if see_through { self.opacity(triangle, u, v).min(1.0) } else { 1.0 };
            let behind = left * (1.0 - opacity);
            let is_last = behind < LEAST_SEEN;
            visit(self.found(hit), if is_last { left } else { left - behind });
            if is_last {
                return;
            }
            left = behind;
            passed.push(self.sheet[triangle as usize]);
        }
    }

    /// The place that a ray met, on the side that it met; none but of surfaces.
    pub fn place(&self, found: Found) -> Option<Place> {
        let Found::Surface { triangle, uv: [u, v], side, .. } = found else { return None };
        let point = self.mesh.point(triangle as usize, DVec2::new(f64::from(u), f64::from(v)));
        let front = self.mesh.normal(triangle as usize);
        Some(Place { point, normal: if side == Side::Front { front } else { -front }, triangle })
    }

    /// Whether anything stops a ray before its end.
    #[inline]
    pub fn blocked(&self, ray: &Ray, seed: u32) -> bool {
        if self.all_opaque {
            self.tree.blocked(ray)
        } else {
            self.tree.blocked_where(ray, |t, u, v, _| self.stops(t, u, v, seed))
        }
    }

    /// The rest of a ray beyond a contact: where the `triangle` that it met after a distance lies flat on the back of an opaque one-sided
    /// surface, or sinks into it by less than the [`Tracer::reach`], as a solid does that touches the one around the ray. Nothing elsewhere.
    pub fn beyond_contact(&self, ray: &Ray, triangle: u32, distance: f32) -> Option<Ray> {
        let (flat, margin) = (self.normals[triangle as usize], (REACH * self.offset) as f32);
        let sinks = self.reach() as f32 / flat.dot(ray.direction).abs().max(LEAST_COSINE);
        let begin = (distance - margin).max(0.0);
        let around = Ray { origin: ray.origin + begin * ray.direction, t_max: distance + sinks - begin, ..*ray };
        let back = self.tree.closest_where(&around, |t, _, _, back| {
            let Kind { double_sided, see_through, .. } = self.kind[t as usize];
            back && !double_sided && !see_through && self.normals[t as usize].dot(flat) < -FLAT
        })?;
        let gone = back.t.max(distance - begin) + margin;
        Some(Ray { origin: around.origin + gone * ray.direction, t_max: ray.t_max - begin - gone, ..*ray })
    }

    /// What people mean to touch lies no further apart than this, metres: a tenth of a per mille of the scene's size, at most one millimetre.
    pub fn reach(&self) -> f64 {
        (self.mesh.tolerance * 100.0).min(1e-3)
    }

    /// Finds what may stand between two convex polygons, the first of which may be a point, opaque as it is and other than a triangle
    /// that the first lies on: up to `most`, each once. Whether these are all, and there are no others that let some light pass.
    pub fn blockers(&self, (from, own): (&[DVec3], u32), to: &[DVec3], most: usize, found: &mut Vec<Blocker>) -> bool {
        let moved = |polygon: &[DVec3]| polygon.iter().map(|p| *p - self.centre).collect::<SmallVec<[DVec3; 8]>>();
        let shaft = Shaft::new(&moved(from), &moved(to));
        let own = if (own as usize) < self.kind.len() { self.first_of(own) } else { u32::MAX };
        let first = found.len();
        let all = self.tree.in_shaft(&shaft, &mut |triangle| {
            let kind = self.kind[triangle as usize];
            let number = self.first_of(triangle);
            if number == own || found[first..].iter().any(|known| known.number == number) {
                return ControlFlow::Continue(());
            }
            if kind.see_through || found.len() - first == most {
                return ControlFlow::Break(());
            }
            found.push(Blocker::new(self.mesh, number, kind.joins != Joins::None));
            ControlFlow::Continue(())
        });
        all.is_continue()
    }

    /// Whether nothing stands before a lamp without area, in a direction at a distance that may be infinite.
    #[inline]
    pub fn sees_lamp(&self, from: &Place, (towards, distance): (DVec3, f64), seed: u32) -> bool {
        let length = distance - self.offset;
        length <= 0.0 || !self.blocked(&self.ray(from, towards, length), seed)
    }

    /// The first triangle of the quadrilateral that a triangle is a part of; itself where it is of none.
    fn first_of(&self, triangle: u32) -> u32 {
        if self.kind[triangle as usize].joins == Joins::Last { triangle - 1 } else { triangle }
    }

    /// Whether two places see each other. The far end is moved off its surface like the near one, so that neither
    /// blocks the ray between them, and what lies a few millionths of the way before it does not either.
    #[inline]
    pub fn mutually_visible(&self, from: &Place, to: &Place, seed: u32) -> bool {
        let origin = from.point + self.offset * from.normal;
        let target = to.point + self.offset * to.normal;
        let along = target - origin;
        let length = along.length();
        if length <= self.offset {
            return true;
        }
        let mut ray = self.ray(from, along / length, length - SHORT * length - CLEAR * self.offset);
        if ray.skip == u32::MAX {
            ray.skip = to.triangle;
        }
        !self.blocked(&ray, seed)
    }

    #[inline]
    fn found(&self, Hit { triangle, u, v, back, t }: Hit) -> Found {
        if back && !self.kind[triangle as usize].double_sided {
            return Found::Back;
        }
        Found::Surface { triangle, uv: [u, v], side: if back { Side::Back } else { Side::Front }, distance: t }
    }

    fn opacity(&self, triangle: u32, u: f32, v: f32) -> f32 {
        self.scene.opacity(self.mesh.surface(triangle as usize, DVec2::new(f64::from(u), f64::from(v))))
    }

    fn stops(&self, triangle: u32, u: f32, v: f32, seed: u32) -> bool {
        if !self.kind[triangle as usize].see_through {
            return true;
        }
        let opacity = self.opacity(triangle, u, v);
        opacity >= 1.0 || (opacity > 0.0 && unit(hash(seed ^ hash(self.sheet[triangle as usize]))) < opacity)
    }
}

/// Joins triangles that follow each other to quadrilaterals.
fn join(kind: &mut [Kind], mesh: &Mesh, flat: f64) {
    let joins: Vec<bool> =
        (0..kind.len()).into_par_iter().map(|triangle| flat_quadrilateral(mesh, triangle, flat).is_some()).collect();
    for triangle in 1..kind.len() {
        let is_like = kind[triangle] == kind[triangle - 1] && !kind[triangle].see_through;
        if joins[triangle - 1] && is_like {
            (kind[triangle - 1].joins, kind[triangle].joins) = (Joins::First, Joins::Last);
        }
    }
}

/// The first of the triangles that let light pass and lie, edge to edge, on one plane, to within a distance: a ray that meets several of them meets one surface, on an edge or at a
/// corner, and either passes or does not.
fn sheets(kind: &[Kind], mesh: &Mesh, flat: f64) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut beside = vec![[NONE; 3]; kind.len()];
    // Those that lie on each other, or more than two, take their part of the light each.
    for sides in mesh.sides_of_edges().chunk_by(|a, b| a.edge == b.edge) {
        if let [one, other] = sides.iter().map(EdgeSide::place).collect::<SmallVec<[(usize, usize); 4]>>()[..]
            && kind[one.0].see_through
            && kind[other.0].see_through
            && goes_on(mesh, one, other)
        {
            beside[one.0][one.1] = other.0 as u32;
            beside[other.0][other.1] = one.0 as u32;
        }
    }
    let mut first: Vec<u32> = (0..kind.len() as u32).collect();
    let mut is_known: Vec<bool> = kind.iter().map(|kind| !kind.see_through).collect();
    let mut left = Vec::new();
    for triangle in 0..kind.len() {
        let (corner, up) = (mesh.corners(triangle)[0], mesh.normal(triangle));
        // What is too thin to face anywhere lies on no plane.
        if is_known[triangle] || up == DVec3::ZERO {
            continue;
        }
        let lies_on = |p: &DVec3| (*p - corner).dot(up).abs() <= flat;
        is_known[triangle] = true;
        left.push(triangle);
        while let Some(own) = left.pop() {
            for other in beside[own].into_iter().filter(|other| *other != NONE) {
                let other = other as usize;
                if !is_known[other] && mesh.corners(other).iter().all(lies_on) {
                    (is_known[other], first[other]) = (true, triangle as u32);
                    left.push(other);
                }
            }
        }
    }
    first
}

/// Whether two triangles lie on opposite sides of an edge, which begins at these corners of them.
fn goes_on(mesh: &Mesh, (one, at): (usize, usize), (other, of_other): (usize, usize)) -> bool {
    let (corners, others) = (mesh.corners(one), mesh.corners(other));
    let [from, to, third] = [0, 1, 2].map(|k| corners[(at + k) % 3]);
    let along = to - from;
    let across = |p: DVec3| (p - from) - (p - from).dot(along) / along.length_squared() * along;
    across(third).dot(across(others[(of_other + 2) % 3])) < 0.0
}

/// A triangle's doubled area, and the lengths of the edges opposite its corners.
fn extent([a, b, c]: [DVec3; 3]) -> (f64, [f64; 3]) {
    ((b - a).cross(c - a).length(), [(c - b).length(), (a - c).length(), (b - a).length()])
}

/// The weight above which no hit on a triangle is at an edge: that at its least height, and more than rounding takes from it.
fn edge_weight(corners: [DVec3; 3], offset: f64) -> f32 {
    let (doubled, opposite) = extent(corners);
    let longest = opposite.into_iter().fold(0.0, f64::max);
    EDGE.min((1.000_001 * REACH * offset * longest / doubled) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::Material;

    /// Now and then a ray at the foot of a wall met the floor behind it, and lit the dark room there.
    #[test]
    fn rays_at_the_foot_of_a_wall_do_not_meet_what_is_behind() {
        let material = Material { double_sided: true, ..Material::default() };
        let mut scene = Scene { materials: vec![material], ..Scene::default() };
        let mut quad = |corners: [[f64; 3]; 4]| scene.add_quad("quad", 0, corners.map(DVec3::from));
        quad([[2., 0., 0.], [4., 0., 0.], [4., 2., 0.], [2., 2., 0.]]);
        let behind = quad([[0., 0., 0.], [2., 0., 0.], [2., 2., 0.], [0., 2., 0.]]);
        let walls = [quad([[2., 0., 0.], [2., 2., 0.], [2., 2., 2.], [2., 0., 2.]])];
        assert_eq!((behind, walls), (1, [2]));
        for turned in [false, true] {
            if turned {
                scene.triangles[4..].iter_mut().for_each(|corners| corners.swap(1, 2));
            }
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            let mut floor = 0;
            for i in 0..100_000u32 {
                let [x, y, z, at] = [1, 2, 3, 4].map(|k| f64::from(unit(hash(i ^ hash(k)))));
                let from = DVec3::new(2.1 + 1.9 * x, 2.0 * y, 0.1 + 1.9 * z);
                // Within a few micrometres of the foot, on either side.
                let foot = DVec3::new(2.0 + 1e-6 * f64::from(i % 9) - 4e-6, 0.1 + 1.8 * at, 0.0);
                let place = Place { point: from, normal: DVec3::Z, triangle: u32::MAX };
                let found = tracer.first(&tracer.ray(&place, (foot - from).normalize(), f64::INFINITY), i);
                let Found::Surface { triangle, .. } = found else { panic!("{found:?} from {from} to {foot}") };
                let object = scene.triangle_object[mesh.source[triangle as usize] as usize];
                assert_ne!(object as usize, behind, "{found:?} from {from} to {foot}");
                floor += u32::from(object == 0);
            }
            assert!((10_000..90_000).contains(&floor), "{floor}");
        }
    }

    /// A pane takes its part of the light once, on the edges and at the corners of its triangles too; two panes take theirs each.
    #[test]
    fn a_pane_is_met_once_on_the_edges_of_its_triangles() {
        let pane = |alpha| Material {
            base_color: [0.0, 0.0, 0.0, alpha],
            alpha_mode: AlphaMode::Blend,
            double_sided: true,
            ..Material::default()
        };
        for (heights, is_doubled, passes) in
            [(&[1.0][..], false, 0.6), (&[1.0, 1.5], false, 0.36), (&[1.0], true, 0.36)]
        {
            let mut scene = Scene { materials: vec![pane(0.4)], ..Scene::default() };
            for z in heights {
                for (x, y) in [(0., 0.), (1., 0.), (0., 1.), (1., 1.)] {
                    let corners = [[x, y, *z], [x + 1., y, *z], [x + 1., y + 1., *z], [x, y + 1., *z]];
                    scene.add_quad("pane", 0, corners.map(DVec3::from));
                }
            }
            // A copy that faces the other way, in two triangles with the other diagonal.
            if is_doubled {
                let corners = [[2., 0., 1.], [0., 0., 1.], [0., 2., 1.], [2., 2., 1.]];
                scene.add_quad("copy", 0, corners.map(DVec3::from));
            }
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            // The edges of a copy are others.
            let places = [(0.6, 0.2), (0.5, 0.5), (0.3, 0.3), (1.0, 0.4), (0.7, 1.0), (1.0, 1.0)];
            for (x, y) in places.into_iter().take(if is_doubled { 1 } else { 6 }) {
                let from = Place { point: DVec3::new(x, y, 0.0), normal: DVec3::Z, triangle: u32::MAX };
                let ray = tracer.ray(&from, DVec3::Z, f64::INFINITY);
                let free = |i: &u32| !tracer.blocked(&ray, hash(*i));
                let part = (0..20_000).filter(free).count() as f64 / 20_000.0;
                assert!((part - passes).abs() < 0.015, "{heights:?} {x} {y}: {part}");
            }
        }
    }

    /// Segments end before what they go to: in a hall of ten metres what lies two hundredths of a millimetre before it does not hide it, and what lies a tenth
    /// before it does.
    #[test]
    fn what_lies_just_before_the_far_end_hides_it() {
        let material = Material { double_sided: true, ..Material::default() };
        for (before, is_hidden) in [(1e-4, true), (1e-3, true), (2e-5, false), (-1e-4, false)] {
            let mut scene = Scene { materials: vec![material.clone()], ..Scene::default() };
            let mut square = |z: f64| {
                let corners = [[-5., -5., z], [5., -5., z], [5., 5., z], [-5., 5., z]];
                scene.add_quad("square", 0, corners.map(DVec3::from))
            };
            for height in [0.0, 9.0, 9.0 - before] {
                square(height);
            }
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            for i in 0..1000u32 {
                let [x, y, u, v] = [1, 2, 3, 4].map(|k| 9.0 * f64::from(unit(hash(i ^ hash(k)))) - 4.5);
                let from = Place { point: DVec3::new(x, y, 0.0), normal: DVec3::Z, triangle: u32::MAX };
                let to = Place { point: DVec3::new(u, v, 9.0), normal: -DVec3::Z, triangle: u32::MAX };
                assert_eq!(
                    tracer.mutually_visible(&from, &to, i),
                    !is_hidden,
                    "{before} m before {to:?}, from {from:?}"
                );
            }
        }
    }

    /// From under a lid on which another plate lies: through both where these touch or sink into each other by less than the reach, and
    /// only where light does not pass.
    #[test]
    fn rays_go_on_beyond_contacts() {
        let up = |z: f64| [[0., 0., z], [4., 0., z], [4., 4., z], [0., 4., z]].map(DVec3::from);
        let down = |z: f64| {
            let [a, b, c, d] = up(z);
            [a, d, c, b]
        };
        let two_sided = Material { double_sided: true, ..Material::default() };
        let reach = 4e-4;
        for (apart, lid, is_contact) in
            [(0.0, 0, true), (-0.8 * reach, 0, true), (-1.2 * reach, 0, false), (0.0, 1, false)]
        {
            let mut scene = Scene { materials: vec![Material::default(), two_sided.clone()], ..Scene::default() };
            scene.add_quad("lid", lid, up(1.0));
            let plate = scene.add_quad("plate", 0, down(1.0 + apart));
            let top = scene.add_quad("top", 0, up(2.0));
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            assert!((tracer.reach() / reach - 1.0).abs() < 1e-6, "{}", tracer.reach());
            for (x, z) in [(0.0, 1.0), (0.6, 0.8), (0.99, 0.141)] {
                let ray = tracer.free_ray(DVec3::new(0.1, 1.9, 0.7), DVec3::new(x, 0.0, z).normalize());
                let Found::Surface { triangle, distance, .. } = tracer.first(&ray, 0) else { panic!("{apart} {x}") };
                if lid == 0 {
                    assert_eq!(
                        scene.triangle_object[mesh.source[triangle as usize] as usize] as usize, plate,
                        "{apart}"
                    );
                }
                let beyond = tracer.beyond_contact(&ray, triangle, distance);
                assert_eq!(beyond.is_some(), is_contact, "{apart} {lid} {x}");
                let Some(beyond) = beyond else { continue };
                let hit = tracer.tree().closest(&beyond);
                let met = hit
                    .map(|hit| (scene.triangle_object[mesh.source[hit.triangle as usize] as usize] as usize, hit.back));
                assert!(met.is_none_or(|met| met == (top, true)) && (met.is_some() || z < 0.2), "{met:?} {x}");
            }
        }
    }
}
