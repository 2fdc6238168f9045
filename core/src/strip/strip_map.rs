//! The strip map: field, seamless map and coverage of a set of curves.

use glam::{DVec2, DVec3};

use super::coverage::{Coverage, MapView, StripCoverage, coverage};
use super::error::StripError;
use super::seamless;
use crate::field::{self, CrossField, EdgePath, trace_curves};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;
use crate::surface::Metric;

/// A seamless map with given curves as isolines, and the strips of these curves.
#[derive(Debug, Clone)]
pub struct StripMap {
    /// The cross field that the gradients of the map follow.
    pub field: CrossField,
    /// Coordinates (u, v) of the corners of each triangle in its own chart, in lengths on the mesh.
    pub uv: Vec<[DVec2; 3]>,
    /// Whether the map flips the triangle or makes it degenerate (det J ≤ 0).
    pub flipped: Vec<bool>,
    /// One strip per curve, or per path if a curve consists of several.
    pub strips: Vec<StripCoverage>,
    /// For each triangle the strip (index into [`Self::strips`]) that covers it with isolines of constant u, and the one with
    /// isolines of constant v.
    pub covered: Vec<[Option<u32>; 2]>,
    /// The distance of each corner from the spine of the covering strip, positive on its left, for both families of isolines.
    /// Continuous within a strip. A point is covered if this is within the widths of the strip; 0 where there is no strip.
    pub spine_distance: Vec<[[f32; 3]; 2]>,
    /// The largest difference of the constant coordinate between the ends of an edge of a curve, in lengths on the mesh.
    pub residual: f64,
}

impl StripMap {
    /// Computes field, map and strips of curves along edges. `curve_of_edge` has the number of the curve of each edge.
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

    /// Computes map and strips of `paths` and a field aligned with them.
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
        let map = seamless::solve(mesh, metric, &field, paths, progress)?;
        progress.report("Strips", 0.9);
        let flipped: Vec<bool> = mesh.faces().map(|f| map.is_flipped(f)).collect();
        let uv = map.uv;
        let residual = residual(mesh, metric, &field, paths, &uv);
        let view = MapView { mesh, metric, field: &field, uv: &uv, flipped: &flipped };
        let Coverage { strips, covered, spine_distance } = coverage(&view, paths);
        tracing::debug!(
            faces = mesh.n_faces(),
            strips = strips.len(),
            singularities = field.singularities.len(),
            flipped = flipped.iter().filter(|&&f| f).count(),
            residual,
            "strip map"
        );
        Ok(Self { field, uv, flipped, strips, covered, spine_distance, residual })
    }

    /// The unit tangent of the isolines of coordinate `axis` (0: u constant) in a triangle; zero if that is constant in the
    /// triangle.
    pub fn iso_direction(&self, mesh: &TriMesh, f: FaceId, axis: usize) -> DVec3 {
        let [a, b, c] = mesh.face_vertices(f).map(|v| mesh.position(v));
        let w = self.uv[f.index()].map(|w| w[axis]);
        // The gradient is the sum over corners of coordinate times normal of the opposite side, up to scale; the tangent, a
        // quarter turn from it, that of coordinate times opposite side.
        ((c - b) * w[0] + (a - c) * w[1] + (b - a) * w[2]).normalize_or_zero()
    }
}

/// See [`StripMap::residual`].
fn residual(mesh: &TriMesh, metric: &Metric, field: &CrossField, paths: &[EdgePath], uv: &[[DVec2; 3]]) -> f64 {
    let mut worst: f64 = 0.0;
    for (step, &tangent_offset) in paths.iter().flat_map(|p| p.steps.iter().zip(&p.tangent_offset)) {
        for (h, c) in seamless::constant_coordinates(mesh, metric, field, *step, tangent_offset) {
            let [a, b] = [h, mesh.next(h)].map(|h| uv[h.index() / 3][h.index() % 3][c as usize]);
            worst = worst.max((a - b).abs());
        }
    }
    worst
}
