//! Directions that crosses should follow: reliable principal directions, features and boundaries.
//!
//! Where the surface bends much more one way than the other its principal directions mean something; where it is
//! flat, round or saddle-shaped with equal curvatures, they are noise (Campen, section 6.3.2, after Bommes et al.,
//! Mixed-Integer Quadrangulation). A guide's weight grows with both the relative anisotropy, which says how well the
//! directions are determined, and the absolute one, which says how much they matter.

use super::bending::face_curvature;
use crate::field::Metric;
use crate::mesh::{FaceId, TriMesh};
use crate::surface::PrincipalCurvature;

/// A direction that the cross of a triangle should have as one of its four.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guide {
    /// The triangle.
    pub face: FaceId,
    /// The direction in the triangle's frame of the [`Metric`]; means the same modulo quarter turns.
    pub angle: f64,
    /// How much it counts, above 0 to 1.
    pub weight: f64,
}

/// Relative anisotropy where guides begin, and where it no longer limits them.
const RELATIVE: [f64; 2] = [0.3, 0.7];
/// Difference of the curvatures' sizes, in inverse bounding-box diagonals, where guides begin and where they are full.
const ABSOLUTE: [f64; 2] = [1.0, 8.0];

/// The reliable principal directions, by triangle. `curvature` has an entry per vertex, `sharp` a flag per edge (empty:
/// none); triangles at sharp edges take the part of their corners off them.
pub fn shape_guides(mesh: &TriMesh, metric: &Metric, curvature: &[PrincipalCurvature], sharp: &[bool]) -> Vec<Guide> {
    let mut on_crease = vec![false; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| sharp.get(e.index()).copied().unwrap_or(false)) {
        for v in mesh.edge_vertices(e) {
            on_crease[v.index()] = true;
        }
    }
    let bending = face_curvature(mesh, curvature, |v| !on_crease[v.index()]);
    let guide = |face: FaceId| {
        let c = &bending[face.index()];
        let weight = reliability(c);
        let angle = (weight > 0.0).then(|| metric.angle_of(mesh, face, c.d_max)).flatten()?;
        Some(Guide { face, angle, weight })
    };
    mesh.faces().filter_map(guide).collect()
}

/// From 0 for directions that mean nothing to 1 for those to be followed.
fn reliability(c: &PrincipalCurvature) -> f64 {
    let (a, b) = (c.k_min.abs(), c.k_max.abs());
    let difference = (a - b).abs();
    if difference == 0.0 {
        return 0.0;
    }
    ramp(difference / (a + b), RELATIVE) * ramp(difference, ABSOLUTE)
}

/// 0 up to the first bound, 1 from the second on, and smooth between.
fn ramp(x: f64, [from, to]: [f64; 2]) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The directions along edges marked in `along` (features, or boundaries to be followed), one for each side of each
/// edge, of full weight; a triangle with several such edges has several.
pub fn feature_guides(mesh: &TriMesh, metric: &Metric, along: &[bool]) -> Vec<Guide> {
    let marked = mesh.halfedges().filter(|&h| along[mesh.edge(h).index()]);
    marked.map(|h| Guide { face: mesh.face(h), angle: metric.direction(h), weight: 1.0 }).collect()
}
