//! Edges of light within elements.
//!
//! The light that is shown runs evenly from corner to corner of an element, and an edge of a shadow within one is as wide as the
//! element. Where the sun or lamps without area light neighbours so differently that one sees it, elements are cut for display: at
//! places all over them the light of such a lamp is found by shadow rays of their own. Lamps with area have softer edges, and what few
//! rays to them find at a place is noisier than what is shown: walls of an office with twelve panels became mottled. Patches shoot and elements receive (Cohen, Greenberg, Immel and Brock
//! 1986, "An efficient radiosity approach for realistic image synthesis"): what surfaces give off is that of whole elements still.
//!
//! Kept is by how much the places differ from what is shown there, for a lamp that is not dimmed: it can be added to every layer
//! that has light of this lamp, in whatever light the lamp is now, and stays when lamps are dimmed and walls painted. Where it runs
//! evenly over an element, its corners are enough.

use super::display::{Display, Light};
use super::{Layer, ObjectId, Session, Strand};
use glam::{DMat3, DMat4, DVec3};
use radiosity_scene::{Bands, Side, luminance};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// Parts of a side of elements as wide as they may be, in which there is an edge, and by which it is seen whether there is one.
const PARTS: u32 = 16;
const PROBE: u32 = 6;

/// Least difference among neighbours that is looked after, over the light there: half as much is hard to see beside the noise.
const LEAST_CONTRAST: f32 = 0.15;

/// What light may differ by from one that runs evenly over an element, over the light there, before the element is cut.
const EVEN: f32 = 0.05;

/// How many times the places that may be in the end are looked at for edges: most elements beside one have none.
const LOOKED_AT: usize = 4;

/// Where around a place light is looked for, in widths of a part: edges of shadows would be stairs. As far as the next places, so that
/// nothing is between them.
const AROUND: [[f32; 2]; 8] = [
    [-0.1875, -0.5625],
    [0.5625, -0.1875],
    [0.1875, 0.5625],
    [-0.5625, 0.1875],
    [-0.5, -0.1],
    [0.1, -0.5],
    [0.5, 0.1],
    [-0.1, 0.5],
];

/// Elements between looks at the time.
const BATCH: usize = 64;

/// How far places at the border of an element are moved towards its middle: beside a wall they would be in it.
const INWARDS: f32 = 1e-3;

/// An element of an object.
type Key = (usize, u32);

/// A strand's light on an element, cut into parts.
type Sample = (Key, usize, u32);

/// An element among whose neighbours light differs, and how much that matters.
struct Wanted {
    key: Key,
    weight: f32,
    /// Parts, if there is an edge in it.
    parts: u32,
    /// Whose light differs, by how much that may differ from one that runs evenly, and what the element has of it.
    strands: Vec<(usize, f32, Bands)>,
}

/// An element that is cut.
struct Cut {
    parts: u32,
    /// Of each strand by how much places have another light than is shown there, and what the element had of it then.
    differences: Vec<(usize, Vec<Bands>, Bands)>,
}

/// What is known of edges.
#[derive(Default)]
pub struct Edges {
    /// Of which light it is; none before all of it is known.
    revision: Option<u64>,
    cuts: BTreeMap<Key, Cut>,
    /// Whether lamps or what stands in their light have changed since.
    is_old: bool,
    /// What is to be known next, and of which light.
    wanted: Option<(u64, Vec<Wanted>)>,
    /// What was found as the lamps and what stands in their light are now.
    samples: BTreeMap<Sample, Vec<Bands>>,
}

/// How many places an element of so many parts has.
pub fn places_of(parts: u32) -> usize {
    ((parts + 1) * (parts + 2) / 2) as usize
}

/// Weights of the corners 1 and 2 of an element at its places, row by row.
pub fn places(parts: u32) -> impl Iterator<Item = [f32; 2]> {
    (0..=parts).flat_map(move |j| (0..=parts - j).map(move |i| [i, j].map(|k| k as f32 / parts as f32)))
}

/// What is at a place of an element between those that are known.
fn between(parts: u32, known: &[Bands], [v, w]: [f32; 2]) -> Bands {
    let n = parts as usize;
    let at = |i: usize, j: usize| known[j * (n + 1) - j * j.saturating_sub(1) / 2 + i];
    let [x, y] = [v, w].map(|x| x.clamp(0.0, 1.0) * n as f32);
    let j = (y as usize).min(n - 1);
    let i = (x as usize).min(n - 1 - j);
    let (x, y) = (x - i as f32, y - j as f32);
    // Of the two halves of a cell, the upper is not there at the slanting side.
    let (first, weights) = if x + y <= 1.0 || i + j + 2 > n {
        (at(i, j), [1.0 - x - y, x, y])
    } else {
        (at(i + 1, j + 1), [x + y - 1.0, 1.0 - y, 1.0 - x])
    };
    let others = [at(i + 1, j), at(i, j + 1)];
    std::array::from_fn(|band| weights[0] * first[band] + weights[1] * others[0][band] + weights[2] * others[1][band])
}

/// What the corners of an element have.
fn corners(parts: u32, known: &[Bands]) -> Vec<Bands> {
    vec![known[0], known[parts as usize], known[known.len() - 1]]
}

/// Whether places have about what would run evenly between the corners.
fn is_even(parts: u32, known: &[Bands], tolerance: f32) -> bool {
    let corners = corners(parts, known);
    let apart = |(uv, known): ([f32; 2], &Bands)| luminance(*known) - luminance(between(1, &corners, uv));
    places(parts).zip(known).all(|place| apart(place).abs() <= tolerance)
}

impl Edges {
    /// Of elements that are wanted, samples that are not there yet.
    fn missing(&self, wanted: &[Wanted]) -> Vec<Sample> {
        let of = |wanted: &Wanted| -> Vec<Sample> {
            let parts = if self.has_edge(wanted) { wanted.parts } else { wanted.parts.min(PROBE) };
            wanted.strands.iter().map(|(strand, ..)| (wanted.key, *strand, parts)).collect()
        };
        let mut missing: Vec<Sample> =
            wanted.iter().flat_map(of).filter(|key| !self.samples.contains_key(key)).collect();
        missing.sort_unstable_by_key(|((object, element), strand, parts)| (*object, *strand, *element, *parts));
        missing
    }

    /// Whether what was found first on an element is not even.
    fn has_edge(&self, Wanted { key, parts, strands, .. }: &Wanted) -> bool {
        let probe = (*parts).min(PROBE);
        strands.iter().any(|(strand, tolerance, _)| {
            let found = self.samples.get(&(*key, *strand, probe));
            found.is_some_and(|found| !is_even(probe, found, *tolerance))
        })
    }

    /// Elements as they are cut, as many as may be.
    fn cut(&self, wanted: &[Wanted], most: usize) -> BTreeMap<Key, Cut> {
        let mut cuts = BTreeMap::new();
        let mut count = 0;
        for one in wanted {
            let has_edge = self.has_edge(one);
            let (from, parts) = if has_edge { (one.parts, one.parts) } else { (one.parts.min(PROBE), 1) };
            count += places_of(parts);
            if count > most {
                break;
            }
            let of = |(strand, _, light): &(usize, f32, Bands)| {
                let found = self.samples.get(&(one.key, *strand, from))?;
                Some((*strand, if has_edge { found.clone() } else { corners(from, found) }, *light))
            };
            cuts.insert(one.key, Cut { parts, differences: one.strands.iter().filter_map(of).collect() });
        }
        cuts
    }
}

impl Session {
    /// Whether all edges of the light that is shown are known, as far as they are looked for.
    pub(super) fn is_sharp(&self) -> bool {
        self.most_places == 0 || self.edges.revision == Some(self.state.revision)
    }

    /// Lamps or what stands in their light have changed. Elements stay cut that have the same light of them as before.
    pub(super) fn doubt(&mut self) {
        let cuts = std::mem::take(&mut self.edges.cuts);
        self.edges = Edges { cuts, is_old: true, ..Edges::default() };
    }

    /// The elements of an object that are cut.
    fn cuts_of(&self, object: usize) -> impl Iterator<Item = (u32, &Cut)> {
        let cuts = self.edges.cuts.range((object, 0)..(object + 1, 0)).map(|((_, element), cut)| (*element, cut));
        cuts.filter(move |(element, cut)| self.is_as_it_was((object, *element), cut))
    }

    fn is_as_it_was(&self, (object, element): Key, cut: &Cut) -> bool {
        let has = |(strand, _, light): &(usize, _, Bands)| self.of_column(object, *strand)(element).0 == *light;
        !self.edges.is_old || cut.differences.iter().all(has)
    }

    /// Looks for edges until a time, at least for some.
    pub(super) fn sharpen(&mut self, deadline: Instant) {
        let revision = self.state.revision;
        let known = self.edges.wanted.take().filter(|(of, _)| *of == revision);
        let wanted = known.map_or_else(|| self.edges_in_sight(), |(_, wanted)| wanted);
        let missing = self.edges.missing(&wanted);
        for group in missing.chunk_by(|a, b| (a.0.0, a.1) == (b.0.0, b.1)) {
            let ((object, _), strand, _) = group[0];
            let shown = self.shown_of(object, strand);
            for some in group.chunks(BATCH) {
                let found: Vec<_> = some.par_iter().map(|sample| (*sample, self.sample(*sample, &shown))).collect();
                self.edges.samples.extend(found);
                if Instant::now() >= deadline {
                    self.edges.wanted = Some((revision, wanted));
                    return;
                }
            }
        }
        if !missing.is_empty() {
            // What has an edge is cut further.
            self.edges.wanted = Some((revision, wanted));
            return;
        }
        let cuts = self.edges.cut(&wanted, self.most_places);
        let there: BTreeSet<Key> = wanted.iter().map(|wanted| wanted.key).collect();
        self.edges.samples.retain(|(key, ..), _| there.contains(key));
        let before = std::mem::replace(&mut self.edges.cuts, cuts);
        self.state.changed.extend(before.keys().chain(self.edges.cuts.keys()).map(|key| key.0));
        (self.edges.revision, self.edges.is_old) = (Some(revision), false);
    }

    /// The light of a strand at the vertices of an object, as it is shown where it is not dimmed.
    fn shown_of(&self, object: usize, strand: usize) -> Vec<Bands> {
        let (light, is_buried) = (self.of_column(object, strand), self.buried(object));
        self.display(object).light(|element| Light { lamps: light(element).0, rest: [0.0; 3] }, None, is_buried)
    }

    /// What a strand brings directly to the elements of an object, and the share of shadow rays that came through.
    fn of_column(&self, object: usize, strand: usize) -> impl Fn(u32) -> (Bands, f32) {
        let (column, chunks) = (self.strands[strand].column, self.chunks_of(object));
        move |element| {
            let Some(column) = column else { return ([0.0; 3], 1.0) };
            let chunk = &chunks[chunks.partition_point(|chunk| chunk.first <= element) - 1];
            let e = (element - chunk.first) as usize;
            (chunk.light(column, e), chunk.clear_share(column, e))
        }
    }

    /// Elements among whose neighbours the light of a strand differs, those first where it matters most.
    fn edges_in_sight(&self) -> Vec<Wanted> {
        let lit = |(strand, own): (usize, &Strand)| {
            let factor = luminance(self.factor(own));
            own.column.filter(|column| factor > 0.0 && self.live.is_certain(*column)).map(|_| (strand, factor))
        };
        let strands: Vec<(usize, f32)> = self.strands.iter().enumerate().filter_map(lit).collect();
        let of_object = |object: usize| self.edges_on(object, &strands);
        let mut wanted: Vec<Wanted> = (0..self.objects.len()).into_par_iter().flat_map_iter(of_object).collect();
        wanted.sort_by(|a, b| b.weight.total_cmp(&a.weight).then(a.key.cmp(&b.key)));
        let mut count = 0;
        let is_much = |wanted: &Wanted| {
            count += places_of(wanted.parts) * wanted.strands.len();
            count > LOOKED_AT * self.most_places
        };
        wanted.truncate(wanted.iter().position(is_much).unwrap_or(wanted.len()));
        wanted
    }

    fn edges_on(&self, object: usize, strands: &[(usize, f32)]) -> Vec<Wanted> {
        let (body, mut found) = (&self.live.world().bodies[object], BTreeMap::new());
        if !body.is_present || self.objects[object].paint.transmits {
            return Vec::new();
        }
        for (strand, factor) in strands {
            let light = self.of_column(object, *strand);
            let light: Vec<(Bands, f32)> = (0..body.elements()).map(light).collect();
            let ranges =
                self.display(object).ranges(|element| luminance(light[element as usize].0), self.buried(object));
            for (element, [low, high]) in (0..).zip(ranges) {
                // A shadow narrower than elements makes no difference among them.
                let (own, share) = light[element as usize];
                let is_crossed = share > 0.0 && share < 1.0;
                let [low, high] = if is_crossed { [0.0, high.max(luminance(own) / share)] } else { [low, high] };
                let all = self.state.shown[(body.first + element) as usize].0;
                let all = luminance([all[0], all[1], all[2]]).max(factor * high);
                let contrast = if all > 0.0 { factor * (high - low) / all } else { 0.0 };
                if contrast < LEAST_CONTRAST {
                    continue;
                }
                let width = (2.0 * body.area(element)).sqrt();
                let parts = (f64::from(PARTS) * width / self.element_size).ceil().clamp(1.0, PARTS.into()) as u32;
                let key = (object, element);
                let one = found.entry(key).or_insert(Wanted { key, weight: 0.0, parts, strands: Vec::new() });
                one.weight = one.weight.max(contrast * (width as f32).sqrt());
                one.parts = one.parts.max(parts);
                one.strands.push((*strand, EVEN * all / factor, own));
            }
        }
        found.into_values().collect()
    }

    /// By how much the places of an element have another light of a strand than is shown there.
    fn sample(&self, ((object, element), strand, parts): Sample, shown: &[Bands]) -> Vec<Bands> {
        let Some(column) = self.strands[strand].column else { return vec![[0.0; 3]; places_of(parts)] };
        let world = self.live.world();
        let (body, display) = (&world.bodies[object], self.display(object));
        let turned = DMat3::from_mat4(DMat4::from(body.matrix)).inverse().transpose();
        let found = |[v, w]: [f32; 2]| {
            let inwards = |x: f32| x + INWARDS * (1.0 / 3.0 - x);
            let (t, side, at) = body.point(element, [inwards(v), inwards(w)]);
            let flat = if side == Side::Front { body.normals[t] } else { -body.normals[t] };
            let smooth = (turned * display.normal(element, [v, w])).normalize_or_zero();
            let normal = if smooth.dot(flat) > 0.0 { smooth } else { flat };
            self.live.receive_from(column, (at + world.middle, normal))
        };
        let difference = |[v, w]: [f32; 2]| {
            let mut sum = [0f32; 3];
            for [x, y] in AROUND {
                let [x, y] = [v + x / parts as f32, w + y / parts as f32].map(|x| x.max(0.0));
                let found = found([x, y].map(|k| k / (x + y).max(1.0)));
                (0..3).for_each(|band| sum[band] += found[band] / AROUND.len() as f32);
            }
            let shown = display.at(shown, element, [v, w]);
            std::array::from_fn(|band| sum[band] - shown[band])
        };
        places(parts).map(difference).collect()
    }

    /// Elements of an object that are cut where light has an edge, and into how many parts along each side.
    pub fn cuts(&self, object: ObjectId) -> Vec<(u32, u32)> {
        self.cuts_of(object.0 as usize).map(|(element, cut)| (element, cut.parts)).collect()
    }

    /// The light of a layer at the places of the elements that are cut ([`Session::cuts`]), given that at the vertices
    /// ([`Session::light`]): with n parts, corner 1 counts i/n and corner 2 j/n, j from 0 to n and for each i from 0 to n − j.
    pub fn light_of_cuts(&self, object: ObjectId, layer: Layer, light: &[Bands]) -> Vec<Bands> {
        let own = match layer {
            Layer::Light(light) => self.light_of(light).map(|light| light.strand),
            _ => None,
        };
        let is_in = |strand: usize| match layer {
            Layer::Total | Layer::Direct | Layer::Bounce(_) => true,
            Layer::Light(_) => own == Some(strand),
            Layer::Indirect | Layer::Error | Layer::RelativeError => false,
        };
        let display = self.display(object.0 as usize);
        let mut all: Vec<Bands> = Vec::new();
        for (element, cut) in self.cuts_of(object.0 as usize) {
            let first = all.len();
            all.extend(places(cut.parts).map(|uv| display.at(light, element, uv)));
            for (strand, differences, _) in cut.differences.iter().filter(|(strand, ..)| is_in(*strand)) {
                let factor = self.state.factors.get(*strand).copied().unwrap_or_default();
                for (light, difference) in all[first..].iter_mut().zip(differences) {
                    (0..3).for_each(|band| light[band] += factor[band] * difference[band]);
                }
            }
            all[first..].iter_mut().flatten().for_each(|x| *x = x.max(0.0));
        }
        all
    }

    /// All light as it is shown at a place of an element, given that at the vertices.
    pub(super) fn shown_at(&self, object: usize, light: &[Bands], element: u32, uv: [f32; 2]) -> Bands {
        let mut shown = self.display(object).at(light, element, uv);
        let key = (object, element);
        if let Some(cut) = self.edges.cuts.get(&key).filter(|cut| self.is_as_it_was(key, cut)) {
            for (strand, differences, _) in &cut.differences {
                let factor = self.state.factors.get(*strand).copied().unwrap_or_default();
                let more = between(cut.parts, differences, uv);
                (0..3).for_each(|band| shown[band] += factor[band] * more[band]);
            }
        }
        shown.map(|x| x.max(0.0))
    }
}

impl Display {
    /// Least and most around each element: of those that share a corner with it.
    pub fn ranges(&self, of: impl Fn(u32) -> f32, is_buried: impl Fn(u32) -> bool) -> Vec<[f32; 2]> {
        let spots = self.around_spots(|elements| {
            let there = elements.iter().filter(|(element, _)| !is_buried(*element)).map(|(element, _)| of(*element));
            there.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        });
        let of = |corners: &[u32]| {
            let range = corners.iter().map(|corner| spots[self.spot_of(*corner)]);
            range.fold([f32::INFINITY, 0.0], |[low, high]: [f32; 2], [a, b]| [low.min(a), high.max(b)])
        };
        self.indices.chunks_exact(3).map(of).map(|[low, high]| [low.min(high), high]).collect()
    }

    /// The normal at a place of an element, of any length.
    pub fn normal(&self, element: u32, [v, w]: [f32; 2]) -> DVec3 {
        let corners = &self.indices[3 * element as usize..][..3];
        let [a, b, c] = [0, 1, 2].map(|k| glam::Vec3::from(self.normals[corners[k] as usize]));
        ((1.0 - v - w) * a + v * b + w * c).as_dvec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places are told as they are, and what runs evenly between them is met everywhere.
    #[test]
    fn between_places_light_runs_evenly() {
        let plane = |[v, w]: [f32; 2]| 1.0 + 2.0 * v - 3.0 * w;
        for parts in [1, 2, 6, 7] {
            let known: Vec<Bands> = places(parts).map(|uv| [plane(uv); 3]).collect();
            assert_eq!(known.len(), places_of(parts));
            assert!(is_even(parts, &known, 1e-5));
            let others = (0..40).flat_map(|i| (0..=40 - i).map(move |j| [i as f32 / 41.0, j as f32 / 41.0]));
            for uv in places(parts).chain(others) {
                assert!((between(parts, &known, uv)[1] - plane(uv)).abs() < 1e-5, "{uv:?}");
            }
        }
        let peak = places(6).position(|uv| uv == [0.5, 0.5]).unwrap();
        let mut one = vec![[0.0; 3]; places_of(6)];
        one[peak] = [1.0; 3];
        assert!(!is_even(6, &one, 0.9));
        for (place, uv) in places(6).enumerate() {
            let wanted = if place == peak { 1.0 } else { 0.0 };
            assert!((between(6, &one, uv)[0] - wanted).abs() < 1e-5, "{uv:?}");
        }
    }
}
