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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::square;

    #[test]
    fn roundness_is_one_for_equilateral_and_zero_for_degenerate_triangles() {
        let top = DVec3::new(0.5, 0.75f64.sqrt(), 0.0);
        assert!((roundness([DVec3::ZERO, DVec3::X, top]) - 1.0).abs() < 1e-15);
        assert_eq!(roundness([DVec3::ZERO, DVec3::X, 3.0 * DVec3::X]), 0.0);
        assert_eq!(roundness([DVec3::ONE; 3]), 0.0);
    }

    #[test]
    fn equilateral_triangles_of_the_length_have_the_area_of_the_mesh() {
        let length = equilateral_length(&square(3), 10);
        assert!((10.0 * length * length * 3f64.sqrt() / 4.0 - 1.0).abs() < 1e-12);
    }
}
