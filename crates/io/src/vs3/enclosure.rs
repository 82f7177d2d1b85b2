//! From single surfaces to an enclosure: what lies upon a base is cut out of it, parts are combined.

use super::cut::{Cut, cut};
use super::report::Report;
use super::surface::{Kind, Surface};
use radiosity_scene::{Enclosure, EnclosureSurface, Facet, counted};
use rustc_hash::{FxHashMap, FxHashSet};

/// Distance from its base, and out of it, at which a subsurface is still in it, relative to the base's radius: what
/// coordinates of six digits leave. View3D allows as much off the plane.
const WITHIN: f64 = 1e-5;

/// Least cosine between directions that are one. View3D's.
const ALIKE: f64 = 0.999;

/// Most surfaces upon one base. Cutting takes time with the square of their number: a tenth of a second for this many, hours
/// for a hostile file without a bound.
const MAX_UPON_ONE: usize = 1024;

/// A masking surface: it covers a part of its base, faces it at no distance, and sees nothing else.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// Its name.
    pub name: String,
    /// Its number in the file.
    pub number: u32,
    /// Its emittance.
    pub emittance: f64,
    /// Its area, and that of the base which it covers, m².
    pub area: f64,
    /// The surface of the enclosure that it covers a part of.
    pub base: usize,
    /// Its row where the masks stand among the other surfaces in the order of the file.
    pub row: usize,
}

/// A surface of the file that has no row of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rowless {
    /// Its number in the file.
    pub number: u32,
    /// Its name.
    pub name: String,
    /// Why.
    pub why: NoRow,
}

/// Why a surface has no row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoRow {
    /// It only stands in the way.
    Obstruction,
    /// A null surface: what it covers of its base, the surface of the enclosure, is no part of that and lets nothing
    /// through.
    Null(usize),
    /// It is combined with a surface of the enclosure.
    Part(usize),
}

/// What the surfaces make.
#[derive(Debug, Default)]
pub(super) struct Built {
    pub enclosure: Enclosure,
    pub numbers: Vec<u32>,
    pub masks: Vec<Mask>,
    pub rowless: Vec<Rowless>,
}

/// Makes an enclosure of surfaces, as far as they are right. Of the numbers in `unreadable` there are lines with errors.
pub(super) fn build(surfaces: &[Surface], unreadable: &FxHashSet<u32>, report: &mut Report) -> Built {
    let at = positions(surfaces, report);
    let bases = bases(surfaces, &at, unreadable, report);
    let wholes = wholes(surfaces, &at, unreadable, report);
    let mut upon: Vec<Vec<usize>> = vec![Vec::new(); surfaces.len()];
    for (i, base) in bases.iter().enumerate() {
        if let Some(base) = base {
            upon[*base].push(i);
        }
    }
    let mut pieces: Vec<Vec<Facet>> = Vec::with_capacity(surfaces.len());
    for (surface, upon) in surfaces.iter().zip(&upon) {
        pieces.push(without(surface, upon, surfaces, report));
    }

    // The rows: every radiating surface that is not a part of another, and the masks, in the order of the file.
    let mut built = Built::default();
    let mut index_of: Vec<Option<usize>> = vec![None; surfaces.len()];
    let mut row = 0;
    for (i, surface) in surfaces.iter().enumerate() {
        let Surface { kind, number, emittance, name, .. } = surface;
        if *kind == Kind::Radiating && surface.combine == 0 {
            index_of[i] = Some(built.numbers.len());
            built.numbers.push(*number);
            let emittance = Some(*emittance);
            built.enclosure.surfaces.push(EnclosureSurface { name: name.clone(), emittance });
            row += 1;
        } else if *kind == Kind::Mask {
            let (name, area) = (name.clone(), surface.facet.area());
            built.masks.push(Mask { name, number: *number, emittance: *emittance, area, base: i, row });
            row += 1;
        }
    }
    let surface_of = |i: usize| index_of[wholes[i].unwrap_or(i)];
    for mask in &mut built.masks {
        mask.base = bases[mask.base].and_then(surface_of).unwrap_or_default();
    }
    for (i, Surface { kind, number, name, .. }) in surfaces.iter().enumerate() {
        let why = match kind {
            Kind::Obstruction => NoRow::Obstruction,
            Kind::Null => NoRow::Null(bases[i].and_then(surface_of).unwrap_or_default()),
            Kind::Radiating if index_of[i].is_none() => NoRow::Part(surface_of(i).unwrap_or_default()),
            Kind::Radiating | Kind::Mask => continue,
        };
        built.rowless.push(Rowless { number: *number, name: name.clone(), why });
    }
    for (i, (surface, pieces)) in surfaces.iter().zip(pieces).enumerate() {
        if surface.kind == Kind::Radiating {
            let Some(index) = surface_of(i) else { continue };
            built.enclosure.surface_of.extend(pieces.iter().map(|_| index as u32));
            built.enclosure.facets.extend(pieces);
        } else {
            // A mask or null surface lets nothing through either: in View3D its base blocks the whole of its outline.
            built.enclosure.obstructions.extend(pieces);
        }
    }
    if !report.has_errors() {
        let areas = built.enclosure.surface_areas();
        for (i, surface) in surfaces.iter().enumerate() {
            if index_of[i].is_some_and(|index| areas[index] == 0.0) {
                let what = format!("nothing is left of surface {}", surface.number);
                report.error(surface.line, what, "make it an obstruction (O), or leave a part of it uncovered");
            }
        }
    }
    built
}

/// The position of each number in the list. Numbers must differ.
fn positions(surfaces: &[Surface], report: &mut Report) -> FxHashMap<u32, usize> {
    let mut at: FxHashMap<u32, usize> = FxHashMap::default();
    let mut in_order = true;
    for (i, surface) in surfaces.iter().enumerate() {
        if let Some(first) = at.get(&surface.number) {
            let what = format!("surface {} is there already, in line {}", surface.number, surfaces[*first].line);
            report.error(surface.line, what, "give each surface a number of its own");
            continue;
        }
        at.insert(surface.number, i);
        if in_order && surface.number as usize != i + 1 && !report.has_errors() {
            in_order = false;
            report.warning(surface.line, "surfaces are not numbered 1, 2, 3 …", "View3D itself refuses that");
        }
    }
    at
}

/// The base of each surface that lies upon one.
fn bases(
    surfaces: &[Surface],
    at: &FxHashMap<u32, usize>,
    unreadable: &FxHashSet<u32>,
    report: &mut Report,
) -> Vec<Option<usize>> {
    let mut bases = Vec::with_capacity(surfaces.len());
    for (i, surface) in surfaces.iter().enumerate() {
        if unreadable.contains(&surface.base) && !at.contains_key(&surface.base) {
            bases.push(None);
            continue;
        }
        let found = base(i, surfaces, at);
        if let Err((what, hint)) = &found {
            report.error(surface.line, what, *hint);
        }
        bases.push(found.unwrap_or_default());
    }
    bases
}

fn base(i: usize, surfaces: &[Surface], at: &FxHashMap<u32, usize>) -> Result<Option<usize>, (String, &'static str)> {
    let Surface { kind, number, base, facet, .. } = &surfaces[i];
    if *base == 0 {
        return match kind {
            Kind::Mask | Kind::Null => {
                Err((format!("{} {number} has no base", kind.word()), "name the surface that it covers a part of"))
            }
            _ => Ok(None),
        };
    }
    let Some(&found) = at.get(base) else {
        return Err((format!("there is no surface {base} for the base"), "correct the number, or 0 for none"));
    };
    let below = &surfaces[found];
    let may_be = below.kind == Kind::Radiating || (below.kind == Kind::Obstruction && *kind == Kind::Radiating);
    if !may_be {
        let what = format!("{} {number} lies upon {} {base}", kind.word(), below.kind.word());
        return Err((what, "a base is a surface (S); that of a surface may be an obstruction (O)"));
    }
    if found >= i && below.kind != Kind::Obstruction {
        return Err((format!("the base {base} comes after it"), "a base stands before what lies upon it"));
    }
    let (alike, reach) = (facet.normal().dot(below.facet.normal()), WITHIN * below.facet.radius());
    let off = facet.corners().iter().map(|c| below.facet.height(*c).abs()).fold(0.0, f64::max);
    if off > reach {
        let what = format!("surface {number} does not lie in the plane of its base {base}: it is {off:.1e} m off");
        return Err((what, "move it into the plane"));
    }
    match kind {
        Kind::Radiating if alike < ALIKE => {
            return Err((
                format!("surface {number} faces away from its base {base}"),
                "turn the order of its vertices",
            ));
        }
        Kind::Mask | Kind::Null if alike > -ALIKE => {
            let hint = "it must face its base: turn the order of its vertices";
            return Err((format!("{} {number} faces as its base {base} does", kind.word()), hint));
        }
        _ => {}
    }
    let normal = below.facet.normal();
    let out = |[a, b]: [glam::DVec3; 2]| {
        let outwards = (b - a).cross(normal).normalize_or_zero();
        facet.corners().iter().map(|c| (*c - a).dot(outwards)).fold(0.0, f64::max)
    };
    let out = below.facet.edges().map(out).fold(0.0, f64::max);
    if out > reach {
        let what = format!("surface {number} reaches {out:.1e} m out of its base {base}");
        return Err((what, "a subsurface lies wholly within its base"));
    }
    Ok(Some(found))
}

/// The surface that each is a part of.
fn wholes(
    surfaces: &[Surface],
    at: &FxHashMap<u32, usize>,
    unreadable: &FxHashSet<u32>,
    report: &mut Report,
) -> Vec<Option<usize>> {
    let mut wholes = Vec::with_capacity(surfaces.len());
    for (i, Surface { line, kind, number, combine, emittance, .. }) in surfaces.iter().enumerate() {
        let mut whole = None;
        if *combine != 0 {
            let found = at.get(combine).copied();
            match found.map(|found| (found, &surfaces[found])) {
                _ if *kind != Kind::Radiating => {
                    report.error(
                        *line,
                        format!("{} {number} cannot be a part of another", kind.word()),
                        "write cmb = 0",
                    );
                }
                None if unreadable.contains(combine) => {}
                None => {
                    let what = format!("there is no surface {combine} to combine with");
                    report.error(*line, what, "correct the number, or 0 for none");
                }
                Some((_, other)) if other.kind != Kind::Radiating => {
                    let what = format!("surface {number} cannot be combined with {} {combine}", other.kind.word());
                    report.error(*line, what, "name a surface (S)");
                }
                Some((found, _)) if found >= i => {
                    let what = format!("surface {combine} to combine with does not stand before it");
                    report.error(*line, what, "combine later surfaces with the first of them");
                }
                Some((_, other)) if other.combine != 0 => {
                    let what = format!("surface {combine} is itself a part of surface {}", other.combine);
                    report.error(*line, what, format!("write cmb = {}", other.combine));
                }
                Some((found, other)) => {
                    if other.emittance != *emittance {
                        let what = format!(
                            "surface {number} has emittance {emittance} and becomes a part of surface {combine}, which has {}",
                            other.emittance
                        );
                        report.warning(*line, what, format!("that of surface {combine} counts"));
                    }
                    whole = Some(found);
                }
            }
        }
        wholes.push(whole);
    }
    wholes
}

/// A surface without what lies upon it.
fn without(surface: &Surface, upon: &[usize], surfaces: &[Surface], report: &mut Report) -> Vec<Facet> {
    let holes: Vec<&Facet> = upon.iter().map(|i| &surfaces[*i].facet).collect();
    // A rim as wide as a subsurface may reach out of the base.
    let rim = 2.0 * WITHIN * surface.facet.radius();
    let within_reason = Some(holes).filter(|holes| holes.len() <= MAX_UPON_ONE);
    let Some(Cut { pieces, missing }) = within_reason.and_then(|holes| cut(&surface.facet, &holes, rim)) else {
        let what = format!("{} upon surface {}", counted(upon.len(), "surface lies", "surfaces lie"), surface.number);
        report.error(surface.line, what, "that is too much to cut out of one; split the base");
        return Vec::new();
    };
    for (i, missing) in upon.iter().zip(missing).filter(|(_, missing)| *missing > 0.0) {
        let Surface { line, number, .. } = &surfaces[*i];
        let what = format!("surface {number} overlaps another upon its base {} by {missing:.3e} m²", surface.number);
        report.error(*line, what, "surfaces upon one base may touch, not overlap");
    }
    pieces
}
