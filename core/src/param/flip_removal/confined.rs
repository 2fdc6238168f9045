//! Minimisation of the energy of a domain without flipped triangles, with the rest of the map fixed.
//!
//! Every triangle is confined to a convex cone of maps: `|(c, d)| ≤ κ r·(a, b) − δ`, where the frame `r` is a unit
//! vector near the direction of the similarity part. The constraint implies `det J > 0` (Lipman, Bounded Distortion
//! Mapping Spaces for Triangular Meshes, section 4). The frame of a triangle that is not flipped is its present
//! direction, so that the triangle satisfies its constraint; the frame of a flipped one is the direction of the field.
//! The energy is minimised by a cone program. Then the frames are set to the directions found and the program is solved
//! again, which can only lower the energy.

use glam::DVec2;

use super::distortion::Distortion;
use super::domain::Domain;
use super::problem::OrientationProblem;
use crate::progress::{Cancelled, Progress};
use crate::solve::{Affine, ConeProgram};

/// `κ`, the bound on the ratio of a triangle's parts. It allows images up to 39 : 1 relative to the target; a triangle
/// counts as flipped beyond 399 : 1.
const MAX_RATIO: f64 = 0.95;
/// `δ`, the distance of the cones' apices from zero, relative to the target: no triangle collapses to a point.
const APEX: f64 = 1e-3;
/// Largest number of cone programs per domain. Constraints that were left out but are violated are added from one to
/// the next.
const MAX_PROGRAMS: usize = 6;
/// Number of times that the frames are set to the directions found.
const FRAME_UPDATES: usize = 1;
/// Penalty of leaving a cone by the size of the target, relative to the energy of a triangle collapsed to a point. It
/// is above what satisfiable constraints usually cost in energy, so that only unsatisfiable ones are violated.
const VIOLATION_PENALTY: f64 = 100.0;
/// Largest sum, relative to its terms, that counts as zero.
const CANCELLATION: f64 = 1e-9;

/// A triangle whose gradients are affine functions of the changes of the inner variables.
struct AffineTriangle {
    triangle: u32,
    /// Gradients without change.
    here: [DVec2; 2],
    /// For u and for v: position of an inner variable, and derivative of the gradient by its change.
    terms: [Vec<(u32, DVec2)>; 2],
}

impl AffineTriangle {
    fn new(problem: &OrientationProblem, domain: &Domain, t: u32, x: &[f64], unit: f64) -> Self {
        let triangle = &problem.triangles[t as usize];
        let mut terms = [Vec::new(), Vec::new()];
        for (hat, corner) in triangle.hats().into_iter().zip(&triangle.corners) {
            for (terms, &(variable, sign)) in terms.iter_mut().zip(corner) {
                for &(y, c) in problem.reduction.expression(variable as usize).0 {
                    if let Ok(i) = domain.inner.binary_search(&y) {
                        terms.push((i as u32, hat * (sign * c * unit)));
                    }
                }
            }
        }
        Self { triangle: t, here: triangle.gradients(x), terms: terms.map(collect) }
    }

    fn gradients(&self, step: &[f64]) -> [DVec2; 2] {
        let along = |terms: &[(u32, DVec2)]| terms.iter().map(|&(i, g)| g * step[i as usize]).sum::<DVec2>();
        [self.here[0] + along(&self.terms[0]), self.here[1] + along(&self.terms[1])]
    }

    fn is_fixed(&self) -> bool {
        self.terms.iter().all(Vec::is_empty)
    }
}

/// Sorts terms by variable and sums those of the same variable.
fn collect(mut terms: Vec<(u32, DVec2)>) -> Vec<(u32, DVec2)> {
    terms.sort_by_key(|t| t.0);
    terms.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    terms
}

/// The convex constraint on a triangle.
#[derive(Clone, Copy)]
struct Cone {
    frame: DVec2,
    ratio: f64,
    apex: f64,
}

impl Cone {
    /// The cone for a triangle of given distortion. It contains the triangle unless it is flipped.
    fn about(distortion: &Distortion) -> Self {
        if distortion.is_flipped() {
            return Self { frame: DVec2::X, ratio: MAX_RATIO, apex: APEX };
        }
        let (now, size) = (distortion.ratio(), distortion.similarity.length());
        let ratio = MAX_RATIO.max(0.5 * (now + 1.0));
        Self { frame: distortion.similarity / size, ratio, apex: APEX.min(0.5 * (ratio - now) * size) }
    }

    /// The second-order cone constraint: the first row bounds the norm of the other two.
    fn constraint(&self, triangle: &AffineTriangle, lengths: DVec2) -> [Affine; 3] {
        let rows = |gradients: [DVec2; 2]| {
            let distortion = Distortion::new(gradients, lengths);
            [self.ratio * self.frame.dot(distortion.similarity), distortion.reflection.x, distortion.reflection.y]
        };
        let here = rows(triangle.here);
        let mut out = here.map(|constant| Affine { terms: Vec::new(), constant });
        out[0].constant -= self.apex;
        let of_u = triangle.terms[0].iter().map(|&(i, g)| (i, rows([g, DVec2::ZERO])));
        let of_v = triangle.terms[1].iter().map(|&(i, g)| (i, rows([DVec2::ZERO, g])));
        let mut changes: Vec<_> = of_u.chain(of_v).collect();
        changes.sort_by_key(|c| c.0);
        changes.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 = [0, 1, 2].map(|k| kept.1[k] + next.1[k]);
            }
            same
        });
        for (i, change) in changes {
            for (row, c) in out.iter_mut().zip(change) {
                row.terms.push((i, c));
            }
        }
        out
    }
}

/// A map and the domain in which it may change.
#[derive(Clone, Copy)]
pub(super) struct ConfinedMap<'a> {
    pub problem: &'a OrientationProblem<'a>,
    pub domain: &'a Domain,
    /// The free variables.
    pub y: &'a [f64],
    /// All variables.
    pub x: &'a [f64],
    /// Triangles that may stay flipped.
    pub spared: &'a [bool],
}

impl ConfinedMap<'_> {
    /// The values of the inner variables of least energy for which no triangle is flipped; `None` if there are none.
    /// Triangles are confined where `confined` holds, others once they flip.
    pub fn minimise(&self, confined: impl Fn(u32) -> bool, progress: &Progress) -> Result<Option<Vec<f64>>, Cancelled> {
        let unit = unit(self.problem, self.domain);
        let triangles = self.triangles(unit);
        let mut at = vec![0.0; self.domain.inner.len()];
        let required = |t: &AffineTriangle| !self.spared[t.triangle as usize];
        if triangles.iter().any(|t| required(t) && t.is_fixed() && self.distortion(t, &at).is_flipped()) {
            return Ok(None);
        }
        let mut program = energy(self.problem, &triangles, self.domain.inner.len());
        let mut imposed: Vec<bool> =
            triangles.iter().map(|t| required(t) && !t.is_fixed() && confined(t.triangle)).collect();
        let mut best: Option<(f64, Vec<f64>)> = None;
        let mut updates = 0;
        for _ in 0..MAX_PROGRAMS {
            let chosen = triangles.iter().zip(&imposed).filter(|(_, imposed)| **imposed);
            program.cones = chosen.map(|(t, _)| self.constraint(t, &at)).collect();
            let Some(step) = program.minimise(progress)? else { break };
            let mut violated = false;
            for (t, imposed) in triangles.iter().zip(&mut imposed) {
                if required(t) && self.distortion(t, &step).is_flipped() {
                    // An imposed constraint is violated only if the solver fails.
                    if *imposed || t.is_fixed() {
                        return Ok(best.map(|b| self.values(&b.1, unit)));
                    }
                    *imposed = true;
                    violated = true;
                }
            }
            if violated {
                continue;
            }
            let value = self.energy(&triangles, &step);
            if best.as_ref().is_none_or(|b| value < b.0) {
                at.clone_from(&step);
                best = Some((value, step));
            }
            if updates == FRAME_UPDATES {
                break;
            }
            updates += 1;
        }
        Ok(best.map(|b| self.values(&b.1, unit)))
    }

    /// Values of the inner variables with fewer flipped triangles, others remaining: triangles flipped now may leave
    /// their cones at a penalty linear in the distance; all others are confined. `None` unless fewer triangles are
    /// flipped.
    pub fn relax(&self, progress: &Progress) -> Result<Option<Vec<f64>>, Cancelled> {
        let unit = unit(self.problem, self.domain);
        let triangles = self.triangles(unit);
        let none = vec![0.0; self.domain.inner.len()];
        let mut program = energy(self.problem, &triangles, none.len());
        let flipped = |step: &[f64]| triangles.iter().filter(|t| self.distortion(t, step).is_flipped()).count();
        for t in triangles.iter().filter(|t| !self.spared[t.triangle as usize] && !t.is_fixed()) {
            let mut constraint = self.constraint(t, &none);
            if self.distortion(t, &none).is_flipped() {
                let slack = program.linear.len() as u32;
                program.linear.push(VIOLATION_PENALTY);
                constraint[0].terms.push((slack, 1.0));
                let positive = Affine { terms: vec![(slack, 1.0)], constant: 0.0 };
                program.cones.push([positive, Affine::default(), Affine::default()]);
            }
            program.cones.push(constraint);
        }
        let Some(mut step) = program.minimise(progress)? else { return Ok(None) };
        step.truncate(none.len());
        Ok((flipped(&step) < flipped(&none)).then(|| self.values(&step, unit)))
    }

    fn triangles(&self, unit: f64) -> Vec<AffineTriangle> {
        self.domain.triangles.iter().map(|&t| AffineTriangle::new(self.problem, self.domain, t, self.x, unit)).collect()
    }

    fn distortion(&self, t: &AffineTriangle, step: &[f64]) -> Distortion {
        Distortion::new(t.gradients(step), self.problem.triangles[t.triangle as usize].lengths)
    }

    fn constraint(&self, t: &AffineTriangle, at: &[f64]) -> [Affine; 3] {
        let lengths = self.problem.triangles[t.triangle as usize].lengths;
        Cone::about(&self.distortion(t, at)).constraint(t, lengths)
    }

    fn energy(&self, triangles: &[AffineTriangle], step: &[f64]) -> f64 {
        triangles.iter().map(|t| self.problem.triangles[t.triangle as usize].energy(t.gradients(step))).sum()
    }

    /// The inner variables after `step`, which is in multiples of `unit`.
    fn values(&self, step: &[f64], unit: f64) -> Vec<f64> {
        self.domain.inner.iter().zip(step).map(|(&i, s)| self.y[i as usize] + s * unit).collect()
    }
}

/// Whether the constraints force a triangle to be flipped: its gradients are fixed, or one coordinate is constant.
pub(super) fn is_fixed(problem: &OrientationProblem, t: u32) -> bool {
    let triangle = &problem.triangles[t as usize];
    let constant = [0, 1].map(|k| {
        let mut terms: Vec<(u32, DVec2)> = Vec::new();
        let mut rest = DVec2::ZERO;
        for (hat, corner) in triangle.hats().into_iter().zip(&triangle.corners) {
            let (variable, sign) = corner[k];
            let (expression, constant) = problem.reduction.expression(variable as usize);
            rest += hat * (sign * constant);
            terms.extend(expression.iter().map(|&(y, c)| (y, hat * (sign * c))));
        }
        let size = terms.iter().map(|t| t.1.length()).fold(0.0, f64::max);
        collect(terms).iter().all(|t| t.1.length() <= CANCELLATION * size).then_some(rest)
    });
    match constant {
        [Some(u), Some(v)] => Distortion::new([u, v], triangle.lengths).is_flipped(),
        [Some(one), None] | [None, Some(one)] => one.length() <= CANCELLATION * triangle.lengths.max_element(),
        [None, None] => false,
    }
}

/// A typical coordinate difference along an edge: the unit in which the changes of variables are of the order of 1.
fn unit(problem: &OrientationProblem, domain: &Domain) -> f64 {
    let size = |&t: &u32| {
        let triangle = &problem.triangles[t as usize];
        let [a, b, c] = triangle.layout;
        (b - a).perp_dot(c - a).abs() * triangle.lengths.x * triangle.lengths.y
    };
    (domain.triangles.iter().map(size).sum::<f64>() / domain.triangles.len().max(1) as f64)
        .sqrt()
        .max(f64::MIN_POSITIVE)
}

/// The energy of triangles as a function of the `n` changes, relative to its typical size.
fn energy(problem: &OrientationProblem, affine: &[AffineTriangle], n: usize) -> ConeProgram {
    let mut program = ConeProgram { linear: vec![0.0; n], ..Default::default() };
    let size = |t: &AffineTriangle| problem.triangles[t.triangle as usize].energy([DVec2::ZERO; 2]);
    let scale = affine.len() as f64 / affine.iter().map(size).sum::<f64>();
    for t in affine {
        let triangle = &problem.triangles[t.triangle as usize];
        let weight = 2.0 * scale * triangle.weight;
        for (k, (terms, norm)) in t.terms.iter().zip(triangle.norms()).enumerate() {
            let residual = (t.here[k] - triangle.target(k)) * norm;
            for (first, &(i, g)) in terms.iter().enumerate() {
                let g = g * norm;
                program.linear[i as usize] += weight * g.dot(residual);
                program.quadratic.extend(terms[first..].iter().map(|&(j, h)| (i, j, weight * g.dot(h * norm))));
            }
        }
    }
    program
}
