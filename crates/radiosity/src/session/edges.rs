//! Edges of light within elements.
//!
//! The light that is shown runs evenly from corner to corner of an element, and an edge of a shadow within one is as wide as the
//! element. Where lamps light neighbours so differently that one sees it, elements are cut for display: at places all over them the
//! light of such a lamp is found by shadow rays of their own. Patches shoot and elements receive
//! (Cohen, Greenberg, Immel and Brock 1986, "An efficient radiosity approach for realistic image synthesis"): what surfaces give off
//! is that of whole elements still.
//!
//! Of the sun and of lamps without area each place sees all or nothing, and parts are split along the edge (`split`), of the lamp that makes
//! the greatest difference where there are several.
//!
//! Shadow rays to a lamp with area go to the same spots of it from all places that are not next to it, so that neighbours differ by what stands in between and by
//! no noise: the same number of other spots from each place made walls mottled. Its shadows are softer, and elements have fewer places.
//!
//! Left out are lights that share a column; sheets that light passes through; and facets of rounded bodies that the lamp grazes, on
//! which the shadow that these cast on themselves would show.
//!
//! Kept is by how much the places differ from what is shown there, for a lamp that is not dimmed: it can be added to every layer
//! that has light of this lamp, in whatever light the lamp is now, and stays when lamps are dimmed and walls painted. Where it runs
//! evenly over an element, its corners are enough. At corners of elements that are not cut for the lamp there is nothing more, so that
//! light is one on both sides. After other edits elements stay cut at whose corners the lamp's light is what it was,
//! until all are looked for again: an edge within that moved, and changed nothing at the corners, is where it was till then.

use super::lattice::{between, corners, is_even, places, places_of};
use super::split::{CutElement, Edge, find_edge};
use super::{Layer, ObjectId, Session, Strand};
use glam::{DMat3, DMat4};
use radiosity_scene::{Bands, luminance};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Instant;

/// Fewest spots of a lamp with area that some place of a lit element sees, by which it is cut: of lamps in many rooms that are one object
/// each room may see next to none.
const LEAST_SEEN: usize = 16;

/// Parts of a side of elements as wide as they may be, in which there is an edge. With 24 edges are finer, and take more than twice as
/// many places: of as many as there may be, tables in the sun went without.
const PARTS: u32 = 16;

/// The same where lamps have area. With 6 the office in sight was 16.4 % off instead of 15.1, with 16 it took three times as many places.
const SOFT_PARTS: u32 = 8;

/// Spots of a lamp with area that a place has shadow rays to. With half as many those behind bars of windows were seen on walls.
const SPOTS: usize = 128;

/// How many times as large parts are by which it is seen whether there is an edge; as each place looks around itself, next to nothing
/// falls between.
const COARSER: u32 = 3;

/// Least difference among neighbours that is looked after, over the light there: half as much is hard to see beside the noise.
const LEAST_CONTRAST: f32 = 0.15;

/// Least part of that by one lamp: of a dozen that light a place each may have as little.
const LEAST_OF_ONE: f32 = 0.03;

/// What light may differ by from one that runs evenly over an element, over the light there, before the element is cut.
const EVEN: f32 = 0.05;

/// How many times the places that may be in the end are wanted before it is known which elements have an edge: those beside it have none.
const LOOKED_AT: usize = 4;

/// Places that are looked at in all, over those that are at first: what has an edge is looked at again. Between 1.2 in a box, and 2.4 and
/// 2.8 in furnished rooms; only the time that is told to be left is by it.
const AGAIN: f64 = 2.0;

/// Where around a place light is looked for, in widths of a part: two squares, turned and of different sizes, so that no two are in a row
/// along an edge, and as far as half way to the next places; opposite ones after each other. With one alone edges are stairs; these make them a part wide.
const FOOTPRINT: [[f32; 2]; 8] = [
    [-0.1875, -0.5625],
    [0.1875, 0.5625],
    [0.5625, -0.1875],
    [-0.5625, 0.1875],
    [-0.5, -0.1],
    [0.5, 0.1],
    [0.1, -0.5],
    [-0.1, 0.5],
];

/// Elements between looks at the time.
const BATCH: usize = 64;

/// How far places at the border of an element are moved towards its middle: beside a wall they would be in it.
const INWARDS: f32 = 1e-3;

/// Least cosine at which a lamp shines on facets of rounded bodies that are cut: next facets that are turned by up to 17° are in the
/// light then, too.
const GRAZING: f64 = 0.3;

/// An element of an object.
type Key = (usize, u32);

/// Parts of a side of an element at which light is looked for, and into which it is cut if it has an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Parts {
    looked: u32,
    cut: u32,
}

/// A strand's light at the places of an element.
type Sample = (Key, usize, Parts);

/// An element among whose neighbours light differs.
struct Wanted {
    key: Key,
    /// By how much, over the light there.
    contrast: f32,
    /// How much that matters.
    weight: f32,
    /// Parts, if there is an edge in it.
    parts: u32,
    /// Whose light differs, and by how much that may differ from one that runs evenly.
    strands: Vec<(usize, f32)>,
}

/// A search for all edges in some light.
struct Search {
    revision: u64,
    wanted: Vec<Wanted>,
    /// Samples that are not there yet.
    missing: Vec<Sample>,
    /// Places that have been looked at, and all that are to be as far as that is known.
    looked: usize,
    all: usize,
}

/// The light of a strand on an element.
#[derive(Clone)]
struct Found {
    /// What is shown at the corners.
    corners: [Bands; 3],
    /// By how much places have more than is shown.
    more: Vec<Bands>,
    /// How much less of that counts, evenly between the corners.
    less: [Bands; 3],
    /// A sharp edge, if there is one, and by how much its places have more.
    edge: Option<(Arc<Edge>, Vec<Bands>)>,
}

impl Found {
    /// The same of other places.
    fn with(&self, more: Vec<Bands>) -> Found {
        Found { corners: self.corners, more, less: self.less, edge: None }
    }

    /// By how much a place has more than is shown, as far as it counts: no place gets less than nothing of the lamp.
    fn counted(&self, uv: [f32; 2], more: Bands) -> Bands {
        if self.less == [[0.0; 3]; 3] {
            return more;
        }
        let (less, shown) = (between(1, &self.less, uv), between(1, &self.corners, uv));
        std::array::from_fn(|band| (more[band] - less[band]).max(-shown[band]))
    }
}

/// An element that is cut.
struct Cut {
    own: CutElement,
    places: Vec<[f32; 2]>,
    strands: Vec<(usize, Found)>,
}

impl Cut {
    /// Where light runs evenly, so that the corners tell all.
    fn whole(element: u32, looked: u32, found: &[(usize, &Found)]) -> Cut {
        let of = |(strand, found): &(usize, &Found)| (*strand, found.with(corners(looked, &found.more).to_vec()));
        let own = CutElement { element, parts: 1, edge: None };
        Cut { places: own.places(), own, strands: found.iter().map(of).collect() }
    }

    /// Where light has an edge: parts are split along that of the lamp that makes the greatest difference, if it is a sharp one.
    fn with_edge(element: u32, parts: u32, found: &[(usize, &Found)]) -> Cut {
        let height = |more: &[Bands]| {
            let light = more.iter().map(|more| luminance(*more));
            let [low, high] =
                light.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
            high - low
        };
        let sharp = found.iter().filter_map(|(strand, found)| found.edge.as_ref().map(|edge| (*strand, edge)));
        let first = sharp.max_by(|(_, a), (_, b)| height(&a.1).total_cmp(&height(&b.1)));
        let own = CutElement { element, parts, edge: first.map(|(_, (edge, _))| edge.clone()) };
        let places = own.places();
        let of = |(strand, found): &(usize, &Found)| match first {
            Some((first, (_, more))) if first == *strand => (*strand, found.with(more.clone())),
            _ => (*strand, found.with(places.iter().map(|uv| between(parts, &found.more, *uv)).collect())),
        };
        let strands = found.iter().map(of).collect();
        Cut { own, places, strands }
    }
}

/// What is known of edges.
#[derive(Default)]
pub struct Edges {
    /// Of which light it is; none before all of it is known.
    revision: Option<u64>,
    cuts: BTreeMap<Key, Cut>,
    /// Whether lamps or what stands in their light have changed since.
    is_old: bool,
    search: Option<Search>,
    /// What was found as the lamps and what stands in their light are now.
    samples: BTreeMap<Sample, Found>,
}

/// Places at which samples are.
fn in_all(samples: &[Sample]) -> usize {
    samples.iter().map(|(.., parts)| places_of(parts.looked)).sum()
}

/// Bytes that so many places take, with what is looked at to find them.
pub fn bytes(places: usize) -> usize {
    // Looked at coarsely and finely, with edges, in use, and in use before.
    (4 * LOOKED_AT + 2) * places * size_of::<Bands>()
}

impl Wanted {
    /// Parts by which it is seen whether there is an edge.
    fn probe(&self) -> Parts {
        Parts { looked: self.parts.div_ceil(COARSER).max(self.parts.min(2)), cut: self.parts }
    }

    /// Parts that it is cut into if there is one.
    fn cut(&self) -> Parts {
        Parts { looked: self.parts, cut: self.parts }
    }
}

impl Edges {
    /// Of elements that are wanted, samples that are not there yet: those of an object together.
    fn missing(&self, wanted: &[Wanted]) -> Vec<Sample> {
        let of = |wanted: &Wanted| -> Vec<Sample> {
            let parts = if self.has_edge(wanted) { wanted.cut() } else { wanted.probe() };
            wanted.strands.iter().map(|(strand, _)| (wanted.key, *strand, parts)).collect()
        };
        let mut missing: Vec<Sample> =
            wanted.iter().flat_map(of).filter(|key| !self.samples.contains_key(key)).collect();
        missing.sort_unstable();
        missing
    }

    /// Whether what was found first on an element is not even.
    fn has_edge(&self, wanted: &Wanted) -> bool {
        let probe = wanted.probe();
        wanted.strands.iter().any(|(strand, tolerance)| {
            let found = self.samples.get(&(wanted.key, *strand, probe));
            found.is_some_and(|found| !is_even(probe.looked, &found.more, *tolerance))
        })
    }

    /// Elements as they are cut, as many as may be.
    fn cut(&self, wanted: &[Wanted], most: usize) -> BTreeMap<Key, Cut> {
        let mut cuts = BTreeMap::new();
        let mut count = 0;
        for one in wanted {
            let has_edge = self.has_edge(one);
            let from = if has_edge { one.cut() } else { one.probe() };
            let found = |(strand, _): &(usize, f32)| Some((*strand, self.samples.get(&(one.key, *strand, from))?));
            let found: Vec<(usize, &Found)> = one.strands.iter().filter_map(found).collect();
            let element = one.key.1;
            let cut = if has_edge {
                Cut::with_edge(element, one.parts, &found)
            } else {
                Cut::whole(element, from.looked, &found)
            };
            count += cut.places.len();
            if count > most {
                break;
            }
            cuts.insert(one.key, cut);
        }
        cuts
    }
}

impl Session {
    /// Whether all edges of the light that is shown are known, as far as they are looked for.
    pub(super) fn is_sharp(&self) -> bool {
        self.most_places == 0 || self.edges.revision == Some(self.state.revision)
    }

    /// Lamps or what stands in their light have changed. Elements stay cut that have the same light of them at their corners.
    pub(super) fn doubt(&mut self) {
        let cuts = std::mem::take(&mut self.edges.cuts);
        self.edges = Edges { cuts, is_old: true, ..Edges::default() };
    }

    /// The first light after that is there.
    pub(super) fn keep_cuts(&mut self) {
        if !std::mem::take(&mut self.edges.is_old) {
            return;
        }
        let cuts = std::mem::take(&mut self.edges.cuts);
        let is_as_it_was = |(key, cut): &(Key, Cut)| {
            let is_there = self.live.world().bodies[key.0].is_present;
            is_there && cut.strands.iter().all(|(strand, found)| self.corners(*key, *strand) == found.corners)
        };
        let count = cuts.len();
        let mut kept: BTreeMap<Key, Cut> = cuts.into_par_iter().filter(is_as_it_was).collect();
        if kept.len() < count {
            self.join(&mut kept);
        }
        self.edges.cuts = kept;
    }

    /// At corners of elements that might be cut for the same lamp and are not nothing more counts.
    fn join(&self, cuts: &mut BTreeMap<Key, Cut>) {
        let mut done: BTreeMap<(usize, usize), Vec<u32>> = BTreeMap::new();
        for ((object, element), cut) in &*cuts {
            for (strand, _) in &cut.strands {
                done.entry((*object, *strand)).or_default().push(*element);
            }
        }
        cuts.par_iter_mut().for_each(|((object, element), cut)| {
            let (display, is_buried) = (self.display(*object), self.buried(*object));
            for (strand, found) in &mut cut.strands {
                let done = &done[&(*object, *strand)];
                let is_done = |element: u32| {
                    done.binary_search(&element).is_ok()
                        || is_buried(element)
                        || self.is_left_out(*strand, (*object, element))
                };
                let (spots, more) = (display.spots(*element), corners(cut.own.parts, &found.more));
                found.less = [0, 1, 2].map(|k| {
                    let share = 1.0 - display.share(spots[k], &is_done);
                    more[k].map(|x| share * x)
                });
            }
        });
    }

    /// The elements of an object that are cut.
    fn cuts_of(&self, object: usize) -> impl Iterator<Item = &Cut> {
        self.edges.cuts.range((object, 0)..(object + 1, 0)).map(|(_, cut)| cut)
    }

    /// Share of the places to be looked at that has been.
    pub(super) fn sharpened(&self) -> f64 {
        match &self.edges.search {
            _ if !self.is_solved() => 0.0,
            _ if self.is_sharp() => 1.0,
            Some(search) if search.revision == self.state.revision => search.looked as f64 / search.all.max(1) as f64,
            _ => 0.0,
        }
    }

    /// Looks for edges until a time, at least for some.
    pub(super) fn sharpen(&mut self, deadline: Instant) {
        let revision = self.state.revision;
        let mut search = match self.edges.search.take().filter(|search| search.revision == revision) {
            Some(search) => search,
            None => {
                let wanted = self.edges_in_sight();
                let missing = self.edges.missing(&wanted);
                let places = in_all(&missing);
                Search { revision, looked: 0, all: (AGAIN * places as f64) as usize, missing, wanted }
            }
        };
        if search.missing.is_empty() {
            // What has an edge is cut further.
            search.missing = self.edges.missing(&search.wanted);
            search.all = search.looked + in_all(&search.missing);
        }
        if search.missing.is_empty() {
            return self.cut(&search);
        }
        loop {
            let some = search.missing.split_off(search.missing.len().saturating_sub(BATCH));
            search.looked += in_all(&some);
            let found: Vec<_> = some.into_par_iter().map(|sample| (sample, self.sample(sample))).collect();
            self.edges.samples.extend(found);
            if search.missing.is_empty() || Instant::now() >= deadline {
                break;
            }
        }
        self.edges.search = Some(search);
    }

    /// All that is wanted is known.
    fn cut(&mut self, search: &Search) {
        let mut cuts = self.edges.cut(&search.wanted, self.most_places);
        self.join(&mut cuts);
        let there: BTreeSet<Key> = search.wanted.iter().map(|wanted| wanted.key).collect();
        self.edges.samples.retain(|(key, ..), _| there.contains(key));
        let before = std::mem::replace(&mut self.edges.cuts, cuts);
        self.state.changed.extend(before.keys().chain(self.edges.cuts.keys()).map(|key| key.0));
        (self.edges.revision, self.edges.is_old) = (Some(search.revision), false);
    }

    /// What a strand brings directly to the corners of an element, as it is shown where it is not dimmed.
    fn corners(&self, (object, element): Key, strand: usize) -> [Bands; 3] {
        let (light, is_buried) = (self.of_column(object, strand), self.buried(object));
        self.display(object).corners(element, |element| (!is_buried(element)).then(|| light(element).0))
    }

    /// What a strand brings directly to the elements of an object, and the share of shadow rays that came through.
    fn of_column(&self, object: usize, strand: usize) -> impl Fn(u32) -> (Bands, f32) {
        let column = self.strands[strand].column;
        move |element| {
            let found = column.zip(self.live.element(object, element));
            found.map_or(([0.0; 3], 1.0), |(column, (chunk, e))| (chunk.light(column, e), chunk.clear_share(column, e)))
        }
    }

    /// Elements among whose neighbours the light of a strand differs, those first where it matters most.
    fn edges_in_sight(&self) -> Vec<Wanted> {
        let lit = |(strand, own): (usize, &Strand)| {
            let factor = luminance(self.factor(own));
            own.column.filter(|column| factor > 0.0 && self.live.is_of_one(*column)).map(|_| (strand, factor))
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
        let display = self.display(object);
        for (strand, factor) in strands {
            let (light, is_certain) = (self.of_column(object, *strand), self.is_certain(*strand));
            let light: Vec<(Bands, f32)> = (0..body.elements()).map(light).collect();
            let ranges = display.ranges(|element| luminance(light[element as usize].0), self.buried(object));
            for (element, [low, high]) in (0..).zip(ranges) {
                // A shadow narrower than elements makes no difference among them.
                let (own, share) = light[element as usize];
                let is_crossed = is_certain && share > 0.0 && share < 1.0;
                let [low, high] = if is_crossed { [0.0, high.max(luminance(own) / share)] } else { [low, high] };
                let all = self.state.shown[(body.first + element) as usize].0;
                let all = luminance([all[0], all[1], all[2]]).max(factor * high);
                let contrast = if all > 0.0 { factor * (high - low) / all } else { 0.0 };
                if contrast < LEAST_OF_ONE || self.is_left_out(*strand, (object, element)) {
                    continue;
                }
                let width = (2.0 * body.area(element)).sqrt();
                let most = f64::from(if is_certain { PARTS } else { SOFT_PARTS });
                let parts = (most * width / self.element_size).ceil().clamp(1.0, most) as u32;
                let key = (object, element);
                let none = Wanted { key, contrast: 0.0, weight: 0.0, parts, strands: Vec::new() };
                let one = found.entry(key).or_insert(none);
                one.contrast += contrast;
                one.weight += contrast * (width as f32).sqrt();
                one.parts = one.parts.max(parts);
                one.strands.push((*strand, EVEN * all / factor));
            }
        }
        found.retain(|_, one| one.contrast >= LEAST_CONTRAST);
        for one in found.values_mut() {
            let count = (one.strands.len() as f32).sqrt();
            one.strands.iter_mut().for_each(|(_, tolerance)| *tolerance /= count);
        }
        found.into_values().collect()
    }

    /// Whether a strand is the light of a lamp without area.
    fn is_certain(&self, strand: usize) -> bool {
        self.strands[strand].column.is_some_and(|column| self.live.is_certain(column))
    }

    /// Whether an element is a facet of a rounded body on which a strand's lamp shines at a small angle, or from behind.
    fn is_left_out(&self, strand: usize, (object, element): Key) -> bool {
        if self.display(object).is_flat(element) {
            return false;
        }
        let world = self.live.world();
        let body = &world.bodies[object];
        let (at, flat) = body.facing(element, [1.0 / 3.0; 2]);
        let cosine = |column| self.live.cosine_from(column, (at + world.middle, flat));
        self.strands[strand].column.is_none_or(|column| cosine(column) < GRAZING)
    }

    /// The light of a strand at the places of an element.
    fn sample(&self, (key, strand, parts): Sample) -> Found {
        let places = || places(parts.looked);
        let corners = self.corners(key, strand);
        let nothing = [[0.0; 3]; 3];
        let as_shown = || Found { corners, more: vec![nothing[0]; places().count()], less: nothing, edge: None };
        let Some(column) = self.strands[strand].column else { return as_shown() };
        let world = self.live.world();
        let (body, display) = (&world.bodies[key.0], self.display(key.0));
        let turned = DMat3::from_mat4(DMat4::from(body.matrix)).inverse().transpose();
        // Of neighbours in one plane both look at what is on either side.
        let is_inside = display.is_inside(key.1);
        let spots = self.live.spots(column, SPOTS);
        let facing = |[v, w]: [f32; 2]| {
            let inwards = |x: f32| x + INWARDS * (1.0 / 3.0 - x);
            let (at, flat) = body.facing(key.1, [inwards(v), inwards(w)]);
            let smooth = (turned * display.normal(key.1, [v, w])).normalize_or_zero();
            let normal = if smooth.dot(flat) > 0.0 { smooth } else { flat };
            (at + world.middle, normal)
        };
        let more = |[v, w]: [f32; 2]| {
            // What is kept of an element that is not cut are its corners, as they are where it is.
            let is_corner = [v, w, 1.0 - v - w].contains(&1.0);
            let width = 1.0 / if is_corner { parts.cut } else { parts.looked } as f32;
            let around = FOOTPRINT.map(|[x, y]| {
                let mut place = [v + width * x, w + width * y];
                if !is_inside {
                    place = place.map(|x| x.max(0.0));
                    place = place.map(|x| x / (place[0] + place[1]).max(1.0));
                }
                facing(place)
            });
            let (found, seen) = self.live.receive_around(column, &around, &spots);
            let shown = between(1, &corners, [v, w]);
            (std::array::from_fn(|band| found[band] - shown[band]), seen)
        };
        let (mut more, seen): (Vec<Bands>, Vec<usize>) = places().map(more).unzip();
        let is_lit = luminance(self.of_column(key.0, strand)(key.1).0) > 0.0;
        if is_lit && !self.is_certain(strand) && seen.into_iter().all(|seen| seen < LEAST_SEEN) {
            return as_shown();
        }
        if parts.looked != parts.cut || !self.is_certain(strand) {
            return Found { corners, more, less: nothing, edge: None };
        }
        let found = |uv: [f32; 2]| self.live.receive_around(column, &[facing(uv)], &spots).0;
        let alone = |uv: [f32; 2]| {
            let (found, shown) = (found(uv), between(1, &corners, uv));
            std::array::from_fn(|band| found[band] - shown[band])
        };
        let edge = find_edge(parts.cut, |uv| luminance(found(uv)) > 0.0);
        if edge.is_none() {
            // That of a neighbour along a side is none of this one.
            let is_on_side = |[v, w]: [f32; 2]| v == 0.0 || w == 0.0 || v + w > 1.0 - 0.5 / parts.cut as f32;
            more.iter_mut().zip(places()).filter(|(_, uv)| is_on_side(*uv)).for_each(|(more, uv)| *more = alone(uv));
        }
        let edge = edge.map(|edge| {
            let values = edge.values(parts.cut, alone);
            (Arc::new(edge), values)
        });
        Found { corners, more, less: nothing, edge }
    }

    /// Elements of an object that are cut for display where light has an edge. None for an object that there is not, and before the
    /// light is there.
    pub fn cuts(&self, object: ObjectId) -> Vec<CutElement> {
        self.cuts_of(object.0 as usize).map(|cut| cut.own.clone()).collect()
    }

    /// The light of a layer at the places of the elements that are cut ([`Session::cuts`]), given that at the vertices
    /// ([`Session::light`]), in lux per band as that, in the order of [`CutElement::places`].
    pub fn light_of_cuts(&self, object: ObjectId, layer: Layer, light: &[Bands]) -> Vec<Bands> {
        let own = match layer {
            Layer::Light(light) => self.light_of(light).map(|light| light.strand),
            _ => None,
        };
        let is_in = |strand: usize| match layer {
            Layer::Total | Layer::Direct | Layer::Bounce(0) => true,
            Layer::Light(_) => own == Some(strand),
            Layer::Indirect | Layer::Bounce(_) | Layer::Error | Layer::RelativeError => false,
        };
        let mut all: Vec<Bands> = Vec::new();
        for cut in self.cuts_of(object.0 as usize) {
            let (first, display) = (all.len(), self.display(object.0 as usize));
            all.extend(cut.places.iter().map(|uv| display.at(light, cut.own.element, *uv)));
            for (strand, found) in cut.strands.iter().filter(|(strand, _)| is_in(*strand)) {
                let factor = self.state.factors.get(*strand).copied().unwrap_or_default();
                for ((light, more), uv) in all[first..].iter_mut().zip(&found.more).zip(&cut.places) {
                    let more = found.counted(*uv, *more);
                    (0..3).for_each(|band| light[band] += factor[band] * more[band]);
                }
            }
            all[first..].iter_mut().flatten().for_each(|x| *x = x.max(0.0));
        }
        all
    }

    /// All light as it is shown at a place of an element, given that at the vertices.
    pub(super) fn shown_at(&self, object: usize, light: &[Bands], element: u32, uv: [f32; 2]) -> Bands {
        let mut shown = self.display(object).at(light, element, uv);
        if let Some(cut) = self.edges.cuts.get(&(object, element)) {
            for (strand, found) in &cut.strands {
                let factor = self.state.factors.get(*strand).copied().unwrap_or_default();
                let more = found.counted(uv, cut.own.between(&found.more, uv));
                (0..3).for_each(|band| shown[band] += factor[band] * more[band]);
            }
        }
        shown.map(|x| x.max(0.0))
    }
}
