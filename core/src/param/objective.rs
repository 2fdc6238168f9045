//! What a seamless map is to minimise: its gradients are to be the directions of the field.
//!
//! Per triangle, with unit field directions `X`, `Y` and target lengths `a`, `b`, the errors are `r = ∇u − a X` and
//! `s = ∇v − b Y`. Their parts along the target are errors of length, those across it errors of direction; these
//! weigh more by the anisotropy `ρ`: `A (r∥² + ρ r⊥² + s∥² + ρ s⊥²)` (Bommes, Zimmer and Kobbelt, Mixed-Integer
//! Quadrangulation, section 5; thesis, section 6.4.3).

use glam::DVec2;

use super::{ParamError, expect_length};
use crate::mesh::FaceId;
use crate::surface::Metric;

/// The weights and targets of the error.
#[derive(Debug, Clone, PartialEq)]
pub struct Objective {
    /// By how much an error of direction counts more than one of length: `ρ`, positive.
    pub anisotropy: f64,
    /// The lengths wanted of the gradients of u and of v in each triangle; empty: all 1.
    pub lengths: Vec<[f64; 2]>,
    /// A factor for each triangle that is no part of the energy: higher where folds are to be pressed flat. Positive;
    /// empty: all 1.
    pub stiffness: Vec<f64>,
}

impl Default for Objective {
    /// The anisotropy of the thesis, which used 10 throughout, and unit length everywhere.
    fn default() -> Self {
        Self { anisotropy: 10.0, lengths: Vec::new(), stiffness: Vec::new() }
    }
}

/// How a triangle misses its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Error of the gradient of u, as parts along directions 0 and 1 of the field.
    pub u: DVec2,
    /// Error of the gradient of v, likewise.
    pub v: DVec2,
    /// The weighted square of both, times the area; without stiffness.
    pub energy: f64,
}

/// A triangle's share of the quadratic form: `x' K x − 2 b x + const` for the values `x` of a coordinate at its
/// corners in the field's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Local {
    /// `K` for u and for v, the pairs of corners in the order of [`PAIRS`].
    pub stiffness: [[f64; 6]; 2],
    /// `b` for u and for v.
    pub load: [[f64; 3]; 2],
}

/// The pairs of corners, each once.
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

impl Objective {
    pub(super) fn check(&self, n_faces: usize) -> Result<(), ParamError> {
        for (what, got) in [("the list of lengths", self.lengths.len()), ("the stiffness", self.stiffness.len())] {
            if got > 0 {
                expect_length(what, got, n_faces)?;
            }
        }
        Ok(())
    }

    /// The lengths wanted in a triangle.
    pub(super) fn target(&self, f: FaceId) -> [f64; 2] {
        self.lengths.get(f.index()).copied().unwrap_or([1.0; 2])
    }

    pub(super) fn local(&self, metric: &Metric, angle: f64, f: FaceId) -> Local {
        let hats = hats(metric, angle, f);
        let area = metric.area(f) * self.stiffness.get(f.index()).copied().unwrap_or(1.0);
        let weight = [DVec2::new(1.0, self.anisotropy), DVec2::new(self.anisotropy, 1.0)];
        let target = self.target(f);
        Local {
            stiffness: weight.map(|w| PAIRS.map(|(i, j)| area * (hats[i] * w).dot(hats[j]))),
            load: [0, 1].map(|k| hats.map(|g| area * g[k] * target[k])),
        }
    }
}

/// The gradients of the corners' hat functions, as parts along directions 0 and 1 of the field.
pub(super) fn hats(metric: &Metric, angle: f64, f: FaceId) -> [DVec2; 3] {
    let [a, b, c] = *metric.layout(f);
    let axis = DVec2::from_angle(angle);
    let double = (b - a).perp_dot(c - a);
    [c - b, a - c, b - a].map(|e| {
        let g = e.perp() / double;
        DVec2::new(axis.dot(g), axis.perp_dot(g))
    })
}

/// How each triangle misses its target under coordinates `uv` in the frames of the field of angles `angle`.
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
