//! The distortion of a triangle relative to its target.
//!
//! Relative to the target, a map with gradients `∇u`, `∇v` has the Jacobian `J = [a −b; b a] + [c d; d −c]`: a
//! similarity part and a reflection part. `det J = a² + b² − c² − d²`, so the triangle keeps its orientation if the
//! similarity part is larger. `|(c, d)| / |(a, b)|` measures how close the triangle is to flipping, independently of
//! its size (Lipman, Bounded Distortion Mapping Spaces for Triangular Meshes, section 3).

use glam::DVec2;

/// Ratio of the two parts from which on a triangle counts as flipped. It includes images flattened to less than 1 : 400
/// of the target, which give no usable coordinates.
const FLIPPED: f64 = 0.995;

/// The two parts of a map in a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Distortion {
    /// `(a, b)`; `(1, 0)` at the target.
    pub similarity: DVec2,
    /// `(c, d)`; zero at the target.
    pub reflection: DVec2,
}

impl Distortion {
    /// From the gradients of u and v in the frame of the target, and the target lengths.
    pub fn new([u, v]: [DVec2; 2], lengths: DVec2) -> Self {
        let (u, v) = (0.5 * u / lengths.x, 0.5 * v / lengths.y);
        Self { similarity: DVec2::new(u.x + v.y, v.x - u.y), reflection: DVec2::new(u.x - v.y, v.x + u.y) }
    }

    /// Ratio of the reflection to the similarity part: 0 for a similar image, 1 for a degenerate one, more for a
    /// flipped one.
    pub fn ratio(&self) -> f64 {
        let ratio = self.reflection.length() / self.similarity.length();
        if ratio.is_nan() { f64::INFINITY } else { ratio }
    }

    /// Whether the image is flipped, degenerate, or turned by more than a quarter from the target direction.
    ///
    /// The last case occurs where a map has an angle of eight quarter turns around a node of four. No triangle need be
    /// flipped there, but all isolines are misplaced.
    pub fn is_flipped(&self) -> bool {
        self.ratio() >= FLIPPED || self.similarity.x <= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distortion(u: [f64; 2], v: [f64; 2]) -> Distortion {
        Distortion::new([u, v].map(DVec2::from_array), DVec2::new(2.0, 4.0))
    }

    #[test]
    fn target_gradients_are_undistorted() {
        let at_target = distortion([2.0, 0.0], [0.0, 4.0]);
        assert_eq!((at_target.similarity, at_target.reflection), (DVec2::X, DVec2::ZERO));
        assert_eq!(at_target.ratio(), 0.0);
        assert!(!at_target.is_flipped());
    }

    #[test]
    fn reflected_and_nearly_degenerate_images_are_flipped() {
        assert!(distortion([2.0, 0.0], [0.0, -4.0]).is_flipped());
        assert!(distortion([2.0, 0.0], [0.0, 4.0 / 500.0]).is_flipped());
        assert!(!distortion([2.0, 0.0], [0.0, 4.0 / 300.0]).is_flipped());
        assert!(distortion([0.0, 0.0], [0.0, 0.0]).is_flipped());
        assert!(distortion([f64::NAN, 0.0], [0.0, 4.0]).is_flipped());
    }

    #[test]
    fn images_turned_by_half_a_turn_count_as_flipped() {
        let turned = distortion([-2.0, 0.0], [0.0, -4.0]);
        assert_eq!(turned.ratio(), 0.0);
        assert!(turned.is_flipped());
    }
}
