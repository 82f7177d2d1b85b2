//! Space is cut by planes of walls, a cell at a time, while that lowers what the cells cost.
//!
//! A cell is convex. It holds the parts of the facets whose fronts look into it, the panels that stand in it or bound
//! it, and the openings that lead out of it. Of the planes of its panels those with most wall are tried, and the one is
//! taken that leaves the least (p₁ + q₁)² + (p₂ + q₂)².

use super::merge::Border;
use super::polygon::{Place, Plane, area, count};
use super::section::{Section, Space, section};
use crate::view_factors::{Planes, panels};
use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};
use rustc_hash::FxHashMap;
use std::borrow::Cow;

/// Planes whose openings are looked at before a cell is cut. The best of 4 cost 100 rooms no more than the best of 12;
/// halls with many shelves have more large planes that are not walls.
const TRIES: usize = 12;

/// Planes that are asked whether something is on both sides of them, before the search ends.
const LOOKS: usize = 96;

/// Cuts above a cell, at most: what keeps the time in bounds where facets make no rooms. 2^40 cells are never needed.
const DEPTH: usize = 40;

/// A part of a facet.
pub struct Piece<'a> {
    pub facet: u32,
    pub corners: Cow<'a, [DVec3]>,
}

/// A part of a panel, and the plane it lies in.
#[derive(Clone)]
struct Sheet<'a> {
    plane: u32,
    corners: Cow<'a, [DVec3]>,
}

/// A convex part of an opening.
pub struct Portal {
    pub corners: Vec<DVec3>,
    /// From the first of its cells to the second.
    pub normal: DVec3,
    /// Cells behind it and before it.
    pub cells: [u32; 2],
    /// The cut that made it.
    pub cut: u32,
    pub is_soft: bool,
}

/// A cell that is cut no further.
pub struct Leaf<'a> {
    pub id: u32,
    pub pieces: Vec<Piece<'a>>,
    pub panels: Vec<Vec<DVec3>>,
}

/// A cell that may be cut.
struct Cell<'a> {
    id: u32,
    /// Half-spaces n · x ≤ d that it is the intersection of.
    sides: Vec<Plane>,
    pieces: Vec<Piece<'a>>,
    sheets: Vec<Sheet<'a>>,
    portals: Vec<u32>,
}

/// All cells, and the openings between them.
pub struct Partition<'a> {
    pub leaves: Vec<Leaf<'a>>,
    pub portals: Vec<Portal>,
    /// Ids given to cells, cut ones among them.
    pub ids: u32,
}

impl Partition<'_> {
    /// The portals as borders of patches about `size` wide.
    pub fn borders(&self, size: f64) -> Vec<Border> {
        let border = |portal: &Portal| Border {
            cells: portal.cells,
            patches: count(&portal.corners, portal.normal, size),
            area: area(&portal.corners),
            is_soft: portal.is_soft,
        };
        self.portals.iter().map(border).collect()
    }
}

struct Cutter<'a> {
    enclosure: &'a Enclosure,
    space: &'a Space,
    planes: Planes,
    size: f64,
    most_open: f64,
    partition: Partition<'a>,
    /// The portals of cells that are not in hand: open ones and leaves.
    waiting: FxHashMap<u32, Vec<u32>>,
    cuts: u32,
}

/// Cuts the space of an enclosure. `size` is the width of patches, m; planes of which more than `most_open` is open are
/// no walls.
pub fn partition<'a>(enclosure: &'a Enclosure, space: &'a Space, size: f64, most_open: f64) -> Partition<'a> {
    let mut planes = Planes::new(space.bounds[0].distance(space.bounds[1]), space.touch);
    let sheets = panels(enclosure, &mut planes)
        .into_iter()
        .filter_map(|panel| {
            let plane = planes.find(&Facet::new(panel.corners.clone()).ok()?).0;
            Some(Sheet { plane, corners: Cow::Owned(panel.corners) })
        })
        .collect();
    let all = enclosure.facets.iter().enumerate();
    let pieces = all.map(|(i, f)| Piece { facet: i as u32, corners: Cow::Borrowed(f.corners()) }).collect();
    let mut cutter = Cutter {
        enclosure,
        space,
        planes,
        size,
        most_open,
        partition: Partition { leaves: Vec::new(), portals: Vec::new(), ids: 1 },
        waiting: FxHashMap::default(),
        cuts: 0,
    };
    cutter.waiting.insert(0, Vec::new());
    let mut open = vec![Cell { id: 0, sides: Vec::new(), pieces, sheets, portals: Vec::new() }];
    while let Some(mut cell) = open.pop() {
        cell.portals = cutter.waiting.get(&cell.id).cloned().unwrap_or_default();
        match cutter.choose(&cell) {
            Some((plane, section)) => open.extend(cutter.cut(cell, &plane, section)),
            None => {
                let panels = cell.sheets.into_iter().map(|sheet| sheet.corners.into_owned()).collect();
                cutter.partition.leaves.push(Leaf { id: cell.id, pieces: cell.pieces, panels });
            }
        }
    }
    cutter.partition
}

impl<'a> Cutter<'a> {
    /// Planes of a cell's panels, those with the most wall first.
    fn candidates(&self, cell: &Cell) -> Vec<Plane> {
        let mut walls: FxHashMap<u32, f64> = FxHashMap::default();
        for sheet in &cell.sheets {
            *walls.entry(sheet.plane).or_default() += area(&sheet.corners);
        }
        let mut walls: Vec<(u32, f64)> = walls.into_iter().collect();
        walls.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let plane = |(id, _)| {
            let (normal, offset) = self.planes.plane(id);
            Plane { normal, offset }
        };
        walls.into_iter().take(LOOKS).map(plane).collect()
    }

    /// The plane that lowers the cost of a cell most, and what it is there.
    fn choose(&self, cell: &Cell) -> Option<(Plane, Section)> {
        if cell.pieces.len() < 2 || cell.sides.len() >= DEPTH {
            return None;
        }
        let q: f64 = cell.portals.iter().map(|k| self.patches(&self.partition.portals[*k as usize].corners)).sum();
        let mut least = (cell.pieces.len() as f64 + q).powi(2);
        let mut best = None;
        let mut tries = 0;
        for plane in self.candidates(cell) {
            let Some([behind, before]) = self.elements(cell, &plane) else { continue };
            // Openings only add to what the two sides cost.
            if behind.powi(2) + before.powi(2) >= least {
                continue;
            }
            tries += 1;
            if tries > TRIES {
                break;
            }
            let sheets = cell.sheets.iter().map(|sheet| &*sheet.corners);
            let found = section(&plane, &cell.sides, sheets, self.space, self.most_open);
            if found.open > self.most_open * (found.open + found.wall) {
                continue;
            }
            let [q1, q2] = self.boundary(cell, &plane);
            let polygons = found.openings.iter().flat_map(|opening| &opening.polygons);
            let q: f64 = polygons.map(|polygon| count(polygon, plane.normal, self.size)).sum();
            let cost = (behind + q1 + q).powi(2) + (before + q2 + q).powi(2);
            if cost < least {
                least = cost;
                best = Some((plane, found));
            }
        }
        best
    }

    /// Elements behind a plane and before it; those across it count on both sides. `None` where a side has none.
    fn elements(&self, cell: &Cell, plane: &Plane) -> Option<[f64; 2]> {
        let mut sides = [0.0; 2];
        for piece in &cell.pieces {
            match self.place(piece, plane) {
                Place::Behind => sides[0] += 1.0,
                Place::Before => sides[1] += 1.0,
                _ => sides.iter_mut().for_each(|side| *side += 1.0),
            }
        }
        sides.iter().all(|side| *side > 0.0).then_some(sides)
    }

    /// Where a piece of a facet is; what lies in the plane belongs where its front looks.
    fn place(&self, piece: &Piece, plane: &Plane) -> Place {
        match plane.place(&piece.corners, self.space.touch) {
            Place::Within => match self.enclosure.facets[piece.facet as usize].normal().dot(plane.normal) > 0.0 {
                true => Place::Before,
                false => Place::Behind,
            },
            place => place,
        }
    }

    fn patches(&self, corners: &[DVec3]) -> f64 {
        let Some([a, b, c]) = corners.first_chunk() else { return 0.0 };
        count(corners, (*b - *a).cross(*c - *a).normalize_or_zero(), self.size)
    }

    /// Patches of a cell's boundary behind a plane and before it.
    fn boundary(&self, cell: &Cell, plane: &Plane) -> [f64; 2] {
        let mut sides = [0.0; 2];
        for portal in &cell.portals {
            let corners = &self.partition.portals[*portal as usize].corners;
            match plane.place(corners, self.space.touch) {
                Place::Behind => sides[0] += self.patches(corners),
                Place::Before | Place::Within => sides[1] += self.patches(corners),
                Place::Across => {
                    let parts = plane.split(corners, self.space.touch);
                    sides.iter_mut().zip(parts).for_each(|(side, part)| *side += self.patches(&part));
                }
            }
        }
        sides
    }

    /// Cuts a cell in two.
    fn cut(&mut self, cell: Cell<'a>, plane: &Plane, section: Section) -> [Cell<'a>; 2] {
        let ids = [self.partition.ids, self.partition.ids + 1];
        self.partition.ids += 2;
        self.waiting.remove(&cell.id);
        for id in ids {
            self.waiting.insert(id, Vec::new());
        }
        for portal in cell.portals {
            self.cut_portal(portal, cell.id, ids, plane);
        }
        for opening in section.openings {
            for corners in opening.polygons {
                let is_soft = opening.is_soft;
                self.add(Portal { corners, normal: plane.normal, cells: ids, cut: self.cuts, is_soft });
            }
        }
        self.cuts += 1;
        let mut pieces = [Vec::new(), Vec::new()];
        for piece in cell.pieces {
            self.cut_piece(piece, plane, &mut pieces);
        }
        let mut sheets = [Vec::new(), Vec::new()];
        for sheet in cell.sheets {
            self.cut_sheet(sheet, plane, &mut sheets);
        }
        let (mut behind, mut before) = (cell.sides.clone(), cell.sides);
        behind.push(*plane);
        before.push(Plane { normal: -plane.normal, offset: -plane.offset });
        let [pieces_behind, pieces_before] = pieces;
        let [sheets_behind, sheets_before] = sheets;
        let cell = |id, sides, pieces, sheets| Cell { id, sides, pieces, sheets, portals: Vec::new() };
        [cell(ids[1], before, pieces_before, sheets_before), cell(ids[0], behind, pieces_behind, sheets_behind)]
    }

    /// Adds a portal to its cells.
    fn add(&mut self, portal: Portal) {
        let id = self.partition.portals.len() as u32;
        for cell in portal.cells {
            self.waiting.entry(cell).or_default().push(id);
        }
        self.partition.portals.push(portal);
    }

    /// Hands a portal of a cell that is cut to its parts; where the plane goes through it, it becomes two.
    fn cut_portal(&mut self, id: u32, cell: u32, ids: [u32; 2], plane: &Plane) {
        let touch = self.space.touch;
        let portal = &mut self.partition.portals[id as usize];
        let side = usize::from(portal.cells[1] == cell);
        let place = plane.place(&portal.corners, touch);
        let half = usize::from(place != Place::Behind);
        if place != Place::Across {
            portal.cells[side] = ids[half];
            self.waiting.entry(ids[half]).or_default().push(id);
            return;
        }
        let [behind, before] = plane.split(&portal.corners, touch);
        let mut cells = portal.cells;
        let (normal, cut, is_soft) = (portal.normal, portal.cut, portal.is_soft);
        portal.corners = behind;
        portal.cells[side] = ids[0];
        self.waiting.entry(ids[0]).or_default().push(id);
        cells[side] = ids[1];
        self.add(Portal { corners: before, normal, cells, cut, is_soft });
    }

    /// Hands a piece of a facet to where it is, cut in two where the plane goes through it.
    fn cut_piece(&self, piece: Piece<'a>, plane: &Plane, sides: &mut [Vec<Piece<'a>>; 2]) {
        match self.place(&piece, plane) {
            Place::Behind => sides[0].push(piece),
            Place::Across => {
                let facet = &self.enclosure.facets[piece.facet as usize];
                let convex: Vec<Vec<DVec3>> = match &piece.corners {
                    Cow::Borrowed(_) if !facet.is_convex() => facet.triangles().iter().map(|t| t.to_vec()).collect(),
                    corners => vec![corners.to_vec()],
                };
                for corners in convex {
                    for (side, part) in sides.iter_mut().zip(plane.split(&corners, self.space.touch)) {
                        // What only touches the plane lies beyond it with no area.
                        if part.len() >= 3 && plane.place(&part, self.space.touch) != Place::Within {
                            side.push(Piece { facet: piece.facet, corners: Cow::Owned(part) });
                        }
                    }
                }
            }
            _ => sides[1].push(piece),
        }
    }

    /// Hands a panel to where it is: to both sides where it lies in the plane.
    fn cut_sheet(&self, sheet: Sheet<'a>, plane: &Plane, sides: &mut [Vec<Sheet<'a>>; 2]) {
        match plane.place(&sheet.corners, self.space.touch) {
            Place::Behind => sides[0].push(sheet),
            Place::Before => sides[1].push(sheet),
            Place::Within => {
                sides[0].push(sheet.clone());
                sides[1].push(sheet);
            }
            Place::Across => {
                let parts = plane.split(&sheet.corners, self.space.touch);
                for (side, part) in sides.iter_mut().zip(parts) {
                    if part.len() >= 3 {
                        side.push(Sheet { plane: sheet.plane, corners: Cow::Owned(part) });
                    }
                }
            }
        }
    }
}
