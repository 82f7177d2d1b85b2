//! Parts of a plane that are told by rays: grown as cells of a grid from a place within.

use glam::DVec3;
use std::collections::{HashMap, VecDeque};

/// Cells of one part at most.
const CELLS: usize = 512;

/// A cell is at most so many times as long as the coarsest are wide.
const LONGEST: f64 = 16.0;

/// A part is as many rectangles as it takes for none to have more than this share of it that is spread over what is not in it.
const UNEVEN: f64 = 0.02;

/// A part of a plane, by the cells of a grid that it has a share of.
#[derive(Clone, Debug)]
pub struct Grid {
    origin: DVec3,
    axes: [DVec3; 2],
    /// Of a cell, along the axes.
    widths: [f64; 2],
    /// Corners of a box around it.
    bounds: [DVec3; 2],
    /// In the order of `at`.
    cells: Vec<Cell>,
}

/// A cell of a grid.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    at: [i32; 2],
    /// What is within of it.
    pub share: f32,
    /// A place that is.
    pub point: DVec3,
}

/// A rectangle around some of a part.
#[derive(Clone, Debug)]
pub struct Rectangle {
    /// Counter-clockwise about the axis that the first two are right-handed with.
    pub corners: [DVec3; 4],
    /// The cells in it.
    pub cells: Vec<Cell>,
    /// How many it would take to fill it.
    pub count: f64,
}

/// What tells how far a part of a plane reaches.
pub(crate) trait Extent {
    /// A place of a cell that is within, if it seems to have one, seen from such a place of the cell beside it.
    fn glance(&self, grid: &Grid, at: [i32; 2], beside: DVec3) -> Option<DVec3>;

    /// How much of a cell is within, more than nothing; asked only where a place is.
    fn share(&self, grid: &Grid, at: [i32; 2]) -> f32;
}

impl Grid {
    /// One of square cells that are still to be found, about a place that is within.
    pub(crate) fn new(origin: DVec3, axes: [DVec3; 2], width: f64) -> Grid {
        Grid { origin, axes, widths: [width; 2], bounds: [origin; 2], cells: Vec::new() }
    }

    /// Finds its cells, made wider until they are few; `None` where they would be wider than `coarsest`, or one would be as long as many of these.
    pub(crate) fn grown(mut self, extent: &impl Extent, coarsest: f64) -> Option<Grid> {
        let from = self.origin;
        let longest = LONGEST * coarsest;
        while self.widths[0].min(self.widths[1]) <= coarsest && self.widths[0].max(self.widths[1]) <= longest {
            let start = self.at(from);
            let mut within = HashMap::from([(start, from)]);
            let mut next = VecDeque::from([start]);
            while let Some([i, j]) = next.pop_front()
                && within.len() <= CELLS
            {
                let beside = within[&[i, j]];
                for at in [[i + 1, j], [i - 1, j], [i, j + 1], [i, j - 1]] {
                    if !within.contains_key(&at)
                        && let Some(place) = extent.glance(&self, at, beside)
                    {
                        within.insert(at, place);
                        next.push_back(at);
                    }
                }
            }
            if within.len() <= CELLS {
                let cell = |(at, point)| Cell { at, share: extent.share(&self, at), point };
                self.cells = within.into_iter().map(cell).collect();
                self.cells.sort_unstable_by_key(|cell| cell.at);
                let boxes = (0..self.cells.len()).map(|cell| self.around(cell));
                self.bounds = boxes.fold([from; 2], |[low, high], [a, b]| [low.min(a), high.max(b)]);
                return Some(self);
            }
            // What is long has long cells: a slit would be lost between places that are spread over wide ones.
            let length = |axis: usize| {
                let (low, high) = within.keys().fold((0, 0), |(low, high), at| (at[axis].min(low), at[axis].max(high)));
                high - low
            };
            let axis = usize::from(length(1) > length(0));
            self.widths[axis] *= 2.0;
        }
        None
    }

    /// Its cells.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Of a cell, along the axes.
    pub(crate) fn widths(&self) -> [f64; 2] {
        self.widths
    }

    /// Area of a cell, m².
    pub fn area(&self) -> f64 {
        self.widths[0] * self.widths[1]
    }

    /// Area of what is within, m².
    pub fn area_within(&self) -> f64 {
        self.area() * self.cells.iter().map(|cell| f64::from(cell.share)).sum::<f64>()
    }

    /// Corners of a box around it.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// Memory that it takes beside itself, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.cells)
    }

    /// The number of the cell that a point of the plane lies in.
    pub fn cell(&self, point: DVec3) -> Option<usize> {
        let at = self.at(point);
        self.cells.binary_search_by_key(&at, |cell| cell.at).ok()
    }

    /// Whether a point of the plane lies in a cell or beside one.
    pub(crate) fn is_about(&self, point: DVec3) -> bool {
        let [i, j] = self.at(point);
        let around = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| [i, j]));
        around.into_iter().any(|at| self.cells.binary_search_by_key(&at, |cell| cell.at).is_ok())
    }

    /// Corners of a box around a cell.
    pub fn around(&self, cell: usize) -> [DVec3; 2] {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let [a, b, c, d] = corners.map(|[x, y]| self.point(cell, x, y));
        [a.min(b).min(c.min(d)), a.max(b).max(c.max(d))]
    }

    /// The point of a cell that (x, y) in the unit square tells.
    pub fn point(&self, cell: usize, x: f64, y: f64) -> DVec3 {
        self.within(self.cells[cell].at, x, y)
    }

    /// It as few rectangles, `most` at most. Those that are filled least evenly are cut first.
    pub fn rectangles(&self, most: usize) -> Vec<Rectangle> {
        let mut parts = vec![Part::new(self, self.cells.clone())];
        let all = self.area_within();
        while parts.len() < most
            && let Some(worst) = (0..parts.len()).max_by(|a, b| parts[*a].uneven.total_cmp(&parts[*b].uneven))
            && parts[worst].uneven > UNEVEN * all
        {
            let Part { cells, sides, .. } = parts.swap_remove(worst);
            let length = |axis: usize| self.widths[axis] * f64::from(sides[axis][1] - sides[axis][0]);
            let is_single = |axis: usize| sides[axis][1] - sides[axis][0] < 2;
            let axis = usize::from(is_single(0) || length(1) > length(0) && !is_single(1));
            let middle = sides[axis][0].midpoint(sides[axis][1]);
            let (low, high): (Vec<Cell>, Vec<Cell>) = cells.iter().partition(|cell| cell.at[axis] < middle);
            parts.extend([low, high].map(|cells| Part::new(self, cells)));
        }
        let rectangle = |Part { sides: [[left, right], [low, high]], count, cells, .. }: Part| {
            let corners = [[left, low], [right, low], [right, high], [left, high]];
            Rectangle { corners: corners.map(|at| self.within(at, 0.0, 0.0)), cells, count }
        };
        parts.into_iter().map(rectangle).collect()
    }

    fn at(&self, point: DVec3) -> [i32; 2] {
        [0, 1].map(|k| ((point - self.origin).dot(self.axes[k]) / self.widths[k]).floor() as i32)
    }

    pub(crate) fn within(&self, [i, j]: [i32; 2], x: f64, y: f64) -> DVec3 {
        let [along, across] = [0, 1].map(|k| self.widths[k] * self.axes[k]);
        self.origin + (f64::from(i) + x) * along + (f64::from(j) + y) * across
    }
}

/// Some cells of a grid, and the rectangle around them.
struct Part {
    cells: Vec<Cell>,
    /// The first cell along each axis, and the one after the last.
    sides: [[i32; 2]; 2],
    /// How many cells the rectangle has.
    count: f64,
    /// What is within of it, m², by how unlike it is to all of it; nothing of what cannot be cut.
    uneven: f64,
}

impl Part {
    fn new(grid: &Grid, cells: Vec<Cell>) -> Part {
        let sides = [0, 1].map(|axis| {
            let at = cells.iter().map(|cell| cell.at[axis]);
            [at.clone().min().unwrap_or(0), at.max().unwrap_or(0) + 1]
        });
        let count = sides.iter().map(|[low, high]| f64::from(high - low)).product::<f64>();
        let within: f64 = cells.iter().map(|cell| f64::from(cell.share)).sum();
        let uneven = if count > 1.0 { grid.area() * within * (1.0 - within / count) } else { 0.0 };
        Part { cells, sides, count, uneven }
    }
}
