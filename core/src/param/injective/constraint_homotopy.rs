//! Constraint homotopy: from a locally injective map that violates constraints to one that satisfies them.
//!
//! Imposing all constraints in one step may flip triangles. Each iteration therefore closes only a part of the
//! remaining coordinate differences, as large as the first degenerate triangle allows, and then decreases the energy
//! with the reached differences held, which widens squeezed triangles. Every iterate is locally injective. The last one
//! satisfies the constraints.

use glam::DVec2;

use super::{InjectiveEnergy, InjectiveMap, SAFE_SHARE, first_degenerate};
use crate::mesh::{FaceId, TriMesh};
use crate::param::newton_system::NewtonSystem;
use crate::param::seamless_system::SeamlessSystem;
use crate::param::{ParamError, flipped_triangles, gradients};
use crate::progress::Progress;
use crate::surface::Metric;

/// Largest number of iterations. Where the constraints can be reached, four usually suffice.
const MAX_ITERATIONS: usize = 10;
/// Smallest share of the remaining differences that an iteration must close; steps below it converge to a map that
/// violates the constraints.
const MIN_SHARE: f64 = 0.02;
/// Newton steps after each iteration.
const NEWTON_STEPS: usize = 3;
/// Largest distance of a corner from its position in the given map for which that map counts as one of this system, in
/// units of the map.
const SAME_MAP: f64 = 1e-7;

impl SeamlessSystem {
    /// Continues the locally injective map `uv` to one that satisfies the constraints. `uv` must satisfy the seam
    /// constraints of this system.
    ///
    /// The inner error holds the triangles that would flip if the remaining differences were closed in one step; it is
    /// empty if `uv` is not a map of this system.
    ///
    /// # Errors
    ///
    /// [`ParamError::Solve`] or [`ParamError::Cancelled`].
    pub fn enforce_constraints(
        &mut self,
        (mesh, metric): (&TriMesh, &Metric),
        (newton, energy): (&NewtonSystem, &InjectiveEnergy<'_>),
        (angle, uv): (&[f64], &[[DVec2; 3]]),
        progress: &Progress,
    ) -> Result<Result<InjectiveMap, Vec<FaceId>>, ParamError> {
        let wanted = self.differences();
        let found = self.homotopy((mesh, metric), (newton, energy), (angle, uv), &wanted, progress);
        self.set_differences(&wanted)?;
        found
    }

    /// As [`Self::enforce_constraints`], but leaves the differences of the constraints at the last ones reached.
    fn homotopy(
        &mut self,
        (mesh, metric): (&TriMesh, &Metric),
        (newton, energy): (&NewtonSystem, &InjectiveEnergy<'_>),
        (angle, uv): (&[f64], &[[DVec2; 3]]),
        wanted: &[f64],
        progress: &Progress,
    ) -> Result<Result<InjectiveMap, Vec<FaceId>>, ParamError> {
        let values = self.values_of(mesh, uv);
        let mut now = self.differences_at(&values);
        self.set_differences(&now)?;
        let Some(mut at) = self.injective_map(energy, self.free_of(&values)) else { return Ok(Err(Vec::new())) };
        if !at.map.uv.iter().flatten().zip(uv.iter().flatten()).all(|(a, b)| (*a - *b).length() < SAME_MAP) {
            return Ok(Err(Vec::new()));
        }
        let mut target = Vec::new();
        for iteration in 0..MAX_ITERATIONS {
            progress.check()?;
            let rest: Vec<f64> = wanted.iter().zip(&now).map(|(w, n)| w - n).collect();
            self.set_differences(&rest)?;
            let change = self.least_change(metric, angle, &at.map.uv)?;
            let change_uv: Vec<[DVec2; 3]> = self.map(&change).uv;
            let moved = |(p, d): (&[DVec2; 3], &[DVec2; 3])| [0, 1, 2].map(|k| p[k] + d[k]);
            target = at.map.uv.iter().zip(&change_uv).map(moved).collect();
            let share = (SAFE_SHARE * first_degenerate(&at.map.uv, &target)).min(1.0);
            tracing::debug!(iteration, share, "constraint homotopy");
            if share < MIN_SHARE {
                break;
            }
            for (n, r) in now.iter_mut().zip(&rest) {
                *n += share * r;
            }
            let done = share == 1.0;
            self.set_differences(if done { wanted } else { &now })?;
            let free = at.free.iter().zip(&change).map(|(y, d)| y + share * d).collect();
            let Some(next) = self.injective_map(energy, free) else { break };
            at = next;
            if done {
                return Ok(Ok(at));
            }
            self.descend(newton, energy, &mut at, NEWTON_STEPS, progress)?;
        }
        Ok(Err(flipped_triangles(&target)))
    }

    /// The free variables of the least change of a map that has the present differences of the constraints: least in
    /// its gradients, relative to the size of each triangle's image.
    fn least_change(&mut self, metric: &Metric, angle: &[f64], uv: &[[DVec2; 3]]) -> Result<Vec<f64>, ParamError> {
        let size = |g: &[f64; 4]| g.iter().map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE);
        let weight: Vec<f64> = gradients(metric, angle, uv).iter().map(|g| 1.0 / size(g)).collect();
        self.fit(metric, angle, &vec![[0.0; 4]; angle.len()], &weight)
    }
}
