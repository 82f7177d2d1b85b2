//! Some elements of one object with all their rays: what each met, how far away, and which of them an edit dirties.
//!
//! An entry of a row is an id and the distance of the hit. After an object has changed, three kinds of entries are dirty:
//! those that met it, which their ids tell and which are traced anew; those that pass through the box where it is now, which
//! are traced against it alone; and its own, all of them. The second are found by cones of directions ([`super::aim`]), so that an
//! edit costs a few rays per element and not all. Shadow rays likewise: stopped ones that pass through the box where the object
//! was may have come free, free ones that pass through the box where it is may be stopped.

mod dirt;
mod kept;
mod shadows;

pub use dirt::{Change, Dirt};

use super::aim::{Aim, MOST_WORDS, towards};
use super::body::Site;
use super::column::Column;
use super::world::{Met, World};
use glam::DVec3;
use radiosity_scene::Bands;
use radiosity_trace::Ray;
use radiosity_trace::sampling::{Sequence, cosine_direction, frame, hash};
use shadows::Shadows;
use smallvec::SmallVec;

/// Elements of a chunk: a millisecond of work for a few rays each.
pub const CHUNK: u32 = 64;

/// Columns of a row, and shadow rays of a light, that are looked at first after an edit. A picture of as many is fit to
/// be shown while the others follow.
pub const NEAR_RAYS: u32 = 64;

/// The same for shadow rays.
pub const NEAR_SHADOWS: u32 = 4;

/// The stream of sample points that rows use.
pub const ROWS: u32 = 0x0100;

/// Which of the rays are worked on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The first of each row.
    Near,
    /// The rest.
    Far,
}

/// How many rays there shall be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// Of each row.
    pub rays: u32,
    /// From each element to each column.
    pub shadows: u32,
}

impl Target {
    /// The part of it that comes first.
    pub fn near(self) -> Target {
        Target { rays: self.rays.min(NEAR_RAYS), shadows: self.shadows.min(NEAR_SHADOWS) }
    }

    fn of(self, part: Part) -> Target {
        if part == Part::Near { self.near() } else { self }
    }
}

/// Some elements of one object.
#[derive(Clone, Debug)]
pub struct Chunk {
    /// The object.
    pub body: usize,
    /// First element of the object.
    pub first: u32,
    /// Id of that.
    pub id: usize,
    /// How many.
    pub len: usize,
    /// Where they lie.
    sites: Vec<Site>,
    /// A ball around them.
    ball: (DVec3, f64),
    /// Rays of each row so far.
    traced: u32,
    /// Room for the first part of each row, and for the rest. First parts lie together, as they are often read alone; there
    /// is nothing of the rest before it is traced, as much memory takes its time to come.
    room: [usize; 2],
    ids: [Vec<u32>; 2],
    keys: [Vec<f32>; 2],
    /// Words of bits for the rays of a row.
    words: usize,
    /// Which rays of each row count, as far as they have been traced.
    kept: Vec<u64>,
    /// One over the rays that count, of the first part and of all, by element.
    scale: [Vec<f32>; 2],
    /// The part of each element that is exposed; zero where next to nothing is.
    exposed: Vec<f32>,
    /// Entries of each row that met black backs.
    dark: Vec<u16>,
    /// Whether only the first part of a row has said which of its rays count.
    is_rough: Vec<bool>,
    shadows: Vec<Shadows>,
    /// Changes that have been looked at, for the first part and the rest.
    seen: [usize; 2],
}

/// Entries of a row.
pub struct Row<'a> {
    /// What each met, in two parts.
    pub ids: [&'a [u32]; 2],
    /// Which of them count.
    pub kept: &'a [u64],
    /// What each that counts weighs.
    pub share: f32,
}

impl Row<'_> {
    /// How many entries there are.
    pub fn len(&self) -> usize {
        self.ids[0].len() + self.ids[1].len()
    }

    /// Whether all entries count.
    #[inline(always)]
    pub fn is_whole(&self) -> bool {
        self.kept.iter().all(|bits| *bits == u64::MAX)
    }

    /// Numbers and ids of the entries that count.
    #[inline(always)]
    pub fn counting(&self) -> impl Iterator<Item = (u32, u32)> {
        let words = self.ids[0].chunks(64).chain(self.ids[1].chunks(64)).zip(self.kept).enumerate();
        words.flat_map(|(word, (ids, kept))| {
            let there = u64::MAX >> (64 - ids.len());
            ones(kept & there).map(move |bit| (64 * word as u32 + bit, ids[bit as usize]))
        })
    }
}

/// What all chunks need to work.
pub struct Work<'a> {
    /// The objects.
    pub world: &'a World,
    /// The lights.
    pub columns: &'a [Column],
    /// Changes.
    pub changes: &'a [Change],
    /// What is dirty for chunks that have seen so many of them; others work it out.
    pub dirt: Vec<(usize, Dirt<'a>)>,
    /// How many rays there shall be.
    pub target: Target,
    /// Whether black backs have an id.
    pub is_dark: &'a [bool],
}

/// The numbers of the bits that are set.
fn ones(mut bits: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (bit < 64).then_some(bit)
    })
}

/// What is kept of a hit.
#[inline]
fn entry(world: &World, met: Option<Met>, direction: DVec3) -> (f32, u32) {
    (met.map_or(f32::INFINITY, |met| met.key), world.id(met, direction))
}

impl Chunk {
    /// Elements `first..first + len` of an object, for rows of `stride` rays at most.
    pub fn new(world: &World, body: usize, first: u32, len: u32, stride: u32, columns: usize) -> Chunk {
        let n = len as usize;
        let near = stride.min(NEAR_RAYS);
        let room = [near as usize, (stride - near) as usize];
        let mut chunk = Chunk {
            body,
            first,
            id: (world.bodies[body].first + first) as usize,
            len: n,
            sites: Vec::new(),
            ball: (DVec3::ZERO, 0.0),
            traced: 0,
            room,
            ids: [vec![0; n * near as usize], Vec::new()],
            keys: [vec![0.0; n * near as usize], Vec::new()],
            words: (stride as usize).div_ceil(64),
            kept: vec![u64::MAX; n * (stride as usize).div_ceil(64)],
            scale: [vec![0.0; n], vec![0.0; n]],
            exposed: vec![0.0; n],
            dark: vec![0; n],
            is_rough: vec![false; n],
            shadows: Vec::new(),
            seen: [0; 2],
        };
        chunk.make_columns(columns);
        chunk.find_sites(world);
        chunk
    }

    fn find_sites(&mut self, world: &World) {
        let body = &world.bodies[self.body];
        self.sites = (0..self.len as u32).map(|e| body.site(self.first + e, world.offset)).collect();
        let n = self.len as f64;
        let centre = self.sites.iter().map(|site| site.centre).sum::<DVec3>() / n;
        let reach = |site: &Site| site.centre.distance(centre) + site.radius;
        self.ball = (centre, self.sites.iter().map(reach).fold(0.0, f64::max));
    }

    /// Bytes of an element with rows of `rays` rays and so many columns.
    pub fn bytes(rays: u32, columns: usize) -> usize {
        rays as usize * (size_of::<u32>() + size_of::<f32>())
            + rays.div_ceil(64) as usize * size_of::<u64>()
            + columns * (size_of::<u64>() + size_of::<Bands>())
            + 3 * size_of::<f32>()
            + size_of::<u16>()
            + size_of::<Site>()
    }

    /// Makes room for more columns.
    pub fn make_columns(&mut self, columns: usize) {
        let empty = Shadows {
            rays: 0,
            clear: vec![0; self.len],
            light: vec![[0.0; 3]; self.len],
            is_rough: vec![false; self.len],
        };
        self.shadows.resize(columns, empty);
    }

    /// Forgets all rays: the object is elsewhere. There is nothing left that changes before the one of number `changes`
    /// could have dirtied.
    pub fn forget(&mut self, world: &World, changes: usize) {
        self.traced = 0;
        self.dark.fill(0);
        self.seen = [changes; 2];
        self.find_sites(world);
        (0..self.shadows.len()).for_each(|column| self.forget_column(column));
    }

    /// Forgets the shadow rays to one column.
    pub fn forget_column(&mut self, column: usize) {
        let shadows = &mut self.shadows[column];
        shadows.rays = 0;
        shadows.clear.fill(0);
        shadows.light.fill([0.0; 3]);
        shadows.is_rough.fill(false);
    }

    /// How many changes have been looked at, for the first part and the rest.
    pub fn seen(&self) -> [usize; 2] {
        self.seen
    }

    /// Whether the light of an element is that of the first few shadow rays to a column.
    #[cfg(test)]
    pub fn has_rough_light(&self) -> bool {
        self.shadows.iter().any(|shadows| shadows.is_rough.contains(&true))
    }

    /// Whether what is exposed of an element is as the first part of its row says.
    #[cfg(test)]
    pub fn has_rough_rows(&self) -> bool {
        self.is_rough.contains(&true)
    }

    /// Changes have other numbers now.
    pub fn renumber(&mut self, number: impl Fn(usize) -> usize) {
        self.seen = self.seen.map(number);
    }

    /// Rays of each row so far.
    pub fn traced(&self) -> u32 {
        self.traced
    }

    /// Whether there is something to do for a part.
    pub fn needs(&self, work: &Work, part: Part) -> bool {
        let target = work.target.of(part);
        work.world.bodies[self.body].is_present
            && (self.seen[part as usize] < work.changes.len()
                || part == Part::Far && self.seen[0] < work.changes.len()
                || self.traced < target.rays
                || self.shadows.iter().any(|s| s.rays < target.shadows))
    }

    /// Does what there is to do for a part; answers how many rays were traced.
    pub fn work(&mut self, work: &Work, part: Part) -> u64 {
        let mut rays = 0;
        if part == Part::Far && self.seen[0] < work.changes.len() {
            rays += self.work(work, Part::Near);
        }
        let target = work.target.of(part);
        // What was traced before the changes, of this part.
        let known = match part {
            Part::Near => 0..self.traced.min(target.rays),
            Part::Far => NEAR_RAYS.min(self.traced)..self.traced,
        };
        let seen = self.seen[part as usize];
        // Elements whose shadow rays count by other places than before, a bit for each.
        let mut replaced = 0u64;
        if seen < work.changes.len() {
            let own;
            let dirt = match work.dirt.iter().find(|(of, _)| *of == seen) {
                Some((_, dirt)) => dirt,
                None => {
                    own = Dirt::new(work.world, &work.changes[seen..]);
                    &own
                }
            };
            if !known.is_empty() {
                for e in 0..self.len {
                    let (traced, has_changed) = self.mend_row(work, dirt, e, known.clone());
                    rays += traced;
                    if has_changed || self.is_rough[e] && part == Part::Far {
                        replaced |= u64::from(self.weigh(work, part, e)) << e;
                    }
                }
            }
            for column in 0..self.shadows.len() {
                rays += self.mend_shadows(work, part, (dirt, replaced), column);
            }
        }
        self.seen[part as usize] = work.changes.len();
        if self.traced <= NEAR_RAYS && self.shadows.iter().all(|s| s.rays <= NEAR_SHADOWS) {
            // There is no rest yet that could be dirty.
            self.seen[1] = self.seen[1].max(self.seen[0]).min(work.changes.len());
        }
        let has_more_rays = self.traced < target.rays;
        if has_more_rays {
            rays += u64::from(target.rays - self.traced) * self.len as u64;
            if target.rays > NEAR_RAYS {
                self.ids[1].resize(self.len * self.room[1], 0);
                self.keys[1].resize(self.len * self.room[1], 0.0);
            }
            for e in 0..self.len {
                self.trace_row(work, e, self.traced..target.rays);
            }
            self.traced = target.rays;
            replaced = (0..self.len).fold(0, |bits, e| bits | u64::from(self.weigh(work, Part::Far, e)) << e);
        }
        for column in 0..self.shadows.len() {
            if self.shadows[column].rays < target.shadows {
                rays += self.trace_shadows(work, column, target.shadows);
            } else if has_more_rays {
                self.add_up(work, column, replaced);
            }
        }
        rays
    }

    fn site(&self, world: &World, e: usize) -> (Site, u32) {
        (self.sites[e], hash(world.bodies[self.body].key ^ hash(self.first + e as u32)))
    }

    fn trace_row(&mut self, work: &Work, e: usize, range: std::ops::Range<u32>) {
        let world = work.world;
        let (site, seed) = self.site(world, e);
        let (sequence, frame) = (Sequence::new(seed, ROWS), frame(site.normal));
        for m in range {
            let (ray, direction, salt) = shoot(world, &site, (&sequence, seed), &frame, m);
            let (part, at) = self.at(e, m);
            let (key, id) = entry(world, world.first(&ray, salt), direction);
            (self.keys[part][at], self.ids[part][at]) = (key, id);
            self.dark[e] += u16::from(work.is_dark[id as usize]);
        }
    }

    /// Sets an entry; answers whether it met a black back and does not any more, or the other way round, and for the first entries
    /// whether it met what is nearer than `limit`.
    fn set(&mut self, work: &Work, e: usize, (part, at): (usize, usize), (key, id): (f32, u32), limit: f32) -> bool {
        let [was, is] = [self.ids[part][at], id].map(|id| work.is_dark[id as usize]);
        let before = std::mem::replace(&mut self.keys[part][at], key);
        self.ids[part][at] = id;
        self.dark[e] = self.dark[e] + u16::from(is) - u16::from(was);
        was != is || part == 0 && (before < limit) != (key < limit)
    }

    /// Traces the entries of a row that changes have dirtied; `known` are those of the part that have been traced. Answers how many
    /// rays that took, and whether other rays may count than before.
    fn mend_row(&mut self, work: &Work, dirt: &Dirt, e: usize, known: std::ops::Range<u32>) -> (u64, bool) {
        let lost = self.find_lost(dirt, e, &known);
        let cones = dirt.cones(&self.sites[e]);
        if lost == [0; MOST_WORDS] && cones.is_empty() {
            return (0, false);
        }
        let world = work.world;
        let (site, seed) = self.site(world, e);
        let (sequence, frame, near_limit) = (Sequence::new(seed, ROWS), frame(site.normal), site.near() as f32);
        let (mut rays, mut has_changed) = (0, false);
        for (word, bits) in lost.into_iter().enumerate() {
            for bit in ones(bits) {
                rays += 1;
                let m = known.start + 64 * word as u32 + bit;
                let (ray, direction, salt) = shoot(world, &site, (&sequence, seed), &frame, m);
                let found = entry(world, world.first(&ray, salt), direction);
                has_changed |= self.set(work, e, self.at(e, m), found, near_limit);
            }
        }
        let margin = world.margin();
        let nearest = cones.iter().map(|cone| cone.nearest).fold(f64::INFINITY, f64::min) - margin;
        let aims: SmallVec<[Aim; 4]> = cones.iter().map(|cone| cone.aim(&frame)).collect();
        let (in_part, at) = self.at(e, known.start);
        let reached = &self.keys[in_part][at..at + known.len()];
        let near = towards(&sequence, known.start, reached, (nearest as f32).next_down(), &aims);
        for (word, (near, lost)) in near.into_iter().zip(lost).enumerate() {
            for bit in ones(near & !lost) {
                let m = known.start + 64 * word as u32 + bit;
                let at = self.at(e, m);
                let key = self.keys[at.0][at.1];
                let [u, v] = sequence.pair(m);
                let direction = cosine_direction(&frame, f64::from(u), f64::from(v));
                if !cones.iter().any(|cone| cone.has(direction)) {
                    continue;
                }
                let (ray, salt) = shoot_to(world, &site, (&sequence, seed), direction, m);
                let mut best: Option<(f32, u32)> = None;
                let (origin, along) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
                for dirty in &dirt.bodies {
                    let Some(bounds) = dirty.now else { continue };
                    let limit = best.map_or(key, |(key, _)| key);
                    if !bounds.may_meet(origin, along, f64::from(limit), margin) {
                        continue;
                    }
                    rays += 1;
                    let Some(met) = world.first_of(dirty.body, &ray, salt, limit) else { continue };
                    if met.key < limit {
                        best = Some(entry(world, Some(met), direction));
                    } else {
                        // At the same distance the number of the triangle decides, which is not kept.
                        rays += 1;
                        best = Some(entry(world, world.first(&ray, salt), direction));
                        break;
                    }
                }
                if let Some(best) = best {
                    has_changed |= self.set(work, e, at, best, near_limit);
                }
            }
        }
        (rays, has_changed)
    }

    /// Which entries of a row met objects that have changed, a bit for each of those that are `known`.
    fn find_lost(&self, dirt: &Dirt, e: usize, known: &std::ops::Range<u32>) -> [u64; MOST_WORDS] {
        let mut lost = [0; MOST_WORDS];
        let (part, from) = self.at(e, known.start);
        let row = &self.ids[part][from..from + known.len()];
        let (low, width) = dirt.ids;
        for (word, ids) in lost.iter_mut().zip(row.chunks(64)) {
            // All at once, as nearly no row has any.
            if !ids.iter().fold(false, |any, id| any | (id.wrapping_sub(low) <= width)) {
                continue;
            }
            for (bit, id) in ids.iter().enumerate() {
                *word |= u64::from(dirt.bodies.iter().any(|dirty| dirty.own.has(*id))) << bit;
            }
        }
        lost
    }

    /// Whether next to nothing of an element is exposed, so that it gets no light.
    pub fn is_buried(&self, e: usize) -> bool {
        self.exposed[e] == 0.0
    }

    /// The part of an element that is exposed, 0 to 1.
    pub fn exposed(&self, e: usize) -> f32 {
        self.exposed[e]
    }

    /// What a column brings directly to an element, lux per band.
    #[inline]
    pub fn light(&self, column: usize, e: usize) -> Bands {
        if self.is_buried(e) { [0.0; 3] } else { self.shadows[column].light[e] }
    }

    /// The share of the shadow rays from an element to a column that came through.
    pub fn clear_share(&self, column: usize, e: usize) -> f32 {
        self.shadows[column].clear_share(e)
    }

    /// The first `rays` entries of a row; fewer where an edit has left only as many. Of fewer than there are in the first part as many are
    /// taken to count as in all of it.
    #[inline(always)]
    pub fn row(&self, e: usize, rays: usize) -> Row<'_> {
        let rays = rays.min(self.traced as usize);
        let (part, near) = (usize::from(rays > NEAR_RAYS as usize), self.traced.min(NEAR_RAYS) as usize);
        let share = self.scale[part][e];
        let share = if rays < near { share * (near as f32 / rays as f32) } else { share };
        Row { ids: self.parts(e, rays), kept: &self.kept[e * self.words..][..self.words], share }
    }

    #[inline(always)]
    fn parts(&self, e: usize, rays: usize) -> [&[u32]; 2] {
        let [near, far] = self.room;
        let first = rays.min(near);
        let rest: &[u32] = if rays > first { &self.ids[1][e * far..][..rays - first] } else { &[] };
        [&self.ids[0][e * near..][..first], rest]
    }

    fn key(&self, e: usize, m: u32) -> f32 {
        let (part, at) = self.at(e, m);
        self.keys[part][at]
    }

    /// Where entry m of a row is kept: in which part, and where in it.
    #[inline]
    fn at(&self, e: usize, m: u32) -> (usize, usize) {
        let ([near, far], m) = (self.room, m as usize);
        if m < near { (0, e * near + m) } else { (1, e * far + m - near) }
    }

    /// The rays of a row: origin and end about the middle of the scene, `far` where they escape.
    pub fn rays(&self, world: &World, e: usize, far: f64) -> Vec<[DVec3; 2]> {
        let (site, seed) = self.site(world, e);
        let (sequence, frame) = (Sequence::new(seed, ROWS), frame(site.normal));
        let ray = |m: u32| {
            let (ray, direction, _) = shoot(world, &site, (&sequence, seed), &frame, m);
            let (origin, key) = (ray.origin.as_dvec3(), self.key(e, m));
            [origin, origin + direction * if key.is_finite() { f64::from(key) } else { far }]
        };
        (0..self.traced).map(ray).collect()
    }
}

/// Ray m of a row.
#[inline]
pub fn shoot(
    world: &World,
    site: &Site,
    (sequence, seed): (&Sequence, u32),
    frame: &[DVec3; 3],
    m: u32,
) -> (Ray, DVec3, u32) {
    let [u, v, x, y] = sequence.point(m);
    let direction = cosine_direction(frame, f64::from(u), f64::from(v));
    (world.ray(&site.place(x, y), direction, f64::INFINITY), direction, salt_of(seed, m))
}

/// Ray m of a row, whose direction is known.
#[inline]
fn shoot_to(world: &World, site: &Site, (sequence, seed): (&Sequence, u32), direction: DVec3, m: u32) -> (Ray, u32) {
    let [_, _, x, y] = sequence.point(m);
    (world.ray(&site.place(x, y), direction, f64::INFINITY), salt_of(seed, m))
}

/// Decides whether blended surfaces stop ray m.
#[inline]
fn salt_of(seed: u32, m: u32) -> u32 {
    hash(hash(seed) ^ m)
}
