//! Stiffening: the weights of folded triangles and of those around them grow until the least-squares solution folds
//! no more, at the price of a larger residual (Bommes, Zimmer and Kobbelt, Mixed-Integer Quadrangulation, section
//! 5.3; Campen, section 6.5). It finds no map where there is none, but it lessens folds where constraints cannot.

use glam::DVec2;

use super::OrientationProblem;
use super::domain::Neighbours;
use crate::progress::{Cancelled, Progress};
use crate::solve::{SparseHermitian, SpdSymbolic};

/// Rounds of solving; what has not unfolded by then is held by constraints.
const ROUNDS: usize = 12;
/// By how much the weight of a folded triangle grows in a round.
const GROWTH: f64 = 3.0;
/// Rings around folds in which the growth fades out, halved from one to the next, so that no fold moves next door.
const RINGS: u32 = 4;

/// The free variables of the stiffened solution of fewest folds; `None` if the system cannot be solved.
pub(super) fn stiffen(
    problem: &OrientationProblem,
    neighbours: &Neighbours,
    spared: &[bool],
    progress: &Progress,
) -> Result<Option<Vec<f64>>, Cancelled> {
    let mut factor = vec![1.0; problem.triangles.len()];
    let mut best: Option<(usize, Vec<f64>)> = None;
    let mut symbolic: Option<SpdSymbolic> = None;
    for _ in 0..ROUNDS {
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
        let folded: Vec<u32> = problem.folded(&x).into_iter().filter(|&t| !spared[t as usize]).collect();
        let count = folded.len();
        let distance = neighbours.distance(problem, &folded, RINGS);
        if best.as_ref().is_none_or(|b| count < b.0) {
            best = Some((count, solution));
        }
        if count == 0 {
            break;
        }
        for (factor, d) in factor.iter_mut().zip(distance).filter(|(_, d)| *d <= RINGS) {
            *factor *= 1.0 + (GROWTH - 1.0) * 0.5f64.powi(d as i32);
        }
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
            // What the variables have to make up for.
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
    fn weights_trade_energy_for_folds() {
        let sheet = dragged(12);
        let problem = sheet.problem();
        let y = solved(&problem);
        let before = problem.folded(&problem.reduction.expand(&y)).len();
        let spared = vec![false; problem.triangles.len()];
        let stiff = stiffen(&problem, &Neighbours::new(&problem), &spared, &Progress::new()).unwrap().unwrap();
        let after = problem.folded(&problem.reduction.expand(&stiff)).len();
        assert!(before > 0 && after < before, "{before} {after}");
        assert!(problem.energy(&stiff) > problem.energy(&y));
    }
}
