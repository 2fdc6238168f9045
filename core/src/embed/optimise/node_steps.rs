//! The step of each node: irregular nodes descend the energy (Campen, sections 6.5.1 and 6.6.2), unconstrained regular
//! nodes move to the crossing of their isolines.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::embed::optimise::isoline_crossing::step_to_crossing;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::relocation::NodeConstraint;
use crate::embed::parameterise::node_gradient::{descent, injective_descent};
use crate::embed::parameterise::state::State;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{TriMesh, VertexId};
use crate::surface::{Metric, PolarMap};

/// Ratio of the step length to the length of the estimated gradient: α = 0.75 of the way to the minimum, and the
/// estimator is 3/2 of the gradient (sections 6.5.1 and 6.6.2).
const STEP_SIZE: f64 = 0.75 * 2.0 / 3.0;

impl Optimiser<'_> {
    /// The unit direction in space in which a node descends; zero for fixed and unconstrained regular nodes.
    pub(super) fn descent_direction(&self, i: usize) -> DVec3 {
        let State { topology, metric, .. } = &self.state;
        let v = topology.nodes[i].vertex;
        if !self.through_arcs.constrained[i] || self.projection.node_constraint[i] == NodeConstraint::Fixed {
            return DVec3::ZERO;
        }
        let d = self.descent_step(v);
        if d.is_finite() { self.in_space(&topology.mesh, metric, v, d).normalize_or_zero() } else { DVec3::ZERO }
    }

    /// The descent direction at a vertex, as a vector of its polar map, scaled such that its length is proportional to
    /// the distance to the minimum.
    fn descent_step(&self, v: VertexId) -> DVec2 {
        let State { topology, metric, field, objective, anisotropy_share, solution } = &self.state;
        let (mesh, angle, uv) = (&topology.mesh, &field.angle, &solution.map.uv);
        match self.distortion {
            // With weights of 1 and ρ instead of 1 and 1 the gradient is larger by their mean, but the minimum is no
            // farther away.
            None => descent(mesh, metric, angle, uv, objective, v) / (0.5 * (1.0 + self.settings.anisotropy)),
            // Around its minimum the energy of injective maps has half the second derivative.
            Some(distortion) => {
                injective_descent(mesh, metric, angle, uv, (objective, distortion, anisotropy_share), v)
                    / (0.25 * (1.0 + distortion.anisotropy))
            }
        }
    }

    /// The topology with all nodes moved by one step except those that `stays` marks.
    pub(super) fn moved(&self, cell: &[u32], stays: &[bool]) -> EmbeddingTopology {
        let State { topology, metric, .. } = &self.state;
        let mut moved = topology.clone();
        for (i, node) in topology.nodes.iter().enumerate() {
            let v = node.vertex;
            if self.projection.node_constraint[i] == NodeConstraint::Fixed || stays[i] {
                continue;
            }
            if !self.through_arcs.constrained[i] {
                self.move_to_crossing(&mut moved, i, cell);
                continue;
            }
            let step = self.descent_step(v) * (STEP_SIZE * self.step_factor[i]);
            if !(step.length() > 0.0 && step.is_finite()) {
                continue;
            }
            match self.projection.node_constraint[i] {
                NodeConstraint::Free => {
                    // The polar map is that of the mesh before the step: in the cell of the node nothing else has
                    // changed.
                    self.projection.move_free(&mut moved, metric, i, step, cell);
                }
                NodeConstraint::Curve => {
                    let along = self.in_space(&topology.mesh, metric, v, step);
                    self.projection.move_along_curve(&mut moved, i, along, along.length());
                }
                NodeConstraint::Fixed => {}
            }
        }
        moved
    }

    /// Moves a regular node towards the crossing of its isolines.
    fn move_to_crossing(&self, moved: &mut EmbeddingTopology, i: usize, cell: &[u32]) {
        let State { topology, metric, solution, .. } = &self.state;
        let found = step_to_crossing(topology, &self.through_arcs, metric, &solution.map, &self.half_arcs[i]);
        let Some((corner, step)) = found.filter(|(_, step)| step.is_finite() && step.length() > 0.0) else { return };
        let mesh = &topology.mesh;
        let v = topology.nodes[i].vertex;
        match self.projection.node_constraint[i] {
            NodeConstraint::Free => {
                let polar = PolarMap::new(mesh, metric, v);
                let from = polar.spokes.iter().find(|s| s.0 == corner).map_or(0.0, |s| s.1);
                let turn = step.to_angle() - metric.direction(corner);
                let turn = turn - (turn / TAU).round() * TAU;
                let step = DVec2::from_angle(from + polar.scale * turn) * step.length();
                self.projection.move_free(moved, metric, i, step, cell);
            }
            NodeConstraint::Curve => {
                let along = metric.tangent(mesh, mesh.face(corner), step.to_angle()) * step.length();
                self.projection.move_along_curve(moved, i, along, along.length());
            }
            NodeConstraint::Fixed => {}
        }
    }

    /// A vector of the polar map of `v` as a tangent vector in space.
    fn in_space(&self, mesh: &TriMesh, metric: &Metric, v: VertexId, step: DVec2) -> DVec3 {
        let polar = PolarMap::new(mesh, metric, v);
        let (h, turn) = polar.wedge(step.to_angle().rem_euclid(TAU));
        metric.tangent(mesh, mesh.face(h), metric.direction(h) + turn) * step.length()
    }

    /// The topology with unconstrained regular nodes, and only these, moved to the crossings of their isolines, except
    /// those that `stays` marks.
    pub(super) fn with_regular_nodes_moved(&self, cell: &[u32], stays: &[bool]) -> EmbeddingTopology {
        let mut moved = self.state.topology.clone();
        for i in (0..moved.nodes.len()).filter(|&i| !stays[i] && !self.through_arcs.constrained[i]) {
            self.move_to_crossing(&mut moved, i, cell);
        }
        moved
    }
}
