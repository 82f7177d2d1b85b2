//! A tree of emitters: which of many to ask for light, by about what each could give to a place.
//!
//! A node knows a box and a ball around its emitters, a cone around their normals, and their power. From these follows about
//! what it gives to a place that sees all of it, and a way down: to each child in proportion to that. What cannot give
//! anything is never asked, all else with a probability above zero, but for rounding. (Conty Estevez and Kulla 2018,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting", sect. 4 and 5; bounds as in Walter et al. 2005,
//! "Lightcuts", sect. 4.1.)
//!
//! Importance is about Φ/(2π) (1/nearest² + 1/r²) cos(θ − θᵤ) cos(θ' − θₒ − θᵤ), with θᵤ the half angle that the ball is seen
//! within and θₒ the spread of the normals; within the ball no direction is known, and what stands between never.

use glam::DVec3;
use std::f64::consts::PI;
use std::ops::Range;

/// What emits to one side, as the tree sees it.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    /// Corners of a box around it.
    pub bounds: [DVec3; 2],
    /// Unit normal of the emitting side.
    pub normal: DVec3,
    /// Flux, in any unit; at least zero.
    pub power: f64,
}

impl Emitter {
    /// A triangle of a given flux.
    pub fn triangle(corners: [DVec3; 3], normal: DVec3, power: f64) -> Emitter {
        let [a, b, c] = corners;
        Emitter { bounds: [a.min(b).min(c), a.max(b).max(c)], normal, power }
    }
}

/// Directions around an axis: all within an angle of it.
#[derive(Clone, Copy, Debug)]
struct Cone {
    axis: DVec3,
    angle: f64,
}

impl Cone {
    /// The smallest that contains both, about.
    fn around(self, other: Cone) -> Cone {
        let (wide, narrow) = if self.angle >= other.angle { (self, other) } else { (other, self) };
        let along = wide.axis.dot(narrow.axis);
        let turned = narrow.axis - wide.axis * along;
        // Normals of one plane differ in their last bits, of which an arc cosine makes an angle.
        let apart = turned.length().atan2(along);
        if apart + narrow.angle <= wide.angle {
            return wide;
        }
        let angle = 0.5 * (wide.angle + apart + narrow.angle);
        if angle >= PI {
            return Cone { axis: wide.axis, angle: PI };
        }
        if turned.length_squared() < 1e-24 {
            // One axis, or opposite ones.
            return Cone { axis: wide.axis, angle: if along > 0.0 { apart + narrow.angle } else { PI } };
        }
        let turn = angle - wide.angle;
        Cone { axis: (wide.axis * turn.cos() + turned.normalize() * turn.sin()).normalize(), angle }
    }
}

/// Part of the squared radius of a node by which what is in it is farther away than the nearest place of its box. A path
/// tracer of a furnished office is 3.6 % off with 1/64, 2.7 % with 1/4, 2.9 % with 1 (512 paths).
const NEAREST: f64 = 0.25;

/// What is below a node.
#[derive(Clone, Copy, Debug)]
enum Below {
    /// A leaf, by its number.
    Leaf(u32),
    /// The two children: the next node, and this one.
    Nodes(u32),
}

#[derive(Clone, Copy, Debug)]
struct Node {
    centre: DVec3,
    /// Half the sides of a box around the emitters, and the radius of the ball around that.
    half: DVec3,
    radius: f64,
    axis: DVec3,
    /// Cosine and sine of the angle between the axis and the farthest normal.
    spread: [f64; 2],
    power: f64,
    below: Below,
}

/// Emitters in a tree. Places within it are named by the number of the node; the root is node 0.
#[derive(Clone, Debug, Default)]
pub struct EmitterTree {
    nodes: Vec<Node>,
    /// Emitters by leaf.
    order: Vec<u32>,
    leaves: Vec<Range<u32>>,
    /// By emitter, the way to its leaf: a bit for each level, 1 for the second child.
    way: Vec<u32>,
}

impl EmitterTree {
    /// Arranges emitters, up to `most` of them in each leaf.
    pub fn new(emitters: &[Emitter], most: usize) -> EmitterTree {
        let mut tree = EmitterTree {
            order: (0..emitters.len() as u32).collect(),
            way: vec![0; emitters.len()],
            ..EmitterTree::default()
        };
        if !emitters.is_empty() {
            tree.arrange(emitters, 0..emitters.len(), most.max(1), (0, 0));
        }
        tree
    }

    /// Makes the node of a range of `order`, and those below it; answers its cone.
    fn arrange(&mut self, emitters: &[Emitter], range: Range<usize>, most: usize, (way, depth): (u32, u32)) -> Cone {
        let own = |tree: &EmitterTree, k: usize| emitters[tree.order[k] as usize];
        let [mut low, mut high, mut first, mut last] =
            [DVec3::INFINITY, DVec3::NEG_INFINITY, DVec3::INFINITY, DVec3::NEG_INFINITY];
        let mut power = 0.0;
        for k in range.clone() {
            let Emitter { bounds: [from, to], power: p, .. } = own(self, k);
            (low, high) = (low.min(from), high.max(to));
            (first, last) = (first.min(from + to), last.max(from + to));
            power += p;
        }
        let half = 0.5 * (high - low);
        let number = self.nodes.len();
        self.nodes.push(Node {
            centre: 0.5 * (low + high),
            half,
            radius: half.length(),
            axis: DVec3::Z,
            spread: [-1.0, 0.0],
            power,
            below: Below::Leaf(self.leaves.len() as u32),
        });
        let cone = if range.len() <= most {
            self.leaves.push(range.start as u32..range.end as u32);
            let mut cone: Option<Cone> = None;
            for k in range {
                let single = Cone { axis: own(self, k).normal, angle: 0.0 };
                cone = Some(cone.map_or(single, |cone| cone.around(single)));
                self.way[self.order[k] as usize] = way;
            }
            cone.unwrap_or(Cone { axis: DVec3::Z, angle: PI })
        } else {
            let sides = last - first;
            let axis = (0..3).max_by(|a, b| sides[*a].total_cmp(&sides[*b])).unwrap_or(0);
            let key = |e: &u32| {
                let [from, to] = emitters[*e as usize].bounds;
                ((from + to)[axis], *e)
            };
            let middle = range.len() / 2;
            self.order[range.clone()]
                .select_nth_unstable_by(middle, |a, b| key(a).0.total_cmp(&key(b).0).then(a.cmp(b)));
            let middle = range.start + middle;
            let near = self.arrange(emitters, range.start..middle, most, (way, depth + 1));
            self.nodes[number].below = Below::Nodes(self.nodes.len() as u32);
            near.around(self.arrange(emitters, middle..range.end, most, (way | 1 << depth, depth + 1)))
        };
        self.nodes[number].axis = cone.axis;
        self.nodes[number].spread = [cone.angle.cos(), cone.angle.sin()];
        cone
    }

    /// Memory that it takes beside itself, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.order) + size_of_val(&*self.leaves) + size_of_val(&*self.way)
    }

    /// The emitters in the order of the leaves.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Which of the order each leaf has.
    pub fn leaves(&self) -> &[Range<u32>] {
        &self.leaves
    }

    /// The leaf that a node is, if it is one.
    pub fn leaf(&self, node: u32) -> Option<usize> {
        match self.nodes[node as usize].below {
            Below::Leaf(leaf) => Some(leaf as usize),
            Below::Nodes(_) => None,
        }
    }

    /// About what a node gives to a place that sees all of it, power per area: zero only where it gives nothing.
    pub fn importance(&self, node: u32, point: DVec3, normal: DVec3) -> f64 {
        let Node { centre, half, radius, axis, spread, power, .. } = &self.nodes[node as usize];
        let away = *centre - point;
        let height = away.dot(normal);
        if height + half.dot(normal.abs()) <= 0.0 {
            return 0.0;
        }
        let (square, ball) = (away.length_squared(), radius * radius);
        // Of what is strewn over a large box, that which is near the place counts most.
        let nearest = (away.abs() - *half).max(DVec3::ZERO).length_squared() + NEAREST * ball;
        let shares =
            0.5 * power / PI * (1.0 / nearest.max(f64::MIN_POSITIVE) + 1.0 / square.max(ball).max(f64::MIN_POSITIVE));
        if square <= ball {
            return shares;
        }
        let distance = square.sqrt();
        // The ball is seen within this angle.
        let size = [(1.0 - ball / square).sqrt(), radius / distance];
        let seen = less(angle(height / distance), size);
        let given = less(less(angle(-away.dot(*axis) / distance), *spread), size);
        shares * seen[0].max(0.0) * given[0].max(0.0)
    }

    /// Goes down from a node to a leaf by a number u in [0, 1), which comes out as good as new; answers the leaf and the
    /// probability of coming to it. None where nothing on the way gives the place any light, or nothing emits.
    pub fn pick(&self, mut node: u32, point: DVec3, normal: DVec3, u: &mut f64) -> Option<(usize, f64)> {
        let mut probability = 1.0;
        loop {
            let second = match self.nodes.get(node as usize)?.below {
                Below::Leaf(leaf) => return Some((leaf as usize, probability)),
                Below::Nodes(second) => second,
            };
            let first = self.share(node, second, point, normal)?;
            if *u < first {
                (node, probability, *u) = (node + 1, probability * first, *u / first);
            } else {
                (node, probability, *u) = (second, probability * (1.0 - first), (*u - first) / (1.0 - first));
            }
            *u = u.clamp(0.0, 1.0 - f64::EPSILON);
        }
    }

    /// The probability with which [`EmitterTree::pick`] comes from the root to the leaf of an emitter.
    pub fn probability(&self, emitter: u32, point: DVec3, normal: DVec3) -> f64 {
        let (mut node, mut probability, mut way) = (0, 1.0, self.way[emitter as usize]);
        while let Below::Nodes(second) = self.nodes[node as usize].below {
            let Some(first) = self.share(node, second, point, normal) else { return 0.0 };
            (node, probability) =
                if way & 1 == 0 { (node + 1, probability * first) } else { (second, probability * (1.0 - first)) };
            way >>= 1;
        }
        probability
    }

    /// The share of the first of two children.
    fn share(&self, node: u32, second: u32, point: DVec3, normal: DVec3) -> Option<f64> {
        let [a, b] = [node + 1, second].map(|child| self.importance(child, point, normal));
        (a + b > 0.0).then(|| a / (a + b))
    }

    /// Appends nodes that together have all emitters that could give light to a place, with their importance: up to `most`, the
    /// more of them the more they could give. From those of the root on, the one that could give most is replaced
    /// by its children, until it is a leaf.
    pub fn cut(&self, point: DVec3, normal: DVec3, most: usize, cut: &mut Vec<(u32, f64)>) {
        let first = cut.len();
        let add = |cut: &mut Vec<(u32, f64)>, node: u32| {
            let importance = self.importance(node, point, normal);
            if importance > 0.0 {
                cut.push((node, importance));
            }
        };
        if !self.nodes.is_empty() {
            add(cut, 0);
        }
        while cut.len() - first < most {
            let open = (first..cut.len()).filter(|k| self.leaf(cut[*k].0).is_none());
            let Some(k) = open.max_by(|a, b| cut[*a].1.total_cmp(&cut[*b].1)) else { return };
            let (node, _) = cut.swap_remove(k);
            if let Below::Nodes(second) = self.nodes[node as usize].below {
                add(cut, node + 1);
                add(cut, second);
            }
        }
    }
}

/// Cosine and sine of an angle of 0 to π, by its cosine.
fn angle(cosine: f64) -> [f64; 2] {
    [cosine, (1.0 - cosine * cosine).max(0.0).sqrt()]
}

/// The first angle less the second, at least 0, each by cosine and sine.
fn less(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    if a[0] >= b[0] { [1.0, 0.0] } else { [a[0] * b[0] + a[1] * b[1], a[1] * b[0] - a[0] * b[1]] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;

    /// Triangles of all directions, strewn over a room.
    fn strewn(count: usize) -> Vec<([DVec3; 3], DVec3)> {
        let mut random = Random::new(5);
        let mut vector = |scale: f64| DVec3::from_array(std::array::from_fn(|_| scale * (random.next_unit() - 0.5)));
        let triangle = |_| {
            let at = vector(10.0);
            let corners = [at, at + vector(1.0), at + vector(1.0)];
            (corners, (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize())
        };
        (0..count).map(triangle).collect()
    }

    fn tree(triangles: &[([DVec3; 3], DVec3)], most: usize) -> EmitterTree {
        let power = |k: usize| 1.0 + (k % 7) as f64;
        let emitters: Vec<Emitter> = triangles
            .iter()
            .enumerate()
            .map(|(k, (corners, normal))| Emitter::triangle(*corners, *normal, power(k)))
            .collect();
        EmitterTree::new(&emitters, most)
    }

    /// What a pick answers is what `probability` says of it, and comes about as often.
    #[test]
    fn picks_are_as_probable_as_told() {
        let triangles = strewn(40);
        let tree = tree(&triangles, 1);
        let (point, normal) = (DVec3::new(0.3, -0.2, 0.1), DVec3::new(0.6, 0.0, 0.8));
        let mut times = vec![0; triangles.len()];
        let count = 200_000;
        for k in 0..count {
            let mut u = (f64::from(k) + 0.5) / f64::from(count);
            if let Some((leaf, probability)) = tree.pick(0, point, normal, &mut u) {
                let emitter = tree.order()[tree.leaves()[leaf].start as usize];
                assert!((probability - tree.probability(emitter, point, normal)).abs() < 1e-12);
                times[emitter as usize] += 1;
            }
        }
        for (emitter, times) in times.iter().enumerate() {
            let share = tree.probability(emitter as u32, point, normal);
            assert!((f64::from(*times) / f64::from(count) - share).abs() < 1e-4, "{emitter}: {times} for {share}");
        }
    }

    /// Lamps in one plane give nothing to what is behind it, however the plane is turned.
    #[test]
    fn lamps_in_a_plane_have_one_direction() {
        let mut random = Random::new(11);
        for _ in 0..40 {
            let mut unit = || DVec3::from_array(std::array::from_fn(|_| random.next_unit() - 0.5)).normalize();
            let x = unit();
            let normal = x.cross(unit()).normalize();
            let y = normal.cross(x);
            let triangle = |k: usize| {
                let at = 0.7 * (k % 8) as f64 * x + 0.9 * (k / 8) as f64 * y;
                let corners = [at, at + 0.3 * x, at + 0.3 * y];
                (corners, (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize())
            };
            let triangles: Vec<([DVec3; 3], DVec3)> = (0..64).map(triangle).collect();
            let tree = tree(&triangles, 4);
            assert!(tree.nodes.iter().all(|node| node.spread[0] > 1.0 - 1e-9));
            let behind = 2.0 * x + 2.0 * y - 40.0 * normal;
            assert!(tree.importance(0, behind, normal) <= 0.0);
            assert!(tree.importance(0, behind + 80.0 * normal, -normal) > 0.0);
        }
    }

    /// Whatever faces a place and is above its horizon is picked now and then, and is in what is cut off for it.
    #[test]
    fn nothing_that_gives_light_is_left_out() {
        let triangles = strewn(300);
        let tree = tree(&triangles, 4);
        let mut random = Random::new(9);
        let mut cut = Vec::new();
        for _ in 0..50 {
            let point = DVec3::from_array(std::array::from_fn(|_| 12.0 * (random.next_unit() - 0.5)));
            let normal = DVec3::from_array(std::array::from_fn(|_| random.next_unit() - 0.5)).normalize();
            cut.clear();
            tree.cut(point, normal, 30, &mut cut);
            let mut in_cut = vec![false; triangles.len()];
            for (node, _) in &cut {
                let mut open = vec![*node];
                while let Some(node) = open.pop() {
                    match tree.nodes[node as usize].below {
                        Below::Leaf(leaf) => {
                            let range = tree.leaves[leaf as usize].clone();
                            tree.order[range.start as usize..range.end as usize]
                                .iter()
                                .for_each(|e| in_cut[*e as usize] = true);
                        }
                        Below::Nodes(second) => open.extend([node + 1, second]),
                    }
                }
            }
            for (k, (corners, own)) in triangles.iter().enumerate() {
                let centre = corners.iter().sum::<DVec3>() / 3.0;
                let (away, square) = (centre - point, (centre - point).length_squared());
                let exact = away.dot(normal).max(0.0) * (-away.dot(*own)).max(0.0) / (PI * square * square);
                if exact > 0.0 {
                    assert!(tree.probability(k as u32, point, normal) > 0.0 && in_cut[k]);
                }
            }
        }
    }

    /// What a far emitter gives is hardly more than its importance says.
    #[test]
    fn importance_bounds_what_far_emitters_give() {
        let triangles = strewn(64);
        let tree = tree(&triangles, 1);
        let mut random = Random::new(3);
        for _ in 0..2000 {
            let point = DVec3::from_array(std::array::from_fn(|_| 20.0 * (random.next_unit() - 0.5)));
            let normal = DVec3::from_array(std::array::from_fn(|_| random.next_unit() - 0.5)).normalize();
            for (number, node) in tree.nodes.iter().enumerate() {
                let Below::Leaf(leaf) = node.below else { continue };
                let (corners, own) = triangles[tree.order[tree.leaves[leaf as usize].start as usize] as usize];
                let away = corners.iter().sum::<DVec3>() / 3.0 - point;
                let square = away.length_squared();
                if square < (20.0 * node.radius).powi(2) {
                    continue;
                }
                let exact = node.power * away.dot(normal).max(0.0) * (-away.dot(own)).max(0.0) / (PI * square * square);
                let importance = tree.importance(number as u32, point, normal);
                assert!(exact <= 1.2 * importance, "{exact} beyond {importance}");
            }
        }
    }
}
