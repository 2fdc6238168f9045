//! Barycentric coordinates of points in the plane of a triangle.

use glam::DVec3;

/// The barycentric coordinates of the orthogonal projection of `p` to the plane of a triangle. They add up to 1 and are
/// negative beyond the triangle's sides. A triangle without area gives 1/3 each.
pub fn barycentric(corners: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let whole = normal.length_squared();
    if whole <= 0.0 {
        return [1.0 / 3.0; 3];
    }
    let part = |i: usize| (corners[(i + 1) % 3] - p).cross(corners[(i + 2) % 3] - p).dot(normal) / whole;
    [part(0), part(1), part(2)]
}

/// The barycentric coordinates of a point inside a triangle. Rounding errors never make one negative, and they add up
/// to 1; a triangle without area gives 1/3 each.
pub fn barycentric_inside(corners: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let part = |i: usize| (corners[(i + 1) % 3] - p).cross(corners[(i + 2) % 3] - p).dot(normal).max(0.0);
    let parts = [part(0), part(1), part(2)];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 { parts.map(|p| p / sum) } else { [1.0 / 3.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::new(0.2, 0.9, 0.4)];

    fn at(weights: [f64; 3]) -> DVec3 {
        TRIANGLE.into_iter().zip(weights).map(|(c, w)| c * w).sum()
    }

    fn is_near(found: [f64; 3], wanted: [f64; 3]) -> bool {
        (0..3).all(|i| (found[i] - wanted[i]).abs() < 1e-12)
    }

    #[test]
    fn coordinates_continue_beyond_the_triangle() {
        let wanted = [0.7, 0.6, -0.3];
        assert!(is_near(barycentric(TRIANGLE, at(wanted)), wanted));
        assert!(barycentric_inside(TRIANGLE, at(wanted)).into_iter().all(|w| w >= 0.0));
    }

    #[test]
    fn both_agree_inside_the_triangle() {
        let wanted = [0.2, 0.5, 0.3];
        assert!(is_near(barycentric(TRIANGLE, at(wanted)), wanted));
        assert!(is_near(barycentric_inside(TRIANGLE, at(wanted)), wanted));
    }

    #[test]
    fn a_triangle_without_area_has_equal_coordinates() {
        let flat = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
        assert_eq!(barycentric(flat, DVec3::Y), [1.0 / 3.0; 3]);
        assert_eq!(barycentric_inside(flat, DVec3::Y), [1.0 / 3.0; 3]);
    }
}
