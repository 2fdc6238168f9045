//! Singularities of cross fields: their indices, and which of them matter.
//!
//! Around a vertex the cross turns by a whole number of quarter turns, counted by the vertex' curvature and the
//! turns between its triangles. Over a closed surface the quarters sum to `4 χ` (Poincaré–Hopf); with a boundary
//! they do so together with those of the boundary vertices, counted against the boundary's own direction.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::FRAC_PI_2;

use super::period_jumps::rest;
use crate::mesh::{TriMesh, VertexId};
use crate::surface::Metric;

/// A vertex around which a cross field turns by other than a full turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singularity {
    /// The vertex.
    pub vertex: VertexId,
    /// Index in quarters; a node there has valence `4 − index` (at the boundary `3 − index`).
    pub index: i8,
}

/// The singularities at inner vertices, by vertex.
pub(super) fn inner_singularities(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i8]) -> Vec<Singularity> {
    collect(mesh, metric, angle, jump, false)
}

/// The singularities at all vertices, by vertex, of a field that is aligned with the boundary.
pub(super) fn all_singularities(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i8]) -> Vec<Singularity> {
    collect(mesh, metric, angle, jump, true)
}

fn collect(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i8], boundary: bool) -> Vec<Singularity> {
    let mut quarters: Vec<f64> = mesh
        .vertices()
        .map(|v| if mesh.is_boundary_vertex(v) { std::f64::consts::PI } else { 2.0 * std::f64::consts::PI })
        .collect();
    for h in mesh.halfedges() {
        // Crossing the incoming spoke `h` leads counter-clockwise around its target.
        quarters[mesh.origin(h).index()] -= metric.corner_angle(h);
        quarters[mesh.target(h).index()] += rest(metric, mesh, angle, jump, h);
    }
    mesh.vertices()
        .filter(|&v| boundary || !mesh.is_boundary_vertex(v))
        .map(|vertex| Singularity { vertex, index: (quarters[vertex.index()] / FRAC_PI_2).round() as i8 })
        .filter(|s| s.index != 0)
        .collect()
}

/// The singularities that remain when those of opposite sign cancel that are closer along edges than `radius`,
/// the closest pairs first. What is left of a pair stays where the larger index was.
pub fn pronounced(mesh: &TriMesh, singularities: &[Singularity], radius: f64) -> Vec<Singularity> {
    let mut index: BTreeMap<VertexId, i8> = singularities.iter().map(|s| (s.vertex, s.index)).collect();
    let mut pairs: Vec<(f64, VertexId, VertexId)> = Vec::new();
    for (&v, &i) in &index {
        if i > 0 {
            let near = within(mesh, v, radius);
            let opposite = |w: &VertexId| index.get(w).is_some_and(|&j| j < 0);
            pairs.extend(near.into_iter().filter(|(w, _)| opposite(w)).map(|(w, d)| (d, v, w)));
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

/// The vertices closer to `from` along edges than `radius`, with their distances, by vertex.
fn within(mesh: &TriMesh, from: VertexId, radius: f64) -> BTreeMap<VertexId, f64> {
    // Distances are not negative, so their bits order as they do.
    let mut queue = BinaryHeap::from([Reverse((0.0f64.to_bits(), from))]);
    let mut settled = BTreeMap::new();
    while let Some(Reverse((bits, v))) = queue.pop() {
        if settled.contains_key(&v) {
            continue;
        }
        let d = f64::from_bits(bits);
        settled.insert(v, d);
        for h in mesh.outgoing(v).flat_map(|h| [h, mesh.prev(h)]) {
            let w = if mesh.origin(h) == v { mesh.target(h) } else { mesh.origin(h) };
            let far = d + mesh.vector(h).length();
            if far < radius && !settled.contains_key(&w) {
                queue.push(Reverse((far.to_bits(), w)));
            }
        }
    }
    settled
}
