//! Cross fields and their harmonic interpolation from curves.
//!
//! A cross in a triangle is an angle modulo a quarter turn; its representation vector `z = e^{4iθ}` is the same
//! for all four directions. Triangles at a curve take the direction of its edges (where several meet, the
//! average), the others the harmonic interpolation of `z` (Campen, Quad Layouts, section 8.2.2). Period jumps say
//! which direction of one triangle continues which of the next; along the given curves they are made such that a
//! curve never changes its branch, however sharply it bends at a vertex.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::edge_paths::EdgePath;
use super::period_jumps;
use super::singularities::{Singularity, inner_singularities};
use super::smoothing::{Pull, interpolate_vectors};
use super::{FieldError, expect_length};
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh};
use crate::progress::Progress;
use crate::solve::c64;
use crate::surface::Metric;

/// A cross in each triangle and how the crosses of neighbours match.
#[derive(Debug, Clone)]
pub struct CrossField {
    /// Angle of one of the four directions of each triangle, from its half-edge 0 in the [`Metric`].
    pub angle: Vec<f64>,
    /// Period jump of each edge, from the triangle `f` of [`TriMesh::halfedge`] to that `g` of its twin: direction
    /// `k` of `g` continues direction `k + jump` of `f`. Zero on the boundary.
    pub jump: Vec<i8>,
    /// The vertices around which the crosses turn by other than four quarters of a full turn, by vertex.
    pub singularities: Vec<Singularity>,
}

impl CrossField {
    /// The period jump from the triangle of `h` to the triangle of its twin.
    #[inline]
    pub fn jump_across(&self, mesh: &TriMesh, h: HalfedgeId) -> i32 {
        period_jumps::across(mesh, &self.jump, h)
    }

    /// Direction `branch` (0 to 3, counter-clockwise) of the cross in a triangle, as a unit tangent vector.
    pub fn direction(&self, mesh: &TriMesh, metric: &Metric, f: FaceId, branch: i32) -> DVec3 {
        metric.tangent(mesh, f, self.angle[f.index()] + f64::from(branch) * FRAC_PI_2)
    }

    /// The branch (0 to 3) of the cross in the triangle of `h` that is nearest to the direction `lean`
    /// counter-clockwise of `h`.
    #[inline]
    pub fn branch_along(&self, metric: &Metric, h: HalfedgeId, lean: f64) -> i32 {
        period_jumps::branch_along(metric, &self.angle, h, lean)
    }
}

/// The smoothest cross field along `paths` and the edges marked in `aligned` (empty: none). Without either it is
/// the smoothest of all.
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
    let on_path = paths.iter().flat_map(|p| p.steps.iter().map(|s| s.edge).zip(p.lean.iter().copied()));
    let marked = mesh.edges().filter(|e| aligned.get(e.index()).copied().unwrap_or(false));
    let hard = along_edges(mesh, metric, on_path.chain(marked.map(|e| (e, 0.0))));
    let vectors = interpolate_vectors(mesh, metric, &hard, &Pull::default(), progress)?;
    let angle: Vec<f64> = vectors.iter().map(|z| z.arg() / 4.0).collect();
    let mut jump = period_jumps::principal(mesh, metric, &angle);
    period_jumps::keep_on_branch(mesh, metric, &angle, &mut jump, paths);
    let singularities = inner_singularities(mesh, metric, &angle, &jump);
    Ok(CrossField { angle, jump, singularities })
}

/// The representation vectors of the triangles at `edges`: the direction of the edge, turned by the angle given with
/// it, or the average of several.
pub(super) fn along_edges(
    mesh: &TriMesh,
    metric: &Metric,
    edges: impl Iterator<Item = (EdgeId, f64)>,
) -> Vec<Option<c64>> {
    let mut sum: Vec<Option<c64>> = vec![None; mesh.n_faces()];
    for (e, lean) in edges {
        let h = mesh.halfedge(e);
        for h in [Some(h), mesh.twin(h)].into_iter().flatten() {
            let z = c64::from_polar(1.0, 4.0 * (metric.direction(h) + lean));
            let slot = &mut sum[mesh.face(h).index()];
            // Two edges that differ by just an eighth of a turn cancel: then the first one stands.
            *slot = match *slot {
                Some(old) if (old + z).norm() > 1e-3 => Some(old + z),
                Some(old) => Some(old),
                None => Some(z),
            };
        }
    }
    sum.iter().map(|z| z.map(|z| z / z.norm())).collect()
}
