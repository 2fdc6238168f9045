//! Maps that never fold: from a map without folds down an energy that no fold can pass.
//!
//! Least squares do not know orientation, and where a layout asks for much distortion what they fold cannot be unfolded
//! locally. Here every step starts from a map in which no triangle is turned over and ends in one: the energy of a
//! triangle grows beyond all bounds as its image becomes flat, and a step ends before that. Per triangle, with the map's
//! matrix `J = [a b; c d]` in the frame of the field (rows `∇u`, `∇v`) and `m` the determinant wanted, it is
//!
//! `(a² + d² + ρ (b² + c²)) / (2 det J) + λ/2 (det J / m + m / det J)`.
//!
//! With `ρ = 1` the first part is half of `σ₁/σ₂ + σ₂/σ₁`, the conformal distortion (Hormann and Greiner, MIPS, 2000);
//! more makes directions count, as in the anisotropic norm (Campen, section 6.4.3). The second part keeps sizes near
//! those wanted. It is minimised by Newton's method with each triangle's Hessian made positive semidefinite (Teran,
//! Sifakis, Irving and Fedkiw, 2005), steps cut short before the first triangle would flatten (Smith and Schaefer,
//! Bijective Parameterization with Free Boundaries, 2015, section 3.3).

mod density;

use glam::DVec2;
use rayon::prelude::*;

use super::assembly::Scatter;
use super::constraints;
use super::objective::{Local, Objective, hats};
use super::seamless::SeamlessMap;
use super::solve::SeamlessSystem;
use super::{ParamError, expect_length};
use crate::field::Metric;
use crate::mesh::{FaceId, HalfedgeId};
use crate::progress::{Cancelled, Progress};
use crate::solve::{SolveError, SparseHermitian, SpdSymbolic};
pub(crate) use density::Density;

/// Share of the way to the first flat triangle that a step may go.
const SAFE: f64 = 0.8;
/// Share of the decrease promised by the slope that a step must achieve (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// Halvings of a step before it is given up.
const HALVINGS: usize = 20;
/// A step that gains less than this share of the energy is the last but for [`PATIENCE`] more.
const GAIN: f64 = 2e-3;
const PATIENCE: usize = 2;
/// How strongly features are pulled towards isolines: across one of them, a difference of a tenth of its length weighs as
/// much as twice the area of the triangles beside it.
const PULL: f64 = 100.0;
/// Area of images, where 1 is usual, below and above whose inverse differences are not weighed by it.
const LEAST_SIZE: f64 = 1e-4;
/// By what share the diagonal is raised: a semidefinite Hessian must become definite beyond rounding.
const GROUND: f64 = 1e-9;

/// What a map without folds is to be like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// By how much components across the field count more than those along it: `ρ`, at least 1.
    pub anisotropy: f64,
    /// How much size counts beside shape: `λ`, positive.
    pub size: f64,
}

impl Shape {
    /// What is wanted where only a share of the anisotropy counts.
    pub(crate) fn softened(self, share: f64) -> Self {
        Self { anisotropy: 1.0 + share * (self.anisotropy - 1.0), ..self }
    }
}

/// A map without folds on its way down.
#[derive(Debug, Clone)]
pub struct Injective {
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
    shares: Scatter,
    fold: Scatter,
    symbolic: SpdSymbolic,
}

/// The derivatives of the energy of a triangle.
struct Derivatives {
    gradient: [f64; 6],
    /// The lower triangle, row by row, in the order u of the corners, v of the corners.
    hessian: [f64; 21],
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

    /// Prepares Newton's method for the present relations.
    ///
    /// # Errors
    ///
    /// [`ParamError::Solve`].
    pub fn newton(&self) -> Result<NewtonSystem, ParamError> {
        let shares = Scatter::of_whole_triangles(self.cut(), self.seams());
        let fold = Scatter::of_matrix(&shares.zero, self.ties());
        let symbolic = SpdSymbolic::new(&fold.zero)?;
        Ok(NewtonSystem { shares, fold, symbolic })
    }

    /// A map with its energy; `None` if it folds.
    pub fn injective(&self, energy: &InjectiveEnergy<'_>, free: Vec<f64>) -> Option<Injective> {
        let map = self.map(&free);
        let total = energy.of(&map.uv)?;
        Some(Injective { map, free, energy: total })
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
        at: &mut Injective,
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
            if !self.search(energy, at, &direction, slope) {
                return Ok(true);
            }
            tracing::debug!(step, energy = at.energy, "map without folds");
            if before - at.energy < GAIN * at.energy {
                patience -= 1;
                if patience == 0 {
                    return Ok(true);
                }
            } else {
                patience = PATIENCE;
            }
        }
        Ok(false)
    }

    /// Goes along a direction as far as it makes the energy less by enough; tells whether it does at all.
    fn search(&self, energy: &InjectiveEnergy<'_>, at: &mut Injective, direction: &[f64], slope: f64) -> bool {
        if !(slope > 0.0 && slope.is_finite()) {
            return false;
        }
        let moved = |t: f64| at.free.iter().zip(direction).map(|(y, d)| y + t * d).collect::<Vec<f64>>();
        let full = self.map(&moved(1.0));
        let mut t = (SAFE * first_flat(&at.map.uv, &full.uv)).min(1.0);
        for _ in 0..HALVINGS {
            if let Some(next) = self.injective(energy, moved(t))
                && next.energy <= at.energy - SUFFICIENT * t * slope
            {
                *at = next;
                return true;
            }
            t *= 0.5;
        }
        false
    }

    /// The Hessian, made positive definite, and the direction of steepest descent.
    fn newton_matrix(
        &self,
        newton: &NewtonSystem,
        energy: &InjectiveEnergy<'_>,
        uv: &[[DVec2; 3]],
    ) -> (SparseHermitian<f64>, Vec<f64>) {
        let locals: Vec<Derivatives> = uv.par_iter().enumerate().map(|(f, w)| energy.derivatives(f, w)).collect();
        let mut open = newton.shares.zero.clone();
        let mut load = vec![0.0; self.seams().n_free()];
        for (f, local) in locals.iter().enumerate() {
            newton.shares.add(f, &local.hessian, &mut open);
            for (k, share) in local.gradient.iter().enumerate() {
                let (variable, sign) = constraints::corner(self.cut(), HalfedgeId::new(3 * f + k % 3), (k / 3) as u32);
                for &(z, c) in self.seams().expression(variable as usize).0 {
                    load[z as usize] -= sign * c * share;
                }
            }
        }
        let mut matrix = newton.fold.zero.clone();
        for (k, (_, _, value)) in open.entries().enumerate() {
            newton.fold.add(k, &[value], &mut matrix);
        }
        let mut downhill = vec![0.0; matrix.n()];
        for (z, b) in load.into_iter().enumerate() {
            for &(y, c) in self.ties().expression(z).0 {
                downhill[y as usize] += c * b;
            }
        }
        matrix.raise_diagonal(GROUND);
        (matrix, downhill)
    }
}

/// The energy of maps on one mesh along one field.
#[derive(Debug, Clone)]
pub struct InjectiveEnergy<'a> {
    metric: &'a Metric,
    angle: &'a [f64],
    objective: &'a Objective,
    shape: Shape,
    firmness: &'a [f64],
    /// For each side of each triangle the coordinate that it is pulled towards an isoline of; empty: none.
    pulled: Vec<[Option<u8>; 3]>,
}

impl<'a> InjectiveEnergy<'a> {
    /// The energy of maps along the field of the angles given, of the sizes that `objective` wants. `firmness` tells for
    /// each triangle which share of the anisotropy counts there, from 0 to 1; empty: all of it.
    pub fn new(
        metric: &'a Metric,
        angle: &'a [f64],
        objective: &'a Objective,
        (shape, firmness): (Shape, &'a [f64]),
    ) -> Self {
        Self { metric, angle, objective, shape, firmness, pulled: Vec::new() }
    }

    /// The same, with these half-edges pulled towards isolines of a coordinate (0: u, 1: v).
    pub fn pulling(mut self, list: &[(HalfedgeId, u8)]) -> Self {
        if !list.is_empty() {
            self.pulled = vec![[None; 3]; self.angle.len()];
        }
        for &(h, axis) in list {
            self.pulled[h.index() / 3][h.index() % 3] = Some(axis);
        }
        self
    }

    /// The sides of a triangle that are pulled: their corners, the coordinate, and how much it differs between them.
    fn pulls(&self, f: usize, w: &[DVec2; 3]) -> impl Iterator<Item = (usize, usize, usize, f64)> {
        let sides = self.pulled.get(f).copied().unwrap_or_default();
        sides.into_iter().enumerate().filter_map(move |(i, axis)| {
            let (k, j) = (usize::from(axis?), (i + 1) % 3);
            Some((i, j, k, w[j][k] - w[i][k]))
        })
    }

    fn hats(&self, f: usize) -> [DVec2; 3] {
        hats(self.metric, self.angle[f], FaceId::new(f))
    }

    fn density(&self, f: usize) -> Density {
        let share = self.firmness.get(f).copied().unwrap_or(1.0);
        Density::new(self.shape.softened(share), self.objective.target(FaceId::new(f)))
    }

    /// The energy of a map; `None` where a triangle is turned over or flat.
    pub fn of(&self, uv: &[[DVec2; 3]]) -> Option<f64> {
        let each = |(f, w): (usize, &[DVec2; 3])| {
            let area = self.metric.area(FaceId::new(f));
            let pull: f64 = self.pulls(f, w).map(|(.., d)| PULL * d * d).sum();
            Some(area * self.density(f).value(&matrix(&self.hats(f), w))? + pull)
        };
        // Added up in order: the sum must not depend on threads.
        let parts: Vec<Option<f64>> = uv.par_iter().enumerate().map(each).collect();
        parts.into_iter().sum()
    }

    fn derivatives(&self, f: usize, w: &[DVec2; 3]) -> Derivatives {
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
        for (i, j, k, d) in self.pulls(f, w) {
            let (p, q) = (3 * k + i, 3 * k + j);
            gradient[p] -= 2.0 * PULL * d;
            gradient[q] += 2.0 * PULL * d;
            for (r, c, sign) in [(p, p, 1.0), (q, q, 1.0), (p.max(q), p.min(q), -1.0)] {
                hessian[r * (r + 1) / 2 + c] += sign * 2.0 * PULL;
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

/// The triangles that a map turns over or flattens.
pub fn folds(uv: &[[DVec2; 3]]) -> Vec<FaceId> {
    let folded = |w: &[DVec2; 3]| (w[1] - w[0]).perp_dot(w[2] - w[0]) <= 0.0;
    uv.iter().enumerate().filter(|(_, w)| folded(w)).map(|(f, _)| FaceId::new(f)).collect()
}

fn matrix(hats: &[DVec2; 3], w: &[DVec2; 3]) -> [f64; 4] {
    let u = hats[0] * w[0].x + hats[1] * w[1].x + hats[2] * w[2].x;
    let v = hats[0] * w[0].y + hats[1] * w[1].y + hats[2] * w[2].y;
    [u.x, u.y, v.x, v.y]
}

/// The first time at which a triangle becomes flat when all corners go from one map to another at constant speed.
fn first_flat(from: &[[DVec2; 3]], to: &[[DVec2; 3]]) -> f64 {
    let flat = |(p, q): (&[DVec2; 3], &[DVec2; 3])| {
        let [e, g] = [p[1] - p[0], p[2] - p[0]];
        let [de, dg] = [q[1] - q[0] - e, q[2] - q[0] - g];
        // det(t) = a t² + b t + c with c > 0: its first positive root, in the form that loses no digits.
        let (a, b, c) = (de.perp_dot(dg), e.perp_dot(dg) + de.perp_dot(g), e.perp_dot(g));
        let root = b * b - 4.0 * a * c;
        if root < 0.0 {
            return f64::INFINITY;
        }
        let t = 2.0 * c / (-b + root.sqrt());
        if t > 0.0 { t } else { f64::INFINITY }
    };
    from.par_iter().zip(to).map(flat).reduce(|| f64::INFINITY, f64::min)
}
