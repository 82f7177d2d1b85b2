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
use radiosity_trace::Place;
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

    /// Whether something else that may bound it is at one of its ends, which is at a point; `reach` is how far that may be.
    fn is_bounded(
        &self,
        (world, bounds): (&World, &[bool]),
        (end, way): (DVec3, DVec3),
        reach: f64,
        beside: f64,
    ) -> bool {
        let inward = WITHIN * (self.middle() - end);
        let (across, other) = way.any_orthonormal_pair();
        [across, -across, other, -other].into_iter().any(|shift| {
            let place = Place { point: end + inward + beside * shift, normal: way, triangle: u32::MAX };
            let ray = world.ray(&place, way, reach - inward.dot(way).min(0.0));
            world.blocked_by_any(&ray, 0, |body| bounds[body] && !self.bodies.contains(&body))
        })
    }
}

/// For each object whether people would move it.
pub fn movable(world: &World, objects: &[Placed]) -> Vec<bool> {
    let up = world.scene.up.direction();
    let mut things: BTreeMap<u32, Thing> = BTreeMap::new();
    for (body, (own, placed)) in world.bodies.iter().zip(objects).enumerate() {
        let thing = things.entry(placed.group).or_insert_with(|| Thing { bodies: Vec::new(), bounds: own.bounds });
        thing.bodies.push(body);
        thing.bounds =
            Bounds { low: thing.bounds.low.min(own.bounds.low), high: thing.bounds.high.max(own.bounds.high) };
    }
    let things: Vec<Thing> = things.into_values().collect();
    let whole = Thing {
        bodies: (0..world.bodies.len()).collect(),
        bounds: Bounds { low: DVec3::splat(-world.half), high: DVec3::splat(world.half) },
    };
    let [low, high] = whole.extent(world, up).map(|(at, _)| at);
    let metre = ((high - low) / ROOM).min(1.0);
    let (right, ahead) = up.any_orthonormal_pair();
    let level: Vec<(DVec3, [f64; 2])> = (0..DIRECTIONS)
        .map(|k| {
            let (sine, cosine) = (PI * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
            let along = cosine * right + sine * ahead;
            (along, whole.extent(world, along).map(|(at, _)| at))
        })
        .collect();

    // Only what is fixed itself bounds others: a bookcase is no wall to its books. So all that is large is taken for fixed at first,
    // and what is not bounded is let go, round by round.
    let size = |thing: &Thing| (thing.bounds.high - thing.bounds.low).max_element();
    let mut is_fixed: Vec<bool> = things.iter().map(|thing| size(thing) >= LARGE * metre).collect();
    loop {
        let mut bounds = vec![false; world.bodies.len()];
        for (thing, _) in things.iter().zip(&is_fixed).filter(|(_, is_fixed)| **is_fixed) {
            thing.bodies.iter().for_each(|body| bounds[*body] = true);
        }
        let stays = |(thing, was): (&Thing, &bool)| {
            if !was {
                return false;
            }
            let others = things.iter().filter(|other| !std::ptr::eq(*other, thing));
            let is_held = |other: &&Thing| {
                other.bounds.low.cmpge(thing.bounds.low).all() && other.bounds.high.cmple(thing.bounds.high).all()
            };
            if 2 * others.filter(is_held).count() > things.len() - 1 {
                return true;
            }
            // At the ends of the scene there is nothing that could bound a floor, and a table is often the tallest thing.
            let upright = (up, [f64::NEG_INFINITY, f64::INFINITY]);
            std::iter::once(&upright).chain(&level).any(|&(along, [first, last])| {
                let [low, high] = thing.extent(world, along);
                let reach = NEAR * (high.0 - low.0);
                let ends = [(low.1, -along, low.0 <= first + reach), (high.1, along, high.0 >= last - reach)];
                high.0 - low.0 >= LARGE * metre
                    && ends.into_iter().all(|(end, way, is_last)| {
                        is_last || thing.is_bounded((world, &bounds), (end, way), reach, BESIDE * metre)
                    })
            })
        };
        let next: Vec<bool> = things.par_iter().zip(&is_fixed).map(stays).collect();
        if next == is_fixed {
            return bounds.into_iter().map(|is_fixed| !is_fixed).collect();
        }
        is_fixed = next;
    }
}
