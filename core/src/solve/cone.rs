//! Convex quadratic programs over second-order cones of dimension three.
//!
//! Minimised is `½ xᵀPx + qᵀx` subject to `√(b² + c²) ≤ a` for given triples of affine expressions `a, b, c`. Solved by an
//! interior-point method (clarabel) on one thread, so that results do not depend on the number of cores.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use crate::progress::{Cancelled, Progress};

/// Most iterations; programs with a solution take 10 to 30.
const MAX_ITERATIONS: u32 = 100;
/// Number of constraints from which on cancellation is checked while solving; smaller programs end before anyone could cancel
/// them.
const CANCELLABLE_FROM: usize = 2000;
/// Time between checks for cancellation.
const CHECK_INTERVAL: Duration = Duration::from_millis(5);

/// `Σ cᵢ xᵢ + constant`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Affine {
    /// Variables and their coefficients; no variable twice.
    pub terms: Vec<(u32, f64)>,
    /// The constant.
    pub constant: f64,
}

/// A convex quadratic program over second-order cones.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ConeProgram {
    /// Entries of the positive semidefinite matrix `P` on and above the diagonal, as (row, column, value); entries of equal
    /// row and column are summed.
    pub quadratic: Vec<(u32, u32, f64)>,
    /// The vector `q`, one entry per variable.
    pub linear: Vec<f64>,
    /// Constraints: the first expression is at least the length of the vector of the other two.
    pub cones: Vec<[Affine; 3]>,
}

impl ConeProgram {
    /// The minimiser; `None` if there is none or the method did not converge. Constraints hold up to about 1e-8 if the
    /// numbers of the program are of the order of 1; a caller that depends on them must check.
    ///
    /// # Errors
    ///
    /// [`Cancelled`].
    pub fn minimise(&self, progress: &Progress) -> Result<Option<Vec<f64>>, Cancelled> {
        progress.check()?;
        if self.cones.len() < CANCELLABLE_FROM {
            return Ok(self.run(&Arc::new(AtomicBool::new(false))));
        }
        let stop = Arc::new(AtomicBool::new(false));
        let x = std::thread::scope(|scope| {
            let worker = scope.spawn(|| self.run(&stop));
            while !worker.is_finished() {
                stop.store(progress.is_cancelled(), Ordering::Relaxed);
                std::thread::sleep(CHECK_INTERVAL);
            }
            worker.join().unwrap_or_default()
        });
        progress.check()?;
        Ok(x)
    }

    /// Solves until `stop` is set.
    fn run(&self, stop: &Arc<AtomicBool>) -> Option<Vec<f64>> {
        let n = self.linear.len();
        let quadratic = matrix(n, n, self.quadratic.iter().map(|&(r, c, v)| (r as usize, c as usize, v)));
        // In the form of the solver, `b − A x` lies in the cone.
        let rows = self.cones.iter().flatten().enumerate();
        let negated = rows.flat_map(|(i, row)| row.terms.iter().map(move |&(x, c)| (i, x as usize, -c)));
        let conic = matrix(3 * self.cones.len(), n, negated);
        let constant: Vec<f64> = self.cones.iter().flatten().map(|row| row.constant).collect();
        let cones = vec![SupportedConeT::SecondOrderConeT(3); self.cones.len()];
        let settings = DefaultSettings {
            verbose: false,
            max_iter: MAX_ITERATIONS,
            max_threads: 1,
            direct_solve_method: "qdldl".to_owned(),
            ..Default::default()
        };
        let mut solver = DefaultSolver::new(&quadratic, &self.linear, &conic, &constant, &cones, settings).ok()?;
        let stop = Arc::clone(stop);
        solver.set_termination_callback(move |_: &_| stop.load(Ordering::Relaxed));
        solver.solve();
        let solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        (solved && solver.solution.x.iter().all(|x| x.is_finite())).then_some(solver.solution.x)
    }
}

/// An `m` by `n` matrix of its entries.
fn matrix(m: usize, n: usize, entries: impl Iterator<Item = (usize, usize, f64)>) -> CscMatrix<f64> {
    let (mut rows, mut columns, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for (r, c, v) in entries {
        rows.push(r);
        columns.push(c);
        values.push(v);
    }
    CscMatrix::new_from_triplets(m, n, rows, columns, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn affine(terms: &[(u32, f64)], constant: f64) -> Affine {
        Affine { terms: terms.to_vec(), constant }
    }

    /// The point of a disc around the origin that is closest to (3, 4). One entry of P is given in two halves.
    fn disc(radius: f64) -> ConeProgram {
        ConeProgram {
            quadratic: vec![(0, 0, 0.5), (1, 1, 1.0), (0, 0, 0.5)],
            linear: vec![-3.0, -4.0],
            cones: vec![[affine(&[], radius), affine(&[(0, 1.0)], 0.0), affine(&[(1, 1.0)], 0.0)]],
        }
    }

    #[test]
    fn the_closest_point_of_a_disc_is_found() {
        let x = disc(1.0).minimise(&Progress::new()).unwrap().unwrap();
        assert!((x[0] - 0.6).abs() < 1e-6 && (x[1] - 0.8).abs() < 1e-6, "{x:?}");
    }

    #[test]
    fn infeasible_programs_have_no_solution() {
        assert_eq!(disc(-1.0).minimise(&Progress::new()), Ok(None));
    }

    #[test]
    fn cancellation_is_an_error() {
        let progress = Progress::new();
        progress.cancel();
        assert_eq!(disc(1.0).minimise(&progress), Err(Cancelled));
    }
}
