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

mod body;
mod chunk;
mod column;
mod gather;
mod strata;
mod world;

pub use body::{Body, Bounds, Shape, Site};
pub use chunk::{Chunk, NEAR_RAYS, Part, Target};
pub use column::{Column, Lamp};
pub use gather::Lanes;
pub use world::{REACH, World};

use chunk::{CHUNK, Change, Work};
use glam::DAffine3;
use radiosity_scene::elements::division_of;
use radiosity_scene::{Bands, Scene};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};
use strata::Strata;

/// How long the chunks that are handed out together shall take: as often it is asked whether to go on.
const PIECE: Duration = Duration::from_millis(5);

/// Objects, rows and columns of light.
pub struct Live {
    world: World,
    columns: Vec<Column>,
    chunks: Vec<Chunk>,
    changes: Vec<Change>,
    strata: [Strata; 2],
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
            changes: Vec::new(),
            strata: [most.near(), most].map(|target| Strata::new(target.rays)),
            target: Target { rays: 0, shadows: 0 },
            most,
            rays_traced: 0,
            batch: 1,
        };
        (0..live.world.bodies.len()).for_each(|body| live.cut(body));
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

    /// Number of ids.
    pub fn ids(&self) -> usize {
        self.world.ids()
    }

    /// Rays traced so far, of all kinds.
    pub fn rays_traced(&self) -> u64 {
        self.rays_traced
    }

    /// Rays of rows as asked for now.
    pub fn target(&self) -> Target {
        self.target
    }

    /// Most rays.
    pub fn most(&self) -> Target {
        self.most
    }

    /// Cuts an object into chunks.
    fn cut(&mut self, body: usize) {
        let n = self.world.bodies[body].elements();
        for first in (0..n).step_by(CHUNK as usize) {
            let len = CHUNK.min(n - first);
            self.chunks.push(Chunk::new(&self.world, body, first, len, self.most.rays, self.columns.len()));
        }
        self.is_dark.extend(std::iter::repeat_n(false, n as usize));
        self.is_dark.push(true);
    }

    fn forget(&mut self, body: usize) {
        let world = &self.world;
        self.chunks.iter_mut().filter(|chunk| chunk.body == body).for_each(|chunk| chunk.forget(world));
    }

    /// Puts an object elsewhere, or brings it back.
    pub fn place(&mut self, body: usize, matrix: DAffine3) {
        let own = &self.world.bodies[body];
        self.changes.push(Change { body, before: own.is_present.then_some(own.bounds) });
        self.world.place(body, matrix);
        self.forget(body);
    }

    /// Takes an object away.
    pub fn remove(&mut self, body: usize) {
        let own = &self.world.bodies[body];
        self.changes.push(Change { body, before: own.is_present.then_some(own.bounds) });
        self.world.remove(body);
        self.forget(body);
    }

    /// Adds a copy of an object; answers its number.
    pub fn copy(&mut self, body: usize, matrix: DAffine3) -> usize {
        let shape = self.world.bodies[body].shape.clone();
        let added = self.world.add(shape, matrix);
        self.world.place(added, matrix);
        self.changes.push(Change { body: added, before: None });
        self.cut(added);
        added
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
        chunks.par_iter_mut().for_each(|chunk| chunk.add_up(&work, column));
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
            strata: &self.strata,
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
        let mut batch = self.batch.max(2 * rayon::current_num_threads());
        let (chunks, work) = self.split();
        let mut open = chunks.into_iter().filter(|chunk| chunk.needs(&work, part));
        let mut rays = 0;
        let is_done = loop {
            let mut own: Vec<&mut Chunk> = open.by_ref().take(batch).collect();
            if own.is_empty() {
                break true;
            }
            let started = Instant::now();
            rays += own.par_iter_mut().map(|chunk| chunk.work(&work, part)).sum::<u64>();
            let took = started.elapsed();
            if took < PIECE / 2 {
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
            self.chunks.iter_mut().for_each(Chunk::reset_seen);
            if self.world.is_scattered() {
                self.world.gather_trees();
            }
        }
        is_done
    }
}
