//! Where nodes go in one step: irregular ones down the energy, regular ones to the crossing of their isolines (Campen,
//! sections 6.5 and 6.6).

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::embed::optimise::isoline_crossing::step_to_crossing;
use crate::embed::optimise::nearest_node;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::relocation::NodeConstraint;
use crate::embed::parameterise::node_gradient::{descent, injective_descent};
use crate::embed::parameterise::state::State;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{TriMesh, VertexId};
use crate::surface::Metric;
use crate::surface::PolarMap;

/// Length of a step over the length of the gradient: the estimator is half as long again as the gradient itself, and
/// three quarters of the way to a parabola's minimum are safe (section 6.6.2).
const STEP: f64 = 0.75 * 2.0 / 3.0;

impl Optimiser<'_> {
    /// The direction in space in which a node is to move.
    pub(in crate::embed) fn heading_of(&self, i: usize) -> DVec3 {
        let State { net, metric, .. } = &self.state;
        let v = net.nodes[i].vertex;
        if !self.through_arcs.constrained[i] || self.ground.hold[i] == NodeConstraint::Fixed {
            return DVec3::ZERO;
        }
        let d = self.downhill(v);
        if d.is_finite() { self.in_space(&net.mesh, metric, v, d).normalize_or_zero() } else { DVec3::ZERO }
    }

    /// The descent direction at a vertex, as a vector of its polar map.
    fn downhill(&self, v: VertexId) -> DVec2 {
        let State { net, metric, field, objective, anisotropy_share, solution } = &self.state;
        let (mesh, angle, uv) = (&net.mesh, &field.angle, &solution.map.uv);
        match self.shape {
            // Error weights of 1 and ρ instead of 1 and 1 make the energy steeper, but its minimum no farther.
            None => descent(mesh, metric, angle, uv, objective, v) / (0.5 * (1.0 + self.settings.anisotropy)),
            // About its minimum the energy rises half as fast.
            Some(shape) => {
                injective_descent(mesh, metric, angle, uv, (objective, shape, anisotropy_share), v)
                    / (0.25 * (1.0 + shape.anisotropy))
            }
        }
    }

    /// The net with every node moved by one step but for those that stay.
    pub(in crate::embed) fn moved(&self, cell: &[u32], stays: &[bool]) -> EmbeddingTopology {
        let State { net, metric, .. } = &self.state;
        let mut moved = net.clone();
        for (i, node) in net.nodes.iter().enumerate() {
            let v = node.vertex;
            if self.ground.hold[i] == NodeConstraint::Fixed || stays[i] {
                continue;
            }
            if !self.through_arcs.constrained[i] {
                self.cross(&mut moved, i, cell);
                continue;
            }
            let step = self.downhill(v) * (STEP * self.pace[i]);
            if !(step.length() > 0.0 && step.is_finite()) {
                continue;
            }
            match self.ground.hold[i] {
                NodeConstraint::Free => {
                    // The polar map is that of the mesh before any node moved: close by nothing else changes.
                    self.ground.glide(&mut moved, metric, i, step, cell);
                }
                NodeConstraint::Curve => {
                    let along = self.in_space(&net.mesh, metric, v, step);
                    self.ground.slide(&mut moved, i, along, along.length());
                }
                NodeConstraint::Fixed => {}
            }
        }
        moved
    }

    /// Brings a regular node towards the crossing of its isolines.
    fn cross(&self, moved: &mut EmbeddingTopology, i: usize, cell: &[u32]) {
        let State { net, metric, solution, .. } = &self.state;
        let found = step_to_crossing(net, &self.through_arcs, metric, &solution.map, &self.ends[i]);
        let Some((corner, step)) = found.filter(|(_, step)| step.is_finite() && step.length() > 0.0) else { return };
        let mesh = &net.mesh;
        let v = net.nodes[i].vertex;
        match self.ground.hold[i] {
            NodeConstraint::Free => {
                let polar = PolarMap::new(mesh, metric, v);
                let from = polar.spokes.iter().find(|s| s.0 == corner).map_or(0.0, |s| s.1);
                let turn = step.to_angle() - metric.direction(corner);
                let turn = turn - (turn / TAU).round() * TAU;
                let step = DVec2::from_angle(from + polar.scale * turn) * step.length();
                self.ground.glide(moved, metric, i, step, cell);
            }
            NodeConstraint::Curve => {
                let along = metric.tangent(mesh, mesh.face(corner), step.to_angle()) * step.length();
                self.ground.slide(moved, i, along, along.length());
            }
            NodeConstraint::Fixed => {}
        }
    }

    /// A vector of the polar map of `v` in space.
    fn in_space(&self, mesh: &TriMesh, metric: &Metric, v: VertexId, step: DVec2) -> DVec3 {
        let polar = PolarMap::new(mesh, metric, v);
        let (h, turn) = polar.wedge(step.to_angle().rem_euclid(TAU));
        metric.tangent(mesh, mesh.face(h), metric.direction(h) + turn) * step.length()
    }

    /// The net with regular nodes, and only these, brought to the crossings of their isolines but for those that stay.
    pub(in crate::embed) fn settled(&self, cell: &[u32], stays: &[bool]) -> EmbeddingTopology {
        let mut moved = self.state.net.clone();
        for i in (0..moved.nodes.len()).filter(|&i| !stays[i] && !self.through_arcs.constrained[i]) {
            self.cross(&mut moved, i, cell);
        }
        moved
    }

    pub(in crate::embed) fn cells(&self) -> Vec<u32> {
        let net = &self.state.net;
        nearest_node::cells(&net.mesh, &net.nodes.iter().map(|n| n.vertex).collect::<Vec<_>>())
    }
}
