//! Which rays of a row count: those of places that far receivers see.
//!
//! Far receivers look an element up and see its open places only; near ones see so much of it that no mean is right for them. Where an
//! element reaches under furniture, or a wall stands on it, the mean over its area gives those far away too little: walls and
//! ceiling of a living room were 0.8 to 1.3 % too dark, and are 0.2 to 1.0 %. So places count by how open they are, the share o of their hemisphere in which
//! nothing is near, over that of the most open place: ray m counts if o(place)/max o is above a random number of its own. A few rays do
//! not tell o of a place; a plane through what the first ones found, near or not, by least squares, is what they do tell. What is
//! enclosed evenly keeps nearly all its rays so, and a step becomes a slope: two triangles of which half is covered have 0.78 of the
//! light of the open half, instead of 0.5.
//!
//! Shadow rays begin at the places of a row's first rays, and count with them. Places inside solids never do.

use super::{Chunk, NEAR_RAYS, Part, ROWS, Work};
use glam::{DMat3, DVec3};
use radiosity_scene::elements::triangle_from_square;
use radiosity_trace::sampling::{Sequence, hash, unit};
use smallvec::SmallVec;

/// Of fewer rays a plane through what they find is noise.
const FEWEST: usize = 16;

/// Rays next to one that tell whether it starts inside a solid. More blur the outline of what is buried, fewer take
/// chance for it.
const NEIGHBOURS: usize = 4;

/// Rays that are looked at together for these: mostly there is none among them.
const AT_ONCE: usize = 16;

/// Elements of which less than this part is exposed get no light.
const LEAST_EXPOSED: f32 = 1.0 / 16.0;

/// The stream of the random numbers by which rays are chosen.
const CHOICE: u32 = 0x0fe7;

/// A bit for each ray of a row.
type Bits = SmallVec<[u64; 4]>;

impl Chunk {
    /// Works out which rays of a row count, and what each does, after some of a part were traced. Answers whether other ones of the
    /// first count now.
    pub(super) fn weigh(&mut self, work: &Work, part: Part, e: usize) -> bool {
        let (rays, near) = (self.traced as usize, self.traced.min(NEAR_RAYS) as usize);
        let (site, seed) = self.site(work.world, e);
        let limit = site.near() as f32;
        let keys = &self.keys[0][e * self.room[0]..][..near];
        // All at once: beside few elements anything is near.
        let is_enclosed = near >= FEWEST && keys.iter().fold(false, |any, key| any | (*key < limit));
        let mut kept: Bits = SmallVec::from_elem(u64::MAX, self.words);
        let (mut known, mut exposed) = (rays, 1.0);
        if is_enclosed || self.dark[e] > 0 {
            if part == Part::Near {
                // All of them would take several times as long, and are not all there.
                known = near;
            }
            let places = Places::new(&Sequence::new(seed, ROWS), known);
            if is_enclosed {
                places.keep_open(|m| keys[m] < limit, near, hash(seed ^ CHOICE), &mut kept);
            }
            if self.dark[e] > 0 {
                let row = self.parts(e, known).concat();
                let (buried, count) = places.buried(&row, work.is_dark, self.words);
                exposed = (known as u32 - count) as f32 / known.max(1) as f32;
                // Where nothing open is left, all that is exposed counts.
                let mut left: Bits = kept.iter().zip(&buried).map(|(kept, buried)| kept & !buried).collect();
                if first_ones(&left, known) == 0 {
                    left = buried.iter().map(|buried| !buried).collect();
                }
                kept = left;
            }
        }
        if exposed < LEAST_EXPOSED {
            exposed = 0.0;
        }
        self.is_rough[e] = known < rays;
        self.exposed[e] = exposed;
        // Of the rest of a row those count that did, until it is looked at.
        let told = if known < rays { 1 } else { self.words };
        let own = &mut self.kept[e * self.words..][..self.words];
        let is_other = own[0] != kept[0];
        own[..told].copy_from_slice(&kept[..told]);
        for (scale, n) in self.scale.iter_mut().zip([near, rays]) {
            let count = first_ones(own, n);
            scale[e] = if count > 0 && exposed > 0.0 { 1.0 / count as f32 } else { 0.0 };
        }
        is_other
    }
}

/// How many of the first `n` bits are set.
pub fn first_ones(bits: &[u64], n: usize) -> u32 {
    let whole: u32 = bits[..n / 64].iter().map(|word| word.count_ones()).sum();
    whole + if n.is_multiple_of(64) { 0 } else { (bits[n / 64] & ((1 << (n % 64)) - 1)).count_ones() }
}

/// Where the rays of a row begin: weights of the element's corners 1 and 2.
struct Places {
    us: SmallVec<[f32; 256]>,
    vs: SmallVec<[f32; 256]>,
}

impl Places {
    fn new(sequence: &Sequence, rays: usize) -> Places {
        let place = |m: u32| {
            let [_, _, x, y] = sequence.point(m);
            let (u, v) = triangle_from_square(f64::from(x), f64::from(y));
            (u as f32, v as f32)
        };
        let (us, vs) = (0..rays as u32).map(place).unzip();
        Places { us, vs }
    }

    fn len(&self) -> usize {
        self.us.len()
    }

    /// (1, u, v) of a place.
    fn at(&self, m: usize) -> DVec3 {
        DVec3::new(1.0, f64::from(self.us[m]), f64::from(self.vs[m]))
    }

    /// Takes out rays by how little open their places are, as the first `near` of them tell.
    fn keep_open(&self, is_near: impl Fn(usize) -> bool, near: usize, seed: u32, kept: &mut [u64]) {
        let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for m in 0..near {
            let at = self.at(m);
            normal += DMat3::from_cols(at * at.x, at * at.y, at * at.z);
            if !is_near(m) {
                right += at;
            }
        }
        // Places of a sequence are spread over the element, so that they lie on no line.
        let plane = normal.inverse() * right;
        let corners = [DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 1.0)];
        let most = corners.into_iter().map(|corner| plane.dot(corner)).fold(0.0, f64::max);
        for m in 0..self.len() {
            // Where nothing is open at all, nothing is left to prefer.
            if most > 0.0 && plane.dot(self.at(m)) <= most * f64::from(unit(hash(seed ^ m as u32))) {
                kept[m / 64] &= !(1 << (m % 64));
            }
        }
    }

    /// Which rays start inside a solid, and how many: those that meet a black back, where half of those that start next to it do so
    /// too: nobody sees that place. Elsewhere backs are black.
    fn buried(&self, row: &[u32], is_dark: &[bool], words: usize) -> (Bits, u32) {
        let is_dark: SmallVec<[bool; 256]> = row.iter().map(|id| is_dark[*id as usize]).collect();
        let mut squares: SmallVec<[f32; 256]> = SmallVec::from_elem(0.0, row.len());
        let mut buried: Bits = SmallVec::from_elem(0, words);
        for m in (0..row.len()).filter(|m| is_dark[*m]) {
            for ((square, u), v) in squares.iter_mut().zip(&self.us).zip(&self.vs) {
                // The square of the distance on an equilateral triangle.
                let (du, dv) = (u - self.us[m], v - self.vs[m]);
                *square = du * du + dv * dv + du * dv;
            }
            squares[m] = f32::INFINITY;
            // The nearest so far, the furthest of them last.
            let mut nearest = [(f32::INFINITY, false); NEIGHBOURS];
            for (squares, dark) in squares.chunks(AT_ONCE).zip(is_dark.chunks(AT_ONCE)) {
                let furthest = nearest[NEIGHBOURS - 1].0;
                if !squares.iter().fold(false, |any, square| any | (*square < furthest)) {
                    continue;
                }
                for (square, dark) in squares.iter().zip(dark) {
                    if *square < nearest[NEIGHBOURS - 1].0 {
                        let mut k = NEIGHBOURS - 1;
                        while k > 0 && *square < nearest[k - 1].0 {
                            nearest[k] = nearest[k - 1];
                            k -= 1;
                        }
                        nearest[k] = (*square, *dark);
                    }
                }
            }
            let dark = nearest.iter().filter(|(_, dark)| *dark).count();
            let all = nearest.iter().filter(|(square, _)| square.is_finite()).count();
            buried[m / 64] |= u64::from(2 * dark >= all) << (m % 64);
        }
        let count = buried.iter().map(|word| word.count_ones()).sum();
        (buried, count)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Lamp, Lanes, Live, Target};
    use super::*;
    use radiosity_scene::{Material, Scene, Sky};
    use std::sync::Arc;

    /// Floors, far enough apart that what averages over them hangs on no seed.
    const FLOORS: usize = 16;

    /// What is found of floors of two elements each, under boards over part of each, by an even sky of radiosity one and a lamp far above:
    /// light of the sky, light of the lamp, rays of 256 that count.
    fn found(board: [f64; 2], height: f64) -> [f64; 3] {
        let mut scene = Scene { sky: Sky::Uniform([1.0; 3]), ..Scene::default() };
        let material = Material { double_sided: true, ..Material::default() };
        scene.materials.extend([material.clone(), Material { emissive: [1e8; 3], ..material }]);
        let square = |k: usize, [x0, x1]: [f64; 2], z: f64| {
            [[x0, 0.0], [x1, 0.0], [x1, 1.0], [x0, 1.0]].map(|[x, y]| DVec3::new(x + 20.0 * k as f64, y, z))
        };
        for (name, x, z) in [("floor", [0.0, 1.0], 0.0), ("board", board, height)] {
            for k in 0..FLOORS {
                scene.add_quad(name, 0, square(k, x, z));
            }
        }
        let lamp = scene.add_quad("lamp", 1, square(FLOORS / 2, [0.0, 1.0], 1e4));
        let mut live = Live::new(Arc::new(scene), 20.0, Target { rays: 256, shadows: 64 });
        let column = live.add_column(1, &[Lamp::Body(lamp)]);
        live.set_target(Target { rays: 256, shadows: 64 });
        live.work(Part::Far, || true);
        let is_sky = |id: usize| id < live.world().sky.len();
        let sky: Vec<Lanes<4>> = (0..live.ids()).map(|id| Lanes([f32::from(u8::from(is_sky(id))); 4])).collect();
        let mut means = vec![Lanes::default(); live.ids()];
        live.gather(&sky, 256, &mut means);
        let mut sums = [0.0; 3];
        for body in 0..FLOORS {
            let first = live.world().bodies[body].first as usize;
            for element in 0..2 {
                let (chunk, e) = live.element(body, element).unwrap();
                let count = first_ones(chunk.row(e, 256).kept, 256);
                let own = [means[first + element as usize].0[1], chunk.light(column, e)[1], count as f32];
                (0..3).for_each(|k| sums[k] += f64::from(own[k]) / (2 * FLOORS) as f64);
            }
        }
        sums
    }

    /// Half a floor lies a centimetre beneath a board, so that over its area it has half the light; far away the open half is what is seen
    /// of it. Beneath a whole board nothing is more open than anything else, and nearly as many rays are left as without one.
    #[test]
    fn from_afar_the_open_half_is_seen() {
        let [open, half, whole] = [[10.0, 10.5], [0.0, 0.5], [-5.0, 6.0]].map(|board| found(board, 0.01));
        assert!(open[0] > 0.99 && open[2] == 256.0, "{open:?}");
        assert!(
            (half[0] / open[0] - 0.78).abs() < 0.02 && (half[1] / open[1] - 0.78).abs() < 0.04,
            "{half:?} {open:?}"
        );
        assert!(whole[2] > 200.0, "{whole:?}");
    }
}
