//! Faces of a projection surface and what their cells weigh.
//!
//! A face is a window on a plane at distance 1 from the eye. The direction through (x, y) is p = (x, y, 1), its square
//! r² = 1 + x² + y², and a cell ΔA of the window stands for the vector v = ∫ p/r dω = ∫ p/r⁴ dA. A facet of normal m gives
//! off ΔF = m·v/π through it, whichever way the window is turned: for the top of a hemicube ΔA/(π(x² + y² + 1)²), for a side
//! y ΔA/(π(x² + y² + 1)²) (Cohen and Greenberg 1985; catalogue 23), and so on for the other surfaces.
//!
//! The integral has a closed form, so the weights of a whole hemisphere sum to one; the classic weights take the integrand
//! at the cell's centre and are off by n⁻² in sum. Cells that the horizon cuts weigh what their centre says of them:
//! everything or nothing.

use glam::DVec3;
use std::ops::Range;

/// What a cell weighs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weights {
    /// The integral over the cell.
    #[default]
    Exact,
    /// The integrand at the cell's centre, as published.
    Midpoint,
}

/// A window of cells on a plane at distance 1.
#[derive(Clone, Debug)]
pub(super) struct Face {
    /// Right, up and forward, in the frame of the projection surface.
    pub frame: [DVec3; 3],
    /// Left, right, lower and upper edge.
    pub window: [f64; 4],
    /// Columns and rows.
    pub cells: [usize; 2],
}

impl Face {
    /// Width and height of a cell.
    pub fn pitch(&self) -> [f64; 2] {
        let [left, right, low, high] = self.window;
        [(right - left) / self.cells[0] as f64, (high - low) / self.cells[1] as f64]
    }

    /// The direction through the centre of a cell, in the face's frame.
    pub fn centre(&self, column: usize, row: usize) -> DVec3 {
        let [width, height] = self.pitch();
        DVec3::new(self.window[0] + (column as f64 + 0.5) * width, self.window[2] + (row as f64 + 0.5) * height, 1.0)
    }

    /// The cell that a point in the face's frame is seen through.
    pub fn cell(&self, point: DVec3) -> Option<usize> {
        let [width, height] = self.pitch();
        let column = ((point.x / point.z - self.window[0]) / width).floor();
        let row = ((point.y / point.z - self.window[2]) / height).floor();
        let inside = |at: f64, len: usize| at >= 0.0 && at < len as f64;
        let is_seen = point.z > 0.0 && inside(column, self.cells[0]) && inside(row, self.cells[1]);
        is_seen.then(|| row as usize * self.cells[0] + column as usize)
    }

    /// What a block of cells weighs together, for a facet whose normal is `normal` in the frame of the projection surface and
    /// has the block above its horizon: the integral in closed form.
    pub fn weight_of_block(&self, [columns, rows]: [&Range<usize>; 2], normal: DVec3) -> f64 {
        let [width, height] = self.pitch();
        let x = |column: usize| self.window[0] + column as f64 * width;
        let y = |row: usize| self.window[2] + row as f64 * height;
        let side = |row: usize| antiderivative(x(columns.end), y(row)) - antiderivative(x(columns.start), y(row));
        let m = DVec3::from_array(self.frame.map(|axis| axis.dot(normal)));
        m.dot(side(rows.end) - side(rows.start)) / std::f64::consts::PI
    }

    /// v of every cell, rows from below.
    pub fn vectors(&self, weights: Weights) -> Vec<DVec3> {
        let [columns, rows] = self.cells;
        let [width, height] = self.pitch();
        if weights == Weights::Midpoint {
            let vector = |i: usize| {
                let p = self.centre(i % columns, i / columns);
                p * (width * height / p.length_squared().powi(2))
            };
            return (0..columns * rows).map(vector).collect();
        }
        let corner = |row: usize| -> Vec<DVec3> {
            let y = self.window[2] + row as f64 * height;
            (0..=columns).map(|column| antiderivative(self.window[0] + column as f64 * width, y)).collect()
        };
        let mut vectors = Vec::with_capacity(columns * rows);
        let mut below = corner(0);
        for row in 1..=rows {
            let above = corner(row);
            vectors.extend((0..columns).map(|c| (above[c + 1] - above[c]) - (below[c + 1] - below[c])));
            below = above;
        }
        vectors
    }

    /// What each cell weighs for a facet whose normal is `normal` in the frame of the projection surface; nothing where
    /// the centre lies on or below the horizon.
    pub fn weights(&self, vectors: &[DVec3], normal: DVec3) -> Vec<f64> {
        // Centres that should lie on the horizon are off it by a few units in the last place.
        const ON_HORIZON: f64 = 1e-12;
        let m = DVec3::from_array(self.frame.map(|axis| axis.dot(normal)));
        let weight = |(i, v): (usize, &DVec3)| {
            let above = m.dot(self.centre(i % self.cells[0], i / self.cells[0])) > ON_HORIZON;
            if above { (m.dot(*v) / std::f64::consts::PI).max(0.0) } else { 0.0 }
        };
        vectors.iter().enumerate().map(weight).collect()
    }
}

/// A function whose mixed second derivative in x and y is p/r⁴.
fn antiderivative(x: f64, y: f64) -> DVec3 {
    let (a, b) = (1.0 / (1.0 + x * x).sqrt(), 1.0 / (1.0 + y * y).sqrt());
    let (along_y, along_x) = ((y * a).atan(), (x * b).atan());
    0.5 * DVec3::new(-a * along_y, -b * along_x, x * a * along_y + y * b * along_x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_cells_are_what_many_midpoints_tend_to() {
        let whole = Face { frame: [DVec3::X, DVec3::Y, DVec3::Z], window: [-2.0, 1.0, 0.25, 0.75], cells: [1, 1] };
        let fine = Face { cells: [600, 100], ..whole.clone() };
        let exact = whole.vectors(Weights::Exact)[0];
        let sum: DVec3 = fine.vectors(Weights::Midpoint).into_iter().sum();
        assert!(exact.distance(sum) < 1e-5, "{exact} {sum}");
        let sum: DVec3 = fine.vectors(Weights::Exact).into_iter().sum();
        assert!(exact.distance(sum) < 1e-13, "{exact} {sum}");
    }
}
