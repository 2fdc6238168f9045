//! The energy of locally injective maps, summed over the triangles, with its derivatives; see [`super`].

use glam::DVec2;
use rayon::prelude::*;

use super::energy_density::{DistortionWeights, EnergyDensity};
use crate::mesh::{FaceId, HalfedgeId};
use crate::param::newton_system::TriangleDerivatives;
use crate::param::objective::{Objective, hats};
use crate::surface::Metric;

/// Unit of the penalty weight of isolines. Along a side of length `l`, a coordinate difference of `l / 10` costs
/// `100 (l / 10)² = l²`, about twice the area of the triangles beside it.
const ISOLINE_PENALTY: f64 = 100.0;
/// Twice the area over the sum of two squared sides of an image, up to which it counts as degenerate. Images that
/// constraints force to be degenerate are so only up to rounding errors; slivers along arcs have at least a thousand
/// times this value.
const DEGENERATE: f64 = 1e-14;

/// A penalty `weight · difference²` on a side of a triangle that should lie on an isoline.
struct IsolinePenalty {
    /// The two corners.
    ends: [usize; 2],
    /// The coordinate, 0 for u or 1 for v.
    axis: usize,
    weight: f64,
    /// The coordinate of the second corner minus that of the first.
    difference: f64,
}

/// The energy of maps on one mesh along one field.
#[derive(Debug, Clone)]
pub struct InjectiveEnergy<'a> {
    metric: &'a Metric,
    angle: &'a [f64],
    objective: &'a Objective,
    weights: DistortionWeights,
    anisotropy_share: &'a [f64],
    /// For each side of each triangle the coordinate that should be constant and the penalty weight; empty: none.
    isolines: Vec<[Option<(u8, f64)>; 3]>,
    /// `ε` of each triangle, see [`EnergyDensity`]; empty: 0 everywhere.
    epsilon: Vec<f64>,
}

impl<'a> InjectiveEnergy<'a> {
    /// The energy of maps along the field with angles `angle` and the target lengths of `objective`. `anisotropy_share`
    /// scales the excess of the anisotropy over 1 in each triangle (0: isotropic); empty: 1 everywhere.
    pub fn new(
        metric: &'a Metric,
        angle: &'a [f64],
        objective: &'a Objective,
        (weights, anisotropy_share): (DistortionWeights, &'a [f64]),
    ) -> Self {
        Self { metric, angle, objective, weights, anisotropy_share, isolines: Vec::new(), epsilon: Vec::new() }
    }

    /// Adds penalties on the deviation of half-edges from isolines: half-edge, coordinate (0: u, 1: v) and relative
    /// penalty weight. A weight of 1 is the usual one.
    pub fn with_isoline_penalties(mut self, list: &[(HalfedgeId, u8, f64)]) -> Self {
        if !list.is_empty() {
            self.isolines = vec![[None; 3]; self.angle.len()];
        }
        for &(h, axis, weight) in list {
            self.isolines[h.index() / 3][h.index() % 3] = Some((axis, weight * ISOLINE_PENALTY));
        }
        self
    }

    /// The regularised energy, finite for flipped triangles, with `ε` of each triangle; see [`super::untangle`].
    pub(super) fn regularised(&self, epsilon: Vec<f64>) -> Self {
        Self { epsilon, ..self.clone() }
    }

    /// The isoline penalties of a triangle.
    fn penalties(&self, f: usize, w: &[DVec2; 3]) -> impl Iterator<Item = IsolinePenalty> {
        let sides = self.isolines.get(f).copied().unwrap_or_default();
        sides.into_iter().enumerate().filter_map(move |(i, isoline)| {
            let ((axis, weight), j) = (isoline?, (i + 1) % 3);
            let axis = usize::from(axis);
            Some(IsolinePenalty { ends: [i, j], axis, weight, difference: w[j][axis] - w[i][axis] })
        })
    }

    fn hats(&self, f: usize) -> [DVec2; 3] {
        hats(self.metric, self.angle[f], FaceId::new(f))
    }

    fn density(&self, f: usize) -> EnergyDensity {
        let share = self.anisotropy_share.get(f).copied().unwrap_or(1.0);
        EnergyDensity::new(self.weights.with_anisotropy_share(share), self.objective.target(FaceId::new(f)))
            .regularised(self.epsilon.get(f).copied().unwrap_or(0.0))
    }

    /// The energy of a map; `None` if a triangle is flipped.
    pub fn of(&self, uv: &[[DVec2; 3]]) -> Option<f64> {
        // Summed in order: the result must not depend on the number of threads.
        let total: f64 = self.of_each(uv).into_iter().sum();
        total.is_finite().then_some(total)
    }

    /// The energy of each triangle of a map; infinite for a flipped triangle.
    pub fn of_each(&self, uv: &[[DVec2; 3]]) -> Vec<f64> {
        let each = |(f, w): (usize, &[DVec2; 3])| {
            let area = self.metric.area(FaceId::new(f));
            let penalty: f64 = self.penalties(f, w).map(|p| p.weight * p.difference * p.difference).sum();
            area * self.density(f).value(&jacobian(&self.hats(f), w)).unwrap_or(f64::INFINITY) + penalty
        };
        uv.par_iter().enumerate().map(each).collect()
    }

    /// The Jacobian determinant of each triangle, in multiples of its target.
    pub(super) fn determinants(&self, uv: &[[DVec2; 3]]) -> Vec<f64> {
        let each = |(f, w): (usize, &[DVec2; 3])| self.density(f).determinant(&jacobian(&self.hats(f), w));
        uv.par_iter().enumerate().map(each).collect()
    }

    /// The derivatives of the energy of a triangle by its corner coordinates `w`.
    pub(super) fn derivatives(&self, f: usize, w: &[DVec2; 3]) -> TriangleDerivatives {
        let (hats, area) = (self.hats(f), self.metric.area(FaceId::new(f)));
        // First and second derivatives by the entries of the Jacobian, which is linear in the coordinates.
        let (first, second) = self.density(f).derivatives(&jacobian(&hats, w));
        let mut gradient = [0.0; 6];
        let mut hessian = [0.0; 21];
        let mut entry = 0;
        for i in 0..6 {
            let (k, hat) = (2 * (i / 3), hats[i % 3]);
            gradient[i] = area * (hat.x * first[k] + hat.y * first[k + 1]);
            for j in 0..=i {
                let (l, other) = (2 * (j / 3), hats[j % 3]);
                let along = |r: usize| second[r][l] * other.x + second[r][l + 1] * other.y;
                hessian[entry] = area * (hat.x * along(k) + hat.y * along(k + 1));
                entry += 1;
            }
        }
        for IsolinePenalty { ends, axis, weight, difference } in self.penalties(f, w) {
            let [p, q] = ends.map(|i| 3 * axis + i);
            gradient[p] -= 2.0 * weight * difference;
            gradient[q] += 2.0 * weight * difference;
            for (r, c, sign) in [(p, p, 1.0), (q, q, 1.0), (p.max(q), p.min(q), -1.0)] {
                hessian[r * (r + 1) / 2 + c] += sign * 2.0 * weight;
            }
        }
        TriangleDerivatives { gradient, hessian }
    }
}

/// The gradients `∇u` and `∇v` of a map in each triangle, in the frame of the field with angles `angle`.
pub fn gradients(metric: &Metric, angle: &[f64], uv: &[[DVec2; 3]]) -> Vec<[f64; 4]> {
    let each = |(f, w): (usize, &[DVec2; 3])| jacobian(&hats(metric, angle[f], FaceId::new(f)), w);
    uv.iter().enumerate().map(each).collect()
}

/// The triangles whose image is flipped, or degenerate up to rounding errors.
pub fn flipped_triangles(uv: &[[DVec2; 3]]) -> Vec<FaceId> {
    let is_flipped = |w: &[DVec2; 3]| {
        let [a, b] = [w[1] - w[0], w[2] - w[0]];
        a.perp_dot(b) <= DEGENERATE * (a.length_squared() + b.length_squared())
    };
    uv.iter().enumerate().filter(|(_, w)| is_flipped(w)).map(|(f, _)| FaceId::new(f)).collect()
}

/// The Jacobian `[∂u/∂x, ∂u/∂y, ∂v/∂x, ∂v/∂y]`.
fn jacobian(hats: &[DVec2; 3], w: &[DVec2; 3]) -> [f64; 4] {
    let u = hats[0] * w[0].x + hats[1] * w[1].x + hats[2] * w[2].x;
    let v = hats[0] * w[0].y + hats[1] * w[1].y + hats[2] * w[2].y;
    [u.x, u.y, v.x, v.y]
}
