//! Cross fields, and their harmonic interpolation from curves.
//!
//! A cross in a triangle is an angle θ modulo a quarter turn. Its representation vector `z = e^{4iθ}` is the same for all
//! four directions. Triangles beside a curve take the direction of its edges (the mean, if several meet); in the others `z`
//! is interpolated harmonically (Campen, Quad Layouts, section 8.2.2). Period jumps are those of smallest rotation, except
//! along the curves: there they are changed so that a curve follows one direction of the crosses all along, however
//! sharply its edges bend at a vertex.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::edge_paths::EdgePath;
use super::error::{FieldError, expect_length};
use super::period_jumps;
use super::singularities::{Singularity, inner_singularities};
use super::smoothing::{SoftConstraints, interpolate_vectors};
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh};
use crate::progress::Progress;
use crate::solve::c64;
use crate::surface::Metric;

/// A cross per triangle and a period jump per edge.
#[derive(Debug, Clone)]
pub struct CrossField {
    /// Angle of direction 0 of each triangle, in radians from its half-edge 0 in the [`Metric`]. Direction `k` is `k`
    /// quarter turns counter-clockwise of it.
    pub angle: Vec<f64>,
    /// Period jump of each edge, from the triangle `f` of [`TriMesh::halfedge`] to that `g` of its twin: direction
    /// `k` of `g` continues direction `k + jump` of `f`. Zero on the boundary.
    pub jump: Vec<i8>,
    /// The vertices of non-zero index, ascending.
    pub singularities: Vec<Singularity>,
}

impl CrossField {
    /// The period jump from the triangle of `h` to the triangle of its twin.
    #[inline]
    pub fn jump_across(&self, mesh: &TriMesh, h: HalfedgeId) -> i32 {
        period_jumps::across(mesh, &self.jump, h)
    }

    /// Direction `branch` (0 to 3) of the cross in a triangle, as a unit tangent vector.
    pub fn direction(&self, mesh: &TriMesh, metric: &Metric, f: FaceId, branch: i32) -> DVec3 {
        metric.tangent(mesh, f, self.angle[f.index()] + f64::from(branch) * FRAC_PI_2)
    }

    /// The direction (0 to 3) of the cross in the triangle of `h` that is nearest to `h` turned by `tangent_offset`
    /// radians counter-clockwise.
    #[inline]
    pub fn branch_along(&self, metric: &Metric, h: HalfedgeId, tangent_offset: f64) -> i32 {
        period_jumps::branch_along(metric, &self.angle, h, tangent_offset)
    }
}

/// The smoothest cross field aligned with `paths` and with the edges marked in `aligned` (a flag per edge; empty: none).
/// Without either it is the smoothest field of the mesh.
///
/// # Errors
///
/// See [`FieldError`].
pub fn interpolate(
    mesh: &TriMesh,
    metric: &Metric,
    paths: &[EdgePath],
    aligned: &[bool],
    progress: &Progress,
) -> Result<CrossField, FieldError> {
    if !aligned.is_empty() {
        expect_length("the list of aligned edges", aligned.len(), mesh.n_edges())?;
    }
    let on_path = paths.iter().flat_map(|p| p.steps.iter().map(|s| s.edge).zip(p.tangent_offset.iter().copied()));
    let marked = mesh.edges().filter(|e| aligned.get(e.index()).copied().unwrap_or(false));
    let hard = along_edges(mesh, metric, on_path.chain(marked.map(|e| (e, 0.0))));
    let vectors = interpolate_vectors(mesh, metric, &hard, &SoftConstraints::default(), progress)?;
    let angle: Vec<f64> = vectors.iter().map(|z| z.arg() / 4.0).collect();
    let mut jump = period_jumps::smallest_rotation(mesh, metric, &angle);
    period_jumps::follow_one_branch(mesh, metric, &angle, &mut jump, paths);
    let singularities = inner_singularities(mesh, metric, &angle, &jump);
    Ok(CrossField { angle, jump, singularities })
}

/// The representation vectors of the triangles beside `edges`: of the direction of the edge turned by the angle given with
/// it, or the normalised sum of several. `None` elsewhere.
pub(super) fn along_edges(
    mesh: &TriMesh,
    metric: &Metric,
    edges: impl Iterator<Item = (EdgeId, f64)>,
) -> Vec<Option<c64>> {
    let mut sum: Vec<Option<c64>> = vec![None; mesh.n_faces()];
    for (e, tangent_offset) in edges {
        let h = mesh.halfedge(e);
        for h in [Some(h), mesh.twin(h)].into_iter().flatten() {
            let z = c64::from_polar(1.0, 4.0 * (metric.direction(h) + tangent_offset));
            let slot = &mut sum[mesh.face(h).index()];
            // The vectors of two edges an eighth of a turn apart cancel: then the first one stays.
            *slot = match *slot {
                Some(old) if (old + z).norm() > 1e-3 => Some(old + z),
                Some(old) => Some(old),
                None => Some(z),
            };
        }
    }
    sum.iter().map(|z| z.map(|z| z / z.norm())).collect()
}
