//! The seamless map with the curves as exact isolines: one coordinate is constrained to be equal at both ends of each edge of
//! a curve (Campen, Quad Layouts, section 8.2.2).

use super::error::StripError;
use crate::field::{CrossField, EdgePath, Step};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::param::{CoordinateConstraint, Objective, SeamlessMap, SeamlessSystem};
use crate::progress::Progress;
use crate::surface::{Metric, SurfacePoint};

/// Anisotropy of the objective: 1 weights errors of length and of direction equally, so that the map stays close to isometric
/// and widths are those of the surface.
const ANISOTROPY: f64 = 1.0;

/// The map of the whole mesh.
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

/// The half-edges left and right of a step, each with the coordinate (0: u, 1: v) to be constant along it: on the left the one
/// whose isolines are closest to the direction of the curve, on the right its continuation across the edge.
pub(super) fn constant_coordinates(
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
        Some((l, axis)) => (r, (i32::from(axis) + field.jump_across(mesh, l)).rem_euclid(2) as u8),
        None => (r, nearest(r)),
    });
    on_left.into_iter().chain(on_right)
}

/// The constraints that make the paths isolines.
fn isolines(mesh: &TriMesh, metric: &Metric, field: &CrossField, paths: &[EdgePath]) -> Vec<CoordinateConstraint> {
    let at = |h: HalfedgeId| {
        let mut weights = [0.0; 3];
        weights[h.index() % 3] = 1.0;
        SurfacePoint { face: mesh.face(h), weights }
    };
    // On one side of the edge only: for the other side the equation follows from the seam's transition.
    let constant = |(&step, &tangent_offset)| constant_coordinates(mesh, metric, field, step, tangent_offset).next();
    let steps = paths.iter().flat_map(|p| p.steps.iter().zip(&p.tangent_offset));
    steps
        .filter_map(constant)
        .map(|(h, axis)| CoordinateConstraint {
            from: at(h),
            crossed: Vec::new(),
            to: at(mesh.next(h)),
            axis,
            difference: 0.0,
        })
        .collect()
}
