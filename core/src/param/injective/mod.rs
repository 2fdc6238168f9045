//! Locally injective seamless maps: minimisation of an energy that is infinite for flipped triangles.
//!
//! The least-squares objective does not prevent flips. Where a layout forces much distortion, it flips triangles that
//! no local repair can restore. The descent here starts from a locally injective map and keeps it so: the energy of a
//! triangle tends to infinity as its image degenerates, and the line search stops before that. Per triangle, with the
//! Jacobian `J = [a b; c d]` in the frame of the field (rows `∇u`, `∇v`) and target determinant `m`, the energy density
//! is
//!
//! `(a² + d² + ρ (b² + c²)) / (2 det J) + λ/2 ((det J / m)² + (m / det J)²)`.
//!
//! For `ρ = 1` the first term is half of `σ₁/σ₂ + σ₂/σ₁`, the conformal distortion (Hormann and Greiner, MIPS, 2000).
//! Larger `ρ` penalises errors of direction, as the anisotropic norm does (Campen, section 6.4.3). The second term
//! keeps sizes near the target. It is quadratic, so that small errors of size hardly affect angles, while protrusions
//! are not mapped to almost nothing. The minimiser is Newton's method with each triangle's Hessian projected to
//! positive semidefinite (Teran, Sifakis, Irving and Fedkiw, 2005). The step size is bounded by the first triangle to
//! degenerate (Smith and Schaefer, Bijective Parameterization with Free Boundaries, 2015, section 3.3).
//!
//! Limits: the result depends on the initial map. [`SeamlessSystem::untangle`] obtains one from a map with few flipped
//! triangles, [`SeamlessSystem::enforce_constraints`] from a locally injective map that violates constraints.

mod constraint_homotopy;
mod energy;
mod energy_density;
#[cfg(test)]
mod tests;
mod untangle;

use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use super::constraints;
use super::newton_system::{NewtonSystem, TriangleDerivatives};
use super::objective::{Objective, TriangleForm, hats};
use super::seamless::SeamlessMap;
use super::seamless_system::SeamlessSystem;
use super::{ParamError, expect_length};
use crate::mesh::HalfedgeId;
use crate::progress::{Cancelled, Progress};
use crate::solve::{SolveError, SparseHermitian};
use crate::surface::Metric;
pub use energy::{InjectiveEnergy, flipped_triangles, gradients};
pub use energy_density::DistortionWeights;
pub(crate) use energy_density::EnergyDensity;

/// Largest step size as a share of the one at which the first triangle degenerates; below 1.
const SAFE_SHARE: f64 = 0.8;
/// Share of the decrease predicted by the slope that a step must achieve (Armijo condition).
const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Halvings of the step size before the line search fails.
const MAX_HALVINGS: usize = 20;
/// Relative decrease of the energy below which a step counts as small. A small full Newton step means convergence; of
/// small shortened steps, the descent stops after [`PATIENCE`] in a row.
const MIN_DECREASE: f64 = 2e-3;
/// Small shortened steps in a row after which the descent stops.
const PATIENCE: usize = 2;
/// Smallest squared norm of a Jacobian used as a weight in [`SeamlessSystem::fit`]; its inverse is the largest. Usual
/// values are near 1.
const MIN_SIZE: f64 = 1e-4;

/// A locally injective map with its energy.
#[derive(Debug, Clone)]
pub struct InjectiveMap {
    /// The map.
    pub map: SeamlessMap,
    /// Its free variables.
    pub free: Vec<f64>,
    /// Its energy: an integral over the surface. The lower bound is `(1 + λ)` times the area.
    pub energy: f64,
}

impl SeamlessSystem {
    /// The free variables of the map whose gradients `∇u`, `∇v`, in the frame of the field, fit given ones in the
    /// least-squares sense. The fit is exact if a map with these gradients satisfies all constraints.
    ///
    /// The residual of a triangle is weighted by the inverse squared norm of its gradients, so that triangles with
    /// small images do not flip for the benefit of large ones, and by `weight`; empty: all 1.
    ///
    /// # Errors
    ///
    /// [`ParamError::WrongLength`] or [`ParamError::Solve`].
    pub fn fit(
        &mut self,
        metric: &Metric,
        angle: &[f64],
        gradients: &[[f64; 4]],
        weight: &[f64],
    ) -> Result<Vec<f64>, ParamError> {
        expect_length("the list of angles", angle.len(), self.cut().turn.len())?;
        expect_length("the list of gradients", gradients.len(), angle.len())?;
        let size = |[a, b, c, d]: &[f64; 4]| (a * a + b * b + c * c + d * d).clamp(MIN_SIZE, 1.0 / MIN_SIZE);
        let extra = |f: usize| weight.get(f).copied().unwrap_or(1.0);
        let stiffness: Vec<f64> = gradients.iter().enumerate().map(|(f, g)| extra(f) / size(g)).collect();
        let plain = Objective { anisotropy: 1.0, lengths: Vec::new(), stiffness };
        let (matrix, rhs) = self.assemble_with(|f| {
            let (area, hats) = (metric.area(f) * plain.stiffness[f.index()], hats(metric, angle[f.index()], f));
            let [ux, uy, vx, vy] = gradients[f.index()];
            let load = [DVec2::new(ux, uy), DVec2::new(vx, vy)].map(|g| hats.map(|hat| area * hat.dot(g)));
            TriangleForm { load, ..plain.form(metric, angle[f.index()], f) }
        });
        Ok(self.factor(&matrix)?.solve(&matrix, &rhs)?)
    }

    /// Prepares Newton's method and [`Self::fit`] for the present constraints.
    ///
    /// # Errors
    ///
    /// [`ParamError::Solve`].
    pub fn newton_system(&mut self) -> Result<Arc<NewtonSystem>, ParamError> {
        if let Some(cached) = self.cached_newton() {
            return Ok(cached);
        }
        let prepare = || NewtonSystem::new(self.coupled_scatter(), self.constraint_reduction());
        let (fit, newton) = rayon::join(|| self.symbolic(), prepare);
        self.cache_symbolic(fit?);
        let newton = Arc::new(newton?);
        self.cache_newton(&newton);
        Ok(newton)
    }

    /// The map with free variables `free` and its energy; `None` if a triangle is flipped.
    pub fn injective_map(&self, energy: &InjectiveEnergy<'_>, free: Vec<f64>) -> Option<InjectiveMap> {
        let map = self.map(&free);
        let total = energy.of(&map.uv)?;
        Some(InjectiveMap { map, free, energy: total })
    }

    /// Minimises the energy of a locally injective map by at most `steps` Newton steps. Returns whether it has
    /// converged.
    ///
    /// # Errors
    ///
    /// [`ParamError::Cancelled`]; the map is then the last one reached.
    pub fn descend(
        &self,
        newton: &NewtonSystem,
        energy: &InjectiveEnergy<'_>,
        at: &mut InjectiveMap,
        steps: usize,
        progress: &Progress,
    ) -> Result<bool, Cancelled> {
        let mut patience = PATIENCE;
        for step in 0..steps {
            progress.check()?;
            let (matrix, downhill) = self.newton_matrix(newton, energy, &at.map.uv);
            let direction = match newton.solve(&matrix, &downhill) {
                Ok(direction) => direction,
                // Fallback where the matrix is numerically singular: steepest descent.
                Err(SolveError::Residual { .. } | SolveError::NotPositiveDefinite { .. }) => downhill.clone(),
                Err(_) => return Ok(true),
            };
            let slope: f64 = direction.iter().zip(&downhill).map(|(a, b)| a * b).sum();
            let before = at.energy;
            let Some(share) = self.line_search(energy, at, &direction, slope) else { return Ok(true) };
            tracing::debug!(step, share, energy = at.energy, "Newton step of a locally injective map");
            if before - at.energy < MIN_DECREASE * at.energy {
                patience -= 1;
                if patience == 0 || share == 1.0 {
                    return Ok(true);
                }
            } else {
                patience = PATIENCE;
            }
        }
        Ok(false)
    }

    /// Backtracking line search (Armijo) that keeps all triangles from flipping. Returns the step size; `None` if no
    /// step decreases the energy.
    fn line_search(
        &self,
        energy: &InjectiveEnergy<'_>,
        at: &mut InjectiveMap,
        direction: &[f64],
        slope: f64,
    ) -> Option<f64> {
        if !(slope > 0.0 && slope.is_finite()) {
            return None;
        }
        let moved = |t: f64| at.free.iter().zip(direction).map(|(y, d)| y + t * d).collect::<Vec<f64>>();
        let full = self.map(&moved(1.0));
        let mut t = (SAFE_SHARE * first_degenerate(&at.map.uv, &full.uv)).min(1.0);
        for _ in 0..MAX_HALVINGS {
            if let Some(next) = self.injective_map(energy, moved(t))
                && next.energy <= at.energy - SUFFICIENT_DECREASE * t * slope
            {
                *at = next;
                return Some(t);
            }
            t *= 0.5;
        }
        None
    }

    /// The Hessian, made positive definite, and the negative gradient.
    fn newton_matrix(
        &self,
        newton: &NewtonSystem,
        energy: &InjectiveEnergy<'_>,
        uv: &[[DVec2; 3]],
    ) -> (SparseHermitian<f64>, Vec<f64>) {
        let triangles: Vec<TriangleDerivatives> =
            uv.par_iter().enumerate().map(|(f, w)| energy.derivatives(f, w)).collect();
        rayon::join(|| newton.matrix(&triangles), || self.downhill(&triangles))
    }

    /// The negative gradient with respect to the free variables.
    fn downhill(&self, triangles: &[TriangleDerivatives]) -> Vec<f64> {
        let mut load = vec![0.0; self.seams().n_free()];
        for (f, triangle) in triangles.iter().enumerate() {
            for (k, value) in triangle.gradient.iter().enumerate() {
                let (variable, sign) = constraints::corner(self.cut(), HalfedgeId::new(3 * f + k % 3), (k / 3) as u32);
                for &(z, c) in self.seams().expression(variable as usize).0 {
                    load[z as usize] -= sign * c * value;
                }
            }
        }
        let mut downhill = vec![0.0; self.n_free()];
        for (z, b) in load.into_iter().enumerate() {
            for &(y, c) in self.constraint_reduction().expression(z).0 {
                downhill[y as usize] += c * b;
            }
        }
        downhill
    }
}

/// The first time at which a triangle degenerates when all corners move linearly from one map to another; infinite if
/// none does. Triangles that are flipped at the start do not count.
fn first_degenerate(from: &[[DVec2; 3]], to: &[[DVec2; 3]]) -> f64 {
    let flat = |(p, q): (&[DVec2; 3], &[DVec2; 3])| {
        let [e, g] = [p[1] - p[0], p[2] - p[0]];
        let [de, dg] = [q[1] - q[0] - e, q[2] - q[0] - g];
        // det(t) = a t² + b t + c. For c > 0 the first positive root, in the form without cancellation.
        let (a, b, c) = (de.perp_dot(dg), e.perp_dot(dg) + de.perp_dot(g), e.perp_dot(g));
        let root = b * b - 4.0 * a * c;
        if root < 0.0 || c <= 0.0 {
            return f64::INFINITY;
        }
        let t = 2.0 * c / (-b + root.sqrt());
        if t > 0.0 { t } else { f64::INFINITY }
    };
    from.par_iter().zip(to).map(flat).reduce(|| f64::INFINITY, f64::min)
}
