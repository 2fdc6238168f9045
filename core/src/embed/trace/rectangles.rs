//! Patches of a traced layout as rectangles of the map (Campen, section 6.4.2).
//!
//! The charts of a patch's triangles are carried into that of one of them; the patch then is a rectangle whose sides
//! are isolines. It is turned and moved so that its first corner is the origin and its first side runs along
//! +u. Opposite sides of neighbours agree, as they share the arc.

use glam::DVec2;
use rayon::prelude::*;
use thiserror::Error;

use crate::dual::Mark;
use crate::embed::trace::arcs::TracedLayout;
use crate::layout::{ArcLookup, PatchMap, QuadLayout, Submesh, patch_faces, patch_sides};
use crate::mesh::{TriMesh, TriMeshError};
use crate::param::{Transition, turn};
use crate::progress::{Cancelled, Progress};

/// Deviation from a rectangle, relative to half its circumference, that is rounding.
const ROUNDING: f64 = 1e-9;

/// Why the patches of a traced layout are not rectangles.
#[derive(Debug, Error)]
pub enum RectangleError {
    /// A patch has not the sides that the layout says.
    #[error("patch {patch} has not the four sides of the layout")]
    Sides {
        /// The patch.
        patch: usize,
    },
    /// A patch is no disc.
    #[error("patch {patch} is not a disc: {source}")]
    NoDisc {
        /// The patch.
        patch: usize,
        /// What the mesh kernel says.
        source: TriMeshError,
    },
    /// A patch is no rectangle in the map.
    #[error("patch {patch} is off a rectangle of {size} by {deviation}")]
    NotRectangle {
        /// The patch.
        patch: usize,
        /// Width and height of the rectangle nearest to it.
        size: DVec2,
        /// How far some point is off.
        deviation: f64,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The patches of `layout` as the rectangles that the map makes of them.
///
/// # Errors
///
/// See [`RectangleError`].
pub fn map_rectangles(
    layout: &QuadLayout,
    traced: &TracedLayout,
    progress: &Progress,
) -> Result<Vec<PatchMap>, RectangleError> {
    let lookup = ArcLookup::new(&traced.embedding);
    (0..layout.patches.len())
        .into_par_iter()
        .map(|patch| {
            progress.check()?;
            map_rectangle(layout, traced, &lookup, patch)
        })
        .collect()
}

fn map_rectangle(
    layout: &QuadLayout,
    traced: &TracedLayout,
    lookup: &ArcLookup,
    patch: usize,
) -> Result<PatchMap, RectangleError> {
    let embedding = &traced.embedding;
    let on_arc = |h: u32| embedding.mesh.mark(h) != Mark::Free;
    let faces = patch_faces(&embedding.mesh, embedding.seeds[patch], on_arc);
    let piece =
        Submesh::cut_out(&embedding.mesh, &faces, on_arc).map_err(|source| RectangleError::NoDisc { patch, source })?;
    let sides = patch_sides(layout, lookup, &piece, patch).ok_or(RectangleError::Sides { patch })?;
    if piece.mesh.euler_characteristic() != 1 {
        return Err(RectangleError::Sides { patch });
    }
    let (mut uv, torn) = one_chart(traced, &piece.mesh, &faces);
    let (size, bent) = straighten(&mut uv, &sides);
    let deviation = torn.max(bent);
    if deviation.is_nan() || deviation > ROUNDING * (size.x + size.y) {
        return Err(RectangleError::NotRectangle { patch, size, deviation });
    }
    let flipped = crate::layout::flipped(&piece.mesh, &uv);
    let base_face = faces.iter().map(|&f| embedding.base_face[f as usize]).collect();
    Ok(PatchMap { mesh: piece.mesh, whole: piece.whole, base_face, uv, size, flipped })
}

/// The coordinates of all vertices of a patch in the chart of its first triangle, and by how much the triangles
/// at a vertex disagree at most. Face `k` of the patch is face `faces[k]` of the traced mesh.
fn one_chart(traced: &TracedLayout, patch: &TriMesh, faces: &[u32]) -> (Vec<DVec2>, f64) {
    let whole = |h: crate::mesh::HalfedgeId| crate::mesh::HalfedgeId(3 * faces[h.index() / 3] + h.0 % 3);
    let mut chart: Vec<Option<Transition>> = vec![None; faces.len()];
    let mut uv: Vec<Option<DVec2>> = vec![None; patch.n_vertices()];
    let mut torn = 0.0f64;
    let mut queue = std::collections::VecDeque::new();
    chart[0] = Some(Transition::IDENTITY);
    queue.push_back((0, Transition::IDENTITY));
    while let Some((f, change)) = queue.pop_front() {
        for h in patch.face_halfedges(crate::mesh::FaceId::new(f)) {
            let w = whole(h);
            let at = change.apply(traced.map.uv[w.index() / 3][w.index() % 3]);
            let known = *uv[patch.origin(h).index()].get_or_insert(at);
            torn = torn.max(known.distance(at));
            let Some(t) = patch.twin(h) else { continue };
            let g = t.index() / 3;
            if chart[g].is_none()
                && let Some(back) = traced.map.transition(&traced.mesh, whole(t))
            {
                let next = back.then(&change);
                chart[g] = Some(next);
                queue.push_back((g, next));
            }
        }
    }
    (uv.into_iter().map(Option::unwrap_or_default).collect(), torn)
}

/// Turns and moves a patch to its rectangle and puts its border exactly on the border of that; returns the size and by
/// how much the border was off.
fn straighten(uv: &mut [DVec2], sides: &[Vec<u32>; 4]) -> (DVec2, f64) {
    let corner = sides.each_ref().map(|s| s[0] as usize);
    let origin = uv[corner[0]];
    let along = uv[corner[1]] - origin;
    let quarters = (0..4).max_by(|&a, &b| turn(along, a).x.total_cmp(&turn(along, b).x)).unwrap_or(0);
    for w in uv.iter_mut() {
        *w = turn(*w - origin, quarters);
    }
    let size = DVec2::new(
        0.5 * (uv[corner[1]].x + uv[corner[2]].x - uv[corner[3]].x),
        0.5 * (uv[corner[2]].y + uv[corner[3]].y - uv[corner[1]].y),
    );
    let exact = [DVec2::ZERO, DVec2::new(size.x, 0.0), size, DVec2::new(0.0, size.y)];
    let mut off = 0.0f64;
    for (k, side) in sides.iter().enumerate() {
        let (axis, value) = [(1, 0.0), (0, size.x), (1, size.y), (0, 0.0)][k];
        for &v in side {
            let w = &mut uv[v as usize];
            off = off.max((w[axis] - value).abs());
            w[axis] = value;
        }
        let w = &mut uv[corner[k]];
        off = off.max(w.distance(exact[k]));
        *w = exact[k];
    }
    (size, off)
}
