//! Symmetric tensors in a tangent plane: outer products and eigenvectors.

use glam::{DMat3, DVec3};

/// `e eᵀ`.
pub(super) fn outer(e: DVec3) -> DMat3 {
    DMat3::from_cols(e * e.x, e * e.y, e * e.z)
}

/// Eigenvalues of a symmetric tensor restricted to a plane.
pub(super) struct PlaneEigen {
    /// Smaller eigenvalue.
    pub low: f64,
    /// Larger eigenvalue.
    pub high: f64,
    /// Unit eigenvector of the larger eigenvalue; of no particular sign.
    pub axis: DVec3,
}

/// The eigenvalues of `tensor` in the plane with unit normal `n`.
pub(super) fn plane_eigen(tensor: DMat3, n: DVec3) -> PlaneEigen {
    let (x, y) = n.any_orthonormal_pair();
    let (a, b, c) = (x.dot(tensor * x), x.dot(tensor * y), y.dot(tensor * y));
    let (mean, difference) = (0.5 * (a + c), 0.5 * (a - c));
    let root = difference.hypot(b);
    let angle = 0.5 * b.atan2(difference);
    PlaneEigen { low: mean - root, high: mean + root, axis: x * angle.cos() + y * angle.sin() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_in_a_plane_leave_out_the_normal() {
        let n = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let (x, y) = n.any_orthonormal_pair();
        let tensor = outer(x) * 3.0 - outer(y) + outer(n) * 7.0;
        let eigen = plane_eigen(tensor, n);
        assert!((eigen.low + 1.0).abs() < 1e-12 && (eigen.high - 3.0).abs() < 1e-12);
        assert!((eigen.axis.dot(x).abs() - 1.0).abs() < 1e-12);
    }
}
