//! Cells become regions: neighbours whose union costs less are joined.
//!
//! A region of p elements and q boundary patches costs (p + q)²; the union of A and B, which share s patches, costs
//! (p_A + p_B + q_A + q_B − 2s)². First all cells are joined between which a plane only went through a room; then, the
//! pair that gains most before the others, all whose union costs less; then doorways, which are more open than they
//! have walls.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// A boundary between two cells.
pub struct Border {
    pub cells: [u32; 2],
    /// Patches that it will have.
    pub patches: f64,
    /// Area, m².
    pub area: f64,
    /// It is no wall's.
    pub is_soft: bool,
}

/// What a cell holds.
#[derive(Clone, Copy, Default)]
pub struct Content {
    /// p: facets, by the part of their area that it has.
    pub elements: f64,
    /// Area of these, m².
    pub area: f64,
}

/// Two neighbours: by how much their union raises the cost, in 1/1024, their ids, and the ages at which that was so.
type Offer = (i64, [u32; 2], [u32; 2]);

struct Merger {
    parent: Vec<u32>,
    /// How often each has grown.
    age: Vec<u32>,
    own: Vec<Content>,
    /// Patches shared with each neighbour, and their area.
    shared: Vec<BTreeMap<u32, [f64; 2]>>,
    /// q, and the area of these patches.
    outer: Vec<[f64; 2]>,
    /// Pairs to be joined, the largest gain first.
    offers: BinaryHeap<Reverse<Offer>>,
}

impl Merger {
    fn root(&self, mut cell: u32) -> u32 {
        while self.parent[cell as usize] != cell {
            cell = self.parent[cell as usize];
        }
        cell
    }

    /// What joining two neighbours adds to the cost.
    fn rise(&self, a: u32, b: u32) -> f64 {
        let of = |i: u32| self.own[i as usize].elements + self.outer[i as usize][0];
        let shared = self.shared[a as usize].get(&b).map_or(0.0, |shared| shared[0]);
        (of(a) + of(b) - 2.0 * shared).powi(2) - of(a).powi(2) - of(b).powi(2)
    }

    /// Joins two, the one with fewer neighbours to the other; answers which remains.
    fn join(&mut self, a: u32, b: u32) -> u32 {
        let neighbours = |i: u32| self.shared[i as usize].len();
        let (a, b) = if (neighbours(b), Reverse(b)) > (neighbours(a), Reverse(a)) { (b, a) } else { (a, b) };
        let (i, j) = (a as usize, b as usize);
        self.parent[j] = a;
        self.age[i] += 1;
        self.own[i].elements += self.own[j].elements;
        self.own[i].area += self.own[j].area;
        let common = self.shared[i].remove(&b).unwrap_or_default();
        let (grown, taken) = (self.outer[i], self.outer[j]);
        self.outer[i] = [0, 1].map(|k| grown[k] + taken[k] - 2.0 * common[k]);
        for (other, patches) in std::mem::take(&mut self.shared[j]) {
            if other != a {
                add(self.shared[i].entry(other).or_default(), patches);
                let back = &mut self.shared[other as usize];
                back.remove(&b);
                add(back.entry(a).or_default(), patches);
            }
        }
        a
    }

    /// Offers the pairs of one region.
    fn offer(&mut self, a: u32) {
        let neighbours: Vec<u32> = self.shared[a as usize].keys().copied().collect();
        for b in neighbours {
            let rise = self.rise(a, b);
            if rise < 0.0 {
                let pair = [a.min(b), a.max(b)];
                let ages = pair.map(|i| self.age[i as usize]);
                self.offers.push(Reverse(((rise * 1024.0) as i64, pair, ages)));
            }
        }
    }

    fn join_what_gains(&mut self) {
        for a in 0..self.parent.len() as u32 {
            if self.root(a) == a {
                self.offer(a);
            }
        }
        while let Some(Reverse((_, [a, b], [first, second]))) = self.offers.pop() {
            let is_current = |i: u32, age: u32| self.parent[i as usize] == i && self.age[i as usize] == age;
            if is_current(a, first) && is_current(b, second) {
                let joined = self.join(a, b);
                self.offer(joined);
            }
        }
    }

    fn join_doorways(&mut self) {
        for cell in 0..self.parent.len() as u32 {
            let mut a = self.root(cell);
            while self.own[a as usize].area <= self.outer[a as usize][1] {
                let least = |x: &u32, y: &u32| self.rise(a, *x).total_cmp(&self.rise(a, *y));
                let Some(b) = self.shared[a as usize].keys().copied().min_by(least) else { break };
                a = self.join(a, b);
            }
        }
    }
}

fn add(sum: &mut [f64; 2], more: [f64; 2]) {
    sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}

/// A region for each cell, by the id of one of its cells.
pub fn merge(cells: Vec<Content>, borders: &[Border]) -> Vec<u32> {
    let n = cells.len();
    let mut merger = Merger {
        parent: (0..n as u32).collect(),
        age: vec![0; n],
        own: cells,
        shared: vec![BTreeMap::new(); n],
        outer: vec![[0.0; 2]; n],
        offers: BinaryHeap::new(),
    };
    for Border { cells: [a, b], patches, area, .. } in borders {
        for (one, other) in [(*a, *b), (*b, *a)] {
            add(merger.shared[one as usize].entry(other).or_default(), [*patches, *area]);
            add(&mut merger.outer[one as usize], [*patches, *area]);
        }
    }
    for border in borders.iter().filter(|border| border.is_soft) {
        let [a, b] = border.cells.map(|cell| merger.root(cell));
        if a != b {
            merger.join(a, b);
        }
    }
    merger.join_what_gains();
    merger.join_doorways();
    (0..n as u32).map(|cell| merger.root(cell)).collect()
}
