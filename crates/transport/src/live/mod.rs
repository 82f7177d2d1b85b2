//! Rows and columns of light that follow a scene while it is changed.
//!
//! F is a table of hit ids as everywhere ([`crate::rows`]), with two additions. Every entry keeps the distance of its hit, so
//! that it is known which rays an object stands in the way of when it is put somewhere; and ids, sample points and
//! everything else that is random depend on an object's own number only, so that a ray which no edit reaches is the same
//! ray before and after it. After a series of edits rows and columns are therefore those of a fresh start, bit for bit
//! (Drettakis and Sillion 1997 find the links that an edit changes by shafts; here they are single rays).
//!
//! What is simpler than in batch work: objects are not sewn together, elements are not divided where light varies, the sky is
//! found by rows alone, and hits at the feet of walls are not looked at again.
//!
//! ```
//! use glam::DAffine3;
//! use radiosity_transport::live::{Lamp, Live, Part, Target};
//! use std::sync::Arc;
//!
//! let mut scene = radiosity_scene::Scene::default();
//! scene.materials.push(radiosity_scene::Material::default());
//! let square = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(glam::DVec3::from);
//! scene.add_quad("floor", 0, square);
//! scene.add_quad("ceiling", 0, [0, 3, 2, 1].map(|k| square[k] + glam::DVec3::Z));
//!
//! let mut live = Live::new(Arc::new(scene), 0.25, Target { rays: 64, shadows: 8 });
//! live.set_target(Target { rays: 64, shadows: 8 });
//! live.work(Part::Far, || true);
//! let first = live.rays_traced();
//! live.place(1, DAffine3::from_translation(glam::DVec3::new(0.0, 0.0, 0.1)));
//! live.work(Part::Far, || true);
//! assert!(live.rays_traced() < 3 * first);
//! ```

mod aim;
mod air;
mod body;
mod chunk;
mod column;
mod gather;
mod world;

pub use air::Arrival;
pub use body::{Body, Bounds, Shape, Site};
pub use chunk::{Chunk, NEAR_RAYS, Part, Target};
pub use column::{Column, Lamp, Spot};
pub use gather::Lanes;
pub use world::{REACH, World};

use chunk::{CHUNK, Change, Dirt, Work};
use glam::DAffine3;
use radiosity_scene::elements::division_of;
use radiosity_scene::{Bands, Scene};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the chunks that are handed out together shall take: as often it is asked whether to go on.
const PIECE: Duration = Duration::from_millis(5);

/// Changes that may gather in any case.
const LEAST_ROOM: usize = 64;

/// Changed objects beyond which a chunk that has not seen them traces all its rays anew: each costs a look at every element,
/// and with so many of them that takes about as long.
const MOST_MENDED: usize = 128;

/// What is dirty is worked out for all chunks together that have seen as many changes, for so many numbers of them.
const MOST_SHARED: usize = 8;

/// Objects, rows and columns of light.
pub struct Live {
    world: World,
    columns: Vec<Column>,
    chunks: Vec<Chunk>,
    /// First chunk of each object.
    starts: Vec<usize>,
    changes: Vec<Change>,
    /// So many changes may gather before those that nobody needs are looked for.
    room: usize,
    target: Target,
    most: Target,
    is_dark: Vec<bool>,
    rays_traced: u64,
    /// Chunks that are handed out together.
    batch: usize,
}

impl Live {
    /// A scene, its objects cut into elements about `size` metres wide, for rows of so many rays at most (a power of two,
    /// 4 to 1024) and so many shadow rays (64 at most). No ray is traced yet.
    pub fn new(scene: Arc<Scene>, size: f64, most: Target) -> Live {
        assert!(most.rays.is_power_of_two() && (4..=1024).contains(&most.rays) && most.shadows <= 64, "{most:?}");
        let world = World::new(scene, size);
        let mut live = Live {
            is_dark: vec![false; world.sky.len()],
            world,
            columns: Vec::new(),
            chunks: Vec::new(),
            starts: Vec::new(),
            changes: Vec::new(),
            room: LEAST_ROOM,
            target: Target { rays: 0, shadows: 0 },
            most,
            rays_traced: 0,
            batch: 1,
        };
        live.cut(0..live.world.bodies.len());
        live
    }

    /// How many elements a scene would have.
    pub fn count(scene: &Scene, size: f64) -> usize {
        let of = |triangle: usize| {
            let sides = 1 + usize::from(scene.material(triangle).has_two_sides());
            (division_of(scene.corners(triangle), size) as usize).pow(2) * sides
        };
        (0..scene.triangles.len()).into_par_iter().map(of).sum()
    }

    /// Bytes that so many elements take, with so many columns.
    pub fn bytes(elements: usize, rays: u32, columns: usize) -> usize {
        elements * Chunk::bytes(rays, columns)
    }

    /// The objects.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The elements, in the order of their ids.
    pub fn chunks(&self) -> &[Chunk] {
        &self.chunks
    }

    /// An element of an object: where its rays are, and which there it is. None where the object has not as many.
    #[inline]
    pub fn element(&self, body: usize, element: u32) -> Option<(&Chunk, usize)> {
        let chunk = self.chunks.get(*self.starts.get(body)? + (element / CHUNK) as usize)?;
        let e = (element % CHUNK) as usize;
        (chunk.body == body && e < chunk.len).then_some((chunk, e))
    }

    /// Number of ids.
    pub fn ids(&self) -> usize {
        self.world.ids()
    }

    /// Rays traced so far, of all kinds.
    pub fn rays_traced(&self) -> u64 {
        self.rays_traced
    }

    /// Share of all rays of rows that are there, dirty ones too.
    pub fn share(&self) -> f64 {
        let is_there = |chunk: &&Chunk| self.world.bodies[chunk.body].is_present;
        let of = |(traced, elements): (u64, u64), chunk: &Chunk| {
            let len = chunk.len as u64;
            (traced + len * u64::from(chunk.traced()), elements + len)
        };
        let (traced, elements) = self.chunks.iter().filter(is_there).fold((0, 0), of);
        traced as f64 / (elements * u64::from(self.most.rays)).max(1) as f64
    }

    /// Rays of rows as asked for now.
    pub fn target(&self) -> Target {
        self.target
    }

    /// Most rays.
    pub fn most(&self) -> Target {
        self.most
    }

    /// Cuts objects into chunks.
    fn cut(&mut self, bodies: std::ops::Range<usize>) {
        let mut parts = Vec::new();
        for body in bodies {
            let n = self.world.bodies[body].elements();
            self.starts.push(self.chunks.len() + parts.len());
            parts.extend((0..n).step_by(CHUNK as usize).map(|first| (body, first, CHUNK.min(n - first))));
            self.is_dark.extend(std::iter::repeat_n(false, n as usize));
            self.is_dark.push(true);
        }
        let (world, rays, columns) = (&self.world, self.most.rays, self.columns.len());
        let made = parts.into_par_iter().map(|(body, first, len)| Chunk::new(world, body, first, len, rays, columns));
        self.chunks.extend(made.collect::<Vec<_>>());
    }

    fn forget(&mut self, body: usize) {
        let (world, changes) = (&self.world, self.changes.len());
        self.chunks.iter_mut().filter(|chunk| chunk.body == body).for_each(|chunk| chunk.forget(world, changes));
    }

    /// Forgets all rays of chunks that have not seen changes of very many objects.
    fn forget_much_changed(&mut self) {
        let mut bodies = BTreeSet::new();
        let too_many = |change: &Change| {
            bodies.insert(change.body);
            bodies.len() > MOST_MENDED
        };
        let Some(last) = self.changes.iter().rposition(too_many) else { return };
        let (world, changes) = (&self.world, self.changes.len());
        let has_not_seen = |chunk: &&mut Chunk| chunk.seen().into_iter().any(|seen| seen <= last);
        self.chunks.par_iter_mut().filter(has_not_seen).for_each(|chunk| chunk.forget(world, changes));
    }

    /// Notes that an object changes.
    fn note(&mut self, body: usize, before: Option<Bounds>) {
        if self.changes.len() >= self.room {
            self.drop_changes();
            self.room = (2 * self.changes.len()).max(LEAST_ROOM);
        }
        self.changes.push(Change { body, before });
    }

    /// Drops changes that no chunk needs: of each object a chunk looks at the first that it has not seen. So they stay few
    /// while an object is dragged about, however long.
    fn drop_changes(&mut self) {
        let seen: BTreeSet<usize> = self.chunks.iter().flat_map(Chunk::seen).collect();
        // How many are kept before each.
        let (mut kept, mut number) = (Vec::new(), Vec::with_capacity(self.changes.len() + 1));
        let mut next = BTreeMap::new();
        for (k, change) in self.changes.drain(..).enumerate() {
            number.push(kept.len());
            let from = next.insert(change.body, k + 1).unwrap_or(0);
            if seen.range(from..=k).next().is_some() {
                kept.push(change);
            }
        }
        number.push(kept.len());
        self.changes = kept;
        self.chunks.iter_mut().for_each(|chunk| chunk.renumber(|seen| number[seen]));
    }

    /// Puts an object elsewhere, or brings it back.
    pub fn place(&mut self, body: usize, matrix: DAffine3) {
        let own = &self.world.bodies[body];
        self.note(body, own.is_present.then_some(own.bounds));
        self.world.place(body, matrix);
        self.forget(body);
    }

    /// Takes an object away.
    pub fn remove(&mut self, body: usize) {
        let own = &self.world.bodies[body];
        self.note(body, own.is_present.then_some(own.bounds));
        self.world.remove(body);
        self.forget(body);
    }

    /// Adds a copy of an object; answers its number.
    pub fn copy(&mut self, body: usize, matrix: DAffine3) -> usize {
        self.add(self.world.bodies[body].shape.clone(), matrix)
    }

    /// Adds an object that was not in the scene: `make` puts it there and answers which it is. Answers its number here.
    pub fn add_new(&mut self, make: impl FnOnce(&mut Scene) -> usize, matrix: DAffine3) -> usize {
        let object = make(Arc::make_mut(&mut self.world.scene));
        self.add(self.world.shape(object), matrix)
    }

    fn add(&mut self, shape: Arc<Shape>, matrix: DAffine3) -> usize {
        let added = self.world.add(shape, matrix);
        self.world.place(added, matrix);
        self.note(added, None);
        self.cut(added..added + 1);
        self.forget(added);
        added
    }

    /// Whether a column has lamps.
    pub fn has_lamps(&self, column: usize) -> bool {
        !self.columns[column].is_empty()
    }

    /// Adds a column for some lamps; `key` fixes its random choices. Answers its number.
    pub fn add_column(&mut self, key: u32, lamps: &[Lamp]) -> usize {
        self.columns.push(Column::new(&self.world, key, lamps));
        let columns = self.columns.len();
        self.chunks.iter_mut().for_each(|chunk| chunk.make_columns(columns));
        columns - 1
    }

    /// The lamps of a column are others, or elsewhere, with these strengths.
    pub fn set_column(&mut self, column: usize, key: u32, lamps: &[Lamp], strength: &[Bands]) {
        self.columns[column] = Column::new(&self.world, key, lamps);
        self.columns[column].strength = strength.to_vec();
        self.chunks.iter_mut().for_each(|chunk| chunk.forget_column(column));
    }

    /// By what the light of each lamp of a column is multiplied. No ray is traced.
    pub fn set_strength(&mut self, column: usize, strength: &[Bands]) {
        self.columns[column].strength = strength.to_vec();
        let (mut chunks, work) = self.split();
        chunks.par_iter_mut().for_each(|chunk| chunk.add_up(&work, column, u64::MAX));
    }

    /// How many rays there shall be; as many as there are at least.
    pub fn set_target(&mut self, target: Target) {
        let (rays, shadows) = (target.rays.min(self.most.rays), target.shadows.min(self.most.shadows));
        self.target = Target { rays: rays.max(self.target.rays), shadows: shadows.max(self.target.shadows) };
    }

    fn split(&mut self) -> (Vec<&mut Chunk>, Work<'_>) {
        let work = Work {
            world: &self.world,
            columns: &self.columns,
            changes: &self.changes,
            dirt: Vec::new(),
            target: self.target,
            is_dark: &self.is_dark,
        };
        (self.chunks.iter_mut().collect(), work)
    }

    /// Whether rays of a part have to be traced.
    pub fn needs(&mut self, part: Part) -> bool {
        let (chunks, work) = self.split();
        chunks.iter().any(|chunk| chunk.needs(&work, part))
    }

    /// Traces what edits have dirtied and what is missing, piece by piece as long as `go_on` says so; at least one piece. Answers
    /// whether all is done. The part [`Part::Far`] is all of it, [`Part::Near`] the first rays of each row.
    pub fn work(&mut self, part: Part, mut go_on: impl FnMut() -> bool) -> bool {
        self.world.join_trees();
        self.forget_much_changed();
        let mut batch = self.batch.max(2 * rayon::current_num_threads());
        let (chunks, mut work) = self.split();
        let seen: BTreeSet<usize> = chunks.iter().flat_map(|chunk| chunk.seen()).collect();
        let dirty = seen.into_iter().filter(|seen| *seen < work.changes.len()).take(MOST_SHARED);
        work.dirt = dirty.map(|seen| (seen, Dirt::new(work.world, &work.changes[seen..]))).collect();
        let mut open = chunks.into_iter().filter(|chunk| chunk.needs(&work, part));
        let mut rays = 0;
        let is_done = loop {
            let mut own: Vec<&mut Chunk> = open.by_ref().take(batch).collect();
            if own.is_empty() {
                break true;
            }
            let (started, is_full) = (Instant::now(), own.len() == batch);
            rays += own.par_iter_mut().with_max_len(1).map(|chunk| chunk.work(&work, part)).sum::<u64>();
            let took = started.elapsed();
            // What was not full tells nothing of larger ones; doubled again and again it would overflow.
            if took < PIECE / 2 && is_full {
                batch *= 2;
            } else if took > 2 * PIECE {
                batch = (batch / 2).max(2 * rayon::current_num_threads());
            }
            if !go_on() {
                break false;
            }
        };
        drop(open);
        (self.batch, self.rays_traced) = (batch, self.rays_traced + rays);
        if is_done && part == Part::Far {
            self.changes.clear();
            self.chunks.iter_mut().for_each(|chunk| chunk.renumber(|_| 0));
            if self.world.is_scattered() {
                self.world.gather_trees();
            }
            self.world.drop_trees();
        }
        is_done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// A room with a box in it.
    fn furnished() -> Arc<Scene> {
        let mut scene = Scene::default();
        scene.materials.push(radiosity_scene::Material { emissive: [1.0; 3], ..Default::default() });
        for (name, low, high, is_room) in
            [("room", 0.0, 4.0, true), ("box", 1.6, 2.4, false), ("lamp", 3.0, 3.2, false)]
        {
            let at = |x: f64, y: f64, z: f64| DVec3::splat(low) + (high - low) * DVec3::new(x, y, z);
            let mut triangles = Vec::new();
            for axis in 0..3 {
                for side in [0.0, 1.0] {
                    let mut quad = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| {
                        let mut p = [side; 3];
                        (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
                        at(p[0], p[1], p[2])
                    });
                    if (side > 0.5) == is_room {
                        quad.reverse();
                    }
                    let [a, b, c, d] = quad;
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
            if is_room {
                // Without area, and so without a normal.
                triangles.push([0.1, 0.3, 0.2].map(|x| at(x, x, 0.5)));
            }
            scene.add_triangles(name, 0, &triangles);
        }
        Arc::new(scene)
    }

    /// The room with the light of its lamp; no ray is traced yet.
    fn fresh(target: Target) -> Live {
        let mut live = Live::new(furnished(), 0.7, target);
        live.add_column(1, &[Lamp::Body(2)]);
        live.set_target(target);
        live
    }

    fn all(live: &Live) -> (Vec<u32>, Vec<u32>) {
        let of = |chunk: &Chunk, e: usize| {
            let row = chunk.row(e, live.target.rays as usize);
            let light = chunk.light(0, e).map(f32::to_bits);
            let kept = row.kept.iter().flat_map(|bits| [*bits as u32, (bits >> 32) as u32]);
            (
                row.ids.into_iter().flatten().copied().chain(kept).collect::<Vec<_>>(),
                [chunk.row(e, NEAR_RAYS as usize).share, row.share, chunk.exposed(e)]
                    .map(f32::to_bits)
                    .into_iter()
                    .chain(light)
                    .collect::<Vec<_>>(),
            )
        };
        let each = live.chunks.iter().flat_map(|chunk| (0..chunk.len).map(move |e| of(chunk, e)));
        let (rows, light): (Vec<_>, Vec<_>) = each.unzip();
        (rows.concat(), light.concat())
    }

    /// An object goes away and comes back before the rest of the rays has followed: where it was only meanwhile, light is that of
    /// all shadow rays again, and not of the first few.
    #[test]
    fn a_thing_that_comes_back_leaves_no_rough_light() {
        let target = Target { rays: 128, shadows: 16 };
        let [up, in_floor] = [[1.0, 0.5, 0.7], [0.3, 0.1, -2.0]].map(|by| DAffine3::from_translation(DVec3::from(by)));
        for [by, to] in [[up, DAffine3::IDENTITY], [in_floor, DAffine3::IDENTITY], [up, in_floor]] {
            let [mut live, mut other] = [(); 2].map(|()| fresh(target));
            live.work(Part::Far, || true);
            for place in [by, to] {
                live.place(1, place);
                live.work(Part::Near, || true);
                // Layers may be asked for before the rest has followed: no row counts more than all of itself.
                let (one, mut sums) = (vec![Lanes([1f32; 4]); live.ids()], vec![Lanes::default(); live.ids()]);
                live.gather(&one, 128, &mut sums);
                assert!(
                    sums.iter().all(|sum| sum.0[0] < 1.001),
                    "{:?}",
                    sums.iter().map(|sum| sum.0[0]).fold(0.0, f32::max)
                );
            }
            let rough =
                |live: &Live| [Chunk::has_rough_light, Chunk::has_rough_rows].map(|is| live.chunks.iter().any(is));
            assert_eq!(rough(&live), [true; 2], "the first part alone has followed");
            live.work(Part::Far, || true);
            assert_eq!(rough(&live), [false; 2]);
            other.place(1, to);
            other.work(Part::Far, || true);
            assert!(all(&live) == all(&other));
        }
    }

    /// An object is dragged about while rows are still being traced: of its ways little is remembered, and in the end all
    /// rays are those of a fresh start.
    #[test]
    fn a_long_drag_is_forgotten() {
        let target = Target { rays: 128, shadows: 16 };
        let shift = |k: u32| {
            let turn = f64::from(k) * 0.37;
            DAffine3::from_translation(DVec3::new(turn.cos(), 0.3 * turn.sin(), (0.7 * turn).sin()))
        };
        let mut live = fresh(target);
        live.work(Part::Far, || true);
        for k in 0..600 {
            live.place(1, shift(k));
            if k % 5 == 0 {
                live.place(0, DAffine3::from_translation(DVec3::new(0.01 * shift(k).translation.x, 0.0, 0.0)));
            }
            // Sometimes the first part is done, sometimes some of all.
            let mut pieces = k % 7;
            live.work(if k % 3 == 0 { Part::Far } else { Part::Near }, || {
                pieces = pieces.saturating_sub(1);
                pieces > 0
            });
            assert!(live.changes.len() <= 256, "{}", live.changes.len());
        }
        live.work(Part::Far, || true);
        let mut other = fresh(target);
        other.place(1, shift(599));
        other.place(0, DAffine3::from_translation(DVec3::new(0.01 * shift(595).translation.x, 0.0, 0.0)));
        other.work(Part::Far, || true);
        assert!(all(&live) == all(&other));
    }

    /// A floor with many boxes on it, some of them see-through, and a lamp above; no ray is traced yet.
    fn field(boxes: u32, target: Target) -> Live {
        let mut scene = Scene::default();
        scene.materials.push(radiosity_scene::Material { emissive: [1.0; 3], ..Default::default() });
        let mut glass =
            radiosity_scene::Material { alpha_mode: radiosity_scene::AlphaMode::Blend, ..Default::default() };
        glass.base_color[3] = 0.5;
        scene.materials.extend([radiosity_scene::Material::default(), glass]);
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let quad =
            |at: DVec3, size: f64| [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| at + size * corner(x, y, 0.0));
        scene.add_quad("floor", 1, quad(corner(-1.0, -1.0, 0.0), 22.0));
        let mut lamp = quad(corner(8.0, 8.0, 4.0), 3.0);
        lamp.reverse();
        scene.add_quad("lamp", 0, lamp);
        for k in 0..boxes {
            let at = corner(f64::from(k % 20), f64::from(k / 20), 0.1);
            let top = quad(at + 0.6 * DVec3::Z, 0.5);
            let [a, b, c, d] = top;
            let foot = at + corner(0.2, 0.2, 0.0);
            let sides = [[a, foot, b], [b, foot, c], [c, foot, d], [d, foot, a], [a, b, c], [a, c, d]];
            scene.add_triangles(&format!("box {k}"), 1 + usize::from(k % 3 == 0), &sides);
        }
        let mut live = Live::new(Arc::new(scene), 3.0, target);
        live.add_column(1, &[Lamp::Body(1)]);
        live.set_target(target);
        live
    }

    /// Many objects are moved at once, so many that they get a tree together, that all rays are traced anew, or that one tree is
    /// built for all: light is that of a fresh start with one tree. Each ray looked at each of them.
    #[test]
    fn many_things_are_moved_at_once() {
        let target = Target { rays: 128, shadows: 16 };
        let boxes = 300;
        for moved in [7, 40, 120, 140, 290] {
            let place = |k: u32, step: u32| {
                let turn = DAffine3::from_rotation_z(0.1 * f64::from(k));
                DAffine3::from_translation(DVec3::new(0.3 * f64::from(step), 0.02 * f64::from(k % 7), 0.1)) * turn
            };
            let mut live = field(boxes, target);
            live.work(Part::Far, || true);
            let before = live.rays_traced();
            for step in 0..3 {
                for k in 0..moved {
                    live.place(2 + (k * 41 % boxes) as usize, place(k, step));
                }
                if step == 1 {
                    live.remove(2 + 41);
                }
                // The first time half of it, then the first part, then all.
                let mut pieces = 3;
                live.work(if step == 1 { Part::Near } else { Part::Far }, || {
                    pieces -= i32::from(step == 0);
                    pieces > 0
                });
            }
            assert!(
                live.rays_traced() > before && live.world.bodies.iter().all(|body| body.tree.is_none() || moved < 7)
            );
            let mut other = field(boxes, target);
            (0..moved).for_each(|k| other.place(2 + (k * 41 % boxes) as usize, place(k, 2)));
            other.world.gather_trees();
            other.work(Part::Far, || true);
            assert!(all(&live) == all(&other), "{moved}");
        }
    }
}
