//! Triangles with shared nodes: where a field is linear on each triangle and continuous across edges.
//!
//! A node has one normal, so that a crease has a node on either side. Without normals of its own a mesh takes the mean of
//! those of the triangles around, weighted by their angles at the node (Thürmer and Wüthrich 1998), which is off by O(h²)
//! where the mesh is regular; whoever knows the surface gives its normals.

use glam::DVec3;
use radiosity_scene::Facet;
use std::collections::HashMap;

/// What is wrong with a mesh, and where.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeshFault {
    /// A coordinate is NaN or infinite.
    #[error("node {node}: the position is not finite")]
    NotFinite {
        /// The node.
        node: usize,
    },
    /// No triangle uses a node, so that it has neither area nor normal.
    #[error("node {node}: no triangle uses it; leave it out")]
    Unused {
        /// The node.
        node: usize,
    },
    /// A triangle names a node that does not exist.
    #[error("triangle {triangle}: there is no node {node}")]
    NoNode {
        /// The triangle.
        triangle: usize,
        /// What it names.
        node: u32,
    },
    /// The corners of a triangle lie on a line.
    #[error("triangle {triangle}: the area is zero")]
    NoArea {
        /// The triangle.
        triangle: usize,
    },
    /// The normal of a node is not finite, zero, or points to the back of a triangle that uses it.
    #[error("node {node}: the normal is on no side of, or behind, triangle {triangle}; split nodes at creases")]
    Normal {
        /// The node.
        node: usize,
        /// A triangle that uses it.
        triangle: usize,
    },
    /// There is not one normal for each node.
    #[error("{given} normals for {nodes} nodes")]
    Normals {
        /// Number of normals.
        given: usize,
        /// Number of nodes.
        nodes: usize,
    },
}

/// Triangles with shared nodes, active on the side from which their corners run counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeMesh {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    facets: Vec<Facet>,
    /// Where the triangles of each node start in `around`, and the end.
    starts: Vec<usize>,
    around: Vec<u32>,
    is_border: Vec<bool>,
}

impl NodeMesh {
    /// A mesh with the mean normals of the triangles around each node.
    ///
    /// # Errors
    /// Every [`MeshFault`] that there is.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<NodeMesh, Vec<MeshFault>> {
        let mut mesh = NodeMesh::flat(positions, triangles)?;
        for (facet, corners) in mesh.facets.iter().zip(&mesh.triangles) {
            for (k, node) in corners.iter().enumerate() {
                let [a, b, c] = [0, 1, 2].map(|m| facet.corners()[(k + m) % 3]);
                mesh.normals[*node as usize] += (b - a).angle_between(c - a) * facet.normal();
            }
        }
        mesh.with_own_normals()
    }

    /// A mesh with the normals of the surface that it stands for, of any length.
    ///
    /// # Errors
    /// Every [`MeshFault`] that there is.
    pub fn with_normals(
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        normals: Vec<DVec3>,
    ) -> Result<NodeMesh, Vec<MeshFault>> {
        if normals.len() != positions.len() {
            return Err(vec![MeshFault::Normals { given: normals.len(), nodes: positions.len() }]);
        }
        let mesh = NodeMesh::flat(positions, triangles)?;
        NodeMesh { normals, ..mesh }.with_own_normals()
    }

    /// Positions of the nodes, m.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Unit normals of the nodes.
    pub fn normals(&self) -> &[DVec3] {
        &self.normals
    }

    /// The nodes of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The triangles as facets, which are what stands in the way.
    pub fn facets(&self) -> &[Facet] {
        &self.facets
    }

    /// Lumped areas, m²: a third of the triangles around each node, the integral of its hat.
    pub fn areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.positions.len()];
        for (facet, corners) in self.facets.iter().zip(&self.triangles) {
            corners.iter().for_each(|node| areas[*node as usize] += facet.area() / 3.0);
        }
        areas
    }

    /// The triangles around a node.
    pub(super) fn around(&self, node: usize) -> &[u32] {
        &self.around[self.starts[node]..self.starts[node + 1]]
    }

    /// Whether a node lies on an edge of one triangle only.
    pub(super) fn is_border(&self, node: usize) -> bool {
        self.is_border[node]
    }

    /// All but the normals, which are zero.
    fn flat(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<NodeMesh, Vec<MeshFault>> {
        let n = positions.len();
        let bad = |(node, p): (usize, &DVec3)| (!p.is_finite()).then_some(MeshFault::NotFinite { node });
        let mut faults: Vec<MeshFault> = positions.iter().enumerate().filter_map(bad).collect();
        for (triangle, corners) in triangles.iter().enumerate() {
            let missing = corners.iter().filter(|node| **node as usize >= n);
            faults.extend(missing.map(|node| MeshFault::NoNode { triangle, node: *node }));
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let mut starts = vec![0; n + 1];
        for node in triangles.iter().flatten() {
            starts[*node as usize + 1] += 1;
        }
        faults.extend((0..n).filter(|node| starts[node + 1] == 0).map(|node| MeshFault::Unused { node }));
        let mut facets = Vec::with_capacity(triangles.len());
        for (triangle, corners) in triangles.iter().enumerate() {
            match Facet::new(corners.iter().map(|node| positions[*node as usize]).collect()) {
                Ok(facet) => facets.push(facet),
                Err(_) => faults.push(MeshFault::NoArea { triangle }),
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        for node in 0..n {
            starts[node + 1] += starts[node];
        }
        let (mut next, mut around) = (starts.clone(), vec![0; 3 * triangles.len()]);
        let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
        for (triangle, corners) in triangles.iter().enumerate() {
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]];
                around[next[a as usize]] = triangle as u32;
                next[a as usize] += 1;
                *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let mut is_border = vec![false; n];
        for (edge, _) in edges.iter().filter(|(_, used)| **used == 1) {
            edge.iter().for_each(|node| is_border[*node as usize] = true);
        }
        Ok(NodeMesh { normals: vec![DVec3::ZERO; n], positions, triangles, facets, starts, around, is_border })
    }

    /// Unit normals, if each is before all triangles around.
    fn with_own_normals(mut self) -> Result<NodeMesh, Vec<MeshFault>> {
        let mut faults = Vec::new();
        for node in 0..self.positions.len() {
            self.normals[node] = self.normals[node].normalize_or_zero();
            let behind = |t: &&u32| self.normals[node].dot(self.facets[**t as usize].normal()) <= 0.0;
            if let Some(triangle) = self.around(node).iter().find(behind) {
                faults.push(MeshFault::Normal { node, triangle: *triangle as usize });
            }
        }
        if faults.is_empty() { Ok(self) } else { Err(faults) }
    }
}
