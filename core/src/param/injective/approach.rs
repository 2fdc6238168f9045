//! From a map without folds that does not satisfy the relations to one that does.
//!
//! To fit at once what is demanded at once may fold triangles. So the way there is gone in parts: the differences that the
//! relations have in the map at hand are made less by as much as the first flat triangle allows, the energy, which lets
//! squeezed triangles widen, is made less with the relations held there, and so on. Every part starts and ends without
//! folds; the last ends where the relations are satisfied.

use glam::DVec2;

use super::{InjectiveEnergy, InjectiveMap, NewtonSystem, SAFE, first_flat};
use crate::mesh::{FaceId, TriMesh};
use crate::param::solve::SeamlessSystem;
use crate::param::{ParamError, folds, gradients};
use crate::progress::Progress;
use crate::surface::Metric;

/// Parts of the way at most: what can be reached is mostly reached in four or less.
const PARTS: usize = 10;
/// The least part worth going: parts that become shorter and shorter lead nowhere.
const LEAST: f64 = 0.02;
/// Steps of Newton's method after each part.
const STEPS: usize = 3;
/// How exactly a map is to be one of this system, in its units.
const SAME: f64 = 1e-7;

impl SeamlessSystem {
    /// The map that satisfies the relations and is reached from one without folds that does not, both of this system but
    /// for its relations. Where it cannot be reached, the triangles that would fold on the rest of the way; none where
    /// the first map is not one of this system.
    ///
    /// # Errors
    ///
    /// [`ParamError::Solve`] or [`ParamError::Cancelled`].
    pub fn approach(
        &mut self,
        (mesh, metric): (&TriMesh, &Metric),
        (newton, energy): (&NewtonSystem, &InjectiveEnergy<'_>),
        (angle, uv): (&[f64], &[[DVec2; 3]]),
        progress: &Progress,
    ) -> Result<Result<InjectiveMap, Vec<FaceId>>, ParamError> {
        let wanted = self.differences();
        let found = self.in_parts((mesh, metric), (newton, energy), (angle, uv), &wanted, progress);
        self.set_differences(&wanted)?;
        found
    }

    fn in_parts(
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
        let Some(mut at) = self.injective(energy, self.free_of(&values)) else { return Ok(Err(Vec::new())) };
        if !at.map.uv.iter().flatten().zip(uv.iter().flatten()).all(|(a, b)| (*a - *b).length() < SAME) {
            return Ok(Err(Vec::new()));
        }
        let mut ahead = Vec::new();
        for part in 0..PARTS {
            progress.check()?;
            let rest: Vec<f64> = wanted.iter().zip(&now).map(|(w, n)| w - n).collect();
            self.set_differences(&rest)?;
            let way = self.least_change(metric, angle, &at.map.uv)?;
            let whole: Vec<[DVec2; 3]> = self.map(&way).uv;
            let moved = |(p, d): (&[DVec2; 3], &[DVec2; 3])| [0, 1, 2].map(|k| p[k] + d[k]);
            ahead = at.map.uv.iter().zip(&whole).map(moved).collect();
            let share = (SAFE * first_flat(&at.map.uv, &ahead)).min(1.0);
            tracing::debug!(part, share, "towards the relations");
            if share < LEAST {
                break;
            }
            for (n, r) in now.iter_mut().zip(&rest) {
                *n += share * r;
            }
            let done = share == 1.0;
            self.set_differences(if done { wanted } else { &now })?;
            let free = at.free.iter().zip(&way).map(|(y, d)| y + share * d).collect();
            let Some(next) = self.injective(energy, free) else { break };
            at = next;
            if done {
                return Ok(Ok(at));
            }
            self.descend(newton, energy, &mut at, STEPS, progress)?;
        }
        Ok(Err(folds(&ahead)))
    }

    /// The free variables of the least change of a map that changes the differences of the relations by those at hand:
    /// least in its gradients, relative to the size of each triangle's image.
    fn least_change(&mut self, metric: &Metric, angle: &[f64], uv: &[[DVec2; 3]]) -> Result<Vec<f64>, ParamError> {
        let size = |g: &[f64; 4]| g.iter().map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE);
        let weight: Vec<f64> = gradients(metric, angle, uv).iter().map(|g| 1.0 / size(g)).collect();
        self.fit(metric, angle, &vec![[0.0; 4]; angle.len()], &weight)
    }
}
