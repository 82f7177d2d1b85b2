//! Cells: what places tell of a piece of a polygon, and what they cannot.
//!
//! A cell (parallelogram or triangle) has the mean T of its corners and the value M at its centre. Where the function
//! is convex or concave in the cell, the integral lies between the two; their weighted mean, exact for quadratics, is
//! taken.
//!
//! Places tell nothing of what lies between them. So where all corners see the whole, the cell is judged as one: if it
//! is proven clear, nothing is hidden. Where one convex body hides all from each corner, it does so from all between.
//! What is left of either has a closed form. In others a shadow that no place saw counts as an error, by what it could
//! hide at most.
//!
//! Visible and hidden together have a closed form. Where places miss that, as they do between parts that touch or cross
//! each other, it is taken for each cell, and the places tell its visible share alone.

use super::clear::Exchange;
use super::frame::Frame;
use super::visible::Sight;
use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// Halvings of an edge on the grid; cells of two of its lines are divided no more, below what any accuracy needs.
pub const DEPTH: i32 = 12;

/// Least error by the difference of the corners where a shadow begins or ends in the cell. Where its edge halves a
/// cell, the mean of the corners is the value at the centre by symmetry, and neither is the mean.
const KINK: f64 = 0.03;

/// Error of a share by a lattice of places: by what it changed, and by the range and the deviation of theirs, over their number,
/// as the edge of a sharp shadow that sweeps over a cell lies anywhere between two of them. With 1, 0.1 and 0.55
/// the stated errors of 25 factors of a furnished room, asked for 1e-3, do not hold instead of 7.
const CHANGE: f64 = 1.5;
const RANGE: f64 = 0.2;
const DEVIATION: f64 = 0.9;

/// Least error of the pieces of a cell by what its division changed: kinks settle as the square of the width, so a
/// quarter of the change is left. After two divisions none is more than the larger of their changes: where the function
/// is smooth, T and M are far apart long after their mean has settled. One small change may be chance.
const LEFT: f64 = 0.25;

/// The whole by this much less certain than its pieces: no division has told how its places mislead.
const UNDIVIDED: f64 = 2.0;

/// Error of what places did not see hidden, by what might be at most.
const DOUBT: f64 = 0.25;

/// The same of what they did not see visible, by all that there is; a sixteenth with each division.
const GAP: f64 = 0.1;

/// What may be is no more than this times the most that a place saw.
const MORE: f64 = 4.0;

/// Least error of a share by what places miss of all.
const UNKNOWN: f64 = 0.25;

/// Panels that may matter, by index.
pub type List = SmallVec<[u16; 16]>;

/// What is integrated: by places, and by cells.
pub trait Shaded {
    /// What of all is seen from a place on a side, past the panels listed.
    fn sight(&mut self, side: u16, place: DVec3, list: &[u16]) -> Sight;

    /// Visible and hidden together, from a place.
    fn all(&mut self, place: DVec3) -> f64;

    /// Which of the panels listed may hide something from a cell.
    fn before(&mut self, corners: &[DVec3], list: &[u16]) -> List;

    /// Whether nothing is hidden from any of a cell, which it is not from its corners.
    fn is_clear(&mut self, corners: &[DVec3], list: &[u16]) -> bool;

    /// The most that the panels listed might hide from the centre of a cell, seen from any of its places; but for those of
    /// some bodies, as bits.
    fn possible(&mut self, corners: &[DVec3], list: &[u16], without: u64) -> f64;

    /// Visible and hidden together, over a cell.
    fn whole(&mut self, cell: &Frame) -> Exchange;

    /// Whether all that reaches some corner of the polygon is next to nothing by what reaches others.
    fn is_steep(&self) -> bool;
}

/// A piece of the polygon.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// The piece.
    pub frame: Frame,
    /// Pieces of one side see the same bodies from the same side.
    pub side: u16,
}

/// A cell: its corners on a grid of 2^[`DEPTH`] along the edges of a piece. As all is known that reaches it, what is
/// visible and what is hidden have one error.
#[derive(Clone, Debug)]
pub struct Cell {
    piece: usize,
    /// Least corner; of a triangle that stands on its head the greatest.
    at: [i32; 2],
    /// Length of an edge, negative for a triangle on its head.
    size: i32,
    /// What is visible, and what is hidden.
    pub values: [f64; 2],
    error: f64,
    /// What places cannot tell: no division above says anything about it.
    doubt: f64,
    /// What the divisions above it changed, a sixteenth by level: a quarter for its share of them, and one for the
    /// width.
    changed: f64,
    /// Least error where a shadow begins or ends.
    least: f64,
    /// Panels that may hide a part; none where all is proven.
    before: Option<List>,
}

impl Cell {
    /// Estimate of the error of either value.
    pub fn error(&self) -> f64 {
        self.error + self.doubt
    }

    /// Whether all is proven to be hidden.
    pub fn is_hidden(&self) -> bool {
        self.before.is_none() && self.values[0] == 0.0
    }

    /// Whether its division would tell more.
    pub fn is_open(&self) -> bool {
        self.before.is_some() && self.size.abs() > 2
    }

    fn is_undivided(&self) -> bool {
        self.size.abs() == 1 << DEPTH
    }
}

/// What a place sees: visible and hidden, the bodies that hide, as bits, and how they do, as a hash.
#[derive(Clone, Copy, Default)]
pub struct Place {
    pub factors: [f64; 2],
    pub bodies: u64,
    pub how: u64,
}

/// What hides all, as a hash.
pub const ALL: u64 = u64::MAX;

impl Place {
    pub fn all(&self) -> f64 {
        self.factors[0] + self.factors[1]
    }

    /// Share of all that is visible, or `usual` if there is nothing.
    fn share(&self, usual: f64) -> f64 {
        let all = self.all();
        if all > 0.0 { self.factors[0] / all } else { usual }
    }
}

/// What the places of a cell see.
pub struct Places {
    pub corners: SmallVec<[Place; 4]>,
    pub centre: Place,
}

/// What they tell: what is visible and what is hidden, their error, what is to be added to it, and the least error.
pub struct Told {
    pub values: [f64; 2],
    pub error: f64,
    pub doubt: f64,
    pub least: f64,
}

impl Places {
    /// Mean of the corners, and of all with weights that are exact for quadratics.
    fn means(&self, f: impl Fn(&Place) -> f64) -> (f64, f64) {
        let rim = self.corners.iter().map(&f).sum::<f64>() / self.corners.len() as f64;
        let weight = if self.corners.len() == 4 { 2.0 / 3.0 } else { 0.75 };
        (rim, rim + weight * (f(&self.centre) - rim))
    }

    /// How far the corners are apart.
    fn range(&self, f: impl Fn(&Place) -> f64) -> f64 {
        let (low, high) =
            self.corners.iter().map(f).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high - low
    }

    /// The most that any place sees.
    fn most(&self, f: impl Fn(&Place) -> f64) -> f64 {
        self.corners.iter().chain([&self.centre]).map(f).fold(0.0, f64::max)
    }

    /// Whether some places see a shadow and others not: it begins or ends between them.
    fn is_bent(&self) -> bool {
        self.corners.iter().any(|c| c.how != self.centre.how)
    }

    /// What places tell of a cell, of which all that is visible and hidden may be known.
    pub fn tell(&self, area: f64, known: Option<Exchange>, is_undivided: bool) -> Told {
        let seen = [0, 1].map(|k| area * self.means(|p| p.factors[k]).1);
        let (all, share) = (seen[0] + seen[1], share(seen));
        let mut bend = if self.is_bent() { KINK } else { 0.0 };
        let (mut values, mut doubt) = (seen, 0.0);
        if let Some(Exchange { value: whole, error }) = known {
            // The closed form, of which the places tell the share.
            values = [share * whole, (1.0 - share) * whole];
            doubt = error + (whole - all).abs() * (UNKNOWN + share.min(1.0 - share));
            // Where all changes from place to place, its share is no plain mean.
            let high = self.corners.iter().map(Place::all).fold(0.0, f64::max);
            bend = bend.max(KINK * if high > 0.0 { self.range(Place::all) / high } else { 1.0 });
        }
        let least = bend * (values[0] + values[1]) * self.range(|p| p.share(share));
        // What is known of both together is taken off what places tell.
        let off = |p: &Place| p.factors[0] - share * p.all();
        let times = if is_undivided { UNDIVIDED } else { 1.0 };
        let error = times * (area * (off(&self.centre) - self.means(off).0).abs() / 3.0).max(least);
        Told { values, error, doubt, least }
    }

    /// What the centre and others, which are a lattice with it, tell of a cell of which all that is visible and hidden is known:
    /// the share that is visible, and the error of that, where `before` is what fewer places told.
    pub fn share_by(&self, others: &[Place], before: f64) -> (f64, f64) {
        let places = || others.iter().chain([&self.centre]);
        let n = 1.0 + others.len() as f64;
        let (visible, all) = places().fold((0.0, 0.0), |(v, a), p| (v + p.factors[0], a + p.all()));
        let share = if all > 0.0 { (visible / all).clamp(0.0, 1.0) } else { 0.5 };
        let (mut low, mut high, mut squares) = (1.0f64, 0.0f64, 0.0);
        for off in places().map(|p| p.share(share) - share) {
            (low, high, squares) = (low.min(off), high.max(off), squares + off * off);
        }
        for off in self.corners.iter().map(|p| p.share(share) - share) {
            (low, high) = (low.min(off), high.max(off));
        }
        let spread = RANGE * (high - low) + DEVIATION * (squares / n).sqrt();
        (share, CHANGE * (share - before).abs() + spread / n)
    }

    /// The share that is visible.
    pub fn share(&self) -> f64 {
        share([0, 1].map(|k| self.means(|p| p.factors[k]).1))
    }

    /// An error of the share that a lattice of five is hardly below.
    pub fn least_error(&self) -> f64 {
        let shares = || self.corners.iter().chain([&self.centre]).map(|p| p.share(0.5));
        let (low, high) = shares().fold((1.0f64, 0.0f64), |(low, high), share| (low.min(share), high.max(share)));
        (RANGE + 0.4 * DEVIATION) / 5.0 * (high - low)
    }

    /// What all places of a lattice tell of both together that is off by `missed`.
    pub fn unknown(missed: f64, share: f64) -> f64 {
        missed * (UNKNOWN + share.min(1.0 - share))
    }

    /// Error by what no place may have seen, in a cell as wide as `level` of the polygon; `possible` is the most that might be
    /// hidden but by some bodies.
    pub fn doubt(&self, values: [f64; 2], area: f64, level: f64, possible: impl FnOnce(u64) -> f64) -> f64 {
        let (seen, hidden) = (self.most(|p| p.factors[0]), self.most(|p| p.factors[1]));
        let all = values[0] + values[1];
        let gap = GAP * all * level.powi(4) * (1.0 - MORE * seen / (seen + hidden)).max(0.0);
        if MORE * hidden >= seen + hidden {
            return gap;
        }
        // Where all places see shadows fall alike, those bodies hide nothing else.
        let known = if self.is_bent() { 0 } else { self.centre.bodies };
        gap + DOUBT * (area * (possible(known) - MORE * hidden)).clamp(0.0, values[0])
    }
}

/// The bit of a body; of more than 64 some share one.
pub fn bit(body: u16) -> u64 {
    1 << (body % 64)
}

/// The share of both that is visible.
fn share([visible, hidden]: [f64; 2]) -> f64 {
    if visible + hidden > 0.0 { (visible / (visible + hidden)).clamp(0.0, 1.0) } else { 0.5 }
}

/// What was seen from corners of cells: by the side and the place, on a grid so fine that only rounding is forgiven. Cells
/// share corners, and so do polygons side by side, of whatever sizes.
#[derive(Default)]
pub struct Sights {
    seen: FxHashMap<(u16, [u64; 3]), Sight>,
    from: DVec3,
    /// Lines of the grid in a metre.
    grid: f64,
}

/// Lines of the grid along the extent of the region.
const LINES: f64 = 1e10;

/// Sights for which memory is kept; to clear more takes longer than to ask for it anew.
const KEPT: usize = 1024;

impl Sights {
    /// Forgets all, and lays the grid over a region.
    pub fn clear(&mut self, region: &[DVec3]) {
        if self.seen.capacity() > 2 * KEPT {
            self.seen = FxHashMap::default();
        }
        self.seen.clear();
        self.from = region[0];
        let extent = region.iter().map(|p| p.distance(region[0])).fold(f64::MIN_POSITIVE, f64::max);
        self.grid = LINES / extent;
    }

    /// The nearest point of the grid, as the bits of its coordinates: beyond 2⁵² numbers are whole.
    fn place(&self, place: DVec3) -> [u64; 3] {
        const WHOLE: f64 = 1.5 * (1u64 << 52) as f64;
        ((place - self.from) * self.grid).to_array().map(|x| (x + WHOLE).to_bits())
    }
}

/// A polygon as pieces, and what was seen so far.
pub struct Domain<'a, S> {
    pieces: &'a [Piece],
    shaded: &'a mut S,
    sights: &'a mut Sights,
    /// Whether cells take the closed form of all that they see.
    is_known: bool,
    /// Error above which cells are of no use, and nobody need ask what their places may have overlooked.
    pub limit: f64,
}

impl<'a, S: Shaded> Domain<'a, S> {
    pub fn new(pieces: &'a [Piece], shaded: &'a mut S, sights: &'a mut Sights) -> Self {
        Domain { pieces, shaded, sights, is_known: false, limit: f64::INFINITY }
    }

    /// The cells that together are all of it, past the panels listed; with `is_known` they take the closed form of all.
    pub fn whole(&mut self, list: &[u16], is_known: bool) -> Vec<Cell> {
        self.is_known = is_known;
        (0..self.pieces.len()).map(|piece| self.cell(piece, [0, 0], 1 << DEPTH, list)).collect()
    }

    /// The four cells that a cell consists of.
    pub fn divided(&mut self, cell: &Cell) -> [Cell; 4] {
        let ([x, y], half) = (cell.at, cell.size / 2);
        let is_square = self.pieces[cell.piece].frame.is_square;
        let list = cell.before.as_deref().unwrap_or(&[]);
        let list = self.shaded.before(&self.shape(cell).corners(), list);
        let last = if is_square { half } else { -half };
        let mut pieces = [([x, y], half), ([x + half, y], half), ([x, y + half], half), ([x + half, y + half], last)]
            .map(|(at, size)| self.cell(cell.piece, at, size, &list));
        let [visible, hidden] = [0, 1].map(|k| pieces.iter().map(|p| p.values[k]).sum::<f64>() - cell.values[k]);
        let share = share(cell.values);
        let change = ((1.0 - share) * visible - share * hidden).abs();
        let changed = change.max(cell.changed / 16.0);
        let most = if cell.is_undivided() { f64::INFINITY } else { changed };
        for piece in &mut pieces {
            if piece.before.is_some() {
                piece.error = piece.error.clamp(0.25 * LEFT * change, most).max(piece.least);
            }
            piece.changed = changed;
        }
        pieces
    }

    fn shape(&self, cell: &Cell) -> Frame {
        let frame = &self.pieces[cell.piece].frame;
        let scale = 1.0 / f64::from(1 << DEPTH);
        let [x, y] = cell.at.map(|x| scale * f64::from(x));
        let edges = frame.edges.map(|edge| scale * f64::from(cell.size) * edge);
        Frame { origin: frame.place(x, y), edges, is_square: frame.is_square }
    }

    fn corner(&mut self, side: u16, place: DVec3, list: &[u16]) -> Sight {
        let on_grid = self.sights.place(place);
        *self.sights.seen.entry((side, on_grid)).or_insert_with(|| self.shaded.sight(side, place, list))
    }

    /// A cell of one past the panels listed.
    fn cell(&mut self, piece: usize, at: [i32; 2], size: i32, list: &[u16]) -> Cell {
        let [error, doubt, changed, least] = [0.0; 4];
        let cell = Cell { piece, at, size, values: [0.0; 2], error, doubt, changed, least, before: None };
        let (shape, side) = (self.shape(&cell), self.pieces[piece].side);
        let corners = shape.corners();
        let sights: SmallVec<[Sight; 4]> = corners.iter().map(|place| self.corner(side, *place, list)).collect();
        let is_nothing = |by: u16| sights.iter().all(|s| matches!(s, Sight::Nothing(other) if *other == by));
        match sights[0] {
            Sight::Nothing(by) if is_nothing(by) => return self.settled(cell, &shape, 1),
            _ if sights.iter().all(|s| matches!(s, Sight::Whole)) && self.shaded.is_clear(&corners, list) => {
                return self.settled(cell, &shape, 0);
            }
            _ => {}
        }
        let centre = shape.centre();
        let of_centre = self.shaded.sight(side, centre, list);
        let places = Places {
            corners: sights.into_iter().zip(&corners).map(|(sight, place)| self.place(sight, *place)).collect(),
            centre: self.place(of_centre, centre),
        };
        self.estimate(Cell { before: Some(list.into()), ..cell }, &shape, &places)
    }

    /// A cell of which all is proven to be visible (0) or hidden (1).
    fn settled(&mut self, mut cell: Cell, shape: &Frame, k: usize) -> Cell {
        let Exchange { value, error } = self.shaded.whole(shape);
        (cell.values[k], cell.error) = (value, if k == 0 { error } else { 0.0 });
        cell
    }

    fn place(&mut self, sight: Sight, place: DVec3) -> Place {
        match sight {
            Sight::Whole => Place { factors: [self.shaded.all(place), 0.0], bodies: 0, how: 0 },
            Sight::Nothing(by) => Place { factors: [0.0, self.shaded.all(place)], bodies: bit(by), how: ALL },
            Sight::Partly { factors, bodies, how } => Place { factors, bodies, how },
        }
    }

    /// What places tell of a cell.
    fn estimate(&mut self, mut cell: Cell, shape: &Frame, places: &Places) -> Cell {
        let area = shape.area();
        let known = self.is_known.then(|| self.shaded.whole(shape));
        let told = places.tell(area, known, cell.is_undivided());
        (cell.values, cell.error, cell.doubt, cell.least) = (told.values, told.error, told.doubt, told.least);
        if cell.error <= self.limit {
            let level = f64::from(cell.size.abs()) / f64::from(1 << DEPTH);
            let list = cell.before.as_deref().unwrap_or(&[]);
            let possible = |bodies| self.shaded.possible(&shape.corners(), list, bodies);
            cell.doubt += places.doubt(told.values, area, level, possible);
        }
        cell
    }
}
