//! The shape of the image of a triangle.
//!
//! Relative to the target, a map of gradients `∇u`, `∇v` has the matrix `J = [a −b; b a] + [c d; d −c]`: a similarity
//! and the same with a reflection. `det J = a² + b² − c² − d²`, so that a triangle keeps its orientation where the
//! second part is the smaller one, and `|(c, d)| / |(a, b)|` tells how near it is to turning over, whatever the size
//! (Lipman, Bounded Distortion Mapping Spaces for Triangular Meshes, section 3).

use glam::DVec2;

use super::OrientedTriangle;

/// A triangle counts as folded from this ratio of its two parts on, i.e. also when its image is flattened to less
/// than 1 : 400 of what is wanted: such images carry no usable coordinates.
const FOLDED: f64 = 0.995;

/// The two parts of a map in a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// `(a, b)`, which is `(1, 0)` for a map as wanted.
    pub similarity: DVec2,
    /// `(c, d)`, which vanishes for a map as wanted.
    pub reflection: DVec2,
}

impl Shape {
    /// From the gradients of u and v in the frame of the target, and the target lengths.
    pub fn new([u, v]: [DVec2; 2], lengths: DVec2) -> Self {
        let (u, v) = (0.5 * u / lengths.x, 0.5 * v / lengths.y);
        Self { similarity: DVec2::new(u.x + v.y, v.x - u.y), reflection: DVec2::new(u.x - v.y, v.x + u.y) }
    }

    /// How near the triangle is to turning over: 0 for a similar image, 1 for a flat one, more for a folded one.
    pub fn ratio(&self) -> f64 {
        let ratio = self.reflection.length() / self.similarity.length();
        if ratio.is_nan() { f64::INFINITY } else { ratio }
    }

    /// Whether the image is turned over, has become flat, or faces away from the direction wanted. The last happens where
    /// a map makes a node of eight quarters out of four: no triangle need be turned over for it, but all isolines go
    /// astray.
    pub fn is_folded(&self) -> bool {
        self.ratio() >= FOLDED || self.similarity.x <= 0.0
    }
}

impl OrientedTriangle {
    /// Gradients of the corners' hat functions in the frame of the target; zero for a triangle without area.
    pub(super) fn hats(&self) -> [DVec2; 3] {
        let [a, b, c] = self.layout;
        let area = (b - a).perp_dot(c - a);
        if area.is_nan() || area <= 0.0 {
            return [DVec2::ZERO; 3];
        }
        [c - b, a - c, b - a].map(|side| {
            let gradient = side.perp() / area;
            DVec2::new(gradient.dot(self.axis), gradient.dot(self.axis.perp()))
        })
    }

    /// The gradients of u and v in the frame of the target where the full variables are `x`.
    pub(super) fn gradients(&self, x: &[f64]) -> [DVec2; 2] {
        let mut out = [DVec2::ZERO; 2];
        for (hat, corner) in self.hats().into_iter().zip(&self.corners) {
            for (gradient, &(variable, sign)) in out.iter_mut().zip(corner) {
                *gradient += hat * sign * x[variable as usize];
            }
        }
        out
    }

    /// The gradient of u (0) or v (1) that is wanted, in the frame of the target.
    pub(super) fn target(&self, k: usize) -> DVec2 {
        if k == 0 { DVec2::new(self.lengths.x, 0.0) } else { DVec2::new(0.0, self.lengths.y) }
    }

    /// For u and for v the factors of the components in the frame of the target: misalignment counts `ratio` times.
    pub(super) fn norms(&self) -> [DVec2; 2] {
        let across = self.ratio.sqrt();
        [DVec2::new(1.0, across), DVec2::new(across, 1.0)]
    }

    /// The energy where the gradients are as given.
    pub(super) fn energy(&self, gradients: [DVec2; 2]) -> f64 {
        let parts = [0, 1].map(|k| ((gradients[k] - self.target(k)) * self.norms()[k]).length_squared());
        self.weight * (parts[0] + parts[1])
    }
}
