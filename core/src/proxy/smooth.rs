//! Smoothing of a proxy, so that strips ignore relief smaller than a radius.
//!
//! Taubin's filter (1995): steps of Laplacian smoothing alternate with steps of opposite sign, which keep limbs from
//! shrinking. Features and boundaries do not move. Connectivity does not change, and images keep their barycentric
//! coordinates.

use glam::DVec3;

use super::map::Proxy;
use super::vertex_kinds::{VertexKind, vertex_kinds};
use crate::mesh::{TriMesh, VertexId};

/// The filter's steps λ and μ, as fractions of the vector to the mean of the neighbours. Frequencies up to about a
/// tenth pass.
const STEPS: [f64; 2] = [0.5, -0.53];
/// Most rounds; more have no visible effect.
const MOST_ROUNDS: f64 = 400.0;

impl Proxy {
    /// Smooths the proxy over about `radius`, in units of the mesh.
    pub fn smooth(&mut self, radius: f64) {
        let mesh = self.mesh();
        let mean = mesh.edges().map(|e| mesh.edge_length(e)).sum::<f64>() / mesh.n_edges() as f64;
        // A round is a diffusion over about half an edge; the squares of diffusion lengths add up.
        let rounds = (2.0 * radius / mean).powi(2).clamp(1.0, MOST_ROUNDS).round() as usize;
        let moves: Vec<bool> = vertex_kinds(mesh, self.sharp()).into_iter().map(|k| k == VertexKind::Smooth).collect();
        let mut positions = mesh.positions().to_vec();
        for step in (0..rounds).flat_map(|_| STEPS) {
            let before = positions.clone();
            for v in mesh.vertices().filter(|v| moves[v.index()]) {
                positions[v.index()] = before[v.index()].lerp(mean_around(mesh, &before, v), step);
            }
        }
        self.move_to(positions);
    }
}

/// The mean of the neighbours of an inner vertex.
fn mean_around(mesh: &TriMesh, positions: &[DVec3], v: VertexId) -> DVec3 {
    let (sum, n) =
        mesh.outgoing(v).fold((DVec3::ZERO, 0.0), |(sum, n), h| (sum + positions[mesh.target(h).index()], n + 1.0));
    sum / n
}
