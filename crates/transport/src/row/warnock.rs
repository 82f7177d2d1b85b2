//! What a face shows, by dividing it where polygons differ (Warnock 1969, "A hidden surface algorithm for computer generated
//! halftone pictures"; as Sillion and Puech 1989 divide their plane; catalogue 25).
//!
//! A window in which no polygon lies, or in front of all others one that covers it whole, is done; others are quartered,
//! down to single cells, which are asked as the item buffer asks them. All questions are about cell centres: what holds of
//! the four outermost of a window holds of all between them, as polygons are convex and reciprocal depth is linear. Answers that
//! rounding could turn are no answers: the window is divided. So every cell shows what it shows in the buffer. It pays where
//! polygons are larger than cells: windows are then as many as there are cells along edges, which grow with n and not n².

use super::face::Face;
use super::scan::{NONE, Scan, Scans};
use std::ops::Range;

/// Margin within which signs are not trusted, relative to the sum of the terms: rounding is 1e-15 of it, a cell 1e-4.
const DOUBTFUL: f64 = 1e-12;

/// How much looking a row takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LookUps {
    /// Cells or windows for which it was found what they show.
    pub places: u64,
    /// Questions whether, and how near, a polygon lies in one of them; of cells those that it covers: no others are asked.
    pub tests: u64,
}

/// Cells that show one polygon.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    /// Which; [`NONE`] if they show none.
    scan: u32,
}

/// A polygon that lies in a window.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    scan: u32,
    covers: bool,
    /// Reciprocal depth at the outermost centres, and what it may be off by.
    nearness: [f64; 4],
    off: f64,
}

impl Candidate {
    fn hides(&self, other: &Candidate) -> bool {
        let off = self.off + other.off;
        self.covers && self.nearness.iter().zip(other.nearness).all(|(own, other)| *own > other + off)
    }
}

/// The windows of a face.
#[derive(Clone, Debug, Default)]
pub(super) struct Windows {
    /// Together all cells, none twice.
    pub blocks: Vec<Block>,
    /// Polygons of the windows that are being divided, each inside the one before.
    candidates: Vec<Candidate>,
}

impl Windows {
    /// Divides a face.
    pub fn divide(&mut self, face: &Face, scans: &Scans, account: &mut LookUps) {
        self.blocks.clear();
        self.candidates.clear();
        let all =
            (0..scans.list.len() as u32).map(|scan| Candidate { scan, covers: false, nearness: [0.0; 4], off: 0.0 });
        self.candidates.extend(all);
        let whole = Block { columns: 0..face.cells[0], rows: 0..face.cells[1], scan: NONE };
        self.window((face, scans), whole, 0..scans.list.len(), account);
    }

    /// Writes down which polygon each cell shows.
    pub fn show(&self, face: &Face, shown: &mut Vec<u32>) {
        shown.resize(face.cells[0] * face.cells[1], NONE);
        for block in &self.blocks {
            for row in block.rows.clone() {
                shown[row * face.cells[0]..][block.columns.clone()].fill(block.scan);
            }
        }
    }

    fn window(&mut self, seen: (&Face, &Scans), mut window: Block, among: Range<usize>, account: &mut LookUps) {
        account.places += 1;
        account.tests += among.len() as u64;
        if window.columns.len() * window.rows.len() == 1 {
            window.scan = self.nearest(seen, [window.columns.start, window.rows.start], among);
            self.blocks.push(window);
            return;
        }
        // What lies in the window, less what is hidden by the nearest of those that cover it.
        let start = self.candidates.len();
        for index in among {
            let scan = self.candidates[index].scan;
            self.candidates.extend(look(seen, scan, &window));
        }
        let total = |c: &Candidate| c.nearness.iter().sum::<f64>();
        let covering = self.candidates[start..].iter().filter(|c| c.covers);
        if let Some(front) = covering.max_by(|a, b| total(a).total_cmp(&total(b))).copied() {
            let mut kept = start;
            for index in start..self.candidates.len() {
                if !front.hides(&self.candidates[index]) {
                    self.candidates.swap(kept, index);
                    kept += 1;
                }
            }
            self.candidates.truncate(kept);
        }
        let among = start..self.candidates.len();
        match &self.candidates[start..] {
            [] => self.blocks.push(window),
            [only] if only.covers => {
                window.scan = only.scan;
                self.blocks.push(window);
            }
            _ => {
                for rows in halves(&window.rows) {
                    for columns in halves(&window.columns) {
                        let quarter = Block { columns, rows: rows.clone(), scan: NONE };
                        self.window(seen, quarter, among.clone(), account);
                    }
                }
            }
        }
        self.candidates.truncate(start);
    }

    /// The polygon that a cell shows: the nearest that covers its centre, of equal ones the first.
    fn nearest(&self, (face, scans): (&Face, &Scans), [column, row]: [usize; 2], among: Range<usize>) -> u32 {
        let (mut nearest, mut shown) = (0.0, NONE);
        for Candidate { scan: index, .. } in &self.candidates[among] {
            let scan = &scans.list[*index as usize];
            let covers = |span: [usize; 2]| (span[0]..=span[1]).contains(&column);
            let [start, step] = scan.nearness(face, row);
            let nearness = start + step * column as f64;
            if nearness > nearest && scan.span(&scans.edges, face, row).is_some_and(covers) {
                (nearest, shown) = (nearness, *index);
            }
        }
        shown
    }
}

/// Both halves of what is more than one, else the one.
fn halves(range: &Range<usize>) -> impl Iterator<Item = Range<usize>> + use<> {
    let middle = range.start + range.len().div_ceil(2);
    [range.start..middle, middle..range.end].into_iter().filter(|half| !half.is_empty())
}

/// How a polygon lies in a window; nothing if it surely covers no centre.
fn look((face, scans): (&Face, &Scans), index: u32, window: &Block) -> Option<Candidate> {
    let scan: &Scan = &scans.list[index as usize];
    let at = |column: usize, row: usize| face.centre(column, row);
    let ([left, right], [low, high]) =
        ([window.columns.start, window.columns.end - 1], [window.rows.start, window.rows.end - 1]);
    if high < scan.rows.start || low >= scan.rows.end {
        return None;
    }
    let corners = [at(left, low), at(right, low), at(left, high), at(right, high)];
    let most = corners[0].abs().max(corners[3].abs());
    let mut covers = low >= scan.rows.start && high < scan.rows.end;
    for edge in &scans.edges[scan.edges.clone()] {
        let margin = DOUBTFUL * edge.abs().dot(most);
        let inside = corners.map(|corner| edge.dot(corner));
        if inside.iter().all(|x| *x < -margin) {
            return None;
        }
        covers &= inside.iter().all(|x| *x > margin);
    }
    let off = DOUBTFUL * scan.plane.abs().dot(most);
    Some(Candidate { scan: index, covers, nearness: corners.map(|corner| scan.plane.dot(corner)), off })
}
