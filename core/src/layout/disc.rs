//! Harmonic maps of discs onto convex shapes (Tutte; Floater).
//!
//! With positive weights and the border on a convex curve the map is one to one. The weights are cotangents,
//! kept positive and of bounded ratio, so that slivers cannot spoil the system.

use glam::DVec2;

use crate::mesh::{TriMesh, VertexId};
use crate::solve::{SolveError, SparseHermitian, SpdFactor};

/// Bounds of an edge's weight. An equilateral mesh has 0.58 everywhere; the lower bound keeps the weights
/// positive, and a ratio of 1000 is harmless to the solver.
const WEIGHTS: (f64, f64) = (0.01, 10.0);

/// Positions in the plane of all vertices of `mesh`, harmonic where `fixed` is `None`.
///
/// # Errors
///
/// When the linear system cannot be solved (no vertex of some component is fixed).
pub(crate) fn harmonic(mesh: &TriMesh, fixed: &[Option<DVec2>]) -> Result<Vec<DVec2>, SolveError> {
    let weights: Vec<f64> = mesh.edges().map(|e| weight(mesh, mesh.halfedge(e))).collect();
    solve(mesh, fixed, &weights)
}

/// As [`harmonic`] with equal weights: coarser in shape, but untouched by bad triangles.
pub(crate) fn barycentric(mesh: &TriMesh, fixed: &[Option<DVec2>]) -> Result<Vec<DVec2>, SolveError> {
    solve(mesh, fixed, &vec![1.0; mesh.n_edges()])
}

fn weight(mesh: &TriMesh, h: crate::mesh::HalfedgeId) -> f64 {
    let cot = |h| {
        let a = mesh.corner_angle(mesh.prev(h));
        if a > 0.0 { a.cos() / a.sin().max(1e-6) } else { 0.0 }
    };
    let both = cot(h) + mesh.twin(h).map_or(0.0, cot);
    (0.5 * both).clamp(WEIGHTS.0, WEIGHTS.1)
}

fn solve(mesh: &TriMesh, fixed: &[Option<DVec2>], weights: &[f64]) -> Result<Vec<DVec2>, SolveError> {
    let mut unknown = vec![u32::MAX; mesh.n_vertices()];
    let mut n = 0;
    for v in mesh.vertices() {
        if fixed[v.index()].is_none() {
            unknown[v.index()] = n;
            n += 1;
        }
    }
    let mut map: Vec<DVec2> = fixed.iter().map(|p| p.unwrap_or(DVec2::ZERO)).collect();
    if n == 0 {
        return Ok(map);
    }
    let mut triplets = Vec::with_capacity(3 * mesh.n_edges());
    let mut rhs = [vec![0.0; n as usize], vec![0.0; n as usize]];
    let mut pull = |v: VertexId, other: VertexId, w: f64, triplets: &mut Vec<(u32, u32, f64)>| {
        let i = unknown[v.index()];
        if i == u32::MAX {
            return;
        }
        triplets.push((i, i, w));
        if let Some(p) = fixed[other.index()] {
            rhs[0][i as usize] += w * p.x;
            rhs[1][i as usize] += w * p.y;
        }
    };
    for e in mesh.edges() {
        let (w, [a, b]) = (weights[e.index()], mesh.edge_vertices(e));
        pull(a, b, w, &mut triplets);
        pull(b, a, w, &mut triplets);
        let (i, j) = (unknown[a.index()], unknown[b.index()]);
        if i != u32::MAX && j != u32::MAX {
            triplets.push((i.max(j), i.min(j), -w));
        }
    }
    let matrix = SparseHermitian::from_triplets(n as usize, &triplets);
    let factor = SpdFactor::new(&matrix)?;
    let (x, y) = (factor.solve(&matrix, &rhs[0])?, factor.solve(&matrix, &rhs[1])?);
    for v in mesh.vertices() {
        let i = unknown[v.index()];
        if i != u32::MAX {
            map[v.index()] = DVec2::new(x[i as usize], y[i as usize]);
        }
    }
    Ok(map)
}

/// The triangles that `map` turns over or flattens.
pub(crate) fn flipped(mesh: &TriMesh, map: &[DVec2]) -> usize {
    mesh.faces()
        .filter(|&f| {
            let [a, b, c] = mesh.face_vertices(f).map(|v| map[v.index()]);
            (b - a).perp_dot(c - a) <= 0.0
        })
        .count()
}
