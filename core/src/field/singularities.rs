//! Singularities of cross fields: their indices, and cancellation of close pairs.
//!
//! The index of a vertex is the angle defect plus the residual rotations around it, a whole number of quarter turns.
//! Over a closed surface indices sum to `4 χ` quarters (Poincaré–Hopf). With a boundary, they do so together with the indices
//! of boundary vertices, which are counted against the direction of the boundary.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::period_jumps::residual_rotation;
use crate::mesh::{Dijkstra, HalfedgeId, TriMesh, VertexId};
use crate::surface::Metric;

/// A vertex of non-zero index of a cross field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singularity {
    /// The vertex.
    pub vertex: VertexId,
    /// Index in quarters. A node of a layout there has valence `4 − index`, on the boundary `3 − index`.
    pub index: i8,
}

/// The singularities at inner vertices, by ascending vertex.
pub(super) fn inner_singularities(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i8]) -> Vec<Singularity> {
    collect(mesh, metric, angle, jump, false)
}

/// The singularities at all vertices, by ascending vertex, of a field that is aligned with the boundary.
pub(super) fn all_singularities(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i8]) -> Vec<Singularity> {
    collect(mesh, metric, angle, jump, true)
}

/// The vertices of non-zero index; those on the boundary only if `boundary`.
fn collect(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i8], boundary: bool) -> Vec<Singularity> {
    let index = vertex_indices(mesh, metric, |h| residual_rotation(metric, mesh, angle, jump, h));
    mesh.vertices()
        .filter(|&v| boundary || !mesh.is_boundary_vertex(v))
        .map(|vertex| Singularity { vertex, index: index[vertex.index()] as i8 })
        .filter(|s| s.index != 0)
        .collect()
}

/// The index of each vertex in quarters; `residual` is the residual rotation across a half-edge, zero on the boundary.
pub(super) fn vertex_indices(mesh: &TriMesh, metric: &Metric, residual: impl Fn(HalfedgeId) -> f64) -> Vec<i32> {
    let mut turn: Vec<f64> = mesh.vertices().map(|v| if mesh.is_boundary_vertex(v) { PI } else { TAU }).collect();
    for h in mesh.halfedges() {
        turn[mesh.origin(h).index()] -= metric.corner_angle(h);
        // Crossing `h` leads counter-clockwise around its target.
        turn[mesh.target(h).index()] += residual(h);
    }
    turn.into_iter().map(|a| (a / FRAC_PI_2).round() as i32).collect()
}

/// The singularities that remain when pairs of opposite sign closer than `radius`, measured along edges, cancel, the closest
/// pair first. The sum of both indices stays where the larger absolute index was.
pub fn cancel_opposite_pairs(mesh: &TriMesh, singularities: &[Singularity], radius: f64) -> Vec<Singularity> {
    let mut index: BTreeMap<VertexId, i8> = singularities.iter().map(|s| (s.vertex, s.index)).collect();
    let mut pairs: Vec<(f64, VertexId, VertexId)> = Vec::new();
    for (&v, &i) in &index {
        if i > 0 {
            let near = within(mesh, v, radius);
            let opposite = |w: &VertexId| index.get(w).is_some_and(|&j| j < 0);
            pairs.extend(near.filter(|(w, _)| opposite(w)).map(|(w, d)| (d, v, w)));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    for (_, v, w) in pairs {
        let (i, j) = (index[&v], index[&w]);
        if i > 0 && j < 0 {
            let sum = i + j;
            index.insert(v, sum.max(0));
            index.insert(w, sum.min(0));
        }
    }
    index.into_iter().filter(|e| e.1 != 0).map(|(vertex, index)| Singularity { vertex, index }).collect()
}

/// The vertices closer to `from` than `radius`, measured along edges, and their distances.
fn within(mesh: &TriMesh, from: VertexId, radius: f64) -> impl Iterator<Item = (VertexId, f64)> {
    let mut search: Dijkstra<VertexId, HalfedgeId> = Dijkstra::sparse();
    search.start(from, 0.0);
    std::iter::from_fn(move || {
        let (v, distance) = search.settle()?;
        for (h, w) in mesh.spokes(v) {
            let far = distance + mesh.vector(h).length();
            if far < radius {
                search.reach(w, far, h);
            }
        }
        Some((v, distance))
    })
}
