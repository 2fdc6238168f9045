//! Assembly of matrices whose variables are affine expressions of free variables.
//!
//! Where each entry of a small matrix goes in the large one, and with which factor, is computed once. Each assembly is
//! then one pass over the small matrices.

use super::constraints;
use super::cut_graph::CutGraph;
use super::objective::PAIRS;
use crate::mesh::HalfedgeId;
use crate::solve::{Reduction, SparseHermitian};

/// Where the entries of small symmetric matrices go in a large one, and with which factors.
#[derive(Debug, Clone)]
pub(super) struct Scatter {
    /// The pattern of the large matrix, with values of zero.
    pub zero: SparseHermitian<f64>,
    /// For each small matrix its first contribution, followed by their total number.
    start: Vec<u32>,
    contributions: Vec<Contribution>,
}

/// One entry of a small matrix times a factor, added to one entry of the large matrix.
#[derive(Debug, Clone, Copy)]
struct Contribution {
    slot: u32,
    entry: u32,
    factor: f64,
}

/// Contributions being collected.
struct Collector {
    at: Vec<(u32, u32)>,
    start: Vec<u32>,
    contributions: Vec<Contribution>,
}

impl Scatter {
    /// For matrices of triangles in which u and v are not coupled: pairs of corners as in [`PAIRS`], of u and then of
    /// v.
    pub fn of_triangles(cut: &CutGraph, reduction: &Reduction) -> Self {
        let n_faces = cut.turn.len();
        let mut out = Collector::new(13 * n_faces);
        for f in 0..n_faces {
            for axis in 0..2 {
                let corners = [0, 1, 2].map(|i| {
                    let (variable, sign) = constraints::corner(cut, HalfedgeId::new(3 * f + i), axis);
                    (reduction.expression(variable as usize).0, sign)
                });
                for (entry, &(i, j)) in (6 * axis..).zip(&PAIRS) {
                    let ((row, s), (column, t)) = (corners[i], corners[j]);
                    out.expand(entry, row, column, i == j, s * t);
                }
            }
            out.close();
        }
        out.finish(reduction.n_free())
    }

    /// For full 6 × 6 matrices of triangles: the lower triangle, row by row, of u and then v of the corners.
    pub fn of_coupled_triangles(cut: &CutGraph, reduction: &Reduction) -> Self {
        let n_faces = cut.turn.len();
        let mut out = Collector::new(23 * n_faces);
        for f in 0..n_faces {
            let coordinates = [0, 1, 2, 3, 4, 5].map(|k| {
                let (variable, sign) = constraints::corner(cut, HalfedgeId::new(3 * f + k % 3), (k / 3) as u32);
                (reduction.expression(variable as usize).0, sign)
            });
            let pairs = (0..6).flat_map(|i| (0..=i).map(move |j| (i, j)));
            for (entry, (i, j)) in (0..).zip(pairs) {
                let ((row, s), (column, t)) = (coordinates[i], coordinates[j]);
                out.expand(entry, row, column, i == j, s * t);
            }
            out.close();
        }
        out.finish(reduction.n_free())
    }

    /// For the single entries of a matrix whose variables are expressed by `reduction`.
    pub fn of_matrix(matrix: &SparseHermitian<f64>, reduction: &Reduction) -> Self {
        let mut out = Collector::new(5 * matrix.n());
        for (r, c, _) in matrix.entries() {
            let [row, column] = [r, c].map(|x| reduction.expression(x as usize).0);
            out.expand(0, row, column, r == c, 1.0);
            out.close();
        }
        out.finish(reduction.n_free())
    }

    /// Adds the entries of small matrix `k` to `matrix`, which has the pattern of [`Self::zero`].
    #[inline]
    pub fn add(&self, k: usize, entries: &[f64], matrix: &mut SparseHermitian<f64>) {
        let values = matrix.values_mut();
        for contribution in &self.contributions[self.start[k] as usize..self.start[k + 1] as usize] {
            values[contribution.slot as usize] += contribution.factor * entries[contribution.entry as usize];
        }
    }
}

impl Collector {
    fn new(expected: usize) -> Self {
        Self { at: Vec::with_capacity(expected), start: vec![0], contributions: Vec::with_capacity(expected) }
    }

    /// Adds the contributions of an entry that couples two expressions, or an expression with itself, times `factor`.
    fn expand(&mut self, entry: u32, row: &[(u32, f64)], column: &[(u32, f64)], same: bool, factor: f64) {
        for (a, &(x, c)) in row.iter().enumerate() {
            // An expression times itself has each pair of variables twice; the matrix stores one of them. In the
            // product of two expressions, a variable times itself counts twice.
            let from = if same { a } else { 0 };
            for &(y, d) in &column[from..] {
                let twice = if !same && x == y { 2.0 } else { 1.0 };
                self.at.push((x, y));
                self.contributions.push(Contribution { slot: 0, entry, factor: twice * factor * c * d });
            }
        }
    }

    /// Ends a small matrix.
    fn close(&mut self) {
        self.start.push(self.contributions.len() as u32);
    }

    fn finish(mut self, n: usize) -> Scatter {
        let (zero, slot) = SparseHermitian::zero(n, self.at.len(), || self.at.iter().copied());
        for (contribution, slot) in self.contributions.iter_mut().zip(slot) {
            contribution.slot = slot;
        }
        Scatter { zero, start: self.start, contributions: self.contributions }
    }
}
