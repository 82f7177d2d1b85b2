//! The binary tree that the tree of boxes is made from: top down, by the surface-area heuristic.
//!
//! A split's cost is the sum over both sides of area × number of triangles (Goldsmith & Salmon 1987); ranges of more
//! than [`SWEEP`] triangles look at [`BINS`] − 1 planes per axis (Wald 2007, "On fast construction of SAH-based bounding
//! volume hierarchies"), smaller ones at every split. It goes down to single triangles; which of its nodes become nodes
//! or leaves of the wide tree is [`collapse`](crate::collapse)'s choice, whose costs are worked out here on the way up.
//!
//! Where the boxes of both sides overlap, a plane through triangles may cost less ([`spatial`](crate::spatial)): those it cuts go to
//! both sides. A range has room for more items than it holds, which its sides share by their numbers. A range with room for n items
//! takes 2n − 1 nodes, its left half right behind it, so both halves can be built at the same time in places known
//! beforehand: the result does not depend on the number of threads.
//!
//! In an office of 70,000 triangles rays visit 28 % fewer nodes and 38 % fewer blocks for it, in a furnished room 15 % and 5 %, in a building
//! of a million triangles 2 % and 0 %; of those that any hit stops 10 % fewer nodes in the office, and in the room a quarter more blocks.
//! Building takes 1.3 to 1.8 times as long. Room shared by how large the boxes are, or by how much larger than their triangles, gained nothing.

use crate::collapse::{Costs, choose};
use crate::intersect::SLACK;
use crate::spatial::Plane;
use crate::tree::WIDTH;
use glam::{Vec3, Vec4};

/// Planes per axis plus one. In a furnished room 16 make rays visit 4 % more nodes, 64 gain nothing.
const BINS: usize = 32;

/// Ranges up to this size are sorted along each axis and split at the best place. With 32 rays in a furnished room
/// visit 1 % fewer nodes and 6 % more blocks; with 2, 1 % fewer and 2 % more.
const SWEEP: usize = 8;

/// Room for so many more items than triangles, as a part of these. In an office 0.1 makes rays visit 6 % more nodes, 0.5 4 % fewer in
/// 13 % more memory.
const SPARE: f32 = 0.2;

/// Smaller ranges are not cut: with any number up to 257 rays visit as many nodes, and building takes a third longer at 33.
const FEWEST: usize = 129;

/// Nor are ranges with less room than this part of their items: mostly none of it would be used. Without, building takes a fifth longer, at
/// 0.1 rays in an office visit 1 % more nodes.
const LEAST_SPARE: f32 = 0.05;

/// A plane through triangles must cost less than this part of what one between them costs. At 1 rays in a furnished room look at a fifth
/// more blocks where any hit will do, at 0.9 rays in an office visit 9 % more nodes.
const GAIN: f32 = 0.95;

/// Planes through triangles are looked for where the sides' overlap has at least this part of the root's area …
const OVERLAP: f32 = 1e-4;

/// … and times all items makes this part of the cost. Without, building takes 15 % longer for the same tree; at 0.4 rays in an office visit
/// 7 % more nodes.
const OVERLAP_COST: f32 = 0.2;

/// From this depth on ranges are halved by number, so that no input makes a tree deeper than this + 32.
const HALVE_FROM: usize = 40;

/// Depth that no binary tree exceeds; the wide tree's traversal stack is sized by it.
#[cfg_attr(not(any(target_arch = "x86_64", target_arch = "aarch64")), allow(dead_code))]
pub(crate) const MAX_DEPTH: usize = HALVE_FROM + 32;

/// Smaller ranges are not worth handing to another thread.
const FORK: usize = 4096;

/// The box of a triangle or of a part of it. The first corner's fourth number carries the bits of the triangle's index: 32 bytes are
/// moved at each level of the tree, not 48, and SIMD handles a corner at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    pub lo: Vec4,
    pub hi: Vec4,
}

impl Item {
    pub fn new(corners: &[Vec3; 3], triangle: u32) -> Item {
        let [a, b, c] = *corners;
        Item { lo: a.min(b).min(c).extend(f32::from_bits(triangle)), hi: a.max(b).max(c).extend(0.0) }
    }

    /// The same with the slack of its triangle.
    pub fn slackened(&self) -> Item {
        let Bounds { lo, hi } = Bounds { lo: self.lo, hi: self.hi }.slackened((self.hi - self.lo).truncate());
        Item { lo: lo.with_w(self.lo.w), hi }
    }

    /// Where there is room for one.
    const NONE: Item = Item { lo: Vec4::from_array([0.0, 0.0, 0.0, f32::from_bits(u32::MAX)]), hi: Vec4::ZERO };

    pub fn is_none(&self) -> bool {
        self.triangle() == u32::MAX
    }

    /// The part of it that lies in a box.
    pub fn within(&self, bounds: &Bounds) -> Item {
        Item { lo: bounds.lo.with_w(self.lo.w), hi: bounds.hi.with_w(0.0) }
    }

    pub fn triangle(&self) -> u32 {
        self.lo.w.to_bits()
    }

    /// Twice the centre.
    fn centre(&self) -> Vec4 {
        self.lo + self.hi
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub lo: Vec4,
    pub hi: Vec4,
}

impl Bounds {
    pub const EMPTY: Bounds = Bounds { lo: Vec4::splat(f32::INFINITY), hi: Vec4::splat(f32::NEG_INFINITY) };

    /// With the slack of a triangle of these extents, rounded outwards by at least a unit in the last place; the same along axes without extent.
    pub fn slackened(self, extent: Vec3) -> Bounds {
        let down = |p: Vec4, axis: usize| match extent[axis] {
            0.0 => p[axis],
            extent => (p[axis] - SLACK * extent).next_down().clamp(f32::MIN, f32::MAX),
        };
        let all_down = |p: Vec4| Vec4::new(down(p, 0), down(p, 1), down(p, 2), 0.0);
        Bounds { lo: all_down(self.lo), hi: -all_down(-self.hi) }
    }

    pub fn of(items: &[Item]) -> Bounds {
        items.iter().fold(Bounds::EMPTY, |bounds, item| bounds.join(item.lo, item.hi))
    }

    pub fn join(self, lo: Vec4, hi: Vec4) -> Bounds {
        Bounds { lo: self.lo.min(lo), hi: self.hi.max(hi) }
    }

    /// What lies in both.
    pub fn meet(self, lo: Vec4, hi: Vec4) -> Bounds {
        Bounds { lo: self.lo.max(lo), hi: self.hi.min(hi) }
    }

    pub fn is_empty(&self) -> bool {
        self.lo.truncate().cmpgt(self.hi.truncate()).any()
    }

    /// Half the surface area.
    pub fn area(&self) -> f32 {
        let d = self.hi - self.lo;
        d.x * d.y + (d.y * d.z + d.z * d.x)
    }
}

/// A node of the binary tree: the box around its items, which lie in a run of places, the first `left` of which are the left child's.
/// The left child is the next node, the right child comes `2 left − 1` nodes after that.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Binary {
    pub lo: Vec3,
    pub hi: Vec3,
    pub left: u32,
    /// How it hangs below the wide tree's nodes, three bits each: [`choose`].
    slots: u32,
}

impl Binary {
    /// The i-th of the numbers by which it hangs below the wide tree's nodes.
    pub fn slots(&self, i: usize) -> usize {
        (self.slots >> (3 * i) & 7) as usize
    }

    fn set_slots(&mut self, slots: [u8; WIDTH - 1]) {
        self.slots = slots.iter().rev().fold(0, |bits, slots| bits << 3 | u32::from(*slots));
    }
}

/// Sorts `items` into the order of the tree's leaves, with parts of triangles and empty places among them, and returns its nodes, the root first.
pub(crate) fn build<C: Fn(usize) -> [Vec3; 3] + Sync>(items: &mut Vec<Item>, corners: &C) -> Vec<Binary> {
    let count = items.len();
    if count == 0 {
        return Vec::new();
    }
    let least_overlap = OVERLAP * Bounds::of(items).area();
    let spare = (SPARE * count as f32) as usize;
    items.reserve_exact(spare);
    items.resize(count + spare, Item::NONE);
    let mut nodes = vec![Binary::default(); 2 * items.len() - 1];
    Builder { corners, least_overlap }.grow(items, count, &mut nodes, 0);
    nodes
}

struct Builder<'a, C> {
    /// The corners of a triangle.
    corners: &'a C,
    /// Planes through triangles are not looked for where less area overlaps.
    least_overlap: f32,
}

impl<C: Fn(usize) -> [Vec3; 3] + Sync> Builder<'_, C> {
    /// Makes the nodes of the first `count` items. Answers what the root costs the node above it, which no node keeps.
    fn grow(&self, items: &mut [Item], count: usize, nodes: &mut [Binary], depth: usize) -> Costs {
        let bounds = Bounds::of(&items[..count]);
        let mut node = Binary { lo: bounds.lo.truncate(), hi: bounds.hi.truncate(), ..Binary::default() };
        if count == 1 {
            let (slots, costs) = choose(1, bounds.area(), None);
            node.set_slots(slots);
            nodes[0] = node;
            return costs;
        }

        let [left, right] = self.split(items, count, &bounds, depth);
        let room = share_room(items, left, right);
        let (left_items, right_items) = items.split_at_mut(room);
        let (root, rest) = nodes.split_at_mut(1);
        let (left_nodes, right_nodes) = rest.split_at_mut(2 * room - 1);
        let mut grow_left = || self.grow(left_items, left, left_nodes, depth + 1);
        let mut grow_right = || self.grow(right_items, right, right_nodes, depth + 1);
        let (on_left, on_right) =
            if count >= FORK { rayon::join(grow_left, grow_right) } else { (grow_left(), grow_right()) };
        let (slots, costs) = choose(left + right, bounds.area(), Some([&on_left, &on_right]));
        node.left = room as u32;
        node.set_slots(slots);
        root[0] = node;
        costs
    }

    /// Brings the items of the left child to the front and those of the right one behind them; returns how many there are of each, at least one.
    fn split(&self, items: &mut [Item], count: usize, bounds: &Bounds, depth: usize) -> [usize; 2] {
        let left = match count {
            2 => 1,
            _ if depth >= HALVE_FROM => halve(&mut items[..count]),
            n if n <= SWEEP => sweep(&mut items[..n]),
            n => match Between::find(&items[..n]) {
                Some(between) => {
                    if let Some(sides) = self.split_through(items, n, bounds, &between) {
                        return sides;
                    }
                    between.split(&mut items[..n])
                }
                None => halve(&mut items[..n]),
            },
        };
        [left, count - left]
    }

    /// Splits by a plane through triangles, if there is room for their parts and it costs less than one between triangles. If not, items change their order.
    fn split_through(
        &self,
        items: &mut [Item],
        count: usize,
        bounds: &Bounds,
        between: &Between,
    ) -> Option<[usize; 2]> {
        let overlap = between.sides[0].meet(between.sides[1].lo, between.sides[1].hi);
        let is_worth_it =
            || overlap.area() > self.least_overlap && overlap.area() * count as f32 > OVERLAP_COST * between.cost;
        let spare = (items.len() - count) as f32;
        if count < FEWEST || spare < LEAST_SPARE * count as f32 || overlap.is_empty() || !is_worth_it() {
            return None;
        }
        let plane = Plane::find(&items[..count], bounds, self.corners)?;
        let parts = plane.count[0] + plane.count[1];
        if !(plane.cost < GAIN * between.cost && parts <= items.len() && plane.count.iter().all(|&side| side < count)) {
            return None;
        }
        let sides = plane.split(items, count, self.corners);
        (sides[0] > 0 && sides[1] > 0).then_some(sides)
    }
}

/// Shares the places behind the items of both sides between them by their numbers, and answers how many the left side has.
fn share_room(items: &mut [Item], left: usize, right: usize) -> usize {
    let spare = items.len() - left - right;
    let room = left + (spare as u64 * left as u64 / (left + right) as u64) as usize;
    if room > left {
        items.copy_within(left..left + right, room);
        items[left..room].fill(Item::NONE);
    }
    items[room + right..].fill(Item::NONE);
    room
}

/// Halves by number along the widest axis: keeps the depth bounded where areas tell nothing.
fn halve(items: &mut [Item]) -> usize {
    let centres = items.iter().fold(Bounds::EMPTY, |bounds, item| bounds.join(item.centre(), item.centre()));
    let extent = (centres.hi - centres.lo).truncate();
    let axis = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| along(axis, a, b));
    middle
}

/// Tries every split of the items sorted along each axis.
fn sweep(items: &mut [Item]) -> usize {
    let n = items.len();
    let (mut best, mut best_axis, mut best_left) = (f32::INFINITY, 2, n / 2);
    for axis in 0..3 {
        items.sort_unstable_by(|a, b| along(axis, a, b));
        let mut right_cost = [0.0; SWEEP];
        let mut right = Bounds::EMPTY;
        for i in (1..n).rev() {
            right = right.join(items[i].lo, items[i].hi);
            right_cost[i] = right.area() * (n - i) as f32;
        }
        let mut left = Bounds::EMPTY;
        for i in 1..n {
            left = left.join(items[i - 1].lo, items[i - 1].hi);
            let cost = left.area() * i as f32 + right_cost[i];
            if cost < best {
                (best, best_axis, best_left) = (cost, axis, i);
            }
        }
    }
    if best_axis != 2 {
        items.sort_unstable_by(|a, b| along(best_axis, a, b));
    }
    best_left
}

/// A total order, so that equal centres cannot make the result depend on how the items came.
fn along(axis: usize, a: &Item, b: &Item) -> std::cmp::Ordering {
    a.centre()[axis].total_cmp(&b.centre()[axis]).then(a.triangle().cmp(&b.triangle()))
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: u32,
}

/// The best plane between two bins of items, which are sorted into them by their centres.
struct Between {
    lowest: Vec4,
    scale: Vec4,
    bins: usize,
    axis: usize,
    bin: usize,
    cost: f32,
    /// The boxes of both sides.
    sides: [Bounds; 2],
}

impl Between {
    fn place(&self, item: &Item) -> [usize; 3] {
        ((item.centre() - self.lowest) * self.scale).truncate().to_array().map(|x| (x as usize).min(self.bins - 1))
    }

    fn find(items: &[Item]) -> Option<Between> {
        let centres = items.iter().fold(Bounds::EMPTY, |bounds, item| bounds.join(item.centre(), item.centre()));
        let extent = centres.hi - centres.lo;
        // An axis without extent gets scale 0: all in the first bin, no plane to choose.
        let wide = extent.cmpgt(Vec4::splat(f32::MIN_POSITIVE));
        let bins = BINS.min(8 + items.len() / 4);
        // A hair less than the number of bins, so that the last centre falls into the last bin.
        let scale = Vec4::select(wide, Vec4::splat(bins as f32 * 0.99999) / extent, Vec4::ZERO);
        let sides = [Bounds::EMPTY; 2];
        let mut best = Between { lowest: centres.lo, scale, bins, axis: 0, bin: 0, cost: f32::INFINITY, sides };

        // Fill the bins of the three axes in one pass.
        let mut filled = [[Bin { bounds: Bounds::EMPTY, count: 0 }; BINS]; 3];
        for item in items {
            for (axis, i) in best.place(item).into_iter().enumerate() {
                let bin = &mut filled[axis][i];
                bin.bounds = bin.bounds.join(item.lo, item.hi);
                bin.count += 1;
            }
        }

        // Sweep the planes of each axis from right to left, then from left to right.
        for (axis, filled) in filled.iter().enumerate() {
            let (mut rights, mut right_cost) = ([Bounds::EMPTY; BINS], [f32::INFINITY; BINS]);
            let mut right = Bin { bounds: Bounds::EMPTY, count: 0 };
            for i in (1..bins).rev() {
                right.bounds = right.bounds.join(filled[i].bounds.lo, filled[i].bounds.hi);
                right.count += filled[i].count;
                if right.count > 0 {
                    (rights[i], right_cost[i]) = (right.bounds, right.bounds.area() * right.count as f32);
                }
            }
            let mut left = Bin { bounds: Bounds::EMPTY, count: 0 };
            for i in 1..bins {
                left.bounds = left.bounds.join(filled[i - 1].bounds.lo, filled[i - 1].bounds.hi);
                left.count += filled[i - 1].count;
                let cost = left.bounds.area() * left.count as f32 + right_cost[i];
                if left.count > 0 && cost < best.cost {
                    best = Between { axis, bin: i, cost, sides: [left.bounds, rights[i]], ..best };
                }
            }
        }
        (best.cost < f32::INFINITY).then_some(best)
    }

    /// Moves what lies left of the plane to the front; answers how many that are.
    fn split(&self, items: &mut [Item]) -> usize {
        let mut left = 0;
        for i in 0..items.len() {
            if self.place(&items[i])[self.axis] < self.bin {
                items.swap(left, i);
                left += 1;
            }
        }
        left
    }
}
