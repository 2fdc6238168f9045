//! The linear equality constraints of a seamless map.
//!
//! The variables are the coordinates of each wedge in combed charts, `2 w` and `2 w + 1` for wedge `w`, followed by
//! the translation of each cut path in the same layout. Across a cut with period jump `p` from left to right,
//! `w_right = i^{-p} w_left + T` (Campen, equation 6.2). A coordinate constraint is transported along its chain of
//! triangles. Combed charts change only at cuts, so its terms are wedge coordinates and translations with signs.

use super::ParamError;
use super::cut_graph::CutGraph;
use super::seamless::CoordinateConstraint;
use crate::field::Step;
use crate::mesh::{HalfedgeId, TriMesh};
use crate::solve::Constraint;
use crate::surface::SurfacePoint;

/// Component `c` of `z` after `quarters` quarter turns counter-clockwise: a component of `z`, and its sign.
pub(super) fn turned(quarters: i32, c: u32) -> (u32, f64) {
    match (quarters.rem_euclid(4), c) {
        (0, c) => (c, 1.0),
        (1, 0) => (1, -1.0),
        (1, _) => (0, 1.0),
        (2, c) => (c, -1.0),
        (_, 0) => (1, 1.0),
        (_, _) => (0, -1.0),
    }
}

/// The variable and sign of a coordinate of the origin of `h` in the field's frame of its triangle.
pub(super) fn corner(cut: &CutGraph, h: HalfedgeId, axis: u32) -> (u32, f64) {
    let (component, sign) = turned(cut.turn[h.index() / 3], axis);
    (2 * cut.wedge[h.index()] + component, sign)
}

/// Priority of each variable to remain free in the elimination: translations, which serve a whole path, before
/// coordinates.
pub(super) fn keep(cut: &CutGraph) -> Vec<u32> {
    let mut keep = vec![1; 2 * cut.n_wedges];
    keep.extend(cut.paths.iter().flat_map(|p| [p.steps.len() as u32 + 2; 2]));
    keep
}

/// Seam constraints: `w_right − i^{-p} w_left − T = 0` at every vertex of every cut; one corner of each component is
/// fixed at the origin.
pub(super) fn seams(mesh: &TriMesh, cut: &CutGraph) -> Vec<Constraint> {
    let mut out = Vec::new();
    for (k, path) in cut.paths.iter().enumerate() {
        let translation = (2 * (cut.n_wedges + k)) as u32;
        for (i, step) in path.steps.iter().enumerate() {
            let (Some(l), Some(r)) = (step.left(mesh), step.right(mesh)) else { continue };
            // The corners at the start of the edge; at the last edge also those at its end.
            let last = (i + 1 == path.steps.len()).then(|| (mesh.next(l), r));
            for (l, r) in std::iter::once((l, mesh.next(r))).chain(last) {
                let (l, r) = (2 * cut.wedge[l.index()], 2 * cut.wedge[r.index()]);
                for c in 0..2 {
                    let (component, sign) = turned(-path.jump, c);
                    let terms = vec![(r + c, 1.0), (l + component, -sign), (translation + c, -1.0)];
                    out.push(Constraint { terms, rhs: 0.0 });
                }
            }
        }
    }
    for &root in &cut.roots {
        let w = 2 * cut.wedge[mesh.face_halfedges(root)[0].index()];
        out.extend([0, 1].map(|c| Constraint { terms: vec![(w + c, 1.0)], rhs: 0.0 }));
    }
    out
}

/// Computes the translations of the cuts from the coordinates of the wedges.
pub(super) fn add_translations(mesh: &TriMesh, cut: &CutGraph, values: &mut [f64]) {
    for (k, path) in cut.paths.iter().enumerate() {
        let sides = |s: &Step| Some((s.left(mesh)?, mesh.next(s.right(mesh)?)));
        let Some((l, r)) = path.steps.first().and_then(sides) else { continue };
        let (l, r) = (2 * cut.wedge[l.index()], 2 * cut.wedge[r.index()]);
        for c in 0..2 {
            let (component, sign) = turned(-path.jump, c);
            values[2 * (cut.n_wedges + k) + c as usize] =
                values[(r + c) as usize] - sign * values[(l + component) as usize];
        }
    }
}

/// Coordinate constraints as linear equalities of the variables.
pub(super) fn linear_constraints(
    mesh: &TriMesh,
    cut: &CutGraph,
    list: &[CoordinateConstraint],
) -> Result<Vec<Constraint>, ParamError> {
    let one = |(i, c)| linear_constraint(mesh, cut, c).ok_or(ParamError::Malformed { constraint: i });
    list.iter().enumerate().map(one).collect()
}

/// A coordinate constraint as a linear equality; `None` if it is malformed.
fn linear_constraint(mesh: &TriMesh, cut: &CutGraph, constraint: &CoordinateConstraint) -> Option<Constraint> {
    let CoordinateConstraint { from, crossed, to, axis, difference } = constraint;
    let is_valid = |p: &SurfacePoint| p.face.index() < mesh.n_faces() && p.weights.iter().all(|w| w.is_finite());
    if *axis > 1 || !difference.is_finite() || !is_valid(from) || !is_valid(to) {
        return None;
    }
    // Coordinates in the combed chart reached: `i^{-quarters} w + Σ sign i^{more} T_path`, `shifts` being `(path, more,
    // sign)`.
    let mut quarters = 0;
    let mut shifts: Vec<(usize, i32, f64)> = Vec::new();
    let mut face = from.face;
    for &h in crossed {
        if h.index() >= mesh.n_halfedges() || mesh.face(h) != face {
            return None;
        }
        face = mesh.face(mesh.twin(h)?);
        let Some((path, from_left)) = cut.crossing(mesh, h) else { continue };
        let jump = cut.paths[path].jump;
        if from_left {
            shifts.iter_mut().for_each(|s| s.1 -= jump);
            shifts.push((path, 0, 1.0));
            quarters += jump;
        } else {
            shifts.push((path, 0, -1.0));
            shifts.iter_mut().for_each(|s| s.1 += jump);
            quarters -= jump;
        }
    }
    if face != to.face {
        return None;
    }
    // In the field's frame of the first triangle: `i^turn (i^quarters (w_to − shifts) − w_from)`.
    let (turn, axis) = (cut.turn[from.face.index()], u32::from(*axis));
    let mut terms = Vec::with_capacity(4);
    let mut add = |variable: u32, quarters: i32, factor: f64| {
        let (component, sign) = turned(turn + quarters, axis);
        terms.push((variable + component, sign * factor));
    };
    for (point, quarters, factor) in [(to, quarters, 1.0), (from, 0, -1.0)] {
        for (h, weight) in mesh.face_halfedges(point.face).into_iter().zip(point.weights) {
            if weight != 0.0 {
                add(2 * cut.wedge[h.index()], quarters, factor * weight);
            }
        }
    }
    for (path, more, sign) in shifts {
        add(2 * (cut.n_wedges + path) as u32, quarters + more, -sign);
    }
    Some(Constraint { terms, rhs: *difference })
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::param::turn;

    #[test]
    fn turned_components_agree_with_turned_vectors() {
        let w = DVec2::new(3.0, 5.0);
        for quarters in -5..6 {
            for c in 0..2 {
                let (component, sign) = turned(quarters, c);
                assert_eq!(sign * w[component as usize], turn(w, quarters)[c as usize], "{quarters} {c}");
            }
        }
    }
}
