//! Period jumps as integers, and the index of the field they prescribe at each vertex.
//!
//! The initial embedding determines the period jump of an edge, an integer rotation in quarter turns, only modulo 4.
//! The smoothest field with these jumps that follows the arcs is computed (one linear solve), and each edge takes the
//! representative that makes the rotation of this field across it least. A vertex may then have an index that differs
//! from the layout's by a multiple of 4; this is rare. Such multiples are moved along shortest edge paths from one such
//! vertex to another, so that in the end every inner vertex has exactly its index.
//!
//! Zipping (Campen, section 6.3.1) solves the same problem from turning numbers along generators; here the jumps along
//! the initial embedding already determine these.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::embed::EmbeddingError;
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::solve::{SparseHermitian, SpdFactor, c64};
use crate::surface::Metric;

/// Penalty weight of an arc's direction in a triangle that the arc passes through, beside edge weights of about 2: the
/// field follows the arcs, but may cut their corners.
const ARC_PENALTY: f64 = 10.0;
/// Diagonal term that keeps the system positive definite on a component without arcs; far below the edge weights.
const REGULARISATION: f64 = 1e-7;
/// Bounds of an edge weight, which is about 2 for equilateral triangles. Slivers have weights far outside them: too
/// small a weight would decouple the field across the edge, too large a one would spoil the conditioning.
const WEIGHT_BOUNDS: [f64; 2] = [1e-2, 1e2];

/// A direction in a triangle that the field should take there.
#[derive(Debug, Clone, Copy)]
pub(super) struct DirectionHint {
    /// The triangle.
    pub face: FaceId,
    /// The direction in space; its length is its weight among the hints of the triangle.
    pub vector: DVec3,
    /// Which direction of the cross it is; modulo 4.
    pub direction: i32,
}

/// The integer jumps with which every inner vertex has the index `index[v]` (in quarter turns), and the angle of
/// direction 0 of a smooth field with these jumps in each triangle. `jump` holds the jumps modulo 4.
///
/// # Errors
///
/// [`EmbeddingError::Solve`] when the linear system cannot be solved, [`EmbeddingError::Turning`] where the given jumps
/// contradict an index modulo 4.
pub(super) fn integer_jumps(
    mesh: &TriMesh,
    metric: &Metric,
    jump: &[i32],
    hints: &[DirectionHint],
    index: &[i32],
) -> Result<(Vec<i32>, Vec<f64>), EmbeddingError> {
    let angle = smooth_angles(mesh, metric, jump, hints)?;
    let mut integer: Vec<i32> = mesh
        .edges()
        .map(|e| {
            let h = mesh.halfedge(e);
            let Some(t) = mesh.twin(h) else { return 0 };
            let turn = angle[mesh.face(t).index()] - angle[mesh.face(h).index()] - metric.transport(h, t);
            let p = jump[e.index()];
            p + 4 * ((turn / FRAC_PI_2 - f64::from(p)) / 4.0).round() as i32
        })
        .collect();
    correct_indices(mesh, metric, &mut integer, index)?;
    Ok((integer, angle))
}

/// The period jump across `h`, from its triangle to that of its twin.
#[inline]
pub(super) fn jump_across(mesh: &TriMesh, jump: &[i32], h: HalfedgeId) -> i32 {
    let e = mesh.edge(h);
    if mesh.halfedge(e) == h { jump[e.index()] } else { -jump[e.index()] }
}

/// The sum of the jumps across a chain of half-edges: the rotation from the first triangle's frame to the last one's.
pub(super) fn turns_along(mesh: &TriMesh, jump: &[i32], crossed: &[HalfedgeId]) -> i32 {
    crossed.iter().map(|&h| jump_across(mesh, jump, h)).sum()
}

/// The index, in quarter turns, of the field around an inner vertex; it follows from the jumps alone.
pub(super) fn vertex_index(mesh: &TriMesh, metric: &Metric, jump: &[i32], v: VertexId) -> i32 {
    let mut quarters = 4.0;
    let mut jumps = 0;
    for h in mesh.outgoing(v) {
        let into = mesh.prev(h);
        quarters -= metric.corner_angle(h) / FRAC_PI_2;
        if let Some(t) = mesh.twin(into) {
            // The transport of an edge is always measured from its own half-edge: measured from the other, it could
            // differ from the inverse by a full turn.
            let own = mesh.halfedge(mesh.edge(into)) == into;
            quarters -= if own { metric.transport(into, t) } else { -metric.transport(t, into) } / FRAC_PI_2;
            jumps += jump_across(mesh, jump, into);
        }
    }
    quarters.round() as i32 - jumps
}

/// The angles of the smoothest field that has the given jumps and follows the hints: the minimum of a quadratic energy
/// in one complex number per triangle, of which the argument is taken.
fn smooth_angles(
    mesh: &TriMesh,
    metric: &Metric,
    jump: &[i32],
    hints: &[DirectionHint],
) -> Result<Vec<f64>, EmbeddingError> {
    let n = mesh.n_faces();
    let mut triplets: Vec<(u32, u32, c64)> = (0..n as u32).map(|i| (i, i, c64::new(REGULARISATION, 0.0))).collect();
    let mut rhs = vec![c64::new(0.0, 0.0); n];
    let mut hint = vec![c64::new(0.0, 0.0); n];
    for &DirectionHint { face, vector, direction } in hints {
        if let Some(a) = metric.angle_of(mesh, face, vector) {
            hint[face.index()] += c64::from_polar(vector.length(), a - f64::from(direction) * FRAC_PI_2);
        }
    }
    for (i, z) in hint.iter().enumerate() {
        let norm = z.norm();
        if norm > 0.0 {
            triplets.push((i as u32, i as u32, c64::new(ARC_PENALTY, 0.0)));
            rhs[i] += *z * (ARC_PENALTY / norm);
        }
    }
    for e in mesh.edges() {
        let h = mesh.halfedge(e);
        let Some(t) = mesh.twin(h) else { continue };
        let (f, g) = (mesh.face(h), mesh.face(t));
        let length = metric.length(h);
        let weight =
            (1.5 * length * length / (metric.area(f) + metric.area(g))).clamp(WEIGHT_BOUNDS[0], WEIGHT_BOUNDS[1]);
        let along = metric.transport(h, t) + f64::from(jump[e.index()]) * FRAC_PI_2;
        let (i, j) = (f.0, g.0);
        triplets.extend([(i, i, c64::new(weight, 0.0)), (j, j, c64::new(weight, 0.0))]);
        triplets.push((j, i, -c64::from_polar(weight, along)));
    }
    let matrix = SparseHermitian::from_triplets(n, &triplets);
    let z = SpdFactor::new(&matrix)?.solve(&matrix, &rhs)?;
    Ok(z.iter().map(|z| z.arg()).collect())
}

/// Moves multiples of 4 of index between vertices, or out over the boundary, until every inner vertex has its index.
fn correct_indices(mesh: &TriMesh, metric: &Metric, jump: &mut [i32], index: &[i32]) -> Result<(), EmbeddingError> {
    let excess = |jump: &[i32], v: VertexId| {
        if mesh.is_boundary_vertex(v) { 0 } else { vertex_index(mesh, metric, jump, v) - index[v.index()] }
    };
    let mut off: Vec<i32> = mesh.vertices().map(|v| excess(jump, v)).collect();
    if let Some(v) = mesh.vertices().find(|v| off[v.index()] % 4 != 0) {
        return Err(EmbeddingError::Turning { vertex: v, quarters: off[v.index()] });
    }
    while let Some(v) = mesh.vertices().find(|v| off[v.index()] != 0) {
        let sign = off[v.index()].signum();
        let path = fewest_edges(mesh, v, |w| off[w.index()] * sign < 0 || mesh.is_boundary_vertex(w))
            .ok_or(EmbeddingError::Turning { vertex: v, quarters: off[v.index()] })?;
        for h in path {
            move_index(mesh, jump, h, 4 * sign);
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
pub(super) fn move_index(mesh: &TriMesh, jump: &mut [i32], h: HalfedgeId, quarters: i32) {
    // Counter-clockwise around its target the edge is crossed over `h`, and around its origin over the twin: a smaller
    // jump across `h` is more index at the target and less at the origin.
    let e = mesh.edge(h);
    jump[e.index()] -= if mesh.halfedge(e) == h { quarters } else { -quarters };
}

/// An edge path with the fewest edges from `from` to a vertex that satisfies `is_target`, by breadth-first search.
pub(super) fn fewest_edges(
    mesh: &TriMesh,
    from: VertexId,
    is_target: impl Fn(VertexId) -> bool,
) -> Option<Vec<HalfedgeId>> {
    let mut search = BreadthFirst::new(mesh.n_vertices());
    search.start(from);
    while let Some(v) = search.visit() {
        if v != from && is_target(v) {
            return search.path_to(v, |&h| mesh.origin(h));
        }
        for h in mesh.outgoing(v) {
            search.reach(mesh.target(h), h);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::torus;

    #[test]
    fn zero_jumps_on_a_torus_give_index_zero_everywhere() {
        let mesh = torus(12, 8);
        let metric = Metric::new(&mesh);
        let (no_jump, no_index) = (vec![0; mesh.n_edges()], vec![0; mesh.n_vertices()]);
        let (jump, angle) = integer_jumps(&mesh, &metric, &no_jump, &[], &no_index).unwrap();
        for v in mesh.vertices() {
            assert_eq!(vertex_index(&mesh, &metric, &jump, v), 0);
        }
        assert!(angle.iter().all(|a| a.is_finite()));
    }

    #[test]
    fn an_index_off_by_full_turns_is_corrected() {
        let mesh = torus(12, 8);
        let metric = Metric::new(&mesh);
        let mut jump = vec![0; mesh.n_edges()];
        let index: Vec<i32> = mesh.vertices().map(|v| vertex_index(&mesh, &metric, &jump, v)).collect();
        for (h, quarters) in [(HalfedgeId(5), 4), (HalfedgeId(200), -8), (HalfedgeId(301), 4)] {
            move_index(&mesh, &mut jump, h, quarters);
        }
        correct_indices(&mesh, &metric, &mut jump, &index).unwrap();
        for v in mesh.vertices() {
            assert_eq!(vertex_index(&mesh, &metric, &jump, v), index[v.index()]);
        }
        move_index(&mesh, &mut jump, HalfedgeId(5), 1);
        let error = correct_indices(&mesh, &metric, &mut jump, &index).unwrap_err();
        assert!(matches!(error, EmbeddingError::Turning { .. }));
    }

    #[test]
    fn the_path_with_the_fewest_edges_is_found_or_none() {
        let mesh = torus(12, 8);
        // Vertex `i + 12 j` of the grid; diagonals go from (i, j) to (i + 1, j + 1).
        let path = fewest_edges(&mesh, VertexId(0), |v| v == VertexId(3 + 12 * 3)).unwrap();
        assert_eq!(path.len(), 3);
        assert_eq!((mesh.origin(path[0]), mesh.target(path[2])), (VertexId(0), VertexId(39)));
        assert!(path.windows(2).all(|w| mesh.target(w[0]) == mesh.origin(w[1])));
        assert!(fewest_edges(&mesh, VertexId(0), |_| false).is_none());
        assert_eq!(fewest_edges(&mesh, VertexId(0), |_| true).unwrap().len(), 1, "the start is not a target");
    }
}
