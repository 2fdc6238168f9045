//! Removal of folds from seamless maps.
//!
//! Least squares do not care for orientation: near fixed points triangles may be turned over. Around each group of
//! such triangles the energy is minimised again with everything outside kept in place and every triangle inside
//! confined to a convex set of orientation preserving maps (Campen, section 6.5.3). Where no such map exists the
//! surroundings grow, at last by the places that seams and relations tie to them. Then as many folds go as can be had
//! beside those that cannot, and the same is tried from a stiffened map. The outcome never has more folds than the
//! input; for each that remains it tells why.

mod domain;
mod local;
mod shape;
mod stiffen;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use glam::DVec2;
use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};
use crate::solve::Reduction;
use domain::{Domain, Neighbours, variables};
use local::Local;
use shape::Shape;

/// How many rings of triangles around folds may move, one try after the other. Three rings leave a regular vertex
/// some 50 others to give way; beyond 24 rings the whole surface is as quick.
const RINGS: [u32; 4] = [3, 6, 12, 24];
/// How many of these are tried where another guess is as cheap.
const QUICK: usize = 2;
/// Rings that may move around folds and all places that share a variable with them. Triangles there are confined
/// from the start, others where they turn out to fold.
const BOUND_RINGS: [u32; 2] = [6, 12];
/// Rings that may move where not all folds can go.
const RELAXED_RINGS: u32 = 6;
/// A domain of more triangles, many folds that is, does not grow before those are gone that hinder no other.
const LARGE: usize = 2000;
/// Most triangles to be solved at once where relations are to move: some seconds.
const AT_ONCE: usize = 25_000;
/// Up to how many folds that one domain does not resolve are worth solving for large parts of the surface: where more
/// remain, the map as a whole does not fit its constraints.
const FEW: usize = 24;
/// The widest angle that corners at one vertex can have on average: 180° less what the bound on flatness takes.
const WIDEST_CORNER: f64 = 175.0;

/// A triangle of a map that is to follow a field.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientedTriangle {
    /// The corners in the triangle's plane, counter-clockwise.
    pub layout: [DVec2; 3],
    /// The unit vector that `∇u` should follow; `∇v` should follow the one a quarter turn further.
    pub axis: DVec2,
    /// The lengths that `∇u` and `∇v` should have; positive.
    pub lengths: DVec2,
    /// The weight in the energy, usually the area.
    pub weight: f64,
    /// How much more misalignment counts than wrong length; 1 for the Euclidean norm.
    pub ratio: f64,
    /// The vertices of the mesh at the corners.
    pub vertices: [u32; 3],
    /// The coordinates u and v of each corner: a variable of the reduction, and the sign it is taken with.
    pub corners: [[(u32, f64); 2]; 3],
}

/// A map given by its free variables, and what it should be like.
#[derive(Debug, Clone, Copy)]
pub struct OrientationProblem<'a> {
    /// All triangles of the surface.
    pub triangles: &'a [OrientedTriangle],
    /// The variables as expressions of the free ones.
    pub reduction: &'a Reduction,
    /// For each vertex the angle around it in the map, in quarter turns: the valence of the field there, 4 where it is
    /// regular; 0 for an angle that is not prescribed, as at a boundary.
    pub quarters: &'a [u32],
}

/// How much is done to remove folds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// What can be done nearby.
    Quick,
    /// All that is known.
    Thorough,
}

/// Why a triangle remains folded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlipReason {
    /// The triangles at this vertex cannot span its angle, each corner being less than 180°: it needs more triangles.
    HighValence {
        /// The vertex.
        vertex: u32,
        /// The angle wanted, in quarter turns.
        quarters: u32,
        /// The triangles there are.
        triangles: u32,
    },
    /// The constraints leave the triangle no choice: its corners are fixed, or one of its coordinates is constant.
    Fixed,
    /// No map without this fold was found.
    NotResolved,
}

/// A triangle that remains folded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlippedTriangle {
    /// The triangle.
    pub triangle: u32,
    /// Why.
    pub reason: FlipReason,
}

/// A map with its folds removed as far as possible.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfolded {
    /// The free variables.
    pub y: Vec<f64>,
    /// Number of folds before.
    pub folds_before: usize,
    /// Folds that remain, ascending.
    pub folds: Vec<FlippedTriangle>,
    /// The energy before.
    pub energy_before: f64,
    /// The energy now.
    pub energy: f64,
}

impl OrientationProblem<'_> {
    /// The weighted squared difference of the map's gradients from those wanted.
    pub fn energy(&self, y: &[f64]) -> f64 {
        let x = self.reduction.expand(y);
        self.triangles.iter().map(|t| t.energy(t.gradients(&x))).sum()
    }

    /// The triangles that are turned over or flat where the variables are `x`, ascending.
    fn folded(&self, x: &[f64]) -> Vec<u32> {
        let folded = |t: &OrientedTriangle| Shape::new(t.gradients(x), t.lengths).is_folded();
        (0..).zip(self.triangles).filter(|(_, t)| folded(t)).map(|(i, _)| i).collect()
    }
}

/// Removes folds from the map with free variables `y`. Without folds the same bits come back.
///
/// # Errors
///
/// [`Cancelled`].
pub fn unfold(
    problem: &OrientationProblem,
    y: &[f64],
    effort: Effort,
    progress: &Progress,
) -> Result<Unfolded, Cancelled> {
    let folded = problem.folded(&problem.reduction.expand(y));
    let energy_before = problem.energy(y);
    let mut out =
        Unfolded { y: y.to_vec(), folds_before: folded.len(), folds: Vec::new(), energy_before, energy: energy_before };
    if folded.is_empty() {
        return Ok(out);
    }
    let neighbours = Neighbours::new(problem);
    let crowded = crowded_vertices(problem, &neighbours);
    let mut spared = vec![false; problem.triangles.len()];
    for &t in crowded.keys().flat_map(|&v| neighbours.around(v)) {
        spared[t as usize] = true;
    }
    for &t in &folded {
        spared[t as usize] |= local::is_fixed(problem, t);
    }
    if y.iter().all(|y| y.is_finite()) {
        let attempt = Attempt { problem, neighbours: &neighbours, spared: &spared, progress };
        let rings = if effort == Effort::Quick { &RINGS[..QUICK] } else { &RINGS };
        let mut best = attempt.relieve(y, rings)?;
        let worth = |best: &Candidate| effort == Effort::Thorough && best.folds > 0 && best.folds <= FEW;
        if worth(&best) {
            best = attempt.relieve_bound(&best.y)?;
        }
        if worth(&best) {
            best = attempt.relax(&best.y)?;
        }
        if worth(&best)
            && let Some(stiff) = stiffen::stiffen(problem, &neighbours, &spared, progress)?
        {
            let other = attempt.relieve(&stiff, &RINGS)?;
            if (other.folds, other.energy) < (best.folds, best.energy) {
                best = other;
            }
        }
        if problem.folded(&problem.reduction.expand(&best.y)).len() < folded.len() {
            out.energy = best.energy;
            out.y = best.y;
        }
    }
    let remaining = problem.folded(&problem.reduction.expand(&out.y));
    out.folds =
        remaining.into_iter().map(|t| FlippedTriangle { triangle: t, reason: reason(problem, &crowded, t) }).collect();
    tracing::debug!(before = out.folds_before, after = out.folds.len(), energy_before, out.energy, "folds removed");
    Ok(out)
}

/// Vertices with too few triangles for their angle, and how many quarter turns and triangles they have.
fn crowded_vertices(problem: &OrientationProblem, neighbours: &Neighbours) -> BTreeMap<u32, (u32, u32)> {
    let n = neighbours.n_vertices().min(problem.quarters.len());
    let at = |v: u32| (problem.quarters[v as usize], neighbours.around(v).len() as u32);
    let too_few = |&(_, (quarters, triangles)): &(u32, (u32, u32))| {
        triangles > 0 && f64::from(quarters) * 90.0 > f64::from(triangles) * WIDEST_CORNER
    };
    (0..n as u32).map(|v| (v, at(v))).filter(too_few).collect()
}

fn reason(problem: &OrientationProblem, crowded: &BTreeMap<u32, (u32, u32)>, t: u32) -> FlipReason {
    let vertices = problem.triangles[t as usize].vertices;
    if let Some((vertex, &(quarters, triangles))) = vertices.iter().find_map(|v| crowded.get_key_value(v)) {
        return FlipReason::HighValence { vertex: *vertex, quarters, triangles };
    }
    if local::is_fixed(problem, t) { FlipReason::Fixed } else { FlipReason::NotResolved }
}

/// A map and how good it is.
struct Candidate {
    y: Vec<f64>,
    /// Folds other than those spared.
    folds: usize,
    energy: f64,
}

/// Removal by constraints.
struct Attempt<'a> {
    problem: &'a OrientationProblem<'a>,
    neighbours: &'a Neighbours,
    /// Triangles that cannot be unfolded and must not hinder the others.
    spared: &'a [bool],
    progress: &'a Progress,
}

impl Attempt<'_> {
    /// Unfolds domain by domain, larger and larger ones.
    fn relieve(&self, y: &[f64], rings: &[u32]) -> Result<Candidate, Cancelled> {
        let mut y = y.to_vec();
        let mut before: Vec<Domain> = Vec::new();
        for &rings in rings {
            let folds = self.folds(&y);
            if folds.is_empty() {
                break;
            }
            let domains = self.neighbours.domains(self.problem, &folds, rings);
            // A domain that could not grow will not do better.
            let grown: Vec<Domain> = domains.iter().filter(|d| !before.contains(d)).cloned().collect();
            self.change(&mut y, &grown, |local| match local.straighten(|_| true, self.progress)? {
                None if local.domain.triangles.len() > LARGE => local.relax(self.progress),
                found => Ok(found),
            })?;
            before = domains;
        }
        Ok(self.candidate(y))
    }

    /// Unfolds what can be unfolded beside folds that cannot.
    fn relax(&self, y: &[f64]) -> Result<Candidate, Cancelled> {
        let mut y = y.to_vec();
        let domains = self.neighbours.domains(self.problem, &self.folds(&y), RELAXED_RINGS);
        self.change(&mut y, &domains, |local| local.relax(self.progress))?;
        Ok(self.candidate(y))
    }

    /// Changes the inner variables of disjoint domains to the values found for each, if any.
    fn change(
        &self,
        y: &mut [f64],
        domains: &[Domain],
        find: impl Fn(Local) -> Result<Option<Vec<f64>>, Cancelled> + Sync,
    ) -> Result<(), Cancelled> {
        let x = self.problem.reduction.expand(y);
        let local = |domain| Local { problem: self.problem, domain, y, x: &x, spared: self.spared };
        let found = domains.par_iter().map(|d| find(local(d))).collect::<Result<Vec<_>, _>>()?;
        for (domain, values) in domains.iter().zip(found) {
            for (&i, value) in domain.inner.iter().zip(values.into_iter().flatten()) {
                y[i as usize] = value;
            }
        }
        Ok(())
    }

    /// Unfolds together with all places that share a translation or a relation with the folds, or the whole at once
    /// where that is about as much.
    fn relieve_bound(&self, y: &[f64]) -> Result<Candidate, Cancelled> {
        let (problem, neighbours) = (self.problem, self.neighbours);
        let mut y = y.to_vec();
        for domain in neighbours.domains(problem, &self.folds(&y), RINGS[RINGS.len() - 1]) {
            // Folds of this domain may have gone with those of an earlier one.
            let mut folds = self.folds(&y);
            folds.retain(|t| domain.triangles.binary_search(t).is_ok());
            let bound = self.bound_variables(&domain, &folds);
            if bound.is_empty() {
                continue;
            }
            let carries = |&t: &u32| variables(problem, t).iter().any(|y| bound.binary_search(y).is_ok());
            let mut seeds = folds;
            seeds.extend((0..problem.triangles.len() as u32).filter(carries));
            for rings in BOUND_RINGS {
                let distance = neighbours.distance(problem, &seeds, rings);
                let reached = |t: u32| distance[t as usize] != u32::MAX;
                let all = 0..problem.triangles.len() as u32;
                let mut triangles: Vec<u32> = all.clone().filter(|&t| reached(t)).collect();
                let whole = 2 * triangles.len() > problem.triangles.len();
                if whole {
                    triangles = all.collect();
                }
                if triangles.len() > AT_ONCE {
                    break;
                }
                let before = self.folds(&y).len();
                let joined = neighbours.joined(problem, triangles);
                self.change(&mut y, &[joined], |local| local.straighten(reached, self.progress))?;
                if whole || self.folds(&y).len() < before {
                    break;
                }
            }
        }
        Ok(self.candidate(y))
    }

    /// The variables near folds that occur outside their widest domain too, ascending.
    fn bound_variables(&self, domain: &Domain, folds: &[u32]) -> Vec<u32> {
        let distance = self.neighbours.distance(self.problem, folds, RINGS[0]);
        let near = domain.triangles.iter().filter(|t| distance[**t as usize] != u32::MAX);
        let mut out: Vec<u32> = near.flat_map(|&t| variables(self.problem, t)).collect();
        out.sort_unstable();
        out.dedup();
        out.retain(|y| domain.inner.binary_search(y).is_err());
        out
    }

    fn candidate(&self, y: Vec<f64>) -> Candidate {
        Candidate { folds: self.folds(&y).len(), energy: self.problem.energy(&y), y }
    }

    /// Folds that there is hope for.
    fn folds(&self, y: &[f64]) -> Vec<u32> {
        let folded = self.problem.folded(&self.problem.reduction.expand(y));
        folded.into_iter().filter(|&t| !self.spared[t as usize]).collect()
    }
}
