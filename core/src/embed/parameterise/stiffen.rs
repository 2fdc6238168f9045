//! Local stiffening: the weights of flipped triangles grow, and those around them less (Bommes, Zimmer and Kobbelt,
//! Mixed-Integer Quadrangulation, section 5.4).

use crate::mesh::{FaceId, TriMesh};

/// Largest weight of a triangle, where 1 is usual: larger ones would make the system ill-conditioned.
const MAX_WEIGHT: f64 = 1e4;
/// Rings of triangles over which the growth fades out, so that no flip moves to the neighbour.
const RINGS: usize = 5;
/// Ratio of the growth in a ring to that in the ring inside it.
const FADE: f64 = 0.7;

/// Multiplies the weights of flipped triangles by `1 + growth`, up to a bound, and those around them by less.
pub(in crate::embed) fn stiffen(mesh: &TriMesh, flipped: &[bool], growth: f64, weight: &mut [f64]) {
    let mut share: Vec<f64> = flipped.iter().map(|&f| if f { 1.0 } else { 0.0 }).collect();
    for _ in 0..RINGS {
        let spread = |f: FaceId| {
            let sides = mesh.face_halfedges(f).into_iter().filter_map(|h| mesh.twin(h));
            let around = sides.map(|t| share[t.index() / 3]).fold(0.0, f64::max);
            share[f.index()].max(FADE * around)
        };
        share = mesh.faces().map(spread).collect();
    }
    for (w, s) in weight.iter_mut().zip(share) {
        *w = (*w * (1.0 + growth * s)).min(MAX_WEIGHT);
    }
}
