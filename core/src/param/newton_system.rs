//! The matrices of Newton's method for an energy that couples u and v.

use std::sync::Arc;

use super::assembly::Scatter;
use crate::solve::{Reduction, SolveError, SparseHermitian, SpdSymbolic};

/// Relative increase of the diagonal, so that a semidefinite Hessian becomes definite beyond rounding errors.
const DIAGONAL_RAISE: f64 = 1e-9;

/// First and second derivatives of the energy of a triangle by its corner coordinates.
pub(super) struct TriangleDerivatives {
    pub gradient: [f64; 6],
    /// The lower triangle, row by row, in the order u of the corners, v of the corners.
    pub hessian: [f64; 21],
}

/// Assembly and symbolic factorisation of the Hessians of one [`SeamlessSystem`](super::SeamlessSystem).
#[derive(Debug, Clone)]
pub struct NewtonSystem {
    /// Assembly of the matrix of the seam-free variables from triangle matrices.
    triangles: Arc<Scatter>,
    /// Assembly of the matrix of the free variables from that of the seam-free variables.
    reduced: Scatter,
    symbolic: SpdSymbolic,
}

impl NewtonSystem {
    /// For triangle matrices assembled by `triangles` and constraints eliminated by `reduction`.
    pub(super) fn new(triangles: Arc<Scatter>, reduction: &Reduction) -> Result<Self, SolveError> {
        let reduced = Scatter::of_matrix(&triangles.zero, reduction);
        let symbolic = SpdSymbolic::new(&reduced.zero)?;
        Ok(Self { triangles, reduced, symbolic })
    }

    /// Assembly of the matrix of the seam-free variables from triangle matrices.
    pub(super) fn scatter(&self) -> Arc<Scatter> {
        self.triangles.clone()
    }

    /// The Hessian of the free variables, made positive definite.
    pub(super) fn matrix(&self, triangles: &[TriangleDerivatives]) -> SparseHermitian<f64> {
        let mut seam_free = self.triangles.zero.clone();
        for (f, triangle) in triangles.iter().enumerate() {
            self.triangles.add(f, &triangle.hessian, &mut seam_free);
        }
        let mut matrix = self.reduced.zero.clone();
        for (k, (_, _, value)) in seam_free.entries().enumerate() {
            self.reduced.add(k, &[value], &mut matrix);
        }
        matrix.raise_diagonal(DIAGONAL_RAISE);
        matrix
    }

    /// The Newton direction: solves `matrix · direction = downhill`.
    pub(super) fn solve(&self, matrix: &SparseHermitian<f64>, downhill: &[f64]) -> Result<Vec<f64>, SolveError> {
        self.symbolic.factor(matrix).and_then(|f| f.solve(matrix, downhill))
    }
}
