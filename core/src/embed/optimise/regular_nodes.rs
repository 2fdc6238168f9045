//! Placement of regular nodes at the crossings of their isolines.
//!
//! While nodes move, regular nodes are not constrained: their through-arcs are, and the node belongs where these cross,
//! inside some triangle. A corner of that triangle is moved to the crossing, and the coordinates of moved vertices are
//! read off the present map at their new positions. So the node has the coordinates of the crossing, and constraining
//! it does not change the map.

use glam::{DVec2, DVec3};

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::isoline_crossing::{crossing, search_outward};
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::relocation::{CrossingPoint, NodeConstraint};
use crate::embed::parameterise::chord_lengths::transition;
use crate::embed::parameterise::solve::FeatureConstraint;
use crate::embed::parameterise::state::State;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::fan_crossings;
use crate::mesh::{FaceId, HalfedgeId, VertexId};
use crate::param::SeamlessMap;
use crate::progress::Progress;
use crate::surface::nearest_in_triangle;

/// Barycentric coordinate up to which a point counts as lying on the opposite side: rounding.
const ON_SIDE: f64 = 1e-6;
/// Attempts to place the nodes, each without the nodes around which triangles flipped in those before. Chosen by hand.
const ATTEMPTS: usize = 6;

impl Optimiser<'_> {
    /// Places regular nodes at the crossings of their isolines. Nodes around which triangles would flip stay off their
    /// crossings; if no attempt succeeds, all nodes stay.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(super) fn place_regular_nodes(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let cell = self.cells();
        let mut stays = vec![false; self.step_factor.len()];
        for _ in 0..ATTEMPTS {
            let (topology, on_feature) = self.with_nodes_at_crossings(&stays);
            let uv = self.transfer_map(&topology);
            match self.try_solve_near(topology, &uv, progress)? {
                Ok(state) => {
                    self.state = state;
                    for i in on_feature {
                        self.projection.node_constraint[i] = NodeConstraint::Curve;
                    }
                    return Ok(());
                }
                Err(flipped) => {
                    let before = stays.clone();
                    self.mark_nodes_near(&flipped, &cell, &mut stays);
                    if stays == before {
                        break;
                    }
                    tracing::debug!(nodes = stays.iter().filter(|&&s| s).count(), "nodes stay off their crossings");
                }
            }
        }
        Ok(())
    }

    /// The topology with regular nodes at their crossings, but for those that `stays` marks; and the nodes that came
    /// onto features.
    fn with_nodes_at_crossings(&self, stays: &[bool]) -> (EmbeddingTopology, Vec<usize>) {
        let mut topology = self.state.topology.clone();
        let mut on_feature = Vec::new();
        for (i, &stays) in stays.iter().enumerate() {
            if self.through_arcs.constrained[i]
                || stays
                || self.projection.node_constraint[i] == NodeConstraint::Fixed
                || topology.nodes[i].boundary
            {
                continue;
            }
            let Some(crossing) = self.crossing_of(i) else { continue };
            let exact = self.features == FeatureConstraint::Hard;
            let sharp = |h: HalfedgeId| exact && self.sharp[topology.mesh.edge(h).index()];
            let from = topology.nodes[i].vertex;
            let fits = |moved: &EmbeddingTopology| self.is_injective_around(moved, from, i);
            let found = self.projection.put_at(&topology, i, &crossing, sharp).find(fits);
            if let Some(moved) = found {
                topology = moved;
                if self.projection.on_curve[topology.nodes[i].vertex.index()] {
                    on_feature.push(i);
                }
            }
        }
        (topology, on_feature)
    }

    /// Whether the transferred map flips no triangle around the vertex `from`, which the node has left, and the node's
    /// vertex.
    fn is_injective_around(&self, moved: &EmbeddingTopology, from: VertexId, node: usize) -> bool {
        let around = |v: VertexId| moved.mesh.outgoing(v).map(|h| moved.mesh.face(h));
        around(from).chain(around(moved.nodes[node].vertex)).all(|f| {
            let [a, b, c] = moved.mesh.face_halfedges(f).map(|h| self.transfer_corner(moved, h));
            (b - a).perp_dot(c - a) > 0.0
        })
    }

    /// The crossing of the isolines of a regular node; `None` where the map does not determine it.
    fn crossing_of(&self, i: usize) -> Option<CrossingPoint> {
        let State { topology, solution, .. } = &self.state;
        let (h, target) = crossing(topology, &self.through_arcs, &solution.map, &self.half_arcs[i])?;
        locate(topology, &solution.map, topology.mesh.face(h), target)
    }

    /// The present map on a topology some of whose vertices have moved: the coordinates of the corners of each
    /// triangle.
    fn transfer_map(&self, moved: &EmbeddingTopology) -> Vec<[DVec2; 3]> {
        let mesh = &moved.mesh;
        mesh.faces().map(|f| mesh.face_halfedges(f).map(|h| self.transfer_corner(moved, h))).collect()
    }

    /// The coordinates of one corner.
    fn transfer_corner(&self, moved: &EmbeddingTopology, h: HalfedgeId) -> DVec2 {
        let State { topology, solution, .. } = &self.state;
        let (mesh, map, v) = (&topology.mesh, &solution.map, topology.mesh.origin(h));
        let read = || {
            let (from, at) = coordinates_near(topology, map, v, moved.mesh.position(v))?;
            let crossed = fan_crossings(mesh, from, h)?;
            Some(transition(mesh, map, &crossed)?.apply(at))
        };
        let stays = mesh.position(v) == moved.mesh.position(v) || mesh.is_boundary_vertex(v);
        (if stays { None } else { read() }).unwrap_or(map.uv[h.index() / 3][h.index() % 3])
    }
}

/// The coordinates of the point nearest to `position` in the triangles around a vertex, and the corner in whose chart
/// they are.
fn coordinates_near(
    topology: &EmbeddingTopology,
    map: &SeamlessMap,
    v: VertexId,
    position: DVec3,
) -> Option<(HalfedgeId, DVec2)> {
    let mesh = &topology.mesh;
    let point = |h: HalfedgeId| {
        let f = mesh.face(h);
        let corners = mesh.face_vertices(f).map(|w| mesh.position(w));
        let weights = nearest_in_triangle(position, &corners);
        let nearest: DVec3 = corners.iter().zip(weights).map(|(p, w)| *p * w).sum();
        let at: DVec2 = map.uv[f.index()].iter().zip(weights).map(|(p, w)| *p * w).sum();
        (nearest.distance_squared(position), h, at)
    };
    let best = mesh.outgoing(v).map(point).min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((best.1, best.2))
}

/// The point with coordinates `target` in the chart of triangle `from`, the nearest one if several triangles have it.
fn locate(topology: &EmbeddingTopology, map: &SeamlessMap, from: FaceId, target: DVec2) -> Option<CrossingPoint> {
    let mesh = &topology.mesh;
    let inside = |f: FaceId, at: DVec2| Some((f, barycentric(&map.uv[f.index()], at)?));
    let ((face, weights), strip) = search_outward(topology, map, [(from, target)], inside)?;
    let corners = mesh.face_vertices(face).map(|v| mesh.position(v));
    let position = corners.iter().zip(weights).map(|(p, w)| *p * w).sum();
    Some(CrossingPoint { face, weights, position, strip })
}

/// The barycentric coordinates of a point in a triangle of the plane, exactly 0 next to a side; `None` outside.
fn barycentric(corners: &[DVec2; 3], at: DVec2) -> Option<[f64; 3]> {
    let [a, b, c] = *corners;
    let area = (b - a).perp_dot(c - a);
    let weights = [(b - at).perp_dot(c - at), (c - at).perp_dot(a - at), (a - at).perp_dot(b - at)].map(|w| w / area);
    if !weights.iter().all(|w| *w >= -ON_SIDE) {
        return None;
    }
    let cut = weights.map(|w| if w < ON_SIDE { 0.0 } else { w });
    let sum: f64 = cut.iter().sum();
    Some(cut.map(|w| w / sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn barycentric_coordinates_next_to_a_side_and_outside() {
        let corners = [DVec2::ZERO, DVec2::new(2.0, 0.0), DVec2::new(0.0, 1.0)];
        let inside = barycentric(&corners, DVec2::new(0.5, 0.25)).unwrap();
        let at: DVec2 = corners.iter().zip(inside).map(|(p, w)| *p * w).sum();
        assert!(at.distance(DVec2::new(0.5, 0.25)) < 1e-12);
        let beside = barycentric(&corners, DVec2::new(1.0, -1e-9)).unwrap();
        assert_eq!(beside[2], 0.0);
        assert!((beside.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(barycentric(&corners, DVec2::new(1.0, -1e-3)).is_none());
    }
}
