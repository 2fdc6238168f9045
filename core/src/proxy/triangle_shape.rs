//! Size and shape of triangles.

use glam::DVec3;

use crate::mesh::TriMesh;

/// Side length of `n_faces` equilateral triangles that together have the area of the mesh.
pub(super) fn equilateral_length(mesh: &TriMesh, n_faces: usize) -> f64 {
    let area: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
    (4.0 * area / (3f64.sqrt() * n_faces.max(1) as f64)).sqrt()
}

/// Shape of a triangle: `4 √3 area / Σ length²`, 1 if equilateral and 0 if degenerate.
#[inline]
pub(super) fn roundness(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let squares = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
    2.0 * 3f64.sqrt() * (b - a).cross(c - a).length() / squares.max(f64::MIN_POSITIVE)
}
