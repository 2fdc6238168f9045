//! The constraints of the map: arcs, boundary and feature edges are isolines (Campen, sections 6.4.1 and 6.5.2).
//!
//! An arc is constrained at its two end nodes only (equation 6.3); between them it may take any path. Boundary and
//! features are constrained edge by edge. The topology gives the coordinate that is constant along an arc and along the
//! boundary; the direction of the field gives it along a feature. A feature at a slant to the field contradicts the
//! layout and would flip triangles, so it is left out.

use crate::embed::parameterise::feature_axes::{self, DirectedEdge, heading_in};
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::{ThroughArcs, TriangleChain, corner_point};
use crate::mesh::HalfedgeId;
use crate::param::CoordinateConstraint;
use crate::surface::Metric;

/// An edge that is to be an isoline of a coordinate (0: u, 1: v).
pub(in crate::embed) type IsolineEdge = (HalfedgeId, u8);

/// The constraints of the layout itself: its arcs and the boundary.
pub(super) fn layout_constraints(
    topology: &EmbeddingTopology,
    through_arcs: &ThroughArcs,
) -> Vec<CoordinateConstraint> {
    let chain = |c: TriangleChain| CoordinateConstraint {
        from: corner_point(c.start),
        crossed: c.crossed,
        to: corner_point(c.end),
        axis: constant_axis(i32::from(c.heading)),
        difference: 0.0,
    };
    let mut list: Vec<CoordinateConstraint> = through_arcs.chains(topology).into_iter().map(chain).collect();
    let edges = topology.mesh.edges().map(|e| topology.mesh.halfedge(e));
    let boundary = edges.filter_map(|h| {
        topology.boundary.get(&h).map(|&(k, _)| edge_constraint(topology, (h, constant_axis(i32::from(k)))))
    });
    list.extend(boundary);
    list
}

/// The constraint that an edge is an isoline.
pub(super) fn edge_constraint(topology: &EmbeddingTopology, (h, axis): IsolineEdge) -> CoordinateConstraint {
    CoordinateConstraint {
        from: corner_point(h),
        crossed: Vec::new(),
        to: corner_point(topology.mesh.next(h)),
        axis,
        difference: 0.0,
    }
}

/// The coordinate that is constant along a heading: v along ±u and vice versa (the note on equations 6.4 and 6.5).
fn constant_axis(heading: i32) -> u8 {
    if heading % 2 == 0 { 1 } else { 0 }
}

/// Limit of the deviation of the field from feature edges constrained in the least-squares map, in quarter turns: half
/// the deviation at which the direction would be ambiguous. Constraints that contradict the layout flip triangles
/// there.
pub(super) const SLANT_LIMIT: f64 = 0.25;
/// The limit for injective maps, in quarter turns: above every deviation. The direction is decided for the whole line.
pub(in crate::embed) const NO_SLANT_LIMIT: f64 = 4.0;

/// The feature edges that can be isolines in a field of the given angles, sorted by increasing deviation from the
/// field. Edges that deviate by `slant` quarter turns or more are left out.
pub(in crate::embed) fn feature_edges(
    topology: &EmbeddingTopology,
    metric: &Metric,
    angle: &[f64],
    sharp: &[bool],
    slant: f64,
) -> Vec<IsolineEdge> {
    let mesh = &topology.mesh;
    let mut found: Vec<Option<DirectedEdge>> = vec![None; mesh.n_edges()];
    let directed = feature_axes::feature_directions(topology, metric, angle, sharp);
    for edge in directed.into_iter().filter(|e| e.off < slant) {
        found[mesh.edge(edge.halfedge).index()] = Some(edge);
    }
    for f in mesh.faces() {
        // Two sides of a triangle on one isoline would flatten it: the one that deviates more is left out.
        let sides = mesh.face_halfedges(f);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let of = |k: usize| found[mesh.edge(sides[k]).index()];
            let axis = |k: usize| of(k).map(|edge| constant_axis(heading_in(topology, sides[k], &edge)));
            if let (Some(a), Some(b)) = (of(i), of(j))
                && axis(i) == axis(j)
            {
                let worse = if a.off > b.off { a } else { b };
                found[mesh.edge(worse.halfedge).index()] = None;
            }
        }
    }
    let mut list: Vec<DirectedEdge> = found.into_iter().flatten().collect();
    list.sort_by(|a, b| a.off.total_cmp(&b.off).then(a.halfedge.cmp(&b.halfedge)));
    list.into_iter().map(|edge| (edge.halfedge, constant_axis(edge.heading))).collect()
}
