//! From the binary tree to the wide one, at the least expected cost of a ray.
//!
//! Ylitie, Karras & Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", section 3:
//! C(n, i) is the least cost of the subtree n when it may hang as up to i children on the node above it.
//! C(n, 1) = min(leaf, area × [`NODE`] + the best way to fill eight children); C(n, i) = min over k of
//! C(left, k) + C(right, i − k), or C(n, i − 1). All are worked out bottom up while the binary tree is built;
//! [`collapse`] then follows the choices top down.
//!
//! Children stand in a node in order of the area of the triangles below them, the largest last: where any hit will do they are looked at
//! from there on (Nah & Manocha 2014, "SATO: Surface area traversal order for shadow ray tracing"). Between random points of a furnished
//! room rays visit 8.5 nodes so instead of 10.2, in a building of 1,200 rooms 7.4 instead of 8.3, and more often the same ones.
//! Triangles that were cut count whole with each part: by the sizes of their parts rays visit as many nodes.

use crate::build::{Binary, Item};
use crate::tree::{Block, Child, LANES, MAX_BLOCKS, Node, WIDTH};
use glam::Vec3;

/// Cost of testing the eight boxes of a node, and of putting those hit in order.
const NODE: f32 = 1.0;

/// Cost of testing a block of four triangles. Where it is 0.6 rays in a furnished room visit 2 % fewer nodes and 9 %
/// more blocks, at 1.5 it is 2 % more and 12 % fewer: anywhere in between will do.
const BLOCK: f32 = 0.8;

/// The costs C(n, 1..=7) of a subtree.
pub(crate) type Costs = [f32; WIDTH - 1];

/// How a subtree of so many triangles hangs below its parent, and what it costs there, given the costs of its children.
/// `[0]`: children given to the left side when this is a node of its own, 0 where it is a leaf.
/// `[i - 1]`: children out of i given to the left side, 0 where i − 1 do as well.
pub(crate) fn choose(count: usize, area: f32, children: Option<[&Costs; 2]>) -> ([u8; WIDTH - 1], Costs) {
    let blocks = count.div_ceil(LANES);
    let leaf = if blocks <= MAX_BLOCKS { area * BLOCK * blocks as f32 } else { f32::INFINITY };
    let (mut slots, mut costs) = ([0; WIDTH - 1], [leaf; WIDTH - 1]);
    let Some([l, r]) = children else { return (slots, costs) };

    // The cheapest way to hand i children to the two sides; costs that are not finite still leave a valid choice.
    let share = |i: usize| {
        let mut best = (f32::INFINITY, 1);
        for k in 1..i {
            if k < WIDTH && i - k < WIDTH {
                let cost = l[k - 1] + r[i - k - 1];
                if cost < best.0 {
                    best = (cost, k as u8);
                }
            }
        }
        best
    };
    let (below, k) = share(WIDTH);
    let inner = below + area * NODE;
    (costs[0], slots[0]) = if blocks <= MAX_BLOCKS && leaf <= inner { (leaf, 0) } else { (inner, k) };
    for i in 2..WIDTH {
        let (cost, k) = share(i);
        (costs[i - 1], slots[i - 1]) = if cost < costs[i - 2] { (cost, k) } else { (costs[i - 2], 0) };
    }
    (slots, costs)
}

/// Makes the wide tree from the binary one. The first node is the root; without triangles there is none.
pub(crate) fn collapse<C: Fn(usize) -> [Vec3; 3]>(
    binary: &[Binary],
    items: &[Item],
    corners: &C,
) -> (Vec<Node>, Vec<Block>) {
    let mut area = vec![0.0; items.len() + 1];
    for (i, item) in items.iter().enumerate() {
        area[i + 1] = area[i];
        if !item.is_none() {
            let [a, b, c] = corners(item.triangle() as usize).map(|p| p.as_dvec3());
            area[i + 1] += (b - a).cross(c - a).length();
        }
    }
    let mut wide = Wide { binary, items, corners, area, nodes: Vec::new(), blocks: Vec::new() };
    if !binary.is_empty() {
        wide.nodes.push(Node::EMPTY);
        if binary[0].slots(0) == 0 {
            // A tree of one leaf still gets a node above it.
            wide.fill(0, &mut [(0, 0, items.len())]);
        } else {
            let mut children = Vec::with_capacity(WIDTH);
            wide.open((0, 0, items.len()), WIDTH, &mut children);
            wide.fill(0, &mut children);
        }
    }
    (wide.nodes, wide.blocks)
}

/// A binary node, the first of its places for items, and how many these are.
type Place = (usize, usize, usize);

struct Wide<'a, C> {
    binary: &'a [Binary],
    items: &'a [Item],
    /// The corners of a triangle.
    corners: &'a C,
    /// Twice the area of the first so many items.
    area: Vec<f64>,
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

impl<C: Fn(usize) -> [Vec3; 3]> Wide<'_, C> {
    /// Lists what hangs on the wide node above when the binary node at `at`, whose items start at `first`, is
    /// opened and may take `slots` places.
    fn open(&self, (at, first, room): Place, slots: usize, children: &mut Vec<Place>) {
        let node = &self.binary[at];
        let left = node.left as usize;
        let k = node.slots(if slots == WIDTH { 0 } else { slots - 1 });
        for (at, first, room, slots) in
            [(at + 1, first, left, k), (at + 2 * left, first + left, room - left, slots - k)]
        {
            // Where fewer slots cost as much, fewer are taken; with one left the subtree stays closed.
            let slots = (2..=slots).rev().find(|&i| self.binary[at].slots(i - 1) != 0);
            match slots {
                Some(slots) => self.open((at, first, room), slots, children),
                None => children.push((at, first, room)),
            }
        }
    }

    /// Fills a wide node. Its inner children come to lie next to each other; everything below them follows in order. The largest
    /// come first there: of boxes that a ray enters at the same distance the first is opened first.
    fn fill(&mut self, index: usize, children: &mut [Place]) {
        children.sort_by(|&a, &b| self.area_below(a).total_cmp(&self.area_below(b)));
        let mut node = Node::EMPTY;
        let mut below = Vec::new();
        for (slot, &(at, first, room)) in children.iter().enumerate().rev() {
            let binary = &self.binary[at];
            for axis in 0..3 {
                node.bounds[axis][slot] = binary.lo[axis];
                node.bounds[axis + 3][slot] = binary.hi[axis];
            }
            node.child[slot] = if binary.slots(0) == 0 {
                self.leaf(&self.items[first..first + room])
            } else {
                self.nodes.push(Node::EMPTY);
                below.push((self.nodes.len() - 1, (at, first, room)));
                Child::node(self.nodes.len() - 1)
            };
        }
        self.nodes[index] = node;
        for (index, place) in below {
            let mut children = Vec::with_capacity(WIDTH);
            self.open(place, WIDTH, &mut children);
            self.fill(index, &mut children);
        }
    }

    /// Twice the area of the triangles below a binary node.
    fn area_below(&self, (_, first, room): Place) -> f64 {
        self.area[first + room] - self.area[first]
    }

    fn leaf(&mut self, items: &[Item]) -> Child {
        let first = self.blocks.len();
        // In the order of their indices, so that equal input gives equal leaves however it was sorted.
        let mut indices: Vec<u32> = items.iter().filter(|item| !item.is_none()).map(Item::triangle).collect();
        indices.sort_unstable();
        // Parts of one triangle may have come together again.
        indices.dedup();
        for four in indices.chunks(LANES) {
            let mut block = Block::EMPTY;
            for (lane, &triangle) in four.iter().enumerate() {
                block.set(lane, triangle, &(self.corners)(triangle as usize));
            }
            self.blocks.push(block);
        }
        Child::leaf(first, self.blocks.len() - first)
    }
}
