//! Sparse Hermitian positive definite systems, real or complex, by Cholesky factorisation (faer).
//!
//! A matrix is assembled from triplets of its lower triangle. The symbolic analysis (fill-reducing order, supernodes) is made
//! once per pattern, the factorisation once per change of values. The residual of every solution is checked; if it is too
//! large, one step of iterative refinement is made, and if it is still too large, the result is an error. Factorisation runs
//! on one thread, so that results do not depend on the number of cores.

use std::ops::{AddAssign, Mul, Sub};
use std::sync::Arc;

pub use faer::c64;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::ComplexField;
use faer::{Conj, MatMut, Par, Side};
use thiserror::Error;

/// Relative residual (maximum norm) above which a solution is refined; chosen by hand.
const REFINE_ABOVE: f64 = 1e-11;
/// Relative residual (maximum norm) above which a solution is an error: far above that of well-conditioned systems, far below
/// a visible error. Chosen by hand.
const REFUSE_ABOVE: f64 = 1e-5;

/// Why a system could not be solved.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// An entry of the matrix or the right-hand side is not a finite number.
    #[error("the linear system has an entry that is not finite")]
    NotFinite,
    /// A pivot is not positive.
    #[error("the matrix is not positive definite (unknown {unknown})")]
    NotPositiveDefinite {
        /// The unknown whose pivot failed, in the order of elimination.
        unknown: usize,
    },
    /// The system needs more memory or larger indices than there are.
    #[error("the linear system is too large: {0}")]
    TooLarge(String),
    /// The pattern is not the analysed one, or a right-hand side has the wrong length.
    #[error("the linear system does not have the size or pattern that was analysed")]
    WrongShape,
    /// The residual of the solution is too large.
    #[error("the solution of the linear system has a relative residual of {residual:e}")]
    Residual {
        /// Residual over right-hand side, in the maximum norm.
        residual: f64,
    },
}

/// A field of numbers: real or complex.
pub trait Scalar: ComplexField + Copy + AddAssign + Sub<Output = Self> + Mul<Output = Self> {
    /// Zero.
    const ZERO: Self;
    /// The complex conjugate.
    fn conjugate(self) -> Self;
    /// The absolute value.
    fn magnitude(self) -> f64;
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    fn conjugate(self) -> Self {
        self
    }
    fn magnitude(self) -> f64 {
        self.abs()
    }
}

impl Scalar for c64 {
    const ZERO: Self = Self { re: 0.0, im: 0.0 };
    fn conjugate(self) -> Self {
        self.conj()
    }
    fn magnitude(self) -> f64 {
        self.norm()
    }
}

/// The lower triangle of a sparse Hermitian matrix, in compressed columns with ascending rows.
#[derive(Debug, Clone)]
pub struct SparseHermitian<T> {
    col_start: Vec<u32>,
    row: Vec<u32>,
    value: Vec<T>,
}

impl SparseHermitian<f64> {
    /// Multiplies every stored diagonal entry by `1 + share`.
    pub fn raise_diagonal(&mut self, share: f64) {
        for c in 0..self.n() {
            let first = self.col_start[c] as usize;
            if first < self.col_start[c + 1] as usize && self.row[first] as usize == c {
                self.value[first] *= 1.0 + share;
            }
        }
    }
}

impl<T: Scalar> SparseHermitian<T> {
    /// The `n` by `n` matrix of `triplets` (row, column, value), summed in the order given. An entry above the diagonal stands
    /// for its conjugate below, so that each pair of off-diagonal entries is to be given once.
    pub fn from_triplets(n: usize, triplets: &[(u32, u32, T)]) -> Self {
        let (mut matrix, slot) = Self::zero(n, triplets.len(), || triplets.iter().map(|&(r, c, _)| (r, c)));
        for (&(r, c, v), k) in triplets.iter().zip(slot) {
            matrix.value[k as usize] += if r >= c { v } else { v.conjugate() };
        }
        matrix
    }

    /// The zero `n` by `n` matrix with the pattern of `count` entries (row, column), and the index of each of these in
    /// [`Self::values_mut`]. An entry above the diagonal has the index of its mirror image.
    pub fn zero<I>(n: usize, count: usize, entries: impl Fn() -> I) -> (Self, Vec<u32>)
    where
        I: Iterator<Item = (u32, u32)>,
    {
        let mut start = vec![0u32; n + 1];
        for (r, c) in entries() {
            start[r.min(c) as usize + 1] += 1;
        }
        for c in 0..n {
            start[c + 1] += start[c];
        }
        let mut fill = start.clone();
        // Row and number of each entry, column by column.
        let mut sorted = vec![(0u32, 0u32); count];
        for (k, (r, c)) in (0u32..).zip(entries()) {
            let next = &mut fill[r.min(c) as usize];
            sorted[*next as usize] = (r.max(c), k);
            *next += 1;
        }
        let mut matrix = Self { col_start: vec![0], row: Vec::with_capacity(count / 2), value: Vec::new() };
        let mut slot = vec![0; count];
        for c in 0..n {
            let column = &mut sorted[start[c] as usize..start[c + 1] as usize];
            column.sort_unstable();
            let first = matrix.row.len();
            for &(r, k) in column.iter() {
                if matrix.row.len() == first || matrix.row.last() != Some(&r) {
                    matrix.row.push(r);
                }
                slot[k as usize] = matrix.row.len() as u32 - 1;
            }
            matrix.col_start.push(matrix.row.len() as u32);
        }
        matrix.value = vec![T::ZERO; matrix.row.len()];
        (matrix, slot)
    }

    /// Row, column and value of the stored entries, in the order of [`Self::values_mut`].
    pub fn entries(&self) -> impl Iterator<Item = (u32, u32, T)> {
        let column = |c: usize| self.col_start[c] as usize..self.col_start[c + 1] as usize;
        (0..self.n()).flat_map(move |c| column(c).map(move |k| (self.row[k], c as u32, self.value[k])))
    }

    /// The values of the stored entries.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.value
    }

    /// Whether both have the same pattern, so that one [`SpdSymbolic`] serves both.
    pub fn same_pattern<U>(&self, other: &SparseHermitian<U>) -> bool {
        self.col_start == other.col_start && self.row == other.row
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.col_start.len() - 1
    }

    /// The product with `x`.
    pub fn multiply(&self, x: &[T]) -> Vec<T> {
        let mut y = vec![T::ZERO; x.len()];
        for c in 0..self.n() {
            for k in self.col_start[c] as usize..self.col_start[c + 1] as usize {
                let (r, v) = (self.row[k] as usize, self.value[k]);
                y[r] += v * x[c];
                if r != c {
                    y[c] += v.conjugate() * x[r];
                }
            }
        }
        y
    }

    fn pattern(&self) -> SymbolicSparseColMatRef<'_, u32> {
        SymbolicSparseColMatRef::new_checked(self.n(), self.n(), &self.col_start, None, &self.row)
    }
}

/// The symbolic analysis of a pattern: a fill-reducing order and the pattern of the factor.
#[derive(Debug, Clone)]
pub struct SpdSymbolic {
    inner: Arc<SymbolicCholesky<u32>>,
    entries: usize,
}

impl SpdSymbolic {
    /// Analyses the pattern of `matrix`; the result serves every matrix of the same pattern.
    ///
    /// # Errors
    ///
    /// [`SolveError::TooLarge`].
    pub fn new<T: Scalar>(matrix: &SparseHermitian<T>) -> Result<Self, SolveError> {
        // On meshes of ten thousand vertices supernodal factorisation is many times faster; on small ones the two hardly
        // differ.
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let inner = factorize_symbolic_cholesky(matrix.pattern(), Side::Lower, SymmetricOrdering::Amd, params)
            .map_err(|e| SolveError::TooLarge(e.to_string()))?;
        Ok(Self { inner: Arc::new(inner), entries: matrix.row.len() })
    }

    /// Factors `matrix`, which must have the analysed pattern.
    ///
    /// # Errors
    ///
    /// All but [`SolveError::Residual`].
    pub fn factor<T: Scalar>(&self, matrix: &SparseHermitian<T>) -> Result<SpdFactor<T>, SolveError> {
        if matrix.n() != self.inner.nrows() || matrix.row.len() != self.entries {
            return Err(SolveError::WrongShape);
        }
        if matrix.value.iter().any(|v| !v.magnitude().is_finite()) {
            return Err(SolveError::NotFinite);
        }
        let mut values = vec![T::ZERO; self.inner.len_val()];
        let scratch = self.inner.factorize_numeric_llt_scratch::<T>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| SolveError::TooLarge("out of memory".into()))?;
        self.inner
            .factorize_numeric_llt(
                &mut values,
                SparseColMatRef::new(matrix.pattern(), &matrix.value),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|LltError::NonPositivePivot { index }| SolveError::NotPositiveDefinite { unknown: index })?;
        Ok(SpdFactor { symbolic: self.clone(), values })
    }
}

/// The Cholesky factor of a matrix.
#[derive(Debug, Clone)]
pub struct SpdFactor<T> {
    symbolic: SpdSymbolic,
    values: Vec<T>,
}

impl<T: Scalar> SpdFactor<T> {
    /// Analyses and factors.
    ///
    /// # Errors
    ///
    /// Those of [`SpdSymbolic::new`] and [`SpdSymbolic::factor`].
    pub fn new(matrix: &SparseHermitian<T>) -> Result<Self, SolveError> {
        SpdSymbolic::new(matrix)?.factor(matrix)
    }

    /// Solves `matrix x = rhs`, where `matrix` is the one that was factored.
    ///
    /// # Errors
    ///
    /// [`SolveError::WrongShape`], [`SolveError::NotFinite`] or [`SolveError::Residual`].
    pub fn solve(&self, matrix: &SparseHermitian<T>, rhs: &[T]) -> Result<Vec<T>, SolveError> {
        if rhs.len() != matrix.n() || matrix.n() != self.symbolic.inner.nrows() {
            return Err(SolveError::WrongShape);
        }
        let scale = max_norm(rhs);
        if !scale.is_finite() {
            return Err(SolveError::NotFinite);
        }
        let mut x = rhs.to_vec();
        if scale == 0.0 {
            return Ok(x);
        }
        self.substitute(&mut x);
        let mut rest = residual(matrix, &x, rhs);
        if max_norm(&rest) > REFINE_ABOVE * scale {
            self.substitute(&mut rest);
            for (x, d) in x.iter_mut().zip(&rest) {
                *x += *d;
            }
            rest = residual(matrix, &x, rhs);
        }
        let residual = max_norm(&rest) / scale;
        if residual <= REFUSE_ABOVE { Ok(x) } else { Err(SolveError::Residual { residual }) }
    }

    /// Forward and backward substitution in place.
    fn substitute(&self, x: &mut [T]) {
        let inner = &*self.symbolic.inner;
        if x.is_empty() {
            return;
        }
        let mut memory = MemBuffer::new(inner.solve_in_place_scratch::<T>(1, Par::Seq));
        let n = x.len();
        LltRef::new(inner, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }
}

/// `rhs − matrix x`.
fn residual<T: Scalar>(matrix: &SparseHermitian<T>, x: &[T], rhs: &[T]) -> Vec<T> {
    matrix.multiply(x).iter().zip(rhs).map(|(&y, &b)| b - y).collect()
}

/// The largest magnitude; NaN if any is NaN.
fn max_norm<T: Scalar>(x: &[T]) -> f64 {
    x.iter().map(|v| v.magnitude()).fold(0.0, |m, v| if v > m || v.is_nan() { v } else { m })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Laplacian of a path of `n` nodes, grounded at its first.
    fn path(n: u32) -> Vec<(u32, u32, f64)> {
        let mut t = vec![(0, 0, 1.0)];
        for i in 1..n {
            t.extend([(i - 1, i - 1, 1.0), (i, i, 1.0), (i, i - 1, -1.0)]);
        }
        t
    }

    #[test]
    fn a_real_system_is_solved() {
        let m = SparseHermitian::from_triplets(50, &path(50));
        let mut rhs = vec![0.0; 50];
        rhs[49] = 1.0;
        let x = SpdFactor::new(&m).unwrap().solve(&m, &rhs).unwrap();
        // Unit flow from the grounded end: the potential rises by one per link.
        for (i, x) in x.iter().enumerate() {
            assert!((x - (i + 1) as f64).abs() < 1e-9);
        }
    }

    #[test]
    fn a_complex_system_is_solved_with_a_reused_analysis() {
        let z = c64::new(0.6, 0.8);
        let t = |s: f64| {
            vec![
                (0, 0, c64::new(3.0 * s, 0.0)),
                (1, 0, z),
                (1, 1, c64::new(2.0, 0.0)),
                (1, 2, z),
                (2, 2, c64::new(4.0, 0.0)),
            ]
        };
        let first = SparseHermitian::from_triplets(3, &t(1.0));
        let symbolic = SpdSymbolic::new(&first).unwrap();
        for s in [1.0, 2.0] {
            let m = SparseHermitian::from_triplets(3, &t(s));
            let want = [c64::new(1.0, -1.0), c64::new(0.5, 2.0), c64::new(0.0, 3.0)];
            let rhs = m.multiply(&want);
            // Row 2 of the product, from the entry given above the diagonal.
            assert!((rhs[2] - (z.conj() * want[1] + want[2] * 4.0)).norm() < 1e-12);
            let x = symbolic.factor(&m).unwrap().solve(&m, &rhs).unwrap();
            assert!(x.iter().zip(want).all(|(a, b)| (a - b).norm() < 1e-12));
        }
    }

    #[test]
    fn systems_without_a_solution_are_errors() {
        let indefinite = SparseHermitian::from_triplets(2, &[(0, 0, 1.0), (1, 0, 2.0), (1, 1, 1.0)]);
        assert!(matches!(SpdFactor::new(&indefinite), Err(SolveError::NotPositiveDefinite { .. })));
        let broken = SparseHermitian::from_triplets(1, &[(0, 0, f64::NAN)]);
        assert_eq!(SpdFactor::new(&broken).err(), Some(SolveError::NotFinite));
        let m = SparseHermitian::from_triplets(3, &path(3));
        let f = SpdFactor::new(&m).unwrap();
        assert_eq!(f.solve(&m, &[1.0, f64::INFINITY, 0.0]), Err(SolveError::NotFinite));
        assert_eq!(f.solve(&m, &[1.0]), Err(SolveError::WrongShape));
        let other = SparseHermitian::from_triplets(3, &path(2));
        assert_eq!(SpdSymbolic::new(&m).unwrap().factor(&other).err(), Some(SolveError::WrongShape));
    }
}
