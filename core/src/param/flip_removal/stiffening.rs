//! The least-squares solution with stiffened flipped triangles; see [`Stiffening`].

use glam::DVec2;

use super::domain::Neighbours;
use super::problem::OrientationProblem;
use crate::param::stiffening::Stiffening;
use crate::progress::{Cancelled, Progress};
use crate::solve::{SparseHermitian, SpdSymbolic};

/// Largest number of solves. Constraints force the flips that remain after them.
const MAX_ROUNDS: usize = 12;
/// Rounds without fewer flipped triangles after which stiffening stops.
const PATIENCE: usize = 4;
/// The weight of a flipped triangle triples in a round; the growth halves from ring to ring.
const STIFFENING: Stiffening = Stiffening { growth: 2.0, fading: 0.5, rings: 4, limit: f64::INFINITY };

/// The free variables of the stiffened solution with the fewest flipped triangles, those in `spared` not counted.
/// `None` if the system cannot be solved.
pub(super) fn stiffen(
    problem: &OrientationProblem,
    neighbours: &Neighbours,
    spared: &[bool],
    progress: &Progress,
) -> Result<Option<Vec<f64>>, Cancelled> {
    let mut factor = vec![1.0; problem.triangles.len()];
    let mut best: Option<(usize, Vec<f64>)> = None;
    let mut symbolic: Option<SpdSymbolic> = None;
    let mut since = 0;
    for _ in 0..MAX_ROUNDS {
        progress.check()?;
        let (matrix, rhs) = assemble(problem, &factor);
        if symbolic.is_none() {
            symbolic = SpdSymbolic::new(&matrix).ok();
        }
        let Some(solution) =
            symbolic.as_ref().and_then(|s| s.factor(&matrix).ok()).and_then(|f| f.solve(&matrix, &rhs).ok())
        else {
            break;
        };
        let x = problem.reduction.expand(&solution);
        let flipped: Vec<u32> = problem.flipped(&x).into_iter().filter(|&t| !spared[t as usize]).collect();
        let count = flipped.len();
        let distance = neighbours.distance(problem, &flipped, STIFFENING.rings);
        if best.as_ref().is_none_or(|b| count < b.0) {
            best = Some((count, solution));
            since = 0;
        }
        since += 1;
        if count == 0 || since > PATIENCE {
            break;
        }
        STIFFENING.raise(&distance, &mut factor);
    }
    Ok(best.map(|b| b.1))
}

/// The normal equations of the energy with each triangle's weight multiplied by its factor.
pub(super) fn assemble(problem: &OrientationProblem, factor: &[f64]) -> (SparseHermitian<f64>, Vec<f64>) {
    let n = problem.reduction.n_free();
    let (mut triplets, mut rhs) = (Vec::with_capacity(14 * problem.triangles.len()), vec![0.0; n]);
    for (triangle, factor) in problem.triangles.iter().zip(factor) {
        let weight = triangle.weight * factor;
        let hats = triangle.hats();
        for (k, norm) in triangle.norms().into_iter().enumerate() {
            let rows: Vec<_> = (0..3)
                .map(|i| {
                    let (variable, sign) = triangle.corners[i][k];
                    let (terms, constant) = problem.reduction.expression(variable as usize);
                    (hats[i] * norm * sign, terms, constant)
                })
                .collect();
            // The constant terms of the expressions move to the right-hand side.
            let fixed = rows.iter().map(|&(hat, _, constant)| hat * constant).sum::<DVec2>();
            let residual = triangle.target(k) * norm - fixed;
            for &(hat, terms, _) in &rows {
                for &(y, a) in terms {
                    rhs[y as usize] += weight * a * hat.dot(residual);
                    for &(other, others, _) in &rows {
                        let below = others.iter().filter(|&&(z, _)| z <= y);
                        triplets.extend(below.map(|&(z, b)| (y, z, weight * a * b * hat.dot(other))));
                    }
                }
            }
        }
    }
    (SparseHermitian::from_triplets(n, &triplets), rhs)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{dragged, solved};
    use super::*;

    #[test]
    fn stiffening_removes_flips_and_raises_the_energy() {
        let sheet = dragged(12);
        let problem = sheet.problem();
        let y = solved(&problem);
        let before = problem.flipped(&problem.reduction.expand(&y)).len();
        let spared = vec![false; problem.triangles.len()];
        let stiff = stiffen(&problem, &Neighbours::new(&problem), &spared, &Progress::new()).unwrap().unwrap();
        let after = problem.flipped(&problem.reduction.expand(&stiff)).len();
        assert!(before > 0 && after < before, "{before} {after}");
        assert!(problem.energy(&stiff) > problem.energy(&y));
    }
}
