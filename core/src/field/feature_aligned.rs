//! The cross field of a shape: smooth, aligned with boundaries and features (hard constraints) and with given directions
//! (penalties). Its singularities suggest where a layout of the shape needs irregular nodes.

use super::cross_field::{CrossField, along_edges};
use super::error::{FieldError, expect_length};
use super::period_jumps;
use super::singularities::all_singularities;
use super::smoothing::{SoftConstraints, interpolate_vectors};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;
use crate::solve::c64;
use crate::surface::Metric;
use glam::DVec3;

/// Directions that deviations of the field are penalised against, for instance principal curvature directions.
#[derive(Debug, Clone, Copy)]
pub struct AlignmentDirections<'a> {
    /// A tangent vector of any length for each triangle; zero for none.
    pub directions: &'a [DVec3],
    /// Penalty weight of each triangle, not negative, in units of `radius⁻²`.
    pub weights: &'a [f64],
    /// Distance over which a direction of weight 1 prevails over smoothness, in units of the mesh.
    pub radius: f64,
}

/// The smoothest cross field aligned with the boundary of `mesh` and the edges marked `sharp` (a flag per edge; empty:
/// none), with penalties for deviation from `directions`. Its singularities include those at boundary vertices, with
/// their index relative to the direction of the boundary.
///
/// # Errors
///
/// See [`FieldError`].
pub fn feature_aligned_field(
    mesh: &TriMesh,
    metric: &Metric,
    directions: Option<AlignmentDirections<'_>>,
    sharp: &[bool],
    progress: &Progress,
) -> Result<CrossField, FieldError> {
    if !sharp.is_empty() {
        expect_length("the list of sharp edges", sharp.len(), mesh.n_edges())?;
    }
    let mut soft = SoftConstraints::default();
    if let Some(aligned) = directions {
        expect_length("the list of directions", aligned.directions.len(), mesh.n_faces())?;
        expect_length("the list of weights of directions", aligned.weights.len(), mesh.n_faces())?;
        let angle = |f: FaceId| metric.angle_of(mesh, f, aligned.directions[f.index()]);
        soft.vector = mesh.faces().map(|f| c64::from_polar(1.0, 4.0 * angle(f).unwrap_or(0.0))).collect();
        let scale = (aligned.radius * aligned.radius).max(f64::MIN_POSITIVE).recip();
        let weight = |f: FaceId| if angle(f).is_some() { aligned.weights[f.index()].max(0.0) * scale } else { 0.0 };
        soft.weight = mesh.faces().map(weight).collect();
    }
    let aligned = |e| mesh.is_boundary_edge(e) || sharp.get(e.index()).copied().unwrap_or(false);
    let hard = along_edges(mesh, metric, mesh.edges().filter(|&e| aligned(e)).map(|e| (e, 0.0)));
    let vectors = interpolate_vectors(mesh, metric, &hard, &soft, progress)?;
    let angle: Vec<f64> = vectors.iter().map(|z| z.arg() / 4.0).collect();
    let jump = period_jumps::smallest_rotation(mesh, metric, &angle);
    let singularities = all_singularities(mesh, metric, &angle, &jump);
    Ok(CrossField { angle, jump, singularities })
}
