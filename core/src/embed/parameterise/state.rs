//! Field and map for nodes at certain places, and what can be read from them.

use glam::DVec2;

use crate::embed::problem::{FeatureEdges, Snapshot};
use crate::embed::topology::embedding_topology::{EmbeddingTopology, TopologyArc};
use crate::embed::trace::arcs::{ArcChain, preview_arcs};
use crate::field::CrossField;
use crate::mesh::{EdgeId, VertexId};
use crate::param::{DistortionWeights, InjectiveEnergy, Objective, Residual, Solution, residuals};
use crate::surface::Metric;

/// Field and map for nodes at certain places.
#[derive(Debug, Clone)]
pub struct State {
    /// The net: mesh, nodes, arcs.
    pub net: EmbeddingTopology,
    /// The planar layouts of the mesh's triangles.
    pub metric: Metric,
    /// The guiding field.
    pub field: CrossField,
    /// What the map minimises.
    pub objective: Objective,
    /// For each triangle the factor by which the anisotropy counts in a map without folds.
    pub anisotropy_share: Vec<f64>,
    /// The map and its energy.
    pub solution: Solution,
}

/// Share of the wanted area below which an image is as good as flat.
const FLAT: f64 = 1e-3;
/// Coordinates that differ by no more are the same.
const SAME: f64 = 1e-9;

impl State {
    /// Number of triangles that the map turns over, or by more than a right angle away from the field.
    pub fn flipped(&self) -> usize {
        self.folded().iter().filter(|&&f| f).count()
    }

    /// For each triangle whether the map turns it over, or by more than a right angle away from the field.
    pub(in crate::embed) fn folded(&self) -> Vec<bool> {
        let errors = residuals(&self.metric, &self.field.angle, &self.solution.map.uv, &self.objective);
        let lengths = |f: usize| self.objective.lengths.get(f).copied().unwrap_or([1.0; 2]);
        let folded = |(f, r): (usize, &Residual)| {
            let [a, b] = lengths(f);
            let (u, v) = (r.u + DVec2::new(a, 0.0), r.v + DVec2::new(0.0, b));
            u.perp_dot(v) <= FLAT * a * b || u.x / a + v.y / b <= 0.0
        };
        errors.iter().enumerate().map(folded).collect()
    }

    /// The energy of least squares of the map.
    pub(in crate::embed) fn least_squares(&self) -> f64 {
        let each = residuals(&self.metric, &self.field.angle, &self.solution.map.uv, &self.objective);
        each.iter().map(|r| r.energy).sum()
    }

    /// The energy of each triangle of the map: that of maps without folds of a shape, or that of least squares.
    pub(in crate::embed) fn energies(&self, shape: Option<DistortionWeights>) -> Vec<f64> {
        let Self { metric, field, objective, anisotropy_share, solution, .. } = self;
        match shape {
            Some(shape) => InjectiveEnergy::new(metric, &field.angle, objective, (shape, anisotropy_share))
                .of_each(&solution.map.uv),
            None => residuals(metric, &field.angle, &solution.map.uv, objective).iter().map(|r| r.energy).collect(),
        }
    }

    /// Which of the edges that are `sharp` lie on isolines.
    pub(in crate::embed) fn features(&self, sharp: &[bool]) -> FeatureEdges {
        let (mesh, uv) = (&self.net.mesh, &self.solution.map.uv);
        let inner: Vec<EdgeId> = mesh.edges().filter(|&e| sharp[e.index()] && !mesh.is_boundary_edge(e)).collect();
        let is_off = |&e: &EdgeId| {
            let h = mesh.halfedge(e).index();
            let [p, q] = [h % 3, (h + 1) % 3].map(|k| uv[h / 3][k]);
            (p - q).abs().min_element() > SAME
        };
        let ends = |e: EdgeId| mesh.edge_vertices(e).map(|v| mesh.position(v).to_array());
        let off: Vec<_> = inner.iter().copied().filter(is_off).map(ends).collect();
        FeatureEdges { all: inner.len(), on_isolines: inner.len() - off.len(), off }
    }

    pub(in crate::embed) fn chains(&self) -> Vec<ArcChain<'_>> {
        let chain = |a: &'_ TopologyArc| (a.start, a.end, a.heading);
        self.net
            .arcs
            .iter()
            .map(|a| {
                let (start, end, heading) = chain(a);
                ArcChain { start, crossed: &a.crossed, end, heading }
            })
            .collect()
    }

    pub(in crate::embed) fn vertices(&self) -> Vec<VertexId> {
        self.net.nodes.iter().map(|n| n.vertex).collect()
    }

    pub(in crate::embed) fn snapshot(&self, step: usize, first: f64) -> Snapshot {
        let vertices = self.vertices();
        Snapshot {
            step,
            energy: if first > 0.0 { self.solution.energy / first } else { 1.0 },
            flipped: self.flipped(),
            arcs: preview_arcs(&self.net.mesh, &self.solution.map, &vertices, &self.chains()),
            nodes: vertices.iter().map(|&v| self.net.mesh.position(v)).collect(),
        }
    }
}
