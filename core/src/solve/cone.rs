//! Convex quadratic programs with constraints that put small vectors into circular cones.
//!
//! Minimised is `½ xᵀPx + qᵀx` such that for every constraint of three affine expressions the first is at least the
//! length of the vector of the other two. Solved by an interior point method (clarabel) on one thread: the same bits
//! whatever the machine.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use crate::progress::{Cancelled, Progress};

/// Iterations after which a program is given up; those that have a solution take 10 to 30.
const MAX_ITERATIONS: u32 = 100;
/// Programs of fewer constraints end before anybody could cancel them.
const WATCHED_ABOVE: usize = 2000;
/// How often the wish to stop is looked at while a program is solved.
const WATCH_EVERY: Duration = Duration::from_millis(5);

/// `Σ cᵢ xᵢ + constant`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Affine {
    /// Variables, none twice, and their coefficients.
    pub terms: Vec<(u32, f64)>,
    /// What is added.
    pub constant: f64,
}

/// A convex quadratic program over cones.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ConeProgram {
    /// Entries of the positive semidefinite `P` as (row, column, value), on and above the diagonal; equal places are
    /// summed.
    pub quadratic: Vec<(u32, u32, f64)>,
    /// The vector `q`, one entry per variable.
    pub linear: Vec<f64>,
    /// Constraints: the first expression is at least the length of the vector of the other two.
    pub cones: Vec<[Affine; 3]>,
}

impl ConeProgram {
    /// The minimiser; `None` if there is none or it could not be found. What comes back is to be checked by who
    /// needs the constraints to hold: they do so up to about 1e-8, for programs whose numbers are of the order of 1.
    ///
    /// # Errors
    ///
    /// [`Cancelled`].
    pub fn minimise(&self, progress: &Progress) -> Result<Option<Vec<f64>>, Cancelled> {
        progress.check()?;
        if self.cones.len() < WATCHED_ABOVE {
            return Ok(self.run(&Arc::new(AtomicBool::new(false))));
        }
        let stop = Arc::new(AtomicBool::new(false));
        let x = std::thread::scope(|scope| {
            let worker = scope.spawn(|| self.run(&stop));
            while !worker.is_finished() {
                stop.store(progress.is_cancelled(), Ordering::Relaxed);
                std::thread::sleep(WATCH_EVERY);
            }
            worker.join().unwrap_or_default()
        });
        progress.check()?;
        Ok(x)
    }

    fn run(&self, stop: &Arc<AtomicBool>) -> Option<Vec<f64>> {
        let n = self.linear.len();
        let quadratic = matrix(n, n, self.quadratic.iter().map(|&(r, c, v)| (r as usize, c as usize, v)));
        // The solver wants `b − A x` in the cone.
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

    /// The point of a disc of radius 1 about the origin that is nearest to (3, 4), in halves of P to test summation.
    fn disc(radius: f64) -> ConeProgram {
        ConeProgram {
            quadratic: vec![(0, 0, 0.5), (1, 1, 1.0), (0, 0, 0.5)],
            linear: vec![-3.0, -4.0],
            cones: vec![[affine(&[], radius), affine(&[(0, 1.0)], 0.0), affine(&[(1, 1.0)], 0.0)]],
        }
    }

    #[test]
    fn the_nearest_point_of_a_disc_is_found() {
        let x = disc(1.0).minimise(&Progress::new()).unwrap().unwrap();
        assert!((x[0] - 0.6).abs() < 1e-6 && (x[1] - 0.8).abs() < 1e-6, "{x:?}");
    }

    #[test]
    fn what_cannot_be_satisfied_has_no_solution() {
        assert_eq!(disc(-1.0).minimise(&Progress::new()), Ok(None));
    }

    #[test]
    fn cancelled_work_ends() {
        let progress = Progress::new();
        progress.cancel();
        assert_eq!(disc(1.0).minimise(&progress), Err(Cancelled));
    }
}
