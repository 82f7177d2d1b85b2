//! The values of lattice corners from those of the cells around them.

use super::planes::FLAT;
use super::{corner, edge_corner, edge_key, edge_of, for_each_cell, lattice, shared_corner, sides};
use glam::DVec3;
use radiosity_scene::{Bands, Elements, Mesh, luminance};
use rustc_hash::FxHashMap;

/// How far corners are moved towards what keeps the means of the cells, times what these miss on average around each. The mean of
/// the cells around a corner is its value only where these lie around it evenly and light is not bent. On a border it is the value a
/// third of a cell further in: 1.8 is exact where light is linear and the border straight, and takes the noise along. 1.5 leaves
/// 0.80 % of error in the Cornell box where none leaves 0.86 % (128 rays).
const MOVED: f64 = 1.5;

/// How often they are moved so where what is missed is no noise (Landweber 1951). Where needles of cells meet in fans, as modellers cut
/// walls around windows, each corner had the light of a place of its own, and the fans showed. Below the eaves of a house light is at most
/// 1.1 % off where it was 3.4 %, and a picture of the house 1.0 instead of 1.7 %. Twice as many would gain a fifth of that more and fit more of the
/// noise; half as many lose a quarter of it.
const MOVES: usize = 4;

/// What is missed is light in the part by which its mean square is more than so many times that of noise (a Wiener filter). With two,
/// noise drew folds along the cells of walls beside a window; the house is as near to the truth with either.
const NOISY: f64 = 8.0;

/// How often squares are evened out over the cells around: of six cells alone noise is told too roughly, and farther away light is
/// another.
const EVENED: usize = 2;

/// All cells lie to one side where the mean of the way to them is this part of its mean length: on a straight border it is
/// half or more, beside a sliver as well, and nothing in the middle of a regular lattice.
const ONE_SIDED: f64 = 0.5;

/// A triangle is a sliver where its longest edge is so many times as long as it is high, which well-shaped ones with vertices on
/// their edges are not. Between larger ones light is as good
/// as equal across it, but the cells beside its two long edges, by which these are told, are not the same.
const SLIVER: f64 = 6.0;

/// Larger are those whose cells are so many times as large. Without this, strips along walls and rugs, across which light does
/// change, were made even: 4.4 % instead of 3.6 % in a furnished room.
const LARGER: f64 = 4.0;

/// How often what lies across slivers is made equal: a sliver is some cells across.
const EQUALIZED: usize = 4;

/// A corner is not moved beyond what the cells around it have by more than this part of their differences, and by twice as much where
/// they lie to one side, which is what a straight border takes where light is linear. Without it light beside a step rings.
const BEYOND: f64 = 0.5;

/// Nor to less than this part of its mean, nor to more than twice of it: where light changes fast along a border, as at the foot of a box
/// that a shadow ends at, a corner had nearly none, a dark spot.
const LEAST: f64 = 0.5;

/// What a corner's value may be, by band.
#[derive(Clone, Copy)]
struct Bounds([[f64; 2]; 3]);

impl Bounds {
    const NONE: Bounds = Bounds([[f64::INFINITY, f64::NEG_INFINITY]; 3]);

    fn widened(self, part: f64) -> Bounds {
        Bounds(self.0.map(|[low, high]| {
            let more = part * (high - low);
            [low - more, high + more]
        }))
    }

    /// Not too far from the mean of the cells.
    fn beside(self, mean: [f64; 3]) -> Bounds {
        Bounds(std::array::from_fn(|band| {
            let ([low, high], mean) = (self.0[band], mean[band].abs());
            [low.max(LEAST * mean), high.min(mean / LEAST)]
        }))
    }

    fn kept(&self, value: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|band| value[band].max(self.0[band][0]).min(self.0[band][1]))
    }
}

/// The corners of all triangles, those that several share counted once.
pub(super) struct Corners<'a> {
    mesh: &'a Mesh,
    elements: &'a Elements,
    /// First lattice corner of each triangle's front and back; `usize::MAX` where there is none.
    pub base: Vec<[usize; 2]>,
    /// Cells along an edge of each triangle.
    pub division: Vec<u32>,
    /// The number of each lattice corner.
    pub number: Vec<u32>,
    /// By lattice corner, between which numbers its value lies.
    anchors: Vec<Anchor>,
    /// How many numbers there are.
    pub count: usize,
}

impl<'a> Corners<'a> {
    pub fn new(mesh: &'a Mesh, elements: &'a Elements) -> Corners<'a> {
        let division: Vec<u32> = (0..mesh.triangles.len()).map(|t| elements.division(t)).collect();
        let mut edges: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        for (t, &k) in division.iter().enumerate() {
            for e in 0..3 {
                let coarsest = edges.entry(edge_key(mesh, t, e)).or_insert(k);
                *coarsest = (*coarsest).min(k);
            }
        }
        let mut base = vec![[usize::MAX; 2]; division.len()];
        let (mut number, mut shared, mut count) = (Vec::new(), FxHashMap::default(), 0);
        for (t, side) in sides(elements, division.len()) {
            let k = division[t];
            base[t][side as usize] = number.len();
            for (i, j) in lattice(k) {
                let own = match shared_corner(mesh, t, side, (i, j), k) {
                    Some(key) => *shared.entry(key).or_insert(count),
                    None => count,
                };
                count += u32::from(own == count);
                number.push(own);
            }
        }
        // By the corners of the coarsest of the triangles at an edge. All divisions are powers of two, so coarse places are fine places,
        // and each triangle has them.
        let mut anchors = Vec::with_capacity(number.len());
        for (t, side) in sides(elements, division.len()) {
            let k = division[t];
            for (i, j) in lattice(k) {
                let own = number[anchors.len()];
                let Some((e, place)) = edge_of(i, j, k) else {
                    anchors.push(Anchor { ends: [own; 2], share: 0.0 });
                    continue;
                };
                let coarsest = edges[&edge_key(mesh, t, e)];
                let step = k / coarsest;
                let (low, rest) = (place / step, place % step);
                let at = |place: u32| {
                    let key = shared_corner(mesh, t, side, edge_corner(e, place, coarsest), coarsest);
                    shared[&key.expect("it lies on an edge")]
                };
                let ends = if rest == 0 { [at(low); 2] } else { [at(low), at(low + 1)] };
                anchors.push(Anchor { ends, share: rest as f32 / step as f32 });
            }
        }
        Corners { mesh, elements, base, division, number, anchors, count: count as usize }
    }

    /// Calls back with every cell and the lattice corners around it.
    pub fn each_cell(&self, mut visit: impl FnMut(usize, [usize; 3])) {
        for (t, side) in sides(self.elements, self.division.len()) {
            let k = self.division[t];
            let first = self.elements.cells_of(t, side).start;
            let base = self.base[t][side as usize];
            for_each_cell(k, |cell, around| {
                visit(first + cell as usize, around.map(|(i, j)| base + corner(i, j, k)));
            });
        }
    }

    /// The mean of the cells around each corner, by number; nothing where none of them weighs anything.
    fn mean(&self, cells: &[Cell]) -> Vec<Option<[f64; 3]>> {
        let mut sums = vec![Cell::default(); self.count];
        self.each_cell(|cell, around| {
            let Cell { weight, value } = cells[cell];
            for number in around.map(|lattice| self.number[lattice] as usize) {
                let sum = &mut sums[number];
                sum.weight += weight;
                (0..3).for_each(|band| sum.value[band] += weight * value[band]);
            }
        });
        sums.iter().map(|sum| (sum.weight > 0.0).then(|| sum.value.map(|v| v / sum.weight))).collect()
    }

    /// The mean of a field over each cell; weights are those of `cells`.
    fn on_cells(&self, field: &[Bands], cells: &[Cell]) -> Vec<Cell> {
        let mut out = cells.to_vec();
        self.each_cell(|cell, around| {
            out[cell].value = std::array::from_fn(|band| {
                around.map(|lattice| f64::from(field[lattice][band])).iter().sum::<f64>() / 3.0
            });
        });
        out
    }

    /// What the field through some corners has too little on average over each cell.
    fn missing(&self, means: &[Option<[f64; 3]>], cells: &[Cell]) -> Vec<Cell> {
        let mut missing = self.on_cells(&self.anchored(means), cells);
        for (missing, cell) in missing.iter_mut().zip(cells) {
            (0..3).for_each(|band| missing.value[band] = cell.value[band] - missing.value[band]);
        }
        missing
    }

    /// By number, how much the cells around each corner lie to one side of it: from 0 to 1.
    fn one_sidedness(&self, cells: &[Cell]) -> Vec<f64> {
        let mut sums = vec![(DVec3::ZERO, 0.0); self.count];
        self.each_cell(|cell, around| {
            let (t, _) = self.elements.place(self.elements.of_cell(cell).start);
            let places = self.elements.cell_corners(cell).map(|uv| self.mesh.point(t, uv));
            let (centre, weight) = ((places[0] + places[1] + places[2]) / 3.0, cells[cell].weight);
            for (lattice, place) in around.into_iter().zip(places) {
                let (way, length) = &mut sums[self.number[lattice] as usize];
                *way += weight * (centre - place);
                *length += weight * centre.distance(place);
            }
        });
        let share = |(way, length): (DVec3, f64)| way.length() / length.max(f64::MIN_POSITIVE) / ONE_SIDED;
        sums.into_iter().map(|sum| share(sum).min(1.0)).collect()
    }

    /// By number, the part of what is missed around each corner that is light, where noise has been added to that of cells.
    fn light_missed(&self, cells: &[Cell], noise: &[f32]) -> Vec<f64> {
        let both = |(cell, noise): (&Cell, &f32)| {
            let light = luminance(cell.value.map(|value| value as f32));
            Cell { weight: cell.weight, value: [f64::from(light), f64::from(*noise), 0.0] }
        };
        let both: Vec<Cell> = cells.iter().zip(noise).map(both).collect();
        let mut squares = self.mean(&self.missing(&self.mean(&both), &both));
        squares.iter_mut().flatten().flatten().for_each(|value| *value *= *value);
        for _ in 0..EVENED {
            squares = self.mean(&self.on_cells(&self.anchored(&squares), cells));
        }
        // Nothing is missed of nothing: not a number is 0.
        let light = |[both, noise, _]: [f64; 3]| (1.0 - NOISY * noise / both).max(0.0);
        squares.into_iter().map(|squares| squares.map_or(0.0, light)).collect()
    }

    /// By number, the least and the most that cells around each corner have.
    fn around(&self, cells: &[Cell]) -> Vec<Bounds> {
        let mut bounds = vec![Bounds::NONE; self.count];
        self.each_cell(|cell, around| {
            let Cell { weight, value } = cells[cell];
            for number in around.map(|lattice| self.number[lattice] as usize).into_iter().filter(|_| weight > 0.0) {
                for ([low, high], value) in bounds[number].0.iter_mut().zip(value) {
                    (*low, *high) = (low.min(value), high.max(value));
                }
            }
        });
        bounds
    }

    /// How the values of corners follow from those of cells with some noise in them, the same whatever of the noise is in them. Where
    /// noise is not known, nothing that is missed off borders is taken for light.
    pub fn fit(&self, cells: &[Cell], noise: Option<&[f32]>) -> Fit {
        let light = noise.map_or_else(|| vec![0.0; self.count], |noise| self.light_missed(cells, noise));
        Fit { one_sided: self.one_sidedness(cells), light, slivers: self.slivers() }
    }

    /// The mean of the cells around each corner, moved towards what keeps their values.
    pub fn fitted(&self, fit: &Fit, cells: &[Cell]) -> Vec<Bands> {
        let mut means = self.mean(cells);
        let allowed = |((bounds, one_sided), mean): ((Bounds, &f64), &Option<[f64; 3]>)| {
            bounds.widened(BEYOND * (1.0 + one_sided)).beside(mean.unwrap_or_default())
        };
        let around = self.around(cells).into_iter().zip(&fit.one_sided);
        let bounds: Vec<Bounds> = around.zip(&means).map(allowed).collect();
        for step in 0..MOVES {
            let missing = self.mean(&self.missing(&means, cells));
            for (number, (mean, missing)) in means.iter_mut().zip(missing).enumerate() {
                let first = if step == 0 { fit.one_sided[number] } else { 0.0 };
                let part = MOVED * fit.light[number].max(first);
                if let (Some(mean), Some(missing)) = (mean, missing) {
                    *mean = bounds[number].kept(std::array::from_fn(|band| mean[band] + part * missing[band]));
                }
            }
            self.equalize(&fit.slivers, &bounds, &mut means);
        }
        self.anchored(&means)
    }

    /// Makes the values on both sides of slivers equal: what the corner opposite to a cell's longest edge has more than the
    /// edge at its foot is taken from it by one half and added there by the other.
    fn equalize(&self, slivers: &[Sliver], bounds: &[Bounds], means: &mut [Option<[f64; 3]>]) {
        for _ in 0..EQUALIZED {
            for &([a, b, tip], foot) in slivers {
                let (Some(from), Some(to), Some(own)) = (means[a], means[b], means[tip]) else { continue };
                let more: [f64; 3] = std::array::from_fn(|k| own[k] - from[k] - foot * (to[k] - from[k]));
                let moved = |value: [f64; 3], share: f64| std::array::from_fn(|k| value[k] + share * more[k]);
                for (number, value) in
                    [(a, moved(from, 0.5 * (1.0 - foot))), (b, moved(to, 0.5 * foot)), (tip, moved(own, -0.5))]
                {
                    means[number] = Some(bounds[number].kept(value));
                }
            }
        }
    }

    /// The cells of slivers between much larger ones of the same plane.
    fn slivers(&self) -> Vec<Sliver> {
        let mut at_edge: FxHashMap<(u32, u32), [Option<usize>; 2]> = FxHashMap::default();
        for t in 0..self.division.len() {
            for e in 0..3 {
                let [first, last] = at_edge.entry(edge_key(self.mesh, t, e)).or_default();
                *(if first.is_none() { first } else { last }) = Some(t);
            }
        }
        let cell_area = |t: usize| self.mesh.area(t) / f64::from(self.division[t] * self.division[t]);
        let is_beside_larger = |t: usize, e: usize| {
            let other = at_edge[&edge_key(self.mesh, t, e)].into_iter().flatten().find(|s| *s != t);
            let on_plane = |s: &usize| self.mesh.normal(t).dot(self.mesh.normal(*s)) > FLAT;
            other.filter(on_plane).is_some_and(|s| cell_area(s) > LARGER * cell_area(t))
        };
        let mut slivers = Vec::new();
        for (t, side) in sides(self.elements, self.division.len()) {
            let corners = self.mesh.corners(t);
            let edge = |e: usize| corners[(e + 1) % 3] - corners[e];
            let e = (0..3)
                .fold(0, |e, other| if edge(other).length_squared() > edge(e).length_squared() { other } else { e });
            let [a, b, tip] = [e, (e + 1) % 3, (e + 2) % 3];
            let (along, up) = (edge(e), corners[tip] - corners[a]);
            let is_sliver = along.length_squared() > SLIVER * along.cross(up).length();
            let foot = (up.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            // The second longest is the one on which the foot does not lie.
            let second = if foot < 0.5 { b } else { tip };
            if is_sliver && is_beside_larger(t, e) && is_beside_larger(t, second) {
                let base = self.base[t][side as usize];
                for_each_cell(self.division[t], |_, around| {
                    let number =
                        |k: usize| self.number[base + corner(around[k].0, around[k].1, self.division[t])] as usize;
                    slivers.push(([a, b, tip].map(number), foot));
                });
            }
        }
        slivers
    }

    /// The value of every lattice corner: on the finer side of each edge the coarser side's interpolation.
    fn anchored(&self, values: &[Option<[f64; 3]>]) -> Vec<Bands> {
        let value = |Anchor { ends: [a, b], share }: &Anchor| {
            match [a, b].map(|end| values[*end as usize]) {
                [Some(a), Some(b)] => {
                    std::array::from_fn(|band| (a[band] + f64::from(*share) * (b[band] - a[band])) as f32)
                }
                // All around the other one is buried.
                [Some(own), None] | [None, Some(own)] => own.map(|v| v as f32),
                [None, None] => [0.0; 3],
            }
        };
        self.anchors.iter().map(value).collect()
    }
}

/// Between which numbers the value of a lattice corner lies, and where; both are its own where it is not interpolated.
#[derive(Clone, Copy)]
struct Anchor {
    ends: [u32; 2],
    share: f32,
}

/// How corners are fitted to cells: by number, how much these lie to one side of each, by which it is moved once, and the part of what
/// they miss that is light, by which it is moved each time; and the slivers.
pub(super) struct Fit {
    one_sided: Vec<f64>,
    light: Vec<f64>,
    slivers: Vec<Sliver>,
}

/// A cell of a sliver: the numbers of its corners, the one opposite to the longest edge last, and where on that edge its foot is.
type Sliver = ([usize; 3], f64);

/// The mean over a cell and what it weighs.
#[derive(Clone, Copy, Default)]
pub(super) struct Cell {
    weight: f64,
    pub value: [f64; 3],
}

impl Cell {
    /// The same with so much more in each band.
    pub fn with(&self, more: f32) -> Cell {
        Cell { value: self.value.map(|value| f64::from(value as f32 + more)), ..*self }
    }

    /// The means over the exposed part of each cell's elements.
    pub fn all(elements: &Elements, values: &[Bands], weight: &[f64]) -> Vec<Cell> {
        let cell = |cell: usize| {
            let mut mean = Cell::default();
            for element in elements.of_cell(cell).map(|e| e as usize) {
                let (weight, value) = (weight[element], values[element]);
                mean.weight += weight;
                (0..3).for_each(|band| mean.value[band] += weight * f64::from(value[band]));
            }
            if mean.weight > 0.0 {
                mean.value = mean.value.map(|v| v / mean.weight);
            }
            mean
        };
        (0..elements.cells()).map(cell).collect()
    }
}
