//! Which objects people would move: furniture, and not the building that it stands in. No file says so; it is guessed once, from the
//! scene as it was handed in.
//!
//! What is large belongs to the building if it goes from one side to the other: something bounds it at both ends, upright as a wall
//! between floor and ceiling, or along any level direction as a floor between walls or a lawn between the ends of the scene; or if it
//! holds most of the other things, as a house in a garden does. How wide the scene is says nothing: a garden makes every room small.
//!
//! Fails for what fits between two walls, such as a wardrobe in a niche, and for a roof on pillars.

use super::Placed;
use glam::DVec3;
use radiosity_trace::{Place, Ray};
use radiosity_transport::live::{Bounds, World};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// What is smaller is furniture, metres: doors and most beds are larger, and chairs, lamps and shelves smaller.
const LARGE: f64 = 1.5;

/// The height of a room that people fit into, metres: in scenes that are lower, all lengths are smaller as much.
const ROOM: f64 = 2.4;

/// How far from an end that is which bounds it, as a share of the thing's length: a rug 12 cm from both walls of a room of 5 m is
/// a carpet.
const NEAR: f64 = 0.025;

/// Level directions looked along: a wall that stands askew is at most 6° off one of them.
const DIRECTIONS: u32 = 16;

/// How far rays begin within a thing, as a share of the way to its middle, and beside its ends, metres: edges of a floor and a wall
/// that end in one line would miss each other.
const WITHIN: f64 = 0.01;
const BESIDE: f64 = 0.01;

/// Objects that belong together.
struct Thing {
    bodies: Vec<usize>,
    bounds: Bounds,
}

impl Thing {
    fn middle(&self) -> DVec3 {
        self.bounds.ball().0
    }

    /// How far its ends are along a direction.
    fn extent(&self, world: &World, along: DVec3) -> [(f64, DVec3); 2] {
        let corners = self.bodies.iter().flat_map(|body| world.bodies[*body].corners.iter().flatten());
        corners.fold([(f64::INFINITY, DVec3::ZERO), (f64::NEG_INFINITY, DVec3::ZERO)], |[low, high], p| {
            let at = p.dot(along);
            [if at < low.0 { (at, *p) } else { low }, if at > high.0 { (at, *p) } else { high }]
        })
    }

    /// The rays that tell what is at one of its ends, which is at a point; `reach` is how far that may be.
    fn rays(&self, world: &World, (end, way): (DVec3, DVec3), reach: f64, beside: f64) -> [Ray; 4] {
        let inward = WITHIN * (self.middle() - end);
        let (across, other) = way.any_orthonormal_pair();
        [across, -across, other, -other].map(|shift| {
            let place = Place { point: end + inward + beside * shift, normal: way, triangle: u32::MAX };
            world.ray(&place, way, reach - inward.dot(way).min(0.0))
        })
    }
}

/// What decides whether things are fixed.
struct Layout<'a> {
    world: &'a World,
    things: Vec<Thing>,
    /// The thing of each object.
    thing_of: Vec<usize>,
    up: DVec3,
    /// Level directions, and where the scene ends along them.
    level: Vec<(DVec3, [f64; 2])>,
    metre: f64,
}

/// What bounds a thing along one direction, by end; none where the scene ends.
type Ends = [Option<Vec<usize>>; 2];

impl<'a> Layout<'a> {
    fn new(world: &'a World, objects: &[Placed]) -> Layout<'a> {
        let up = world.scene.up.direction();
        let mut groups: BTreeMap<u32, Thing> = BTreeMap::new();
        for (body, (own, placed)) in world.bodies.iter().zip(objects).enumerate() {
            let thing = groups.entry(placed.group).or_insert_with(|| Thing { bodies: Vec::new(), bounds: own.bounds });
            thing.bodies.push(body);
            thing.bounds =
                Bounds { low: thing.bounds.low.min(own.bounds.low), high: thing.bounds.high.max(own.bounds.high) };
        }
        let things: Vec<Thing> = groups.into_values().collect();
        let mut thing_of = vec![usize::MAX; world.bodies.len()];
        for (index, thing) in things.iter().enumerate() {
            thing.bodies.iter().for_each(|body| thing_of[*body] = index);
        }
        let whole = Thing {
            bodies: (0..world.bodies.len()).collect(),
            bounds: Bounds { low: DVec3::splat(-world.half), high: DVec3::splat(world.half) },
        };
        let [low, high] = whole.extent(world, up).map(|(at, _)| at);
        let (right, ahead) = up.any_orthonormal_pair();
        let level = (0..DIRECTIONS)
            .map(|k| {
                let (sine, cosine) = (PI * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
                let along = cosine * right + sine * ahead;
                (along, whole.extent(world, along).map(|(at, _)| at))
            })
            .collect();
        Layout { world, things, thing_of, up, level, metre: ((high - low) / ROOM).min(1.0) }
    }

    fn is_large(&self) -> Vec<bool> {
        let size = |thing: &Thing| (thing.bounds.high - thing.bounds.low).max_element();
        self.things.iter().map(|thing| size(thing) >= LARGE * self.metre).collect()
    }

    /// For each of some things whether it holds most of the others.
    fn holds_most(&self, asked: &[bool]) -> Vec<bool> {
        let sorted = |of: &(dyn Fn(&Bounds) -> DVec3 + Sync)| {
            [0, 1, 2].map(|axis| {
                // A zero less than nothing would be another one to the order.
                let mut all: Vec<f64> = self.things.iter().map(|thing| of(&thing.bounds)[axis] + 0.0).collect();
                all.sort_unstable_by(f64::total_cmp);
                all
            })
        };
        let (lows, highs) = (sorted(&|bounds| bounds.low), sorted(&|bounds| bounds.high));
        let others = self.things.len().saturating_sub(1);
        let holds = |(thing, own): (usize, &Thing)| {
            // At most as many as do not stick out on any one side, which is soon known and seldom most.
            let may_hold = (0..3).all(|axis| {
                let above = self.things.len() - lows[axis].partition_point(|low| *low < own.bounds.low[axis]);
                let below = highs[axis].partition_point(|high| *high <= own.bounds.high[axis]);
                2 * above.min(below).saturating_sub(1) > others
            });
            let is_held = |(other, bounds): &(usize, Bounds)| {
                *other != thing && bounds.low.cmpge(own.bounds.low).all() && bounds.high.cmple(own.bounds.high).all()
            };
            let all = || self.things.iter().map(|thing| thing.bounds).enumerate();
            asked[thing] && may_hold && 2 * all().filter(is_held).count() > others
        };
        self.things.par_iter().enumerate().map(holds).collect()
    }

    /// The directions along which a thing is bounded at both ends by what may bound others, and by what.
    fn bounded(&self, thing: usize, may_bound: &[bool]) -> Vec<Ends> {
        let (own, world) = (&self.things[thing], self.world);
        let found = |end: (DVec3, DVec3), reach: f64| {
            let mut found = Vec::new();
            for ray in own.rays(world, end, reach, BESIDE * self.metre) {
                world.all_in_the_way(&ray, 0, |body| {
                    let other = self.thing_of[body];
                    if other != thing && may_bound[other] && !found.contains(&other) {
                        found.push(other);
                    }
                });
            }
            found
        };
        // At the ends of the scene there is nothing that could bound a floor, and a table is often the tallest thing.
        let upright = (self.up, [f64::NEG_INFINITY, f64::INFINITY]);
        let along = |&(along, [first, last]): &(DVec3, [f64; 2])| {
            let [low, high] = own.extent(world, along);
            let reach = NEAR * (high.0 - low.0);
            if high.0 - low.0 < LARGE * self.metre {
                return None;
            }
            let below = (low.0 > first + reach).then(|| found((low.1, -along), reach));
            if below.as_ref().is_some_and(Vec::is_empty) {
                return None;
            }
            let above = (high.0 < last - reach).then(|| found((high.1, along), reach));
            (!above.as_ref().is_some_and(Vec::is_empty)).then_some([below, above])
        };
        std::iter::once(&upright).chain(&self.level).filter_map(along).collect()
    }
}

/// For each object whether people would move it.
pub fn movable(world: &World, objects: &[Placed]) -> Vec<bool> {
    let layout = Layout::new(world, objects);
    // Only what is fixed itself bounds others: a bookcase is no wall to its books. So all that is large is taken for fixed at first,
    // and what is not bounded is let go, until all that is left is bounded by what is left. What bounds what is found once.
    let mut is_fixed = layout.is_large();
    let holds_most = layout.holds_most(&is_fixed);
    let asked = |thing: usize| is_fixed[thing] && !holds_most[thing];
    let bounded: Vec<Vec<Ends>> = (0..layout.things.len())
        .into_par_iter()
        .map(|thing| if asked(thing) { layout.bounded(thing, &is_fixed) } else { Vec::new() })
        .collect();
    let mut open: Vec<usize> = (0..bounded.len()).filter(|thing| asked(*thing) && bounded[*thing].is_empty()).collect();
    // How many things are at each end, how many directions a thing has left, and which ends a thing bounds.
    let mut left: Vec<Vec<[usize; 2]>> = Vec::with_capacity(bounded.len());
    let mut directions: Vec<usize> = bounded.iter().map(Vec::len).collect();
    let mut bounds: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new(); bounded.len()];
    for (thing, ways) in bounded.iter().enumerate() {
        left.push(ways.iter().map(|ends| ends.each_ref().map(|end| end.as_ref().map_or(0, Vec::len))).collect());
        for (way, ends) in ways.iter().enumerate() {
            for (end, others) in ends.iter().enumerate() {
                others.iter().flatten().for_each(|other| bounds[*other].push((thing, way, end)));
            }
        }
    }
    open.iter().for_each(|thing| is_fixed[*thing] = false);
    while let Some(gone) = open.pop() {
        for &(thing, way, end) in &bounds[gone] {
            let ends = &mut left[thing][way];
            let was_bounded = ends.iter().zip(&bounded[thing][way]).all(|(left, end)| end.is_none() || *left > 0);
            ends[end] -= 1;
            if was_bounded && ends[end] == 0 {
                directions[thing] -= 1;
                if directions[thing] == 0 {
                    is_fixed[thing] = false;
                    open.push(thing);
                }
            }
        }
    }
    layout.thing_of.into_iter().map(|thing| !is_fixed[thing]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::Scene;
    use radiosity_trace::sampling::Random;
    use radiosity_transport::live::{Live, Target};
    use std::sync::Arc;

    /// Round by round: all that is large is fixed at first, and what nothing fixed bounds is let go.
    fn plain(world: &World, objects: &[Placed]) -> Vec<bool> {
        let layout = Layout::new(world, objects);
        let Layout { things, level, up, metre, .. } = &layout;
        let mut is_fixed = layout.is_large();
        loop {
            let mut bounds = vec![false; world.bodies.len()];
            for (thing, _) in things.iter().zip(&is_fixed).filter(|(_, is_fixed)| **is_fixed) {
                thing.bodies.iter().for_each(|body| bounds[*body] = true);
            }
            let stays = |(thing, was): (&Thing, &bool)| {
                let others = things.iter().filter(|other| !std::ptr::eq(*other, thing));
                let is_held = |other: &&Thing| {
                    other.bounds.low.cmpge(thing.bounds.low).all() && other.bounds.high.cmple(thing.bounds.high).all()
                };
                let is_bounded = |end: (DVec3, DVec3), reach: f64| {
                    thing
                        .rays(world, end, reach, BESIDE * metre)
                        .iter()
                        .any(|ray| world.blocked_by_any(ray, 0, |body| bounds[body] && !thing.bodies.contains(&body)))
                };
                let upright = (*up, [f64::NEG_INFINITY, f64::INFINITY]);
                let along = |&(along, [first, last]): &(DVec3, [f64; 2])| {
                    let [low, high] = thing.extent(world, along);
                    let reach = NEAR * (high.0 - low.0);
                    let ends = [(low.1, -along, low.0 <= first + reach), (high.1, along, high.0 >= last - reach)];
                    high.0 - low.0 >= LARGE * metre
                        && ends.into_iter().all(|(end, way, is_last)| is_last || is_bounded((end, way), reach))
                };
                *was && (2 * others.filter(is_held).count() > things.len() - 1
                    || std::iter::once(&upright).chain(level).any(along))
            };
            let next: Vec<bool> = things.iter().zip(&is_fixed).map(stays).collect();
            if next == is_fixed {
                return bounds.into_iter().map(|is_fixed| !is_fixed).collect();
            }
            is_fixed = next;
        }
    }

    /// What bounds what is found once; what is let go is what rounds let go that look at everything again.
    #[test]
    fn what_is_let_go_does_not_depend_on_how_it_is_found() {
        let (mut fixed, mut loose) = (0, 0);
        for seed in 0..60 {
            let mut random = Random::new(seed);
            let mut between = |low: f64, high: f64| low + (high - low) * random.next_unit();
            let mut scene = Scene::default();
            scene.materials.push(radiosity_scene::Material::default());
            // Boxes in cells whose gaps are small or not, so that rows of them bound each other; some lie about within others.
            let cells = [between(2.0, 7.0) as i32, between(1.0, 3.0) as i32, between(1.0, 4.0) as i32];
            let gap = between(0.0, 0.08);
            let mut boxes = Vec::new();
            for x in 0..cells[0] {
                for y in 0..cells[1] {
                    for z in 0..cells[2] {
                        let low = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * (2.0 + gap);
                        let size =
                            DVec3::new(between(1.9, 2.0 + gap), between(1.9, 2.0 + gap), between(1.9, 2.0 + gap));
                        boxes.push((low, if between(0.0, 1.0) < 0.1 { 0.6 * size } else { size }));
                    }
                }
            }
            let reach = 2.0 * cells.map(f64::from).into_iter().fold(0.0, f64::max);
            for _ in 0..between(0.0, 6.0) as i32 {
                let low = DVec3::new(between(-1.0, reach), between(-1.0, 4.0), between(-1.0, reach));
                boxes.push((low, DVec3::new(between(0.1, reach), between(0.1, 3.0), between(0.1, reach))));
            }
            if seed % 3 > 0 {
                boxes.push((DVec3::splat(-2.0), DVec3::splat(reach + 8.0)));
            }
            for (k, (low, size)) in boxes.iter().enumerate() {
                let corner = |k: usize| *low + *size * DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
                let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
                let halves = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
                let triangles: Vec<[DVec3; 3]> = halves.map(|t| t.map(corner)).collect();
                scene.add_triangles(&format!("box {k}"), 0, &triangles);
            }
            let live = Live::new(Arc::new(scene), f64::INFINITY, Target { rays: 4, shadows: 1 });
            // Some belong together.
            let group = |k: usize| if seed % 4 == 0 { k as u32 / 2 } else { k as u32 };
            let objects: Vec<Placed> = (0..boxes.len()).map(|k| Placed::new(&live, k, k, group(k))).collect();
            let found = movable(live.world(), &objects);
            assert_eq!(found, plain(live.world(), &objects), "seed {seed}");
            loose += found.iter().filter(|is_movable| **is_movable).count();
            fixed += found.iter().filter(|is_movable| !**is_movable).count();
        }
        assert!(fixed > 50 && loose > 50, "{fixed} {loose}");
    }
}
