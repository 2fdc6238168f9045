//! Field and map for nodes at given vertices, with their flipped triangles, energies and feature edges.

use glam::DVec2;
use serde::Serialize;

use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::field::CrossField;
use crate::mesh::{EdgeId, VertexId};
use crate::param::{DistortionWeights, InjectiveEnergy, Objective, Residual, Solution, residuals};
use crate::surface::Metric;

/// Field and map for nodes at given vertices.
#[derive(Debug, Clone)]
pub struct State {
    /// The topology of the embedding: working mesh, nodes, arcs.
    pub topology: EmbeddingTopology,
    /// Metric of the working mesh: each triangle in a plane.
    pub metric: Metric,
    /// The guiding field.
    pub field: CrossField,
    /// Target lengths and norm of the least-squares energy.
    pub objective: Objective,
    /// For each triangle the share of the anisotropy that counts there in an injective map; see
    /// [`DistortionWeights::with_anisotropy_share`].
    pub anisotropy_share: Vec<f64>,
    /// The map and its energy.
    pub solution: Solution,
}

/// Sharp edges inside the surface, counted on the working mesh, which may be finer than the mesh of the problem.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeatureEdges {
    /// Number of sharp edges.
    pub total: usize,
    /// Number of those on isolines of the map: one coordinate is the same at both ends up to 1e-9, in units in which
    /// the surface's model size is 1.
    pub on_isolines: usize,
    /// The end points of the others.
    pub off_isolines: Vec<[[f64; 3]; 2]>,
}

/// Ratio of an image's area to its target area at and below which the triangle counts as flipped: degenerate up to
/// rounding errors. Chosen by hand.
const FLAT: f64 = 1e-3;
/// Coordinates that differ by no more count as equal: rounding on a surface of model size 1.
const EQUAL: f64 = 1e-9;

impl State {
    /// Number of flipped triangles; see [`Self::flipped_triangles`].
    pub fn flipped(&self) -> usize {
        self.flipped_triangles().iter().filter(|&&f| f).count()
    }

    /// For each triangle whether the map flips it or turns it by more than a right angle away from the field. The
    /// latter counts because a node of eight quarters can be mapped onto four without any triangle of negative area.
    pub(in crate::embed) fn flipped_triangles(&self) -> Vec<bool> {
        let errors = residuals(&self.metric, &self.field.angle, &self.solution.map.uv, &self.objective);
        let lengths = |f: usize| self.objective.lengths.get(f).copied().unwrap_or([1.0; 2]);
        let flipped = |(f, r): (usize, &Residual)| {
            let [a, b] = lengths(f);
            let (u, v) = (r.u + DVec2::new(a, 0.0), r.v + DVec2::new(0.0, b));
            u.perp_dot(v) <= FLAT * a * b || u.x / a + v.y / b <= 0.0
        };
        errors.iter().enumerate().map(flipped).collect()
    }

    /// The least-squares energy of the map (equation 6.1), whatever energy it minimises.
    pub(in crate::embed) fn least_squares(&self) -> f64 {
        let each = residuals(&self.metric, &self.field.angle, &self.solution.map.uv, &self.objective);
        each.iter().map(|r| r.energy).sum()
    }

    /// The energy of each triangle: that of injective maps with the given weights, or without weights that of least
    /// squares.
    pub(in crate::embed) fn energies(&self, distortion: Option<DistortionWeights>) -> Vec<f64> {
        let Self { metric, field, objective, anisotropy_share, solution, .. } = self;
        match distortion {
            Some(distortion) => InjectiveEnergy::new(metric, &field.angle, objective, (distortion, anisotropy_share))
                .of_each(&solution.map.uv),
            None => residuals(metric, &field.angle, &solution.map.uv, objective).iter().map(|r| r.energy).collect(),
        }
    }

    /// Which of the `sharp` edges lie on isolines.
    pub(in crate::embed) fn feature_edges(&self, sharp: &[bool]) -> FeatureEdges {
        let (mesh, uv) = (&self.topology.mesh, &self.solution.map.uv);
        let inner: Vec<EdgeId> = mesh.edges().filter(|&e| sharp[e.index()] && !mesh.is_boundary_edge(e)).collect();
        let is_off = |&e: &EdgeId| {
            let h = mesh.halfedge(e).index();
            let [p, q] = [h % 3, (h + 1) % 3].map(|k| uv[h / 3][k]);
            (p - q).abs().min_element() > EQUAL
        };
        let ends = |e: EdgeId| mesh.edge_vertices(e).map(|v| mesh.position(v).to_array());
        let off: Vec<_> = inner.iter().copied().filter(is_off).map(ends).collect();
        FeatureEdges { total: inner.len(), on_isolines: inner.len() - off.len(), off_isolines: off }
    }

    /// The vertices of the nodes.
    pub(in crate::embed) fn vertices(&self) -> Vec<VertexId> {
        self.topology.nodes.iter().map(|n| n.vertex).collect()
    }
}
