//! What the simplification knows of the original: which vertices may move how, normals, sizes.

use glam::DVec3;

use crate::mesh::TriMesh;

/// A crease or boundary that turns by more than this at a vertex has a corner there: 45°.
const CORNER_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// How a vertex may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Anywhere.
    Smooth,
    /// Along the feature or the boundary it lies on.
    Crease,
    /// Not at all: a corner.
    Corner,
}

/// The kind of each vertex.
pub(super) fn kinds(mesh: &TriMesh, sharp: &[bool]) -> Vec<Kind> {
    let kind = |v| {
        let mut ends = [DVec3::ZERO; 2];
        let mut n = 0;
        let mut meet = |arm: DVec3| {
            if n < 2 {
                ends[n] = arm.normalize_or_zero();
            }
            n += 1;
        };
        for h in mesh.outgoing(v).filter(|&h| mesh.twin(h).is_none() || sharp[mesh.edge(h).index()]) {
            meet(mesh.vector(h));
        }
        if mesh.is_boundary_vertex(v) {
            meet(-mesh.vector(mesh.incoming_boundary(v)));
        }
        match n {
            0 => Kind::Smooth,
            2 if -ends[0].dot(ends[1]) > CORNER_COSINE => Kind::Crease,
            _ => Kind::Corner,
        }
    };
    mesh.vertices().map(kind).collect()
}

/// Unit normals of the vertices, weighted by area; zero where the faces cancel.
pub(super) fn vertex_normals(mesh: &TriMesh) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.n_vertices()];
    for f in mesh.faces() {
        let n = mesh.face_area_vector(f);
        for v in mesh.face_vertices(f) {
            normals[v.index()] += n;
        }
    }
    normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
    normals
}

/// Length of the sides of `n_faces` equilateral triangles with the area of the mesh.
pub(super) fn even_length(mesh: &TriMesh, n_faces: usize) -> f64 {
    let area: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
    (4.0 * area / (3f64.sqrt() * n_faces.max(1) as f64)).sqrt()
}

/// Shape of a triangle, 1 if equilateral and 0 if degenerate: `4 √3 area / Σ length²`.
#[inline]
pub(super) fn roundness(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let squares = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
    2.0 * 3f64.sqrt() * (b - a).cross(c - a).length() / squares.max(f64::MIN_POSITIVE)
}
