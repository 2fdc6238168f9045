//! The seamless map with the curves as exact isolines: along each edge of a curve the coordinate that the curve
//! keeps is equal at both ends (Campen, Quad Layouts, section 8.2.2).

use super::StripError;
use crate::field::{CrossField, EdgePath, Step};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::param::{CoordinateConstraint, Objective, SeamlessMap, SeamlessSystem};
use crate::progress::Progress;
use crate::surface::Metric;
use crate::surface::SurfacePoint;

/// Errors of length and of direction count alike: strips are to be as wide as the surface has room.
const ANISOTROPY: f64 = 1.0;

/// Solves for the coordinates of all corners.
pub(super) fn solve(
    mesh: &TriMesh,
    metric: &Metric,
    field: &CrossField,
    paths: &[EdgePath],
    progress: &Progress,
) -> Result<SeamlessMap, StripError> {
    let nodes: Vec<_> = field.singularities.iter().map(|s| s.vertex).collect();
    let mut system = SeamlessSystem::new(mesh, field, &nodes, &isolines(mesh, metric, field, paths))?;
    progress.check()?;
    let objective = Objective { anisotropy: ANISOTROPY, ..Default::default() };
    Ok(system.solve(metric, field, &objective, progress)?.map)
}

/// The half-edges of a curve's step, left and right, each with the coordinate (0 or 1) that is to be constant along
/// it: on the left the one whose isolines are nearest to the curve, on the right its continuation.
pub(super) fn kept_coordinates(
    mesh: &TriMesh,
    metric: &Metric,
    field: &CrossField,
    step: Step,
    tangent_offset: f64,
) -> impl Iterator<Item = (HalfedgeId, u8)> {
    let nearest = |h| (field.branch_along(metric, h, tangent_offset) + 1).rem_euclid(2) as u8;
    let (left, right) = (step.left(mesh), step.right(mesh));
    let on_left = left.map(|h| (h, nearest(h)));
    let on_right = right.map(|r| match on_left {
        Some((l, kept)) => (r, (i32::from(kept) + field.jump_across(mesh, l)).rem_euclid(2) as u8),
        None => (r, nearest(r)),
    });
    on_left.into_iter().chain(on_right)
}

fn isolines(mesh: &TriMesh, metric: &Metric, field: &CrossField, paths: &[EdgePath]) -> Vec<CoordinateConstraint> {
    let at = |h: HalfedgeId| {
        let mut weights = [0.0; 3];
        weights[h.index() % 3] = 1.0;
        SurfacePoint { face: mesh.face(h), weights }
    };
    // What holds on one side holds on the other by the seam's equations.
    let kept = |(&step, &tangent_offset)| kept_coordinates(mesh, metric, field, step, tangent_offset).next();
    let steps = paths.iter().flat_map(|p| p.steps.iter().zip(&p.tangent_offset));
    steps
        .filter_map(kept)
        .map(|(h, axis)| CoordinateConstraint {
            from: at(h),
            crossed: Vec::new(),
            to: at(mesh.next(h)),
            axis,
            difference: 0.0,
        })
        .collect()
}
