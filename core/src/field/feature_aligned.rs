//! The cross field of a shape: smooth, along boundaries and features, drawn towards given directions.
//!
//! Its singularities are where a layout of the shape wants irregular nodes.

use super::cross_field::{CrossField, along_edges};
use super::singularities::all_singularities;
use super::smoothing::{Pull, interpolate_vectors};
use super::{FieldError, expect_length, period_jumps};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;
use crate::solve::c64;
use crate::surface::Metric;
use glam::DVec3;

/// Directions the field is drawn towards, for instance principal curvature directions.
#[derive(Debug, Clone, Copy)]
pub struct AlignmentDirections<'a> {
    /// A tangent vector of any length for each triangle; zero for none.
    pub directions: &'a [DVec3],
    /// How much each counts, not negative; 1 is full.
    pub weights: &'a [f64],
    /// Distance over which a direction of full weight prevails over smoothness.
    pub radius: f64,
}

/// The cross field of `mesh` along its boundary and the edges marked `sharp` (empty: none), drawn towards `guides`.
/// Its singularities include those at boundary vertices, counted against the boundary.
///
/// # Errors
///
/// See [`FieldError`].
pub fn feature_aligned_field(
    mesh: &TriMesh,
    metric: &Metric,
    guides: Option<AlignmentDirections<'_>>,
    sharp: &[bool],
    progress: &Progress,
) -> Result<CrossField, FieldError> {
    if !sharp.is_empty() {
        expect_length("the list of sharp edges", sharp.len(), mesh.n_edges())?;
    }
    let mut pull = Pull::default();
    if let Some(g) = guides {
        expect_length("the list of guiding directions", g.directions.len(), mesh.n_faces())?;
        expect_length("the list of guiding weights", g.weights.len(), mesh.n_faces())?;
        let angle = |f: FaceId| metric.angle_of(mesh, f, g.directions[f.index()]);
        pull.vector = mesh.faces().map(|f| c64::from_polar(1.0, 4.0 * angle(f).unwrap_or(0.0))).collect();
        let scale = (g.radius * g.radius).max(f64::MIN_POSITIVE).recip();
        let weight = |f: FaceId| if angle(f).is_some() { g.weights[f.index()].max(0.0) * scale } else { 0.0 };
        pull.weight = mesh.faces().map(weight).collect();
    }
    let held = |e| mesh.is_boundary_edge(e) || sharp.get(e.index()).copied().unwrap_or(false);
    let hard = along_edges(mesh, metric, mesh.edges().filter(|&e| held(e)).map(|e| (e, 0.0)));
    let vectors = interpolate_vectors(mesh, metric, &hard, &pull, progress)?;
    let angle: Vec<f64> = vectors.iter().map(|z| z.arg() / 4.0).collect();
    let jump = period_jumps::principal(mesh, metric, &angle);
    let singularities = all_singularities(mesh, metric, &angle, &jump);
    Ok(CrossField { angle, jump, singularities })
}
