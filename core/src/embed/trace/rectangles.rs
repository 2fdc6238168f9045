//! The patches of a traced layout as rectangles in the map (Campen, section 6.4.2).
//!
//! The charts of a patch's triangles are all transformed to that of one of them. The patch then is a rectangle whose
//! sides are isolines; it is rotated and translated so that its first corner is the origin and its first side runs
//! along +u. Neighbouring patches agree along their arc without scaling, as both take its length from the same map.

use glam::DVec2;
use rayon::prelude::*;
use thiserror::Error;

use crate::embed::trace::isolines::corner_uv;
use crate::embed::trace::traced_layout::TracedLayout;
use crate::layout::{ArcLookup, PatchDisc, PatchMap, PatchShapeError, QuadLayout, count_flipped};
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh};
use crate::param::{Transition, turn};
use crate::progress::{Cancelled, Progress};

/// Largest deviation from a rectangle that counts as rounding, relative to half its circumference.
const ROUNDING: f64 = 1e-9;

/// Why the patches of a traced layout are not rectangles.
#[derive(Debug, Error)]
pub enum RectangleError {
    /// A patch is not a disc with the four sides of the layout.
    #[error(transparent)]
    Shape(#[from] PatchShapeError),
    /// A patch is not a rectangle in the map.
    #[error("patch {patch} deviates by {deviation} from a rectangle of size {size} in the map")]
    NotRectangle {
        /// The patch.
        patch: usize,
        /// Width and height of the rectangle compared with.
        size: DVec2,
        /// The largest distance of a point from where it should be.
        deviation: f64,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The maps of all patches of `layout` to rectangles, in the order of the patches.
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
    let PatchDisc { submesh, faces, sides } = PatchDisc::cut_out(layout, embedding, lookup, patch)?;
    if submesh.mesh.euler_characteristic() != 1 {
        return Err(PatchShapeError::Sides { patch }.into());
    }
    let (mut uv, gap) = one_chart(traced, &submesh.mesh, &faces);
    let (size, border_deviation) = align_to_rectangle(&mut uv, &sides);
    let deviation = gap.max(border_deviation);
    if deviation.is_nan() || deviation > ROUNDING * (size.x + size.y) {
        return Err(RectangleError::NotRectangle { patch, size, deviation });
    }
    let flipped = count_flipped(&submesh.mesh, &uv);
    let base_face = faces.iter().map(|&f| embedding.base_face[f as usize]).collect();
    Ok(PatchMap { mesh: submesh.mesh, parent: submesh.parent, base_face, uv, size, flipped })
}

/// The coordinates of all vertices of a patch in the chart of its first triangle, and the largest distance between the
/// coordinates of a vertex in different triangles. Face `k` of the patch is face `faces[k]` of the traced mesh.
fn one_chart(traced: &TracedLayout, patch: &TriMesh, faces: &[u32]) -> (Vec<DVec2>, f64) {
    let whole = |h: HalfedgeId| HalfedgeId(3 * faces[h.index() / 3] + h.0 % 3);
    // The transition from the chart of each triangle to that of the first.
    let mut to_first = vec![Transition::IDENTITY; faces.len()];
    let mut uv: Vec<Option<DVec2>> = vec![None; patch.n_vertices()];
    let mut gap = 0.0f64;
    let mut search = BreadthFirst::new(faces.len());
    search.start(FaceId(0));
    while let Some(f) = search.visit() {
        let change = to_first[f.index()];
        for h in patch.face_halfedges(f) {
            let w = whole(h);
            let at = change.apply(corner_uv(&traced.map, w));
            let known = *uv[patch.origin(h).index()].get_or_insert(at);
            gap = gap.max(known.distance(at));
            if let Some(t) = patch.twin(h)
                && let Some(back) = traced.map.transition(&traced.mesh, whole(t))
                && search.reach(patch.face(t), ())
            {
                to_first[patch.face(t).index()] = back.then(&change);
            }
        }
    }
    (uv.into_iter().map(Option::unwrap_or_default).collect(), gap)
}

/// Rotates and translates a patch onto its rectangle and moves its border exactly onto the rectangle's; returns the
/// size and the largest distance by which a point of the border moved.
fn align_to_rectangle(uv: &mut [DVec2], sides: &[Vec<u32>; 4]) -> (DVec2, f64) {
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
