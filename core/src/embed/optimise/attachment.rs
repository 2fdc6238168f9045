//! Attachment of nodes to features.
//!
//! Arcs tie nodes to features: if a chain of arcs runs from a corner of a feature along it to a node, the node has the
//! constant coordinate of the feature, and a map in which the feature is an isoline squeezes all triangles between
//! both. Squeezed triangles therefore reveal such nodes; distance on the surface does not. They are moved onto the
//! feature, along edges and with their arcs, and stay on it from then on. Unconstrained regular nodes follow if their
//! crossing lies on a feature.

use glam::DVec2;

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::isoline_crossing::{crossing, search_outward};
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::relocation::{NodeConstraint, edge_path};
use crate::embed::parameterise::feature_axes;
use crate::embed::parameterise::state::State;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{FaceId, HalfedgeId, VertexId};
use crate::progress::Progress;

/// Largest ratio of the distance between a constrained node and its feature in the map to their distance on the
/// surface, both in lengths of the feature edge, at which the node is attached. Chosen by hand.
const SQUEEZED: f64 = 0.1;
/// Largest distance in the map, in lengths of the feature edge, of the crossing of a regular node at which it is
/// attached.
const NEAR: f64 = 0.1;
/// Largest ratio of the distance of a node from a stepping line to the step, both in the map, at which the node is
/// attached: equality with some tolerance.
const STEP_RATIO: f64 = 1.2;

/// The foot of the perpendicular from a point to an edge, in the map.
struct Foot {
    halfedge: HalfedgeId,
    /// Its position on the edge's line, 0 at the origin of the half-edge and 1 at its target.
    along: f64,
    /// Distance of the point from the line.
    far: f64,
    /// Length of the edge.
    length: f64,
}

impl Foot {
    fn new(state: &State, halfedge: HalfedgeId, at: DVec2) -> Self {
        let corner = |k: usize| state.solution.map.uv[halfedge.index() / 3][(halfedge.index() + k) % 3];
        let (from, side) = (at - corner(0), corner(1) - corner(0));
        let length = side.length();
        Self { halfedge, along: from.dot(side) / length.powi(2), far: from.perp_dot(side).abs() / length, length }
    }

    /// Distance of the point from the edge.
    fn distance(&self) -> f64 {
        let beyond = (self.along - self.along.clamp(0.0, 1.0)) * self.length;
        beyond.hypot(self.far)
    }

    fn is_inside(&self) -> bool {
        (0.0..=1.0).contains(&self.along)
    }

    /// The nearer end of the edge.
    fn end(&self, state: &State) -> VertexId {
        let mesh = &state.topology.mesh;
        if self.along < 0.5 { mesh.origin(self.halfedge) } else { mesh.target(self.halfedge) }
    }
}

/// The vertex on a feature that a node is to be attached to.
struct Target {
    vertex: VertexId,
    /// Adjacent triangles from there back to the node.
    strip: Vec<FaceId>,
}

/// A feature line at whose relaxed edges the constant coordinate steps.
struct SteppingLine {
    edges: Vec<HalfedgeId>,
    /// The largest step.
    step: f64,
}

impl Optimiser<'_> {
    /// Attaches nodes to features from which squeezed triangles separate them; returns their number.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(super) fn attach_nodes(&mut self, progress: &Progress) -> Result<usize, EmbeddingError> {
        let beside = |i: usize, h: HalfedgeId, at: DVec2| self.squeezed_to(i, h, at);
        let targets = (0..self.step_factor.len()).map(|i| self.target_of(i, beside)).collect();
        self.move_to_targets(targets, progress)
    }

    /// Attaches irregular nodes to feature lines that step from one isoline to another at relaxed edges, if the node is
    /// no farther from the line than it steps: such a line leaves the isoline of the node in order to pass it. Returns
    /// their number.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(super) fn attach_nodes_at_steps(&mut self, progress: &Progress) -> Result<usize, EmbeddingError> {
        let lines = self.stepping_lines();
        let targets = (0..self.step_factor.len()).map(|i| self.target_at_step(i, &lines)).collect();
        self.move_to_targets(targets, progress)
    }

    fn stepping_lines(&self) -> Vec<SteppingLine> {
        let State { topology, solution, .. } = &self.state;
        let mut step = vec![0.0; topology.mesh.n_edges()];
        for (h, axis) in self.feature_edges().into_iter().filter(|&(h, _)| self.relaxed[topology.mesh.edge(h).index()])
        {
            let [p, q] = [h.index() % 3, (h.index() + 1) % 3].map(|k| solution.map.uv[h.index() / 3][k]);
            step[topology.mesh.edge(h).index()] = (q - p)[usize::from(axis)].abs();
        }
        let largest =
            |line: &[HalfedgeId]| line.iter().map(|&h| step[topology.mesh.edge(h).index()]).fold(0.0, f64::max);
        let lines = feature_axes::lines(topology, &self.sharp).into_iter();
        lines.map(|edges| SteppingLine { step: largest(&edges), edges }).filter(|l| l.step > 0.0).collect()
    }

    /// The target of an irregular node on a stepping line: the free vertex nearest on the surface.
    fn target_at_step(&self, i: usize, lines: &[SteppingLine]) -> Option<Target> {
        let State { topology, .. } = &self.state;
        let mesh = &topology.mesh;
        if topology.nodes[i].is_regular() {
            return None;
        }
        let line_of =
            |h: HalfedgeId| lines.iter().position(|line| line.edges.iter().any(|&l| mesh.edge(l) == mesh.edge(h)));
        let mut found = None;
        self.target_of(i, |_, h, at| {
            let line = line_of(h)?;
            let near = Foot::new(&self.state, h, at).distance() <= STEP_RATIO * lines[line].step;
            found = near.then_some(line);
            near.then(|| mesh.origin(h))
        })?;
        let from = mesh.position(topology.nodes[i].vertex);
        let far = |v: &VertexId| mesh.position(*v).distance_squared(from);
        let vertices = lines[found?].edges.iter().map(|&h| mesh.origin(h));
        let vertex = vertices.filter(|&v| self.is_free(v)).min_by(|v, w| far(v).total_cmp(&far(w)))?;
        // The search is for a vertex, so that the coordinates do not matter.
        let around = mesh.outgoing(topology.nodes[i].vertex).map(|h| (mesh.face(h), DVec2::ZERO));
        let at_vertex = |f: FaceId, _| mesh.face_vertices(f).contains(&vertex).then_some(());
        let ((), strip) = search_outward(topology, &self.state.solution.map, around, at_vertex)?;
        Some(Target { vertex, strip })
    }

    /// Moves nodes to their targets, but for those around which triangles would flip; returns the number moved.
    fn move_to_targets(&mut self, targets: Vec<Option<Target>>, progress: &Progress) -> Result<usize, EmbeddingError> {
        if targets.iter().all(Option::is_none) {
            return Ok(0);
        }
        let moved = |this: &Self, _: &[u32], stays: &[bool]| this.with_nodes_at_targets(&targets, stays);
        let (found, _) = self.solve_moved(moved, vec![false; self.step_factor.len()], progress)?;
        let Some(state) = found else {
            self.synchronise(progress)?;
            return Ok(0);
        };
        let mut count = 0;
        for (i, target) in targets.iter().enumerate() {
            if target.as_ref().is_some_and(|t| state.topology.nodes[i].vertex == t.vertex) {
                self.projection.node_constraint[i] = NodeConstraint::Curve;
                count += 1;
            }
        }
        tracing::debug!(count, "nodes attached to features");
        self.state = state;
        Ok(count)
    }

    /// The topology with nodes at their targets, but for those that `stays` marks.
    fn with_nodes_at_targets(&self, targets: &[Option<Target>], stays: &[bool]) -> EmbeddingTopology {
        let mut topology = self.state.topology.clone();
        for (i, target) in targets.iter().enumerate() {
            let Some(Target { vertex, strip }) = target.as_ref().filter(|_| !stays[i]) else { continue };
            let from = topology.nodes[i].vertex;
            let taken: Vec<VertexId> = topology.nodes.iter().map(|n| n.vertex).filter(|&v| v != from).collect();
            if taken.contains(vertex) {
                continue;
            }
            if let Some(path) = edge_path(&topology.mesh, strip, from, *vertex, |v| taken.contains(&v)) {
                topology.mesh.set_position(from, self.projection.rest_position[from.index()]);
                path.into_iter().for_each(|h| topology.move_node(i, h));
            }
        }
        topology
    }

    /// The target of a free node, if it has one: the first vertex that `beside` returns in a search outward from the
    /// node, given the node, a feature edge and the coordinates the node is to have, in the chart of the edge's
    /// triangle.
    fn target_of(
        &self,
        i: usize,
        mut beside: impl FnMut(usize, HalfedgeId, DVec2) -> Option<VertexId>,
    ) -> Option<Target> {
        let State { topology, solution, .. } = &self.state;
        let (mesh, map) = (&topology.mesh, &solution.map);
        if self.projection.node_constraint[i] != NodeConstraint::Free {
            return None;
        }
        let corners: Vec<(HalfedgeId, DVec2)> = if self.through_arcs.constrained[i] {
            let own = |h: HalfedgeId| (h, map.uv[h.index() / 3][h.index() % 3]);
            mesh.outgoing(topology.nodes[i].vertex).map(own).collect()
        } else {
            crossing(topology, &self.through_arcs, map, &self.half_arcs[i]).into_iter().collect()
        };
        let first = corners.into_iter().map(|(h, at)| (mesh.face(h), at));
        let (vertex, strip) = search_outward(topology, map, first, |f, at| {
            let features = mesh.face_halfedges(f).into_iter().filter(|&h| self.sharp[mesh.edge(h).index()]);
            features.into_iter().find_map(|h| beside(i, h, at))
        })?;
        self.is_free(vertex).then_some(Target { vertex, strip })
    }

    /// The nearer end of a feature edge if the triangles between it and the node are squeezed.
    fn squeezed_to(&self, i: usize, h: HalfedgeId, at: DVec2) -> Option<VertexId> {
        let mesh = &self.state.topology.mesh;
        let foot = Foot::new(&self.state, h, at);
        // A constrained node has coordinates of its own, to be compared with its distance on the surface. The
        // coordinates of an unconstrained one are those of its crossing.
        let far = mesh.position(self.state.topology.nodes[i].vertex).distance(mesh.position(mesh.origin(h)));
        let near = if self.through_arcs.constrained[i] { SQUEEZED * far / mesh.vector(h).length() } else { NEAR };
        (foot.is_inside() && foot.far < near * foot.length).then(|| foot.end(&self.state))
    }

    /// Whether a vertex on a feature may have a node: it is no end or crossing of features, and no other node is there.
    fn is_free(&self, v: VertexId) -> bool {
        let mesh = &self.state.topology.mesh;
        let rays = mesh.outgoing(v).filter(|&h| self.sharp[mesh.edge(h).index()]).count();
        rays == 2 && !mesh.is_boundary_vertex(v) && self.state.topology.nodes.iter().all(|n| n.vertex != v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embed::topology::testing::sample_topology;

    #[test]
    fn distance_of_a_point_from_an_edge() {
        let halfedge = sample_topology().mesh.halfedges().next().unwrap();
        let at = |along: f64, far: f64| Foot { halfedge, along, far, length: 2.0 };
        assert_eq!(at(0.3, 0.5).distance(), 0.5);
        assert!(at(0.3, 0.5).is_inside() && !at(1.2, 0.0).is_inside());
        assert!((at(1.2, 0.3).distance() - 0.5).abs() < 1e-12);
        assert!((at(-0.2, 0.3).distance() - 0.5).abs() < 1e-12);
    }
}
