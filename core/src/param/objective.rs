//! The least-squares objective of a seamless map: its gradients should equal the directions of the field.
//!
//! Per triangle, with unit field directions `X`, `Y` and target lengths `a`, `b`, the residuals are `r = ∇u − a X` and
//! `s = ∇v − b Y`. Components along the target are errors of length, components across it are errors of direction.
//! Errors of direction weigh more by the anisotropy `ρ`: `A (r∥² + ρ r⊥² + s∥² + ρ s⊥²)` (Bommes, Zimmer and Kobbelt,
//! Mixed-Integer Quadrangulation, section 5; Campen, equation 6.1 and section 6.4.3).

use glam::DVec2;

use super::{ParamError, expect_length};
use crate::mesh::FaceId;
use crate::surface::Metric;

/// Weights and target lengths of the least-squares objective.
#[derive(Debug, Clone, PartialEq)]
pub struct Objective {
    /// `ρ`: weight of an error of direction relative to one of length; positive.
    pub anisotropy: f64,
    /// Target lengths of the gradients of u and of v in each triangle; empty: all 1.
    pub lengths: Vec<[f64; 2]>,
    /// Stiffness of each triangle: a factor of its weight in the solve that is not part of the reported energy. Raised
    /// around flipped triangles (see [`Stiffening`](super::Stiffening)). Positive; empty: all 1.
    pub stiffness: Vec<f64>,
}

impl Default for Objective {
    /// Anisotropy 10, the value used throughout in Campen, section 6.4.3; unit target lengths.
    fn default() -> Self {
        Self { anisotropy: 10.0, lengths: Vec::new(), stiffness: Vec::new() }
    }
}

/// The residual of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Residual of the gradient of u: components along directions 0 and 1 of the field.
    pub u: DVec2,
    /// Residual of the gradient of v, likewise.
    pub v: DVec2,
    /// Weighted squared norm of both, times the area; without stiffness.
    pub energy: f64,
}

/// A triangle's contribution to the quadratic form: `x' K x − 2 b x + const` for the values `x` of a coordinate at its
/// corners, in the field's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct TriangleForm {
    /// `K` for u and for v; pairs of corners in the order of [`PAIRS`].
    pub stiffness: [[f64; 6]; 2],
    /// `b` for u and for v.
    pub load: [[f64; 3]; 2],
}

/// The pairs of corners, each once.
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

impl Objective {
    /// Checks the lengths of the arrays.
    pub(super) fn check(&self, n_faces: usize) -> Result<(), ParamError> {
        for (what, got) in [("the list of target lengths", self.lengths.len()), ("the stiffness", self.stiffness.len())]
        {
            if got > 0 {
                expect_length(what, got, n_faces)?;
            }
        }
        Ok(())
    }

    /// Target lengths in a triangle.
    pub(super) fn target(&self, f: FaceId) -> [f64; 2] {
        self.lengths.get(f.index()).copied().unwrap_or([1.0; 2])
    }

    /// The quadratic form of a triangle with field angle `angle`.
    pub(super) fn form(&self, metric: &Metric, angle: f64, f: FaceId) -> TriangleForm {
        let hats = hats(metric, angle, f);
        let area = metric.area(f) * self.stiffness.get(f.index()).copied().unwrap_or(1.0);
        let weight = [DVec2::new(1.0, self.anisotropy), DVec2::new(self.anisotropy, 1.0)];
        let target = self.target(f);
        TriangleForm {
            stiffness: weight.map(|w| PAIRS.map(|(i, j)| area * (hats[i] * w).dot(hats[j]))),
            load: [0, 1].map(|k| hats.map(|g| area * g[k] * target[k])),
        }
    }
}

/// Gradients of the corners' hat functions: components along directions 0 and 1 of the field.
pub(super) fn hats(metric: &Metric, angle: f64, f: FaceId) -> [DVec2; 3] {
    let [a, b, c] = *metric.layout(f);
    let axis = DVec2::from_angle(angle);
    let double = (b - a).perp_dot(c - a);
    [c - b, a - c, b - a].map(|e| {
        let g = e.perp() / double;
        DVec2::new(axis.dot(g), axis.perp_dot(g))
    })
}

/// Residuals of all triangles for corner coordinates `uv`, in the frames of the field with angles `angle`.
pub fn residuals(metric: &Metric, angle: &[f64], uv: &[[DVec2; 3]], objective: &Objective) -> Vec<Residual> {
    let residual = |(f, w): (usize, &[DVec2; 3])| {
        let f = FaceId::new(f);
        let hats = hats(metric, angle[f.index()], f);
        let [a, b] = objective.target(f);
        let gradient = |k: usize| hats[0] * w[0][k] + hats[1] * w[1][k] + hats[2] * w[2][k];
        let (u, v) = (gradient(0) - DVec2::new(a, 0.0), gradient(1) - DVec2::new(0.0, b));
        let square = u.x * u.x + v.y * v.y + objective.anisotropy * (u.y * u.y + v.x * v.x);
        Residual { u, v, energy: metric.area(f) * square }
    };
    uv.iter().enumerate().map(residual).collect()
}
