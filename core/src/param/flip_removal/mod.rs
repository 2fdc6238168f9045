//! Removal of flipped triangles from seamless maps (Campen, section 6.5.3).
//!
//! The least-squares objective does not see orientation: near fixed points triangles may flip. Around each group of
//! flipped triangles the energy is minimised again. Everything outside stays in place, and each triangle inside is
//! confined to a convex set of orientation-preserving maps ([`confined`]). Where this fails, further attempts follow,
//! each from the best map so far:
//!
//! 1. larger domains, ring by ring;
//! 2. domains that include all triangles sharing a variable with the flipped ones;
//! 3. a relaxation in which flipped triangles may leave their convex set at a cost;
//! 4. the first step again from a stiffened map.
//!
//! The result never has more flipped triangles than the input. For each that remains, a reason is given.

mod confined;
mod distortion;
mod domain;
mod problem;
mod stiffening;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};
use confined::ConfinedMap;
use domain::{Domain, Neighbours};
pub use problem::{OrientationProblem, OrientedTriangle};

/// Rings of triangles around flipped ones that form a domain, in successive attempts. Three rings around a regular
/// vertex have some 50 other vertices; beyond 24 rings, solving for the whole surface is as fast.
const RINGS: [u32; 4] = [3, 6, 12, 24];
/// Number of these attempts for [`Effort::Quick`].
const QUICK_ATTEMPTS: usize = 2;
/// Rings around flipped triangles and all triangles that share a variable with them, in successive attempts. Triangles
/// within are confined from the start, others once they flip.
const SHARED_RINGS: [u32; 2] = [6, 12];
/// Rings of a domain of the relaxation.
const RELAXED_RINGS: u32 = 6;
/// Triangles of a domain above which the relaxation follows at once instead of a larger domain. Such a domain contains
/// many flipped triangles; the relaxation removes those that do not depend on others.
const LARGE_DOMAIN: usize = 2000;
/// Most triangles of a domain with shared variables; larger ones are skipped. At this size a solve takes some seconds.
const MAX_SHARED_TRIANGLES: usize = 25_000;
/// Most flipped triangles left by the first step for which the further steps run. Where more remain, the map as a whole
/// does not fit its constraints.
const MAX_STUBBORN: usize = 24;
/// Largest mean angle of the corners at a vertex, in degrees: 180 less what the bound on distortion takes.
const MAX_CORNER_ANGLE: f64 = 175.0;

/// Which steps are taken to remove flipped triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Small domains only.
    Quick,
    /// All steps.
    Thorough,
}

/// Why a triangle remains flipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlipReason {
    /// The triangles at this vertex cannot span its angle, since each corner is below 180°: the vertex needs more
    /// triangles.
    HighValence {
        /// The vertex.
        vertex: u32,
        /// The prescribed angle, in quarter turns.
        quarters: u32,
        /// The number of triangles.
        triangles: u32,
    },
    /// The constraints determine the triangle: its corners are fixed, or one of its coordinates is constant.
    Fixed,
    /// No map was found in which the triangle is not flipped.
    NotResolved,
}

/// A triangle that remains flipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlippedTriangle {
    /// The triangle.
    pub triangle: u32,
    /// The reason.
    pub reason: FlipReason,
}

/// The result of [`remove_flips`].
#[derive(Debug, Clone, PartialEq)]
pub struct FlipRemoval {
    /// The free variables.
    pub y: Vec<f64>,
    /// Number of flipped triangles before.
    pub flipped_before: usize,
    /// Triangles that remain flipped, ascending.
    pub flipped: Vec<FlippedTriangle>,
    /// The energy before.
    pub energy_before: f64,
    /// The energy after.
    pub energy: f64,
}

/// Removes flipped triangles from the map with free variables `y`. A map without flipped triangles is returned
/// unchanged.
///
/// # Errors
///
/// [`Cancelled`].
pub fn remove_flips(
    problem: &OrientationProblem,
    y: &[f64],
    effort: Effort,
    progress: &Progress,
) -> Result<FlipRemoval, Cancelled> {
    let flipped = problem.flipped(&problem.reduction.expand(y));
    let energy_before = problem.energy(y);
    let mut out = FlipRemoval {
        y: y.to_vec(),
        flipped_before: flipped.len(),
        flipped: Vec::new(),
        energy_before,
        energy: energy_before,
    };
    if flipped.is_empty() {
        return Ok(out);
    }
    let neighbours = Neighbours::new(problem);
    let crowded = crowded_vertices(problem, &neighbours);
    let mut spared = vec![false; problem.triangles.len()];
    for &t in crowded.keys().flat_map(|&v| neighbours.around(v)) {
        spared[t as usize] = true;
    }
    for &t in &flipped {
        spared[t as usize] |= confined::is_fixed(problem, t);
    }
    if y.iter().all(|y| y.is_finite()) {
        let removal = Removal { problem, neighbours: &neighbours, spared: &spared, progress };
        let best = removal.run(y, effort)?;
        if problem.flipped(&problem.reduction.expand(&best.y)).len() < flipped.len() {
            out.energy = best.energy;
            out.y = best.y;
        }
    }
    let remaining = problem.flipped(&problem.reduction.expand(&out.y));
    out.flipped =
        remaining.into_iter().map(|t| FlippedTriangle { triangle: t, reason: reason(problem, &crowded, t) }).collect();
    let (before, after) = (out.flipped_before, out.flipped.len());
    tracing::debug!(before, after, energy_before, out.energy, "flipped triangles removed");
    Ok(out)
}

/// Vertices with too few triangles for their angle, with the angle in quarter turns and the number of triangles.
fn crowded_vertices(problem: &OrientationProblem, neighbours: &Neighbours) -> BTreeMap<u32, (u32, u32)> {
    let n = neighbours.n_vertices().min(problem.quarters.len());
    let at = |v: u32| (problem.quarters[v as usize], neighbours.around(v).len() as u32);
    let too_few = |&(_, (quarters, triangles)): &(u32, (u32, u32))| {
        triangles > 0 && f64::from(quarters) * 90.0 > f64::from(triangles) * MAX_CORNER_ANGLE
    };
    (0..n as u32).map(|v| (v, at(v))).filter(too_few).collect()
}

/// Why a triangle remains flipped.
fn reason(problem: &OrientationProblem, crowded: &BTreeMap<u32, (u32, u32)>, t: u32) -> FlipReason {
    let vertices = problem.triangles[t as usize].vertices;
    if let Some((vertex, &(quarters, triangles))) = vertices.iter().find_map(|v| crowded.get_key_value(v)) {
        return FlipReason::HighValence { vertex: *vertex, quarters, triangles };
    }
    if confined::is_fixed(problem, t) { FlipReason::Fixed } else { FlipReason::NotResolved }
}

/// A map with its number of flipped triangles.
struct Candidate {
    y: Vec<f64>,
    /// Number of flipped triangles that are not spared.
    flipped: usize,
    energy: f64,
}

/// The steps of the removal.
struct Removal<'a> {
    problem: &'a OrientationProblem<'a>,
    neighbours: &'a Neighbours,
    /// Triangles that must stay flipped. They are not confined, so that they do not obstruct others.
    spared: &'a [bool],
    progress: &'a Progress,
}

impl Removal<'_> {
    /// All steps that `effort` asks for, from the map with free variables `y`.
    fn run(&self, y: &[f64], effort: Effort) -> Result<Candidate, Cancelled> {
        let rings = if effort == Effort::Quick { &RINGS[..QUICK_ATTEMPTS] } else { &RINGS };
        let mut best = self.confine(y, rings)?;
        let goes_on = |best: &Candidate| effort == Effort::Thorough && best.flipped > 0 && best.flipped <= MAX_STUBBORN;
        if goes_on(&best) {
            best = self.confine_shared(&best.y)?;
        }
        if goes_on(&best) {
            best = self.relax(&best.y)?;
        }
        if goes_on(&best)
            && let Some(stiffened) = stiffening::stiffen(self.problem, self.neighbours, self.spared, self.progress)?
        {
            let other = self.confine(&stiffened, &RINGS)?;
            if (other.flipped, other.energy) < (best.flipped, best.energy) {
                best = other;
            }
        }
        Ok(best)
    }

    /// Minimises domain by domain with confined triangles, with growing domains.
    fn confine(&self, y: &[f64], rings: &[u32]) -> Result<Candidate, Cancelled> {
        let mut y = y.to_vec();
        let mut before: Vec<Domain> = Vec::new();
        for &rings in rings {
            let flipped = self.flipped(&y);
            if flipped.is_empty() {
                break;
            }
            let domains = self.neighbours.domains(self.problem, &flipped, rings);
            // A domain that has not grown gives the same result.
            let grown: Vec<Domain> = domains.iter().filter(|d| !before.contains(d)).cloned().collect();
            self.change(&mut y, &grown, |local| match local.minimise(|_| true, self.progress)? {
                None if local.domain.triangles.len() > LARGE_DOMAIN => local.relax(self.progress),
                found => Ok(found),
            })?;
            before = domains;
        }
        Ok(self.candidate(y))
    }

    /// Removes flipped triangles beside others that stay flipped.
    fn relax(&self, y: &[f64]) -> Result<Candidate, Cancelled> {
        let mut y = y.to_vec();
        let domains = self.neighbours.domains(self.problem, &self.flipped(&y), RELAXED_RINGS);
        self.change(&mut y, &domains, |local| local.relax(self.progress))?;
        Ok(self.candidate(y))
    }

    /// Changes the inner variables of disjoint domains to the values that `find` returns for each, if any.
    fn change(
        &self,
        y: &mut [f64],
        domains: &[Domain],
        find: impl Fn(ConfinedMap) -> Result<Option<Vec<f64>>, Cancelled> + Sync,
    ) -> Result<(), Cancelled> {
        let x = self.problem.reduction.expand(y);
        let local = |domain| ConfinedMap { problem: self.problem, domain, y, x: &x, spared: self.spared };
        let found = domains.par_iter().map(|d| find(local(d))).collect::<Result<Vec<_>, _>>()?;
        for (domain, values) in domains.iter().zip(found) {
            for (&i, value) in domain.inner.iter().zip(values.into_iter().flatten()) {
                y[i as usize] = value;
            }
        }
        Ok(())
    }

    /// Minimises domains that include all triangles sharing a variable (a translation, or through a coordinate
    /// constraint) with the flipped ones; the whole surface where that is more than half of it.
    fn confine_shared(&self, y: &[f64]) -> Result<Candidate, Cancelled> {
        let (problem, neighbours) = (self.problem, self.neighbours);
        let mut y = y.to_vec();
        for domain in neighbours.domains(problem, &self.flipped(&y), RINGS[RINGS.len() - 1]) {
            // The solve of an earlier domain may have removed flipped triangles of this one.
            let mut flipped = self.flipped(&y);
            flipped.retain(|t| domain.triangles.binary_search(t).is_ok());
            let shared = self.shared_variables(&domain, &flipped);
            if shared.is_empty() {
                continue;
            }
            let has_shared = |&t: &u32| problem.variables(t).iter().any(|y| shared.binary_search(y).is_ok());
            let mut seeds = flipped;
            seeds.extend((0..problem.triangles.len() as u32).filter(has_shared));
            for rings in SHARED_RINGS {
                let distance = neighbours.distance(problem, &seeds, rings);
                let reached = |t: u32| distance[t as usize] != u32::MAX;
                let all = 0..problem.triangles.len() as u32;
                let mut triangles: Vec<u32> = all.clone().filter(|&t| reached(t)).collect();
                let whole = 2 * triangles.len() > problem.triangles.len();
                if whole {
                    triangles = all.collect();
                }
                if triangles.len() > MAX_SHARED_TRIANGLES {
                    break;
                }
                let before = self.flipped(&y).len();
                let joined = neighbours.joined(problem, triangles);
                self.change(&mut y, &[joined], |local| local.minimise(reached, self.progress))?;
                if whole || self.flipped(&y).len() < before {
                    break;
                }
            }
        }
        Ok(self.candidate(y))
    }

    /// The variables near flipped triangles that also occur outside their largest domain, ascending.
    fn shared_variables(&self, domain: &Domain, flipped: &[u32]) -> Vec<u32> {
        let distance = self.neighbours.distance(self.problem, flipped, RINGS[0]);
        let near = domain.triangles.iter().filter(|t| distance[**t as usize] != u32::MAX);
        let mut out: Vec<u32> = near.flat_map(|&t| self.problem.variables(t)).collect();
        out.sort_unstable();
        out.dedup();
        out.retain(|y| domain.inner.binary_search(y).is_err());
        out
    }

    fn candidate(&self, y: Vec<f64>) -> Candidate {
        Candidate { flipped: self.flipped(&y).len(), energy: self.problem.energy(&y), y }
    }

    /// The flipped triangles that are not spared.
    fn flipped(&self, y: &[f64]) -> Vec<u32> {
        let flipped = self.problem.flipped(&self.problem.reduction.expand(y));
        flipped.into_iter().filter(|&t| !self.spared[t as usize]).collect()
    }
}
