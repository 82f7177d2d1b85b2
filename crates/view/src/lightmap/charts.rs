//! Which triangles form a chart: maximal coplanar regions first, then smooth neighbours joined while the cone around
//! their normals stays narrow. Joining takes the pair with the narrowest cone and the longest common border first.

use super::{SharedEdge, UnwrapInput, UnwrapParams};
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// A set of triangles and the direction to look along.
#[derive(Clone, Debug)]
pub(super) struct Region {
    pub triangles: Vec<u32>,
    pub axis: DVec3,
}

/// Cosine of the largest angle (0.25°) between a triangle and the plane of its region. A length in the region is then
/// wrong by at most 1e-5; ten times the angle would let tessellated columns pass for planes.
pub(super) const COPLANAR: f64 = 0.999_990_5;

/// A coplanar region is not joined to anything less than this share of its area: a wall shall not be tilted by its fillet.
const FILLET: f64 = 1.0 / 16.0;

/// Neighbour across each side of each triangle, `u32::MAX` where none.
pub(super) fn neighbours(triangles: usize, edges: &[SharedEdge]) -> Vec<[u32; 3]> {
    let mut across = vec![[u32::MAX; 3]; triangles];
    for edge in edges {
        let [a, b] = edge.triangles;
        across[a as usize][usize::from(edge.sides[0])] = b;
        across[b as usize][usize::from(edge.sides[1])] = a;
    }
    across
}

/// Cuts the triangles into regions. Every triangle is in exactly one.
pub(super) fn segment(
    input: &UnwrapInput,
    edges: &[SharedEdge],
    across: &[[u32; 3]],
    params: &UnwrapParams,
) -> Vec<Region> {
    let corners = |t: usize| input.triangles[t].map(|v| input.positions[v as usize]);
    let doubled: Vec<DVec3> = (0..input.triangles.len())
        .map(|t| {
            let [a, b, c] = corners(t);
            (b - a).cross(c - a)
        })
        .collect();
    let normals: Vec<DVec3> = doubled.iter().map(|n| n.try_normalize().unwrap_or(DVec3::ZERO)).collect();

    // Coplanar regions grow from the largest triangle left, whose plane is the best known.
    let mut order: Vec<u32> = (0..input.triangles.len() as u32).collect();
    order.sort_by(|&a, &b| {
        let area = |t: u32| doubled[t as usize].length_squared();
        area(b).total_cmp(&area(a)).then(a.cmp(&b))
    });
    let size = input.positions.iter().fold(0.0_f64, |size, p| size.max(p.abs().max_element()));
    // Slivers have no reliable normal: they belong to the plane that their corners lie in, to f32 rounding.
    let near = 1e-6 * size;
    let mut region_of = vec![u32::MAX; input.triangles.len()];
    let mut regions: Vec<Growing> = Vec::new();
    for seed in order {
        if region_of[seed as usize] != u32::MAX {
            continue;
        }
        let index = regions.len() as u32;
        let axis = normals[seed as usize];
        let origin = corners(seed as usize)[0];
        let mut members = vec![seed];
        region_of[seed as usize] = index;
        let mut next = 0;
        while next < members.len() && axis != DVec3::ZERO {
            for &t in &across[members[next] as usize] {
                if t == u32::MAX || region_of[t as usize] != u32::MAX {
                    continue;
                }
                let cosine = normals[t as usize].dot(axis);
                let flat = cosine >= COPLANAR
                    || cosine >= 0.0 && corners(t as usize).iter().all(|p| (*p - origin).dot(axis).abs() <= near);
                if flat {
                    region_of[t as usize] = index;
                    members.push(t);
                }
            }
            next += 1;
        }
        let area = members.iter().map(|&t| 0.5 * doubled[t as usize].length()).sum();
        regions.push(Growing {
            members,
            axis,
            half: 0.0,
            area,
            outline: 0.0,
            planar: true,
            stamp: 0,
            beside: BTreeMap::new(),
        });
    }

    // Smooth borders between the regions.
    let crease = params.crease_degrees.to_radians().cos();
    for (t, sides) in across.iter().enumerate() {
        for (side, &other) in sides.iter().enumerate() {
            let mine = region_of[t];
            if other != u32::MAX && region_of[other as usize] == mine {
                continue;
            }
            let from = input.triangles[t][side];
            let to = input.triangles[t][(side + 1) % 3];
            let length = input.positions[from as usize].distance(input.positions[to as usize]);
            regions[mine as usize].outline += length;
        }
    }
    for edge in edges {
        let [a, b] = edge.triangles.map(|t| region_of[t as usize]);
        let [na, nb] = edge.triangles.map(|t| normals[t as usize]);
        if a == b || na.dot(nb) < crease || na == DVec3::ZERO || nb == DVec3::ZERO {
            continue;
        }
        let t = edge.triangles[0] as usize;
        let side = usize::from(edge.sides[0]);
        let from = input.triangles[t][side];
        let to = input.triangles[t][(side + 1) % 3];
        let length = input.positions[from as usize].distance(input.positions[to as usize]);
        *regions[a as usize].beside.entry(b).or_insert(0.0) += length;
        *regions[b as usize].beside.entry(a).or_insert(0.0) += length;
    }

    join(&mut regions, params.cone_degrees.to_radians());
    let mut result: Vec<Region> = regions
        .into_iter()
        .filter(|region| !region.members.is_empty())
        .map(|mut region| {
            region.members.sort_unstable();
            Region { triangles: region.members, axis: region.axis }
        })
        .collect();
    result.sort_by_key(|region| region.triangles[0]);
    result
}

struct Growing {
    members: Vec<u32>,
    axis: DVec3,
    /// Half angle of the cone about `axis` that holds all normals.
    half: f64,
    area: f64,
    outline: f64,
    planar: bool,
    /// Counts the changes, so that old candidates in the heap are recognised.
    stamp: u32,
    /// Length of the smooth border by neighbour.
    beside: BTreeMap<u32, f64>,
}

/// A pair to join, cheapest first; the cost is not negative, so its bits sort as it does.
type Candidate = Reverse<(u64, u32, u32, u32, u32)>;

fn join(regions: &mut [Growing], limit: f64) {
    let mut heap: BinaryHeap<Candidate> = BinaryHeap::new();
    for a in 0..regions.len() as u32 {
        for (&b, &shared) in regions[a as usize].beside.range(a + 1..) {
            heap.extend(candidate(regions, a, b, shared, limit));
        }
    }
    while let Some(Reverse((_, a, b, stamp_a, stamp_b))) = heap.pop() {
        if regions[a as usize].stamp != stamp_a || regions[b as usize].stamp != stamp_b {
            continue;
        }
        // The smaller list of neighbours moves over to the other region.
        let (keep, gone) =
            if regions[a as usize].beside.len() >= regions[b as usize].beside.len() { (a, b) } else { (b, a) };
        let (axis, half) = cone(&regions[a as usize], &regions[b as usize]);
        let moved = std::mem::take(&mut regions[gone as usize].beside);
        let members = std::mem::take(&mut regions[gone as usize].members);
        let (area, outline) = (regions[gone as usize].area, regions[gone as usize].outline);
        regions[gone as usize].stamp += 1;
        let shared = moved.get(&keep).copied().unwrap_or(0.0);
        let region = &mut regions[keep as usize];
        region.members.extend(members);
        (region.axis, region.half, region.planar) = (axis, half, false);
        region.area += area;
        region.outline = (region.outline + outline - 2.0 * shared).max(0.0);
        region.stamp += 1;
        region.beside.remove(&gone);
        for (other, length) in moved {
            if other != keep {
                *regions[keep as usize].beside.entry(other).or_insert(0.0) += length;
                let beside = &mut regions[other as usize].beside;
                beside.remove(&gone);
                *beside.entry(keep).or_insert(0.0) += length;
            }
        }
        let beside = regions[keep as usize].beside.clone();
        for (other, shared) in beside {
            heap.extend(candidate(regions, keep, other, shared, limit));
        }
    }
}

fn candidate(regions: &[Growing], a: u32, b: u32, shared: f64, limit: f64) -> Option<Candidate> {
    let (a, b) = (a.min(b), a.max(b));
    let (x, y) = (&regions[a as usize], &regions[b as usize]);
    let wall = |wall: &Growing, other: &Growing| wall.planar && other.area < FILLET * wall.area;
    if wall(x, y) || wall(y, x) {
        return None;
    }
    let (_, half) = cone(x, y);
    if half > limit {
        return None;
    }
    // A common border of the whole outline of one is worth 0.3 radians: it keeps charts from growing into strips.
    let common = (shared / x.outline.min(y.outline).max(f64::MIN_POSITIVE)).min(1.0);
    let cost = half + 0.3 * (1.0 - common);
    Some(Reverse((cost.to_bits(), a, b, x.stamp, y.stamp)))
}

/// The smallest cone that holds two cones of directions.
fn cone(a: &Growing, b: &Growing) -> (DVec3, f64) {
    let between = a.axis.angle_between(b.axis);
    if between + b.half <= a.half {
        return (a.axis, a.half);
    }
    if between + a.half <= b.half {
        return (b.axis, b.half);
    }
    let half = 0.5 * (a.half + b.half + between);
    let turn = half - a.half;
    let sideways = (b.axis - a.axis * a.axis.dot(b.axis)).try_normalize().unwrap_or(DVec3::ZERO);
    ((a.axis * turn.cos() + sideways * turn.sin()).normalize_or(a.axis), half)
}
