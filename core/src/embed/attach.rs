//! Nodes that belong on features.
//!
//! A layout ties nodes to features by their arcs: where a chain of arcs leads from a corner along a feature to a node, that
//! node has the feature's coordinate, and a map in which the feature is an isoline squeezes all that lies between both to
//! nothing. What is squeezed tells which nodes these are: they are brought onto the feature, along edges and with their
//! arcs in tow, and slide along it from then on. Regular nodes follow if their crossing lies on one.

use glam::DVec2;

use super::EmbeddingError;
use super::cross::crossing;
use super::descent::Optimizer;
use super::net::Net;
use super::relocate::{Hold, edge_path};
use super::settle::outward;
use super::state::State;
use crate::mesh::{FaceId, HalfedgeId, VertexId};
use crate::progress::Progress;

/// To what share of its width on the surface what lies between a node and its feature is squeezed in the map.
const SQUEEZED: f64 = 0.1;
/// How near to an edge of a feature, in its lengths, the crossing of a regular node lies that belongs there.
const NEAR: f64 = 0.1;

/// A place on a feature: a vertex, and the triangles on the way back from there.
struct Place {
    vertex: VertexId,
    strip: Vec<FaceId>,
}

impl Optimizer<'_> {
    /// Brings nodes onto the features that they belong to; returns how many.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(super) fn attach(&mut self, progress: &Progress) -> Result<usize, EmbeddingError> {
        let places: Vec<Option<Place>> = (0..self.pace.len()).map(|i| self.place_of(i)).collect();
        if places.iter().all(Option::is_none) {
            return Ok(0);
        }
        let brought = |this: &Self, _: &[u32], stays: &[bool]| this.brought(&places, stays);
        let (found, _) = self.as_far_as_possible(brought, progress)?;
        let Some(state) = found else {
            self.synchronise(progress)?;
            return Ok(0);
        };
        let mut count = 0;
        for (i, place) in places.iter().enumerate() {
            if place.as_ref().is_some_and(|p| state.net.nodes[i].vertex == p.vertex) {
                self.ground.hold[i] = Hold::Curve;
                count += 1;
            }
        }
        tracing::debug!(count, "nodes brought onto features");
        self.state = state;
        Ok(count)
    }

    /// The net with nodes at their places but for those that stay.
    fn brought(&self, places: &[Option<Place>], stays: &[bool]) -> Net {
        let mut net = self.state.net.clone();
        for (i, place) in places.iter().enumerate() {
            let Some(Place { vertex, strip }) = place.as_ref().filter(|_| !stays[i]) else { continue };
            let from = net.nodes[i].vertex;
            let taken: Vec<VertexId> = net.nodes.iter().map(|n| n.vertex).filter(|&v| v != from).collect();
            if taken.contains(vertex) {
                continue;
            }
            if let Some(path) = edge_path(&net.mesh, strip, from, *vertex, |v| taken.contains(&v)) {
                net.mesh.set_position(from, self.ground.home[from.index()]);
                path.into_iter().for_each(|h| net.move_along(i, h));
            }
        }
        net
    }

    /// The place on a feature that a free node belongs to, if any.
    fn place_of(&self, i: usize) -> Option<Place> {
        let State { net, solution, .. } = &self.state;
        let (mesh, map) = (&net.mesh, &solution.map);
        if self.ground.hold[i] != Hold::Free {
            return None;
        }
        let corners: Vec<(HalfedgeId, DVec2)> = if self.roads.held[i] {
            let own = |h: HalfedgeId| (h, map.uv[h.index() / 3][h.index() % 3]);
            mesh.outgoing(net.nodes[i].vertex).map(own).collect()
        } else {
            crossing(net, &self.roads, map, &self.ends[i]).into_iter().collect()
        };
        let first = corners.into_iter().map(|(h, at)| (mesh.face(h), at));
        let (vertex, strip) = outward(net, map, first, |f, at| {
            let features = mesh.face_halfedges(f).into_iter().filter(|&h| self.sharp[mesh.edge(h).index()]);
            features.into_iter().find_map(|h| self.end_beside(i, h, at))
        })?;
        self.is_free(vertex).then_some(Place { vertex, strip })
    }

    /// The nearer end of an edge of a feature if a node belongs there that is to have coordinates `at` in the frame of the
    /// edge's triangle.
    fn end_beside(&self, i: usize, h: HalfedgeId, at: DVec2) -> Option<VertexId> {
        let State { net, solution, .. } = &self.state;
        let mesh = &net.mesh;
        let [p, q] = [h.index() % 3, (h.index() + 1) % 3].map(|k| solution.map.uv[h.index() / 3][k]);
        let along = (at - p).dot(q - p) / (q - p).length_squared();
        let across = (at - p).perp_dot(q - p).abs() / (q - p).length_squared();
        // Of a node that is held the coordinates are its own, and what counts is how far it is on the surface.
        let far = mesh.position(net.nodes[i].vertex).distance(mesh.position(mesh.origin(h))) / mesh.vector(h).length();
        let near = if self.roads.held[i] { SQUEEZED * far } else { NEAR };
        let end = if along < 0.5 { mesh.origin(h) } else { mesh.target(h) };
        ((0.0..=1.0).contains(&along) && across < near).then_some(end)
    }

    /// Whether a vertex on a feature may have a node: no corner of features, and no other's place.
    fn is_free(&self, v: VertexId) -> bool {
        let mesh = &self.state.net.mesh;
        let rays = mesh.outgoing(v).filter(|&h| self.sharp[mesh.edge(h).index()]).count();
        rays == 2 && !mesh.is_boundary_vertex(v) && self.state.net.nodes.iter().all(|n| n.vertex != v)
    }
}
