//! The input of the removal of flipped triangles: a map, and the gradients it should have.

use glam::DVec2;

use super::distortion::Distortion;
use crate::solve::Reduction;

/// A triangle of a map that should follow a cross field.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientedTriangle {
    /// The corners in the triangle's plane, counter-clockwise.
    pub layout: [DVec2; 3],
    /// The unit vector that `∇u` should follow; `∇v` should follow the vector a quarter turn further.
    pub axis: DVec2,
    /// Target lengths of `∇u` and `∇v`; positive.
    pub lengths: DVec2,
    /// The weight in the energy, usually the area.
    pub weight: f64,
    /// Weight of errors of direction relative to errors of length; 1 for the Euclidean norm.
    pub ratio: f64,
    /// The vertices of the mesh at the corners.
    pub vertices: [u32; 3],
    /// The coordinates u and v of each corner: a variable of the reduction, and its sign.
    pub corners: [[(u32, f64); 2]; 3],
}

/// A map, given by its free variables, and its target gradients.
#[derive(Debug, Clone, Copy)]
pub struct OrientationProblem<'a> {
    /// All triangles of the surface.
    pub triangles: &'a [OrientedTriangle],
    /// All variables in terms of the free ones.
    pub reduction: &'a Reduction,
    /// The angle around each vertex in the map, in quarter turns: the valence of the field there, 4 at a regular
    /// vertex; 0 where the angle is not prescribed, as on the boundary.
    pub quarters: &'a [u32],
}

impl OrientationProblem<'_> {
    /// The weighted squared difference of the map's gradients from their targets.
    pub fn energy(&self, y: &[f64]) -> f64 {
        let x = self.reduction.expand(y);
        self.triangles.iter().map(|t| t.energy(t.gradients(&x))).sum()
    }

    /// The triangles that are flipped or degenerate for variables `x`, ascending.
    pub(super) fn flipped(&self, x: &[f64]) -> Vec<u32> {
        let flipped = |t: &OrientedTriangle| Distortion::new(t.gradients(x), t.lengths).is_flipped();
        (0..).zip(self.triangles).filter(|(_, t)| flipped(t)).map(|(i, _)| i).collect()
    }

    /// The free variables that occur in a triangle, ascending, each once.
    pub(super) fn variables(&self, t: u32) -> Vec<u32> {
        let corners = self.triangles[t as usize].corners.iter().flatten();
        let mut out: Vec<u32> =
            corners.flat_map(|&(x, _)| self.reduction.expression(x as usize).0.iter().map(|term| term.0)).collect();
        out.sort_unstable();
        out.dedup();
        out
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

    /// The gradients of u and v in the frame of the target, for variables `x`.
    pub(super) fn gradients(&self, x: &[f64]) -> [DVec2; 2] {
        let mut out = [DVec2::ZERO; 2];
        for (hat, corner) in self.hats().into_iter().zip(&self.corners) {
            for (gradient, &(variable, sign)) in out.iter_mut().zip(corner) {
                *gradient += hat * sign * x[variable as usize];
            }
        }
        out
    }

    /// The target gradient of u (0) or v (1), in the frame of the target.
    pub(super) fn target(&self, k: usize) -> DVec2 {
        if k == 0 { DVec2::new(self.lengths.x, 0.0) } else { DVec2::new(0.0, self.lengths.y) }
    }

    /// For u and for v the factors of the components in the frame of the target; squared, the one across is `ratio`.
    pub(super) fn norms(&self) -> [DVec2; 2] {
        let across = self.ratio.sqrt();
        [DVec2::new(1.0, across), DVec2::new(across, 1.0)]
    }

    /// The energy for given gradients.
    pub(super) fn energy(&self, gradients: [DVec2; 2]) -> f64 {
        let parts = [0, 1].map(|k| ((gradients[k] - self.target(k)) * self.norms()[k]).length_squared());
        self.weight * (parts[0] + parts[1])
    }
}
