//! The linear equalities of a seamless map.
//!
//! Variables are the coordinates of each wedge in combed charts, `2 w` and `2 w + 1` of wedge `w`, and then the
//! translation of each cut path likewise. Across a cut with period jump `p` from left to right
//! `w_right = i^{-p} w_left + T`. A relation is carried along its chain: only where that crosses a cut coordinates
//! change, by turns that are whole and translations that are sums of those of the cuts.

use super::ParamError;
use super::cut::Cut;
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
pub(super) fn corner(cut: &Cut, h: HalfedgeId, axis: u32) -> (u32, f64) {
    let (component, sign) = turned(cut.turn[h.index() / 3], axis);
    (2 * cut.wedge[h.index()] + component, sign)
}

/// How much each variable is worth keeping: translations, as each serves a whole path, rather than coordinates.
pub(super) fn keep(cut: &Cut) -> Vec<u32> {
    let mut keep = vec![1; 2 * cut.n_wedges];
    keep.extend(cut.paths.iter().flat_map(|p| [p.steps.len() as u32 + 2; 2]));
    keep
}

/// `w_right − i^{-p} w_left − T = 0` at every vertex of every cut, and the origin at a corner of each component.
pub(super) fn seams(mesh: &TriMesh, cut: &Cut) -> Vec<Constraint> {
    let mut out = Vec::new();
    for (k, path) in cut.paths.iter().enumerate() {
        let translation = (2 * (cut.n_wedges + k)) as u32;
        for (i, step) in path.steps.iter().enumerate() {
            let (Some(l), Some(r)) = (step.left(mesh), step.right(mesh)) else { continue };
            // The corners at the start of the edge, and at the end of the last edge too.
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

/// Enters the translations of the cuts that follow from the coordinates of the wedges.
pub(super) fn add_translations(mesh: &TriMesh, cut: &Cut, values: &mut [f64]) {
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

/// The relations as constraints.
pub(super) fn relations(
    mesh: &TriMesh,
    cut: &Cut,
    list: &[CoordinateConstraint],
) -> Result<Vec<Constraint>, ParamError> {
    let one = |(i, r)| relation(mesh, cut, r).ok_or(ParamError::Malformed { relation: i });
    list.iter().enumerate().map(one).collect()
}

/// A relation as a constraint; `None` if it is malformed.
fn relation(mesh: &TriMesh, cut: &Cut, relation: &CoordinateConstraint) -> Option<Constraint> {
    let CoordinateConstraint { from, crossed, to, axis, difference } = relation;
    let fine = |p: &SurfacePoint| p.face.index() < mesh.n_faces() && p.weights.iter().all(|w| w.is_finite());
    if *axis > 1 || !difference.is_finite() || !fine(from) || !fine(to) {
        return None;
    }
    // Coordinates in the combed chart reached are `i^{-turned} w + Σ sign i^quarters T_path`.
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
    // In the field's frame of the first triangle: `i^turn (i^turned (w_to − shifts) − w_from)`.
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
