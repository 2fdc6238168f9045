//! The best map of a domain that folds no triangle, all else kept in place.
//!
//! Every triangle is confined to a convex cone of maps: with its frame, a unit vector `r` near the direction of the
//! similarity part, `|(c, d)| ≤ κ r·(a, b) − δ`, which implies `det J > 0` (Lipman, Bounded Distortion Mapping Spaces
//! for Triangular Meshes, section 4). A triangle that is not folded has its present direction as its frame, so that
//! it may stay as it is; one that is folded has that of the field, whose direction it should have. Within the cones
//! the energy is minimised; then the frames are turned to the map that was found and once more, which can only
//! lower the energy.

use glam::DVec2;

use super::OrientationProblem;
use super::domain::Domain;
use super::shape::Shape;
use crate::progress::{Cancelled, Progress};
use crate::solve::{Affine, ConeProgram};

/// The bound `κ` on the ratio of a triangle's parts: images up to 39 : 1 relative to the target, while a fold
/// begins beyond 399 : 1.
const RATIO: f64 = 0.95;
/// The distance `δ` of the cones' apices from zero, relative to the target: no triangle collapses to a point.
const APEX: f64 = 1e-3;
/// Rounds in which constraints that had not been imposed and turned out to be violated are added.
const LAZY_ROUNDS: usize = 6;
/// How often the frames are turned to the map found.
const TURNS: usize = 1;

/// Sums below this, relative to their terms, have cancelled.
const CANCELLED: f64 = 1e-9;

/// A triangle with the gradients as affine expressions of the inner variables' steps.
struct Piece {
    triangle: u32,
    /// Gradients without any step.
    here: [DVec2; 2],
    /// Number among the inner variables and how the gradient changes with it.
    terms: [Vec<(u32, DVec2)>; 2],
}

impl Piece {
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

/// Sorts terms and sums those of one variable.
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

/// The constraint on a triangle.
#[derive(Clone, Copy)]
struct Cone {
    frame: DVec2,
    ratio: f64,
    apex: f64,
}

impl Cone {
    /// The cone for a triangle of a given shape, which it holds unless it is folded.
    fn about(shape: &Shape) -> Self {
        if shape.is_folded() {
            return Self { frame: DVec2::X, ratio: RATIO, apex: APEX };
        }
        let (now, size) = (shape.ratio(), shape.similarity.length());
        let ratio = RATIO.max(0.5 * (now + 1.0));
        Self { frame: shape.similarity / size, ratio, apex: APEX.min(0.5 * (ratio - now) * size) }
    }

    fn constraint(&self, piece: &Piece, lengths: DVec2) -> [Affine; 3] {
        let rows = |gradients: [DVec2; 2]| {
            let shape = Shape::new(gradients, lengths);
            [self.ratio * self.frame.dot(shape.similarity), shape.reflection.x, shape.reflection.y]
        };
        let here = rows(piece.here);
        let mut out = here.map(|constant| Affine { terms: Vec::new(), constant });
        out[0].constant -= self.apex;
        let of_u = piece.terms[0].iter().map(|&(i, g)| (i, rows([g, DVec2::ZERO])));
        let of_v = piece.terms[1].iter().map(|&(i, g)| (i, rows([DVec2::ZERO, g])));
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

/// Finds the values of `domain`'s inner variables of least energy for which none of its triangles folds but those
/// `spared`; `None` where there are none. Constraints are imposed where `confined` says so, and where need be.
pub(super) fn straighten(
    problem: &OrientationProblem,
    domain: &Domain,
    y: &[f64],
    x: &[f64],
    spared: &[bool],
    confined: impl Fn(u32) -> bool,
    progress: &Progress,
) -> Result<Option<Vec<f64>>, Cancelled> {
    let unit = unit(problem, domain);
    let pieces: Vec<Piece> = domain.triangles.iter().map(|&t| Piece::new(problem, domain, t, x, unit)).collect();
    let shape = |p: &Piece, step: &[f64]| Shape::new(p.gradients(step), problem.triangles[p.triangle as usize].lengths);
    let none = vec![0.0; domain.inner.len()];
    let bound = |p: &Piece| !spared[p.triangle as usize];
    if pieces.iter().any(|p| bound(p) && p.is_fixed() && shape(p, &none).is_folded()) {
        return Ok(None);
    }
    let mut program = energy(problem, &pieces, domain.inner.len());
    let mut imposed: Vec<bool> = pieces.iter().map(|p| bound(p) && !p.is_fixed() && confined(p.triangle)).collect();
    let mut at = none;
    let mut best: Option<(f64, Vec<f64>)> = None;
    let mut turns = 0;
    for _ in 0..LAZY_ROUNDS {
        let chosen = pieces.iter().zip(&imposed).filter(|(_, imposed)| **imposed);
        program.cones = chosen
            .map(|(p, _)| Cone::about(&shape(p, &at)).constraint(p, problem.triangles[p.triangle as usize].lengths))
            .collect();
        let Some(step) = program.minimise(progress)? else { break };
        let mut violated = false;
        for (p, imposed) in pieces.iter().zip(&mut imposed) {
            if bound(p) && shape(p, &step).is_folded() {
                // A constraint that is imposed and yet violated is the solver's failure.
                if *imposed || p.is_fixed() {
                    return Ok(best.map(|b| b.1));
                }
                *imposed = true;
                violated = true;
            }
        }
        if violated {
            continue;
        }
        let gradients = pieces.iter().map(|p| problem.triangles[p.triangle as usize].energy(p.gradients(&step)));
        let value: f64 = gradients.sum();
        if best.as_ref().is_none_or(|b| value < b.0) {
            at.clone_from(&step);
            best = Some((value, domain.inner.iter().zip(&step).map(|(&i, s)| y[i as usize] + s * unit).collect()));
        }
        if turns == TURNS {
            break;
        }
        turns += 1;
    }
    Ok(best.map(|b| b.1))
}

/// Whether the constraints decide that a triangle is folded: nothing in it can vary, or one coordinate is constant.
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
        collect(terms).iter().all(|t| t.1.length() <= CANCELLED * size).then_some(rest)
    });
    match constant {
        [Some(u), Some(v)] => Shape::new([u, v], triangle.lengths).is_folded(),
        [Some(one), None] | [None, Some(one)] => one.length() <= CANCELLED * triangle.lengths.max_element(),
        [None, None] => false,
    }
}

/// A typical difference of coordinates along an edge, so that the program's numbers are of the order of 1.
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

/// The energy of the pieces as a function of the steps, relative to its typical size.
fn energy(problem: &OrientationProblem, pieces: &[Piece], n: usize) -> ConeProgram {
    let mut program = ConeProgram { linear: vec![0.0; n], ..Default::default() };
    let size = |p: &Piece| problem.triangles[p.triangle as usize].energy([DVec2::ZERO; 2]);
    let scale = pieces.len() as f64 / pieces.iter().map(size).sum::<f64>();
    for piece in pieces {
        let triangle = &problem.triangles[piece.triangle as usize];
        let weight = 2.0 * scale * triangle.weight;
        for (k, (terms, norm)) in piece.terms.iter().zip(triangle.norms()).enumerate() {
            let residual = (piece.here[k] - triangle.target(k)) * norm;
            for (first, &(i, g)) in terms.iter().enumerate() {
                let g = g * norm;
                program.linear[i as usize] += weight * g.dot(residual);
                program.quadratic.extend(terms[first..].iter().map(|&(j, h)| (i, j, weight * g.dot(h * norm))));
            }
        }
    }
    program
}
