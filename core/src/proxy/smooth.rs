//! Smoothing a proxy: strips then pass over relief smaller than a radius.
//!
//! Positions diffuse over the mesh by Taubin's filter (1995), whose step back keeps limbs from shrinking. Features and
//! boundaries stay. The connectivity stays, too, and so does the map: images keep their weights in their triangles.

use glam::DVec3;

use super::Proxy;
use super::shape::{Kind, kinds};
use crate::mesh::{TriMesh, VertexId};

/// The share of the way to the mean of the neighbours, forth and back: frequencies up to about a tenth pass.
const STEPS: [f64; 2] = [0.5, -0.53];
/// Rounds at most: more do not show.
const MOST_ROUNDS: f64 = 400.0;

impl Proxy {
    /// Smooths the proxy over about `radius`.
    pub fn smooth(&mut self, radius: f64) {
        let mesh = self.mesh();
        let mean = mesh.edges().map(|e| mesh.edge_length(e)).sum::<f64>() / mesh.n_edges() as f64;
        // A round spreads a position by about half an edge, and spreads add up by their squares.
        let rounds = (2.0 * radius / mean).powi(2).clamp(1.0, MOST_ROUNDS).round() as usize;
        let moves: Vec<bool> = kinds(mesh, self.sharp()).into_iter().map(|k| k == Kind::Smooth).collect();
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
