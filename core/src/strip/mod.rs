//! Strips: the seamless map of which placed curves are isolines, and what each curve's strip covers.
//!
//! The room for turning curves along edges into strips. It may use `mesh`, `field`, `param` and `progress`;
//! it does not know where the curves come from.

mod coverage;
mod map;
#[cfg(test)]
mod tests;

use coverage::{Conquered, Ground};
use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::field::{self, CrossField, EdgePath, FieldError, trace_curves};
use crate::mesh::{FaceId, TriMesh};
use crate::param::ParamError;
use crate::progress::{Cancelled, Progress};
use crate::surface::Metric;

/// Why strips could not be computed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StripError {
    /// The cross field could not be computed.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The map could not be computed.
    #[error(transparent)]
    Map(#[from] ParamError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The strip around one curve.
#[derive(Debug, Clone, PartialEq)]
pub struct StripCoverage {
    /// The curve that is its spine.
    pub curve: u32,
    /// How far it reaches to the left and to the right of its spine, in lengths on the mesh.
    pub bounds: [f64; 2],
    /// Number of triangles it covers, counted once for each family.
    pub faces: usize,
}

/// A seamless map with given curves as isolines, and the strips of these curves.
#[derive(Debug, Clone)]
pub struct StripMap {
    /// The cross field the map follows.
    pub field: CrossField,
    /// Coordinates of each triangle's corners in the chart of its cross, in lengths on the mesh.
    pub uv: Vec<[DVec2; 3]>,
    /// Whether the map turns the triangle over or collapses it.
    pub flipped: Vec<bool>,
    /// One strip for each curve; for each piece if a curve has several.
    pub strips: Vec<StripCoverage>,
    /// The strip (position in [`Self::strips`]) whose isolines pass a triangle: those of constant u, of constant v.
    pub covered: Vec<[Option<u32>; 2]>,
    /// For the covering strip, the distance from its spine at each corner, positive on its left; continuous across
    /// charts within a strip. It is covered where this is within the strip's bounds.
    pub stripe: Vec<[[f32; 3]; 2]>,
    /// The largest difference of the kept coordinate along any edge of a curve.
    pub residual: f64,
}

impl StripMap {
    /// Computes field, map and strips for the curves along the edges of `mesh`.
    ///
    /// # Errors
    ///
    /// See [`StripError`].
    pub fn new(mesh: &TriMesh, curve_of_edge: &[Option<u32>], progress: &Progress) -> Result<Self, StripError> {
        progress.report("Cross field", 0.2);
        let metric = Metric::new(mesh);
        let paths = trace_curves(mesh, &metric, curve_of_edge)?;
        let field = field::interpolate(mesh, &metric, &paths, &[], progress)?;
        progress.report("Strip map", 0.5);
        Self::along_field(mesh, &metric, &paths, field, progress)
    }

    /// Computes map and strips for `paths` and a field aligned with them.
    ///
    /// # Errors
    ///
    /// See [`StripError`].
    pub fn along_field(
        mesh: &TriMesh,
        metric: &Metric,
        paths: &[EdgePath],
        field: CrossField,
        progress: &Progress,
    ) -> Result<Self, StripError> {
        let map = map::solve(mesh, metric, &field, paths, progress)?;
        progress.report("Strips", 0.9);
        let flipped: Vec<bool> = mesh.faces().map(|f| map.is_flipped(f)).collect();
        let uv = map.uv;
        let residual = residual(mesh, metric, &field, paths, &uv);
        let mean_edge = mesh.edges().map(|e| mesh.edge_length(e)).sum::<f64>() / mesh.n_edges().max(1) as f64;
        let ground = Ground { mesh, metric, field: &field, uv: &uv, flipped: &flipped, mean_edge };
        let Conquered { strips, covered, stripe } = coverage::conquer(&ground, paths);
        tracing::debug!(
            faces = mesh.n_faces(),
            strips = strips.len(),
            singularities = field.singularities.len(),
            flipped = flipped.iter().filter(|&&f| f).count(),
            residual,
            "strip map"
        );
        Ok(Self { field, uv, flipped, strips, covered, stripe, residual })
    }

    /// The unit tangent of the isolines of coordinate `axis` (0: u constant) in a triangle; zero where the map
    /// collapses.
    pub fn iso_direction(&self, mesh: &TriMesh, f: FaceId, axis: usize) -> DVec3 {
        let [a, b, c] = mesh.face_vertices(f).map(|v| mesh.position(v));
        let w = self.uv[f.index()].map(|w| w[axis]);
        // The gradient is the sum of coordinates times normals of the opposite sides; turned, times the sides.
        ((c - b) * w[0] + (a - c) * w[1] + (b - a) * w[2]).normalize_or_zero()
    }
}

fn residual(mesh: &TriMesh, metric: &Metric, field: &CrossField, paths: &[EdgePath], uv: &[[DVec2; 3]]) -> f64 {
    let mut worst: f64 = 0.0;
    for (step, &tangent_offset) in paths.iter().flat_map(|p| p.steps.iter().zip(&p.tangent_offset)) {
        for (h, c) in map::kept_coordinates(mesh, metric, field, *step, tangent_offset) {
            let [a, b] = [h, mesh.next(h)].map(|h| uv[h.index() / 3][h.index() % 3][c as usize]);
            worst = worst.max((a - b).abs());
        }
    }
    worst
}
