//! What an edit has dirtied, as chunks look for it.

use super::super::aim::Aim;
use super::super::body::{Body, Bounds, Site};
use super::super::world::World;
use glam::DVec3;
use smallvec::SmallVec;

/// Slack for cosines of angles: that of ray directions in single precision.
const ROUNDING: f64 = 1e-6;

/// A change of an object.
#[derive(Clone, Debug)]
pub struct Change {
    /// The object.
    pub body: usize,
    /// Where it was, if it was there.
    pub before: Option<Bounds>,
}

/// An object that has changed, and where it is now, if it is there.
pub struct Dirty<'a> {
    pub body: usize,
    pub own: &'a Body,
    pub now: Option<Bounds>,
}

/// What chunks that have seen as many changes have to look at.
pub struct Dirt<'a> {
    pub bodies: Vec<Dirty<'a>>,
    /// Where they were and are: a box, and the ball around it.
    pub before: Vec<(Bounds, (DVec3, f64))>,
    pub now: Vec<(Bounds, (DVec3, f64))>,
    /// Lowest of their ids, and how much higher the highest is.
    pub ids: (u32, u32),
}

impl<'a> Dirt<'a> {
    /// Of some changes. Only the first of each object counts: rays that have not seen it are of the world before it, and
    /// where the object is now it tells itself.
    pub fn new(world: &'a World, changes: &[Change]) -> Dirt<'a> {
        let mut dirt = Dirt { bodies: Vec::new(), before: Vec::new(), now: Vec::new(), ids: (0, 0) };
        let margin = world.margin();
        let around = |bounds: Bounds| {
            let (centre, radius) = bounds.ball();
            (bounds, (centre, radius + margin))
        };
        for change in changes {
            if dirt.bodies.iter().all(|other| other.body != change.body) {
                let own = &world.bodies[change.body];
                let now = own.is_present.then_some(own.bounds);
                dirt.before.extend(change.before.map(around));
                dirt.now.extend(now.map(around));
                dirt.bodies.push(Dirty { body: change.body, own, now });
            }
        }
        let low = dirt.bodies.iter().map(|dirty| dirty.own.first).min().unwrap_or(0);
        let high = dirt.bodies.iter().map(|dirty| dirty.own.dark()).max().unwrap_or(0);
        dirt.ids = (low, high - low);
        dirt
    }

    /// The directions from a place in which what has changed may be now.
    pub fn cones(&self, site: &Site) -> SmallVec<[Cone; 4]> {
        let mut cones = SmallVec::new();
        for (_, (centre, radius)) in &self.now {
            let along = *centre - site.centre;
            let reach = radius + site.radius;
            if along.dot(site.normal) <= -reach {
                continue;
            }
            let distance = along.length();
            // What has no area has no normal, and rays of any length in any direction.
            if distance <= 1.001 * reach || site.normal == DVec3::ZERO {
                cones.clear();
                cones.push(Cone { axis: site.normal, cosine: None, nearest: 0.0 });
                break;
            }
            let sine = reach / distance;
            let cosine = Some((1.0 - sine * sine).sqrt());
            cones.push(Cone { axis: along / distance, cosine, nearest: distance - reach });
        }
        cones
    }
}

/// Directions to a ball.
pub struct Cone {
    axis: DVec3,
    /// Cosine of half its angle; none for all directions.
    cosine: Option<f64>,
    /// Nearer than this nothing of the ball is met.
    pub nearest: f64,
}

impl Cone {
    #[inline]
    pub fn has(&self, direction: DVec3) -> bool {
        self.cosine.is_none_or(|cosine| self.axis.dot(direction) >= cosine - ROUNDING)
    }

    /// The same in an element's frame.
    pub fn aim(&self, frame: &[DVec3; 3]) -> Aim {
        self.cosine.map_or(Aim::ALL, |cosine| Aim::new(frame.map(|axis| axis.dot(self.axis)), cosine))
    }
}
