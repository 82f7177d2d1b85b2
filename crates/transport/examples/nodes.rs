//! Radiosity at the nodes of a mesh, linear in between: a box lit by its ceiling, and how its floor brightens as the
//! mesh is refined.
//!
//! `cargo run --release -p radiosity-transport --example nodes -- 4`

#![expect(clippy::print_stdout, reason = "an example shows its answer")]

use glam::DVec3;
use radiosity_solve::{DiffuseResponse, Go, Params, Solver, solve};
use radiosity_transport::pair::blockers::Blockers;
use radiosity_transport::{NodeMesh, NodeOptions, node_transport};

/// A unit square of n × n cells, active along u × v; nodes are not shared with other faces, as light jumps at creases.
fn add_square(nodes: &mut Vec<DVec3>, triangles: &mut Vec<[u32; 3]>, origin: DVec3, [u, v]: [DVec3; 2], n: u32) {
    let first = nodes.len() as u32;
    for k in 0..(n + 1) * (n + 1) {
        let [i, j] = [k % (n + 1), k / (n + 1)].map(|k| f64::from(k) / f64::from(n));
        nodes.push(origin + i * u + j * v);
    }
    for k in 0..n * n {
        let a = first + k / n * (n + 1) + k % n;
        triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let most: u32 = std::env::args().nth(1).map_or(Ok(4), |n| n.parse())?;
    for n in 1..=most {
        // Cells halve from one mesh to the next, and the middle of the floor is a node of each.
        let cells = 1 << n;
        let (mut nodes, mut triangles) = (Vec::new(), Vec::new());
        for k in 0..3 {
            let [u, v, w] = [0, 1, 2].map(|m| DVec3::AXES[(k + m) % 3]);
            add_square(&mut nodes, &mut triangles, DVec3::ZERO, [u, v], cells);
            add_square(&mut nodes, &mut triangles, w, [v, u], cells);
        }
        let mesh = NodeMesh::new(nodes, triangles).map_err(|faults| format!("{faults:?}"))?;
        let transport = node_transport(&mesh, &Blockers::new(mesh.facets()), &NodeOptions::default(), &())?;

        let positions = mesh.positions();
        let response = DiffuseResponse { reflectance: vec![0.7; positions.len()], bands: 1, reciprocal_area: None };
        let is_ceiling = |k: usize| mesh.normals()[k].z < -0.5;
        let e: Vec<f64> = (0..positions.len()).map(|k| if is_ceiling(k) { 1.0 } else { 0.0 }).collect();
        let mut b = vec![0.0; e.len()];
        let info = solve(Solver::Gmres, &transport, &response, &e, &mut b, &Params::default(), |_, _| Go::On)?;

        let is_middle = |p: &DVec3| p.distance(DVec3::new(0.5, 0.5, 0.0)) < 1e-9;
        let middle = positions.iter().position(is_middle).ok_or("no node in the middle")?;
        println!("{:6} nodes: {:.6} in the middle of the floor, {} steps", positions.len(), b[middle], info.steps);
    }
    Ok(())
}
