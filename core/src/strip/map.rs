//! The seamless map: field-aligned coordinates with the curves as exact isolines.
//!
//! Per triangle corner `w = u + iv`. Minimised is `Σ A (|∇u − X|² + |∇v − Y|²)` with unit field directions `X`, `Y`.
//! Across a cut with period jump `p` from left to right `w_right = i^{-p} w_left + T`, the translation `T` of each
//! cut being unknown and real. Along each edge of a curve the coordinate that the curve keeps is equal at both
//! ends; translations carry that through cuts. All these equalities are eliminated exactly; what remains is one
//! positive definite system (Campen, Quad Layouts, sections 6.4 and 8.2.2).

use glam::DVec2;

use super::StripError;
use super::cut::Cut;
use crate::field::{CrossField, EdgePath, Metric, Step};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::progress::Progress;
use crate::solve::{Constraint, Reduction, SparseHermitian, SpdFactor, eliminate};

/// Solves for the coordinates of all corners.
pub(super) fn solve(
    mesh: &TriMesh,
    metric: &Metric,
    field: &CrossField,
    cut: &Cut,
    paths: &[EdgePath],
    progress: &Progress,
) -> Result<Vec<[DVec2; 3]>, StripError> {
    let mut constraints = Vec::new();
    curve_constraints(mesh, metric, field, cut, paths, &mut constraints);
    seam_constraints(mesh, cut, &mut constraints);
    for &root in &cut.roots {
        let w = cut.wedge[mesh.face_halfedges(root)[0].index()];
        constraints.extend([0, 1].map(|c| Constraint { terms: vec![(2 * w + c, 1.0)], rhs: 0.0 }));
    }
    // Translations stay rather than coordinates: each serves a whole path.
    let mut keep = vec![1; 2 * cut.n_wedges];
    keep.extend(cut.paths.iter().flat_map(|p| [p.steps.len() as u32 + 2; 2]));
    let reduction = eliminate(&keep, &constraints)?;
    progress.check()?;
    let (matrix, rhs) = assemble(mesh, metric, field, cut, &reduction);
    progress.check()?;
    let factor = SpdFactor::new(&matrix)?;
    progress.check()?;
    let x = reduction.expand(&factor.solve(&matrix, &rhs)?);
    let at = |h: HalfedgeId| {
        let w = 2 * cut.wedge[h.index()] as usize;
        DVec2::new(x[w], x[w + 1])
    };
    Ok(mesh.faces().map(|f| mesh.face_halfedges(f).map(at)).collect())
}

/// The half-edges of a curve's step, left and right, each with the coordinate (0 or 1) that is to be constant along
/// it: on the left the one whose isolines are nearest to the curve, on the right its continuation.
pub(super) fn kept_coordinates(
    mesh: &TriMesh,
    metric: &Metric,
    field: &CrossField,
    cut: &Cut,
    step: Step,
    lean: f64,
) -> impl Iterator<Item = (HalfedgeId, u32)> {
    let nearest = |h| (field.branch_along(metric, h, lean) - cut.turn[h.index() / 3] + 1).rem_euclid(2) as u32;
    let (left, right) = (step.left(mesh), step.right(mesh));
    let on_left = left.map(|h| (h, nearest(h)));
    let on_right = right.map(|r| match on_left {
        Some((l, kept)) => (r, (kept as i32 + cut.jump_across(mesh, field, l, r)).rem_euclid(2) as u32),
        None => (r, nearest(r)),
    });
    on_left.into_iter().chain(on_right)
}

fn curve_constraints(
    mesh: &TriMesh,
    metric: &Metric,
    field: &CrossField,
    cut: &Cut,
    paths: &[EdgePath],
    out: &mut Vec<Constraint>,
) {
    for (step, &lean) in paths.iter().flat_map(|p| p.steps.iter().zip(&p.lean)) {
        // What holds on one side holds on the other by the seam's equations.
        let Some((h, c)) = kept_coordinates(mesh, metric, field, cut, *step, lean).next() else { continue };
        let [a, b] = [h, mesh.next(h)].map(|h| 2 * cut.wedge[h.index()] + c);
        if a != b {
            out.push(Constraint { terms: vec![(a, 1.0), (b, -1.0)], rhs: 0.0 });
        }
    }
}

/// `w_right − i^{-p} w_left − T = 0` at every vertex of every cut.
fn seam_constraints(mesh: &TriMesh, cut: &Cut, out: &mut Vec<Constraint>) {
    for (k, path) in cut.paths.iter().enumerate() {
        let translation = (2 * (cut.n_wedges + k)) as u32;
        for (i, step) in path.steps.iter().enumerate() {
            let (Some(l), Some(r)) = (step.left(mesh), step.right(mesh)) else { continue };
            // The corners at the start of the edge, and at the end of the last edge too.
            let mut ends = vec![(l, mesh.next(r))];
            if i + 1 == path.steps.len() {
                ends.push((mesh.next(l), r));
            }
            for (l, r) in ends {
                let (l, r) = (2 * cut.wedge[l.index()], 2 * cut.wedge[r.index()]);
                // Multiplication by i^{-p} as rows of (component, sign).
                let rows = match path.jump {
                    0 => [(0, 1.0), (1, 1.0)],
                    1 => [(1, 1.0), (0, -1.0)],
                    2 => [(0, -1.0), (1, -1.0)],
                    _ => [(1, -1.0), (0, 1.0)],
                };
                for (c, (component, sign)) in (0u32..).zip(rows) {
                    let terms = vec![(r + c, 1.0), (l + component, -sign), (translation + c, -1.0)];
                    out.push(Constraint { terms, rhs: 0.0 });
                }
            }
        }
    }
}

fn assemble(
    mesh: &TriMesh,
    metric: &Metric,
    field: &CrossField,
    cut: &Cut,
    reduction: &Reduction,
) -> (SparseHermitian<f64>, Vec<f64>) {
    let mut triplets = Vec::with_capacity(14 * mesh.n_faces());
    let mut rhs = vec![0.0; reduction.n_free()];
    for f in mesh.faces() {
        let area = metric.area(f);
        let [a, b, c] = *metric.layout(f);
        // Gradients of the corners' hat functions.
        let gradient = [c - b, a - c, b - a].map(|e| e.perp() / (2.0 * area));
        let wedge = mesh.face_halfedges(f).map(|h| 2 * cut.wedge[h.index()] as usize);
        let axis =
            DVec2::from_angle(field.angle[f.index()] + f64::from(cut.turn[f.index()]) * std::f64::consts::FRAC_PI_2);
        for (component, axis) in [axis, axis.perp()].into_iter().enumerate() {
            let expression = wedge.map(|w| reduction.expression(w + component).0);
            for (i, row) in expression.iter().enumerate() {
                for &(x, a) in row.iter() {
                    rhs[x as usize] += a * area * gradient[i].dot(axis);
                    for (j, column) in expression.iter().enumerate() {
                        let stiffness = area * gradient[i].dot(gradient[j]);
                        let below = column.iter().filter(|&&(y, _)| y <= x);
                        triplets.extend(below.map(|&(y, b)| (x, y, a * b * stiffness)));
                    }
                }
            }
        }
    }
    (SparseHermitian::from_triplets(reduction.n_free(), &triplets), rhs)
}
