//! The energy of maps without folds, summed over the triangles, with its derivatives; see [`super`].

use glam::DVec2;
use rayon::prelude::*;

use super::density::EnergyDensity;
use crate::mesh::{FaceId, HalfedgeId};
use crate::param::objective::{Objective, hats};
use crate::surface::Metric;

/// How strongly features are pulled towards isolines: across one of them, a difference of a tenth of its length weighs as
/// much as twice the area of the triangles beside it.
const PULL: f64 = 100.0;
/// Doubled area over squared sides of an image up to which it is flat: what relations force to be flat is not quite so for
/// rounding. Slivers that arcs leave have a thousand times as much and more.
const FLAT: f64 = 1e-14;

/// What a map without folds is to be like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistortionWeights {
    /// By how much components across the field count more than those along it: `ρ`, at least 1.
    pub anisotropy: f64,
    /// How much size counts beside shape: `λ`, positive.
    pub size: f64,
}

impl DistortionWeights {
    /// What is wanted where the anisotropy counts by a factor: 0 not at all, 1 as it is.
    pub(crate) fn with_anisotropy_share(self, anisotropy_share: f64) -> Self {
        Self { anisotropy: 1.0 + anisotropy_share * (self.anisotropy - 1.0), ..self }
    }
}

/// The derivatives of the energy of a triangle.
pub(super) struct Derivatives {
    pub gradient: [f64; 6],
    /// The lower triangle, row by row, in the order u of the corners, v of the corners.
    pub hessian: [f64; 21],
}

/// A side of a triangle that is pulled towards an isoline: its two corners, the coordinate, how strongly, and by how much
/// that differs from the first to the second.
struct Pull {
    ends: [usize; 2],
    axis: usize,
    strength: f64,
    off: f64,
}

/// The energy of maps on one mesh along one field.
#[derive(Debug, Clone)]
pub struct InjectiveEnergy<'a> {
    metric: &'a Metric,
    angle: &'a [f64],
    objective: &'a Objective,
    shape: DistortionWeights,
    anisotropy_share: &'a [f64],
    /// For each side of each triangle the coordinate that it is pulled towards an isoline of, and how strongly; empty:
    /// none.
    pulled: Vec<[Option<(u8, f64)>; 3]>,
    /// For each triangle how far its determinant may be below zero, see [`EnergyDensity`]; empty: nowhere.
    slack: Vec<f64>,
}

impl<'a> InjectiveEnergy<'a> {
    /// The energy of maps along the field of the angles given, of the sizes that `objective` wants. `firmness` tells for
    /// each triangle by what factor the anisotropy counts there; empty: 1 everywhere.
    pub fn new(
        metric: &'a Metric,
        angle: &'a [f64],
        objective: &'a Objective,
        (shape, anisotropy_share): (DistortionWeights, &'a [f64]),
    ) -> Self {
        Self { metric, angle, objective, shape, anisotropy_share, pulled: Vec::new(), slack: Vec::new() }
    }

    /// The same, with these half-edges pulled towards isolines of a coordinate (0: u, 1: v), each so many times as strongly
    /// as usual.
    pub fn with_isoline_penalties(mut self, list: &[(HalfedgeId, u8, f64)]) -> Self {
        if !list.is_empty() {
            self.pulled = vec![[None; 3]; self.angle.len()];
        }
        for &(h, axis, strength) in list {
            self.pulled[h.index() / 3][h.index() % 3] = Some((axis, strength * PULL));
        }
        self
    }

    /// The same with a finite energy of triangles that are turned over by as much as given; see [`super::untangle`].
    pub(super) fn with_slack(&self, slack: Vec<f64>) -> Self {
        Self { slack, ..self.clone() }
    }

    /// The sides of a triangle that are pulled.
    fn pulls(&self, f: usize, w: &[DVec2; 3]) -> impl Iterator<Item = Pull> {
        let sides = self.pulled.get(f).copied().unwrap_or_default();
        sides.into_iter().enumerate().filter_map(move |(i, pulled)| {
            let ((axis, strength), j) = (pulled?, (i + 1) % 3);
            let axis = usize::from(axis);
            Some(Pull { ends: [i, j], axis, strength, off: w[j][axis] - w[i][axis] })
        })
    }

    fn hats(&self, f: usize) -> [DVec2; 3] {
        hats(self.metric, self.angle[f], FaceId::new(f))
    }

    fn density(&self, f: usize) -> EnergyDensity {
        let share = self.anisotropy_share.get(f).copied().unwrap_or(1.0);
        EnergyDensity::new(self.shape.with_anisotropy_share(share), self.objective.target(FaceId::new(f)))
            .with_slack(self.slack.get(f).copied().unwrap_or(0.0))
    }

    /// The energy of a map; `None` where a triangle is turned over or flat.
    pub fn of(&self, uv: &[[DVec2; 3]]) -> Option<f64> {
        // Added up in order: the sum must not depend on threads.
        let total: f64 = self.of_each(uv).into_iter().sum();
        total.is_finite().then_some(total)
    }

    /// The energy of each triangle of a map, infinite where it is turned over or flat.
    pub fn of_each(&self, uv: &[[DVec2; 3]]) -> Vec<f64> {
        let each = |(f, w): (usize, &[DVec2; 3])| {
            let area = self.metric.area(FaceId::new(f));
            let pull: f64 = self.pulls(f, w).map(|p| p.strength * p.off * p.off).sum();
            area * self.density(f).value(&matrix(&self.hats(f), w)).unwrap_or(f64::INFINITY) + pull
        };
        uv.par_iter().enumerate().map(each).collect()
    }

    /// The determinants of a map, in multiples of those wanted.
    pub(super) fn determinants(&self, uv: &[[DVec2; 3]]) -> Vec<f64> {
        let each = |(f, w): (usize, &[DVec2; 3])| self.density(f).determinant(&matrix(&self.hats(f), w));
        uv.par_iter().enumerate().map(each).collect()
    }

    pub(super) fn derivatives(&self, f: usize, w: &[DVec2; 3]) -> Derivatives {
        let (hats, area) = (self.hats(f), self.metric.area(FaceId::new(f)));
        let (slope, bend) = self.density(f).derivatives(&matrix(&hats, w));
        let mut gradient = [0.0; 6];
        let mut hessian = [0.0; 21];
        let mut entry = 0;
        for i in 0..6 {
            let (k, hat) = (2 * (i / 3), hats[i % 3]);
            gradient[i] = area * (hat.x * slope[k] + hat.y * slope[k + 1]);
            for j in 0..=i {
                let (l, other) = (2 * (j / 3), hats[j % 3]);
                let along = |r: usize| bend[r][l] * other.x + bend[r][l + 1] * other.y;
                hessian[entry] = area * (hat.x * along(k) + hat.y * along(k + 1));
                entry += 1;
            }
        }
        for Pull { ends, axis, strength, off } in self.pulls(f, w) {
            let [p, q] = ends.map(|i| 3 * axis + i);
            gradient[p] -= 2.0 * strength * off;
            gradient[q] += 2.0 * strength * off;
            for (r, c, sign) in [(p, p, 1.0), (q, q, 1.0), (p.max(q), p.min(q), -1.0)] {
                hessian[r * (r + 1) / 2 + c] += sign * 2.0 * strength;
            }
        }
        Derivatives { gradient, hessian }
    }
}

/// The gradients `∇u` and `∇v` of a map in each triangle, in the frame of the field of the angles given.
pub fn gradients(metric: &Metric, angle: &[f64], uv: &[[DVec2; 3]]) -> Vec<[f64; 4]> {
    let each = |(f, w): (usize, &[DVec2; 3])| matrix(&hats(metric, angle[f], FaceId::new(f)), w);
    uv.iter().enumerate().map(each).collect()
}

/// The triangles that a map turns over or flattens but for rounding.
pub fn folds(uv: &[[DVec2; 3]]) -> Vec<FaceId> {
    let folded = |w: &[DVec2; 3]| {
        let [a, b] = [w[1] - w[0], w[2] - w[0]];
        a.perp_dot(b) <= FLAT * (a.length_squared() + b.length_squared())
    };
    uv.iter().enumerate().filter(|(_, w)| folded(w)).map(|(f, _)| FaceId::new(f)).collect()
}

fn matrix(hats: &[DVec2; 3], w: &[DVec2; 3]) -> [f64; 4] {
    let u = hats[0] * w[0].x + hats[1] * w[1].x + hats[2] * w[2].x;
    let v = hats[0] * w[0].y + hats[1] * w[1].y + hats[2] * w[2].y;
    [u.x, u.y, v.x, v.y]
}
