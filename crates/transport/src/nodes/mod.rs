//! Radiosity at nodes: collocation with linear hats (Cohen and Wallace 1993, ch. 3; catalogue 89).
//!
//! B(y) = Σ_k N_k(y) B_k on triangles, and the equation is asked to hold at the nodes x_i themselves:
//! B_i = E_i + ρ_i Σ_k K_ik B_k with K_ik = ∫ N_k(y) cos θ cos θ' V/(π r²) dA, from the normal n_i of the surface at x_i.
//! One integral per entry where linear Galerkin needs two and a mass matrix; both are off by O(h²) on smooth surfaces. The
//! price is reciprocity: K is not symmetric in any weight, so that conjugate gradients and Cholesky are out, and what is
//! given off is what is received to O(h²) only.
//!
//! **Constants are exact.** Entries are Lambert's closed form split between the hats ([`linear_form_factors`]), shadows
//! are cut exactly, and so Σ_k K_ik is the closed form of all that the node sees: one to rounding in a closed enclosure.
//! Not so past hundreds of polygons or what is no polygon: there segments find the visible share, good to about a percent.
//!
//! **A node's own triangles** touch it. Where they lie in a plane with n_i they give it nothing. Where they stand for a
//! curved surface they are chords that rise above the tangent plane, and the node looks along them: the flat triangles
//! give nothing, but the surface would, its kernel being bounded (κ²/4π for curvature κ). What they should give is what
//! they hide: the share of the hemisphere between tangent plane and chords, (φ − γ û·n)/2π for chords at an angle γ in a
//! plane of normal û whose azimuths differ by φ. It goes to the three corners alike, and rows of a closed cavity sum to
//! one without being scaled.
//!
//! **At borders**, where surfaces meet at a crease or end, irradiance is the limit from inside: a node there looks from a
//! point a millionth of its triangles' size inwards. It fails where walls stand on the middle of triangles: the light
//! jumps there and hats do not, so that triangles must be cut along walls and nodes split.

mod linear;
mod mesh;
#[cfg(test)]
mod tests;

pub use linear::linear_form_factors;
pub use mesh::{MeshFault, NodeMesh};

use crate::Progress;
use crate::pair::Occlusion;
use glam::DVec3;
use linear::View;
use radiosity_scene::Facet;
use radiosity_solve::{SolveError, SparseTransport};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How far inside its triangles a node at a border stands, in their size: what coordinates of six digits leave of a
/// crease. The light of a corner changes by about as much; ten times less, and walls from such files may hide the node.
const INSIDE: f64 = 1e-6;

/// Size of the facet that stands for a node where blockers are looked up, in the size of its triangles: smaller than
/// [`INSIDE`], so that it does not reach through a wall at the border.
const SPOT: f64 = 0.1 * INSIDE;

/// Share of the hemisphere below which what chords hide is rounding.
const HIDDEN: f64 = 1e-14;

/// How nodes look at triangles.
#[derive(Clone, Copy, Debug)]
pub struct NodeOptions {
    /// Largest Σ_k |error of K_ik| in a row by quadrature, about. The default 1e-5 is far below what linear hats leave of
    /// any field. Sums of rows are exact in any case, unless segments find shadows.
    pub tolerance: f64,
}

impl Default for NodeOptions {
    fn default() -> Self {
        NodeOptions { tolerance: 1e-5 }
    }
}

/// Why there is no transport between nodes.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// A tolerance that is not between 0 and 1.
    #[error("a tolerance of {0} for form factors of nodes is not between 0 and 1")]
    Tolerance(f64),
    /// It was stopped.
    #[error(transparent)]
    Stopped(#[from] crate::Stopped),
    /// Numbers too large or too small to be factors.
    #[error(transparent)]
    Transport(#[from] SolveError),
}

/// The transport between the nodes of a mesh past what stands between, weighted by [`NodeMesh::areas`], for every solver
/// that does not ask for reciprocity. Triangles are opaque if `occlusion` has them.
///
/// ```
/// use glam::DVec3;
/// use radiosity_solve::{DiffuseResponse, Go, Params, Solver, solve};
/// use radiosity_transport::pair::blockers::Blockers;
/// use radiosity_transport::{NodeMesh, NodeOptions, node_transport};
///
/// // A tetrahedron seen from inside: four faces of three nodes each, as creases split nodes.
/// let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let positions = vec![p[0], p[1], p[2], p[0], p[2], p[3], p[0], p[3], p[1], p[1], p[3], p[2]];
/// let triangles = vec![[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]];
/// let mesh = NodeMesh::new(positions, triangles).map_err(|faults| format!("{faults:?}"))?;
/// let transport = node_transport(&mesh, &Blockers::new(mesh.facets()), &NodeOptions::default(), &())?;
///
/// // The furnace: a closed box that emits 1/2 and reflects 1/2 gives off 1.
/// let half = DiffuseResponse { reflectance: vec![0.5; 12], bands: 1, reciprocal_area: None };
/// let mut b = [0.0; 12];
/// solve(Solver::Lu, &transport, &half, &[0.5; 12], &mut b, &Params::default(), |_, _| Go::On)?;
/// assert!(b.iter().all(|b| (b - 1.0).abs() < 1e-12));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`NodeError`] for a tolerance that is none, if `progress` says so, or where coordinates overflow.
pub fn node_transport(
    mesh: &NodeMesh,
    occlusion: &dyn Occlusion,
    options: &NodeOptions,
    progress: &dyn Progress,
) -> Result<SparseTransport, NodeError> {
    if !(options.tolerance > 0.0 && options.tolerance < 1.0) {
        return Err(NodeError::Tolerance(options.tolerance));
    }
    let n = mesh.positions().len();
    let done = AtomicUsize::new(0);
    let rows: Vec<Vec<(u32, f64)>> = (0..n)
        .into_par_iter()
        .map(|node| {
            let row = row(mesh, node, occlusion, options.tolerance);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.step(done, n).then_some(row).ok_or(crate::Stopped)
        })
        .collect::<Result<_, _>>()?;
    let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for (column, value) in rows.into_iter().map(|row| row.into_iter().unzip::<u32, f64, Vec<_>, Vec<_>>()) {
        columns.extend(column);
        values.extend(value);
        starts.push(values.len());
    }
    Ok(SparseTransport::new(mesh.areas(), starts, columns, values)?)
}

/// The entries of row i that are not zero.
fn row(mesh: &NodeMesh, node: usize, occlusion: &dyn Occlusion, tolerance: f64) -> Vec<(u32, f64)> {
    let (position, normal, around) = (mesh.positions()[node], mesh.normals()[node], mesh.around(node));
    let size = around.iter().map(|t| mesh.facets()[*t as usize].area()).sum::<f64>().sqrt();
    let inwards: DVec3 = around.iter().map(|t| mesh.facets()[*t as usize].centroid() - position).sum();
    let inwards =
        if mesh.is_border(node) { inwards.reject_from_normalized(normal).normalize_or_zero() } else { DVec3::ZERO };
    let view = View::new(position + INSIDE * size * inwards, normal, tolerance);
    let own = spot(view.point, normal, SPOT * size).unwrap_or_else(|| mesh.facets()[around[0] as usize].clone());

    let mut row = vec![0.0; mesh.positions().len()];
    let mut add = |corners: [u32; 3], factors: [f64; 3]| {
        corners.iter().zip(factors).for_each(|(k, factor)| row[*k as usize] += factor);
    };
    for (corners, facet) in mesh.triangles().iter().zip(mesh.facets()) {
        if let Some(k) = corners.iter().position(|k| *k as usize == node) {
            let [from, to] = [1, 2].map(|m| facet.corners()[(k + m) % 3] - position);
            add(*corners, [hidden(from, to, normal) / 3.0; 3]);
        } else {
            add(*corners, view.past(occlusion, &own, facet));
        }
    }
    row.into_iter().enumerate().filter(|(_, factor)| *factor != 0.0).map(|(k, factor)| (k as u32, factor)).collect()
}

/// A small triangle about a point.
fn spot(point: DVec3, normal: DVec3, size: f64) -> Option<Facet> {
    let (u, v) = normal.any_orthonormal_pair();
    Facet::new(vec![point + size * u, point + size * (v - u), point - size * (u + v)]).ok()
}

/// Share of the hemisphere that a triangle between two chords, counter-clockwise about the normal, hides of it: what is
/// above the tangent plane and below the triangle.
fn hidden(from: DVec3, to: DVec3, normal: DVec3) -> f64 {
    // Where one chord dips below, what counts begins at the tangent plane.
    let heights = [from, to].map(|d| d.dot(normal));
    let crossing = || from + heights[0] / (heights[0] - heights[1]) * (to - from);
    let [from, to] = match heights.map(|h| h > 0.0) {
        [false, false] => return 0.0,
        [true, false] => [from, crossing()],
        [false, true] => [crossing(), to],
        [true, true] => [from, to],
    };
    let cross = from.cross(to);
    let [level_from, level_to] = [from, to].map(|d| d.reject_from_normalized(normal));
    let (gamma, phi) =
        (cross.length().atan2(from.dot(to)), level_from.cross(level_to).length().atan2(level_from.dot(level_to)));
    let share = (phi - gamma * cross.normalize_or_zero().dot(normal)) / TAU;
    if share > HIDDEN { share } else { 0.0 }
}
