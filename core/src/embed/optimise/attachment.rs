//! Nodes that belong on features.
//!
//! A layout ties nodes to features by their arcs: where a chain of arcs leads from a corner along a feature to a node, that
//! node has the feature's coordinate, and a map in which the feature is an isoline squeezes all that lies between both to
//! nothing. What is squeezed tells which nodes these are: they are brought onto the feature, along edges and with their
//! arcs in tow, and slide along it from then on. Regular nodes follow if their crossing lies on one.

use glam::DVec2;

use crate::embed::EmbeddingError;
use crate::embed::optimise::isoline_crossing::crossing;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::regular_nodes::outward;
use crate::embed::optimise::relocation::{NodeConstraint, edge_path};
use crate::embed::parameterise::feature_axes;
use crate::embed::parameterise::state::State;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{FaceId, HalfedgeId, VertexId};
use crate::progress::Progress;

/// To what share of its width on the surface what lies between a node and its feature is squeezed in the map.
const SQUEEZED: f64 = 0.1;
/// How near to an edge of a feature, in its lengths, the crossing of a regular node lies that belongs there.
const NEAR: f64 = 0.1;
/// How many times as far as it steps a node may be from a line of features that steps because of it.
const STEPPED: f64 = 1.2;

/// The foot of a point on an edge, in the map.
struct Foot {
    halfedge: HalfedgeId,
    /// Where on the edge it is, from 0 to 1.
    along: f64,
    /// How far the point is from the edge's line.
    far: f64,
    /// The length of the edge.
    length: f64,
}

impl Foot {
    fn new(state: &State, halfedge: HalfedgeId, at: DVec2) -> Self {
        let corner = |k: usize| state.solution.map.uv[halfedge.index() / 3][(halfedge.index() + k) % 3];
        let (from, side) = (at - corner(0), corner(1) - corner(0));
        let length = side.length();
        Self { halfedge, along: from.dot(side) / length.powi(2), far: from.perp_dot(side).abs() / length, length }
    }

    /// How far the point is from the edge.
    fn distance(&self) -> f64 {
        let beyond = (self.along - self.along.clamp(0.0, 1.0)) * self.length;
        beyond.hypot(self.far)
    }

    fn is_inside(&self) -> bool {
        (0.0..=1.0).contains(&self.along)
    }

    /// The end of the edge that is nearer.
    fn end(&self, state: &State) -> VertexId {
        let mesh = &state.net.mesh;
        if self.along < 0.5 { mesh.origin(self.halfedge) } else { mesh.target(self.halfedge) }
    }
}

/// A place on a feature: a vertex, and the triangles on the way back from there.
struct Place {
    vertex: VertexId,
    strip: Vec<FaceId>,
}

impl Optimiser<'_> {
    /// Brings nodes onto the features from which what lies between is squeezed away; returns how many.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn attach(&mut self, progress: &Progress) -> Result<usize, EmbeddingError> {
        let beside = |i: usize, h: HalfedgeId, at: DVec2| self.squeezed_to(i, h, at);
        let places = (0..self.pace.len()).map(|i| self.place_of(i, beside)).collect();
        self.bring(places, progress)
    }

    /// Brings nodes onto lines of features that step from one isoline to another at edges let go, where they are no
    /// farther from the line than it steps: the line leaves the isoline of such a node to pass it. Returns how many.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn attach_at_steps(&mut self, progress: &Progress) -> Result<usize, EmbeddingError> {
        let lines = self.stepping_lines();
        let places = (0..self.pace.len()).map(|i| self.place_at_step(i, &lines)).collect();
        self.bring(places, progress)
    }

    /// The lines of features that step at edges let go, and how far at most.
    fn stepping_lines(&self) -> Vec<(Vec<HalfedgeId>, f64)> {
        let State { net, solution, .. } = &self.state;
        let mut step = vec![0.0; net.mesh.n_edges()];
        for (h, axis) in self.aligned().into_iter().filter(|&(h, _)| self.loose[net.mesh.edge(h).index()]) {
            let [p, q] = [h.index() % 3, (h.index() + 1) % 3].map(|k| solution.map.uv[h.index() / 3][k]);
            step[net.mesh.edge(h).index()] = (q - p)[usize::from(axis)].abs();
        }
        let farthest = |line: &[HalfedgeId]| line.iter().map(|&h| step[net.mesh.edge(h).index()]).fold(0.0, f64::max);
        let lines = feature_axes::lines(net, &self.sharp).into_iter();
        lines.map(|line| (farthest(&line), line)).filter(|l| l.0 > 0.0).map(|(far, line)| (line, far)).collect()
    }

    /// The place of an irregular node on one of these lines, that nearest on the surface, if it is no farther from it in
    /// the map than the line steps.
    fn place_at_step(&self, i: usize, lines: &[(Vec<HalfedgeId>, f64)]) -> Option<Place> {
        let State { net, .. } = &self.state;
        let mesh = &net.mesh;
        if net.nodes[i].is_regular() {
            return None;
        }
        let line_of =
            |h: HalfedgeId| lines.iter().position(|(line, _)| line.iter().any(|&l| mesh.edge(l) == mesh.edge(h)));
        let mut found = None;
        self.place_of(i, |_, h, at| {
            let line = line_of(h)?;
            let near = Foot::new(&self.state, h, at).distance() <= STEPPED * lines[line].1;
            found = near.then_some(line);
            near.then(|| mesh.origin(h))
        })?;
        let from = mesh.position(net.nodes[i].vertex);
        let far = |v: &VertexId| mesh.position(*v).distance_squared(from);
        let vertices = lines[found?].0.iter().map(|&h| mesh.origin(h));
        let vertex = vertices.filter(|&v| self.is_free(v)).min_by(|v, w| far(v).total_cmp(&far(w)))?;
        let around = mesh.outgoing(net.nodes[i].vertex).map(|h| (mesh.face(h), DVec2::ZERO));
        let at_vertex = |f: FaceId, _| mesh.face_vertices(f).contains(&vertex).then_some(());
        let ((), strip) = outward(net, &self.state.solution.map, around, at_vertex)?;
        Some(Place { vertex, strip })
    }

    /// Brings nodes to their places, if they have one and the map does not fold there; returns how many.
    fn bring(&mut self, places: Vec<Option<Place>>, progress: &Progress) -> Result<usize, EmbeddingError> {
        if places.iter().all(Option::is_none) {
            return Ok(0);
        }
        let brought = |this: &Self, _: &[u32], stays: &[bool]| this.brought(&places, stays);
        let (found, _) = self.as_far_as_possible(brought, vec![false; self.pace.len()], progress)?;
        let Some(state) = found else {
            self.synchronise(progress)?;
            return Ok(0);
        };
        let mut count = 0;
        for (i, place) in places.iter().enumerate() {
            if place.as_ref().is_some_and(|p| state.net.nodes[i].vertex == p.vertex) {
                self.ground.hold[i] = NodeConstraint::Curve;
                count += 1;
            }
        }
        tracing::debug!(count, "nodes brought onto features");
        self.state = state;
        Ok(count)
    }

    /// The net with nodes at their places but for those that stay.
    fn brought(&self, places: &[Option<Place>], stays: &[bool]) -> EmbeddingTopology {
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
                path.into_iter().for_each(|h| net.move_node(i, h));
            }
        }
        net
    }

    /// The place on a feature that a free node belongs to, if any: the first that `beside` names, given the node, an edge
    /// of a feature and the coordinates that the node is to have in the frame of the edge's triangle.
    fn place_of(
        &self,
        i: usize,
        mut beside: impl FnMut(usize, HalfedgeId, DVec2) -> Option<VertexId>,
    ) -> Option<Place> {
        let State { net, solution, .. } = &self.state;
        let (mesh, map) = (&net.mesh, &solution.map);
        if self.ground.hold[i] != NodeConstraint::Free {
            return None;
        }
        let corners: Vec<(HalfedgeId, DVec2)> = if self.through_arcs.constrained[i] {
            let own = |h: HalfedgeId| (h, map.uv[h.index() / 3][h.index() % 3]);
            mesh.outgoing(net.nodes[i].vertex).map(own).collect()
        } else {
            crossing(net, &self.through_arcs, map, &self.ends[i]).into_iter().collect()
        };
        let first = corners.into_iter().map(|(h, at)| (mesh.face(h), at));
        let (vertex, strip) = outward(net, map, first, |f, at| {
            let features = mesh.face_halfedges(f).into_iter().filter(|&h| self.sharp[mesh.edge(h).index()]);
            features.into_iter().find_map(|h| beside(i, h, at))
        })?;
        self.is_free(vertex).then_some(Place { vertex, strip })
    }

    /// The nearer end of an edge of a feature if a node belongs there because what lies between is squeezed.
    fn squeezed_to(&self, i: usize, h: HalfedgeId, at: DVec2) -> Option<VertexId> {
        let mesh = &self.state.net.mesh;
        let foot = Foot::new(&self.state, h, at);
        // Of a node that is held the coordinates are its own, and what counts is how far it is on the surface.
        let far = mesh.position(self.state.net.nodes[i].vertex).distance(mesh.position(mesh.origin(h)));
        let near = if self.through_arcs.constrained[i] { SQUEEZED * far / mesh.vector(h).length() } else { NEAR };
        (foot.is_inside() && foot.far < near * foot.length).then(|| foot.end(&self.state))
    }

    /// Whether a vertex on a feature may have a node: no corner of features, and no other's place.
    fn is_free(&self, v: VertexId) -> bool {
        let mesh = &self.state.net.mesh;
        let rays = mesh.outgoing(v).filter(|&h| self.sharp[mesh.edge(h).index()]).count();
        rays == 2 && !mesh.is_boundary_vertex(v) && self.state.net.nodes.iter().all(|n| n.vertex != v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embed::topology::testing::net;

    #[test]
    fn a_point_is_as_far_from_an_edge_as_from_its_nearest_point() {
        let halfedge = net().mesh.halfedges().next().unwrap();
        let at = |along: f64, far: f64| Foot { halfedge, along, far, length: 2.0 };
        assert_eq!(at(0.3, 0.5).distance(), 0.5);
        assert!(at(0.3, 0.5).is_inside() && !at(1.2, 0.0).is_inside());
        assert!((at(1.2, 0.3).distance() - 0.5).abs() < 1e-12);
        assert!((at(-0.2, 0.3).distance() - 0.5).abs() < 1e-12);
    }
}
