//! Period jumps as integers.
//!
//! A drawing tells the jumps up to full turns. Of the fields with these jumps a smooth one along the arcs is
//! computed, and every edge takes the full turns that make its rotation least. Where that leaves a vertex with another
//! index than the layout asks for (by multiples of four quarters, hence rarely), full turns are moved along
//! shortest paths between such vertices: what the layout asks for is then met exactly.

use std::collections::VecDeque;
use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::embed::EmbeddingError;
use crate::embed::topology::embedding_topology::jump_across;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::solve::{SparseHermitian, SpdFactor, c64};
use crate::surface::Metric;

/// Pull of an arc's direction on a triangle it passes through, beside weights of edges of about 2: the field follows
/// the arcs, but may cut their corners.
const ARC_PULL: f64 = 10.0;
/// A mass that keeps the system definite on a component without arcs.
const GROUND: f64 = 1e-7;
/// Bounds of edge weights: slivers must neither cut the field off nor swamp the system.
const WEIGHT: [f64; 2] = [1e-2, 1e2];

/// The integer jumps with which every inner vertex has the index wanted, and the angles of a field they fit.
///
/// # Errors
///
/// When the linear system cannot be solved, or a vertex has an index that differs by other than full turns.
pub(in crate::embed) fn lift(
    mesh: &TriMesh,
    metric: &Metric,
    jump: &[i32],
    guides: &[(FaceId, DVec3, i32)],
    index: &[i32],
) -> Result<(Vec<i32>, Vec<f64>), EmbeddingError> {
    let angle = smooth_angles(mesh, metric, jump, guides)?;
    let mut lifted: Vec<i32> = mesh
        .edges()
        .map(|e| {
            let h = mesh.halfedge(e);
            let Some(t) = mesh.twin(h) else { return 0 };
            let turn = angle[mesh.face(t).index()] - angle[mesh.face(h).index()] - metric.transport(h, t);
            let p = jump[e.index()];
            p + 4 * ((turn / FRAC_PI_2 - f64::from(p)) / 4.0).round() as i32
        })
        .collect();
    settle(mesh, metric, &mut lifted, index)?;
    Ok((lifted, angle))
}

/// The index, in quarters, of the field around an inner vertex; it follows from the jumps alone.
pub(in crate::embed) fn vertex_index(mesh: &TriMesh, metric: &Metric, jump: &[i32], v: VertexId) -> i32 {
    let mut quarters = 4.0;
    let mut jumps = 0;
    for h in mesh.outgoing(v) {
        let into = mesh.prev(h);
        quarters -= metric.corner_angle(h) / FRAC_PI_2;
        if let Some(t) = mesh.twin(into) {
            // The transport belongs to the edge's own half-edge: to and fro must cancel without full turns.
            let own = mesh.halfedge(mesh.edge(into)) == into;
            quarters -= if own { metric.transport(into, t) } else { -metric.transport(t, into) } / FRAC_PI_2;
            jumps += jump_across(mesh, jump, into);
        }
    }
    quarters.round() as i32 - jumps
}

fn smooth_angles(
    mesh: &TriMesh,
    metric: &Metric,
    jump: &[i32],
    guides: &[(FaceId, DVec3, i32)],
) -> Result<Vec<f64>, EmbeddingError> {
    let n = mesh.n_faces();
    let mut triplets: Vec<(u32, u32, c64)> = (0..n as u32).map(|i| (i, i, c64::new(GROUND, 0.0))).collect();
    let mut rhs = vec![c64::new(0.0, 0.0); n];
    let mut pull = vec![c64::new(0.0, 0.0); n];
    for &(f, along, k) in guides {
        if let Some(a) = metric.angle_of(mesh, f, along) {
            pull[f.index()] += c64::from_polar(along.length(), a - f64::from(k) * FRAC_PI_2);
        }
    }
    for (i, z) in pull.iter().enumerate() {
        let norm = z.norm();
        if norm > 0.0 {
            triplets.push((i as u32, i as u32, c64::new(ARC_PULL, 0.0)));
            rhs[i] += *z * (ARC_PULL / norm);
        }
    }
    for e in mesh.edges() {
        let h = mesh.halfedge(e);
        let Some(t) = mesh.twin(h) else { continue };
        let (f, g) = (mesh.face(h), mesh.face(t));
        let length = metric.length(h);
        let weight = (1.5 * length * length / (metric.area(f) + metric.area(g))).clamp(WEIGHT[0], WEIGHT[1]);
        let along = metric.transport(h, t) + f64::from(jump[e.index()]) * FRAC_PI_2;
        let (i, j) = (f.0, g.0);
        triplets.extend([(i, i, c64::new(weight, 0.0)), (j, j, c64::new(weight, 0.0))]);
        triplets.push((j, i, -c64::from_polar(weight, along)));
    }
    let matrix = SparseHermitian::from_triplets(n, &triplets);
    let z = SpdFactor::new(&matrix)?.solve(&matrix, &rhs)?;
    Ok(z.iter().map(|z| z.arg()).collect())
}

/// Moves full turns between vertices until all inner ones have the index wanted.
fn settle(mesh: &TriMesh, metric: &Metric, jump: &mut [i32], index: &[i32]) -> Result<(), EmbeddingError> {
    let excess = |jump: &[i32], v: VertexId| {
        if mesh.is_boundary_vertex(v) { 0 } else { vertex_index(mesh, metric, jump, v) - index[v.index()] }
    };
    let mut off: Vec<i32> = mesh.vertices().map(|v| excess(jump, v)).collect();
    if let Some(v) = mesh.vertices().find(|v| off[v.index()] % 4 != 0) {
        return Err(EmbeddingError::Turning { vertex: v, quarters: off[v.index()] });
    }
    while let Some(v) = mesh.vertices().find(|v| off[v.index()] != 0) {
        let sign = off[v.index()].signum();
        let path = shortest(mesh, v, |w| off[w.index()] * sign < 0 || mesh.is_boundary_vertex(w))
            .ok_or(EmbeddingError::Turning { vertex: v, quarters: off[v.index()] })?;
        for h in path {
            shift(mesh, jump, h, 4 * sign);
        }
        for w in mesh.vertices() {
            if off[w.index()] != 0 {
                off[w.index()] = excess(jump, w);
            }
        }
    }
    Ok(())
}

/// Moves `quarters` of index from the origin of a half-edge to its target.
pub(in crate::embed) fn shift(mesh: &TriMesh, jump: &mut [i32], h: HalfedgeId, quarters: i32) {
    // Crossing the edge counter-clockwise around its target leads over `h`: more jump there is less index.
    let e = mesh.edge(h);
    jump[e.index()] -= if mesh.halfedge(e) == h { quarters } else { -quarters };
}

/// A path of half-edges with the fewest edges from `from` to a vertex that `wanted` accepts.
fn shortest(mesh: &TriMesh, from: VertexId, wanted: impl Fn(VertexId) -> bool) -> Option<Vec<HalfedgeId>> {
    let mut reached: Vec<Option<HalfedgeId>> = vec![None; mesh.n_vertices()];
    let mut queue = VecDeque::from([from]);
    while let Some(v) = queue.pop_front() {
        if v != from && wanted(v) {
            let mut path = Vec::new();
            let mut at = v;
            while at != from {
                let h = reached[at.index()]?;
                path.push(h);
                at = mesh.origin(h);
            }
            path.reverse();
            return Some(path);
        }
        for h in mesh.outgoing(v) {
            let w = mesh.target(h);
            if w != from && reached[w.index()].is_none() {
                reached[w.index()] = Some(h);
                queue.push_back(w);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::torus;

    #[test]
    fn a_torus_without_jumps_has_no_index() {
        let mesh = torus(12, 8);
        let metric = Metric::new(&mesh);
        let (jump, angle) = lift(&mesh, &metric, &vec![0; mesh.n_edges()], &[], &vec![0; mesh.n_vertices()]).unwrap();
        for v in mesh.vertices() {
            assert_eq!(vertex_index(&mesh, &metric, &jump, v), 0);
        }
        assert!(angle.iter().all(|a| a.is_finite()));
    }
}
