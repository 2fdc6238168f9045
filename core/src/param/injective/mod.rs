//! Maps that never fold: from a map without folds down an energy that no fold can pass.
//!
//! Least squares do not know orientation, and where a layout asks for much distortion what they fold cannot be unfolded
//! locally. Here every step starts from a map in which no triangle is turned over and ends in one: the energy of a
//! triangle grows beyond all bounds as its image becomes flat, and a step ends before that. Per triangle, with the map's
//! matrix `J = [a b; c d]` in the frame of the field (rows `∇u`, `∇v`) and `m` the determinant wanted, it is
//!
//! `(a² + d² + ρ (b² + c²)) / (2 det J) + λ/2 ((det J / m)² + (m / det J)²)`.
//!
//! With `ρ = 1` the first part is half of `σ₁/σ₂ + σ₂/σ₁`, the conformal distortion (Hormann and Greiner, MIPS, 2000);
//! more makes directions count, as in the anisotropic norm (Campen, section 6.4.3). The second part keeps sizes near
//! those wanted: squared, so that it costs angles little as long as these are not far off, and yet no limb is mapped to
//! almost nothing. It is minimised by Newton's method with each triangle's Hessian made positive semidefinite (Teran,
//! Sifakis, Irving and Fedkiw, 2005), steps cut short before the first triangle would flatten (Smith and Schaefer,
//! Bijective Parameterization with Free Boundaries, 2015, section 3.3).

mod approach;
mod density;
mod energy;
#[cfg(test)]
mod tests;
mod untangle;

use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use super::assembly::Scatter;
use super::constraints;
use super::objective::{Local, Objective, hats};
use super::seamless::SeamlessMap;
use super::solve::SeamlessSystem;
use super::{ParamError, expect_length};
use crate::mesh::HalfedgeId;
use crate::progress::{Cancelled, Progress};
use crate::solve::{SolveError, SparseHermitian, SpdSymbolic};
use crate::surface::Metric;
pub(crate) use density::EnergyDensity;
use energy::Derivatives;
pub use energy::{DistortionWeights, InjectiveEnergy, folds, gradients};

/// Share of the way to the first flat triangle that a step may go.
const SAFE: f64 = 0.8;
/// Share of the decrease promised by the slope that a step must achieve (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// Halvings of a step before it is given up.
const HALVINGS: usize = 20;
/// A step that gains less than this share of the energy is the last if it was a whole one, after which Newton's method has
/// arrived, and else the last but for [`PATIENCE`] more.
const GAIN: f64 = 2e-3;
const PATIENCE: usize = 2;
/// Area of images, where 1 is usual, below and above whose inverse differences are not weighed by it.
const LEAST_SIZE: f64 = 1e-4;
/// By what share the diagonal is raised: a semidefinite Hessian must become definite beyond rounding.
const GROUND: f64 = 1e-9;

/// A map without folds on its way down.
#[derive(Debug, Clone)]
pub struct InjectiveMap {
    /// The map.
    pub map: SeamlessMap,
    /// Its free variables.
    pub free: Vec<f64>,
    /// Its energy: an integral over the surface, that of the best map conceivable being `(1 + λ)` times the area.
    pub energy: f64,
}

/// The Newton systems of one seamless system.
#[derive(Debug, Clone)]
pub struct NewtonSystem {
    shares: Arc<Scatter>,
    fold: Scatter,
    symbolic: SpdSymbolic,
}

impl NewtonSystem {
    /// How the shares of triangles make the matrix of what the seams leave.
    pub(super) fn shares(&self) -> Arc<Scatter> {
        self.shares.clone()
    }

    /// The Hessian, made positive definite.
    fn matrix(&self, locals: &[Derivatives]) -> SparseHermitian<f64> {
        let mut open = self.shares.zero.clone();
        for (f, local) in locals.iter().enumerate() {
            self.shares.add(f, &local.hessian, &mut open);
        }
        let mut matrix = self.fold.zero.clone();
        for (k, (_, _, value)) in open.entries().enumerate() {
            self.fold.add(k, &[value], &mut matrix);
        }
        matrix.raise_diagonal(GROUND);
        matrix
    }
}

impl SeamlessSystem {
    /// The free variables of the map whose gradients in the frame of the field, `∇u` and `∇v` of each triangle, come
    /// nearest to those given: exactly these if they are those of a map that satisfies all relations. Differences count
    /// in proportion to the size of a triangle's image, so that small images do not fold for the sake of large ones, and to the weights given; none: all 1.
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
        let size = |[a, b, c, d]: &[f64; 4]| (a * a + b * b + c * c + d * d).clamp(LEAST_SIZE, 1.0 / LEAST_SIZE);
        let extra = |f: usize| weight.get(f).copied().unwrap_or(1.0);
        let stiffness: Vec<f64> = gradients.iter().enumerate().map(|(f, g)| extra(f) / size(g)).collect();
        let plain = Objective { anisotropy: 1.0, lengths: Vec::new(), stiffness };
        let (matrix, rhs) = self.assemble_with(|f| {
            let (area, hats) = (metric.area(f) * plain.stiffness[f.index()], hats(metric, angle[f.index()], f));
            let [ux, uy, vx, vy] = gradients[f.index()];
            let load = [DVec2::new(ux, uy), DVec2::new(vx, vy)].map(|g| hats.map(|hat| area * hat.dot(g)));
            Local { load, ..plain.local(metric, angle[f.index()], f) }
        });
        Ok(self.factor(&matrix)?.solve(&matrix, &rhs)?)
    }

    /// Prepares Newton's method for the present relations, and the fit that it starts from.
    ///
    /// # Errors
    ///
    /// [`ParamError::Solve`].
    pub fn newton(&mut self) -> Result<Arc<NewtonSystem>, ParamError> {
        if let Some(kept) = self.newton_kept() {
            return Ok(kept);
        }
        let (fit, newton) = rayon::join(|| self.analysed(), || self.newton_system());
        self.keep_analysis(fit?);
        let newton = Arc::new(newton?);
        self.keep_newton(&newton);
        Ok(newton)
    }

    fn newton_system(&self) -> Result<NewtonSystem, SolveError> {
        let shares = self.whole_shares();
        let fold = Scatter::of_matrix(&shares.zero, self.ties());
        let symbolic = SpdSymbolic::new(&fold.zero)?;
        Ok(NewtonSystem { shares, fold, symbolic })
    }

    /// A map with its energy; `None` if it folds.
    pub fn injective(&self, energy: &InjectiveEnergy<'_>, free: Vec<f64>) -> Option<InjectiveMap> {
        let map = self.map(&free);
        let total = energy.of(&map.uv)?;
        Some(InjectiveMap { map, free, energy: total })
    }

    /// Makes the energy of a map without folds less in at most `steps` steps of Newton's method; tells whether it is as
    /// good as least.
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
            let solved = newton.symbolic.factor(&matrix).and_then(|f| f.solve(&matrix, &downhill));
            let direction = match solved {
                Ok(direction) => direction,
                // Near its limits the solver still tells a direction downhill: that of steepest descent.
                Err(SolveError::Residual { .. } | SolveError::NotPositiveDefinite { .. }) => downhill.clone(),
                Err(_) => return Ok(true),
            };
            let slope: f64 = direction.iter().zip(&downhill).map(|(a, b)| a * b).sum();
            let before = at.energy;
            let Some(share) = self.search(energy, at, &direction, slope) else { return Ok(true) };
            tracing::debug!(step, share, energy = at.energy, "map without folds");
            if before - at.energy < GAIN * at.energy {
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

    /// Goes along a direction as far as it makes the energy less by enough and nothing folds; tells which share of it that
    /// is, if it does at all.
    fn search(
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
        let mut t = (SAFE * first_flat(&at.map.uv, &full.uv)).min(1.0);
        for _ in 0..HALVINGS {
            if let Some(next) = self.injective(energy, moved(t))
                && next.energy <= at.energy - SUFFICIENT * t * slope
            {
                *at = next;
                return Some(t);
            }
            t *= 0.5;
        }
        None
    }

    /// The Hessian, made positive definite, and the direction of steepest descent.
    fn newton_matrix(
        &self,
        newton: &NewtonSystem,
        energy: &InjectiveEnergy<'_>,
        uv: &[[DVec2; 3]],
    ) -> (SparseHermitian<f64>, Vec<f64>) {
        let locals: Vec<Derivatives> = uv.par_iter().enumerate().map(|(f, w)| energy.derivatives(f, w)).collect();
        rayon::join(|| newton.matrix(&locals), || self.downhill(&locals))
    }

    /// The direction of steepest descent.
    fn downhill(&self, locals: &[Derivatives]) -> Vec<f64> {
        let mut load = vec![0.0; self.seams().n_free()];
        for (f, local) in locals.iter().enumerate() {
            for (k, share) in local.gradient.iter().enumerate() {
                let (variable, sign) = constraints::corner(self.cut(), HalfedgeId::new(3 * f + k % 3), (k / 3) as u32);
                for &(z, c) in self.seams().expression(variable as usize).0 {
                    load[z as usize] -= sign * c * share;
                }
            }
        }
        let mut downhill = vec![0.0; self.n_free()];
        for (z, b) in load.into_iter().enumerate() {
            for &(y, c) in self.ties().expression(z).0 {
                downhill[y as usize] += c * b;
            }
        }
        downhill
    }
}

/// The first time at which a triangle that is not turned over becomes flat when all corners go from one map to another at constant speed.
fn first_flat(from: &[[DVec2; 3]], to: &[[DVec2; 3]]) -> f64 {
    let flat = |(p, q): (&[DVec2; 3], &[DVec2; 3])| {
        let [e, g] = [p[1] - p[0], p[2] - p[0]];
        let [de, dg] = [q[1] - q[0] - e, q[2] - q[0] - g];
        // det(t) = a t² + b t + c: where c > 0 its first positive root, in the form that loses no digits.
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
