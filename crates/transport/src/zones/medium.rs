//! What a line meets on its way: zones, and at last a facet or nothing.
//!
//! A tree over the faces of all cells says which a line may cross; where it does is then found in double precision. What
//! is left of a line after optical depth τ is e^-τ, and a zone takes the difference between its two ends.

use super::Zone;
use crate::row::around::Around;
use glam::DVec3;
use radiosity_scene::Enclosure;
use radiosity_trace::Tree;

/// How much farther than a facet zones are looked for, relative to its distance: the single precision of that.
const FARTHER: f64 = 1.0 + 1e-5;

/// How near a facet a zone begins that lies behind it, relative to the scene: the same.
const BEHIND: f64 = 1e-6;

/// The facets and the zones that are not transparent.
pub(super) struct Medium<'a> {
    pub around: Around<'a>,
    pub zones: &'a [Zone],
    /// Which zones are not transparent, by the order of their unknowns.
    pub dense: &'a [usize],
    tree: Tree,
    /// The unknown, counted from the facets', of each triangle.
    owner: Vec<u32>,
}

/// One line, to be used again.
#[derive(Default)]
pub(super) struct Line {
    /// What zones take, by the order of their unknowns, in the order of the line.
    pub taken: Vec<(u32, f64)>,
    crossed: Vec<u32>,
    chords: Vec<(f64, f64, u32)>,
}

impl<'a> Medium<'a> {
    pub fn new(enclosure: &'a Enclosure, zones: &'a [Zone], dense: &'a [usize]) -> Medium<'a> {
        let around = Around::new(enclosure);
        let (mut triangles, mut owner) = (Vec::new(), Vec::new());
        for (k, zone) in dense.iter().enumerate() {
            for triangle in zones[*zone].cell.hull() {
                triangles.push(triangle.map(|c| (c - around.middle).as_vec3()));
                owner.push(k as u32);
            }
        }
        Medium { around, zones, dense, tree: Tree::new(&triangles), owner }
    }

    /// Zone of an unknown, counted from the facets'.
    pub fn zone(&self, k: usize) -> &Zone {
        &self.zones[self.dense[k]]
    }

    /// The largest share that the medium may take of any line.
    pub fn most_taken(&self) -> f64 {
        let thickest = (0..self.dense.len()).map(|k| self.zone(k).extinction()).fold(0.0, f64::max);
        let [low, high] = self.tree.bounds().unwrap_or_default();
        -(-thickest * f64::from(low.distance(high))).exp_m1()
    }

    /// Follows a line between two distances, `left` of it at the first; notes what zones other than `own` take and
    /// answers what is left at the end.
    pub fn follow(
        &self,
        line: &mut Line,
        (place, direction): (DVec3, DVec3),
        [start, end]: [f64; 2],
        own: Option<usize>,
        mut left: f64,
    ) -> f64 {
        line.taken.clear();
        line.crossed.clear();
        line.chords.clear();
        let ray = self.around.ray(place, direction, end * FARTHER);
        self.tree.blocked_where(&ray, |triangle, _, _, _| {
            let zone = self.owner[triangle as usize];
            if !line.crossed.contains(&zone) {
                line.crossed.push(zone);
            }
            false
        });
        for &k in line.crossed.iter().filter(|k| Some(**k as usize) != own) {
            if let Some([near, far]) = self.zone(k as usize).cell.chord(place, direction) {
                let (near, far) = (near.max(start), far.min(end));
                if near < far && near < end - BEHIND * self.around.reach {
                    line.chords.push((near, far, k));
                }
            }
        }
        // The order of the tree means nothing.
        line.chords.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        for &(near, far, k) in &line.chords {
            let taken = -left * (-self.zone(k as usize).extinction() * (far - near)).exp_m1();
            line.taken.push((k, taken));
            left -= taken;
        }
        left
    }
}
