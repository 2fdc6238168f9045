//! Assembling matrices whose variables are expressions of others: worked out once, added up as often as wanted.

use super::constraints;
use super::cut::Cut;
use super::objective::PAIRS;
use crate::mesh::HalfedgeId;
use crate::solve::{Reduction, SparseHermitian};

/// Where the entries of small symmetric matrices go in a large one.
#[derive(Debug, Clone)]
pub(super) struct Scatter {
    /// The large matrix without values.
    pub zero: SparseHermitian<f64>,
    /// Of each small matrix, the first of its shares; and their number.
    start: Vec<u32>,
    shares: Vec<Share>,
}

/// One entry of a small matrix times a factor, to be added to one of the large.
#[derive(Debug, Clone, Copy)]
struct Share {
    slot: u32,
    entry: u32,
    factor: f64,
}

/// Shares being collected.
struct Collector {
    at: Vec<(u32, u32)>,
    start: Vec<u32>,
    shares: Vec<Share>,
}

impl Scatter {
    /// For the triangles' shares: pairs of corners as in [`PAIRS`], of u and then of v.
    pub fn of_triangles(cut: &Cut, reduction: &Reduction) -> Self {
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

    /// For the triangles' whole shares: the lower triangle, row by row, of u and then v of the corners.
    pub fn of_whole_triangles(cut: &Cut, reduction: &Reduction) -> Self {
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

    /// For the single entries of a matrix, of which each variable is expressed by `reduction`.
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
        for share in &self.shares[self.start[k] as usize..self.start[k + 1] as usize] {
            values[share.slot as usize] += share.factor * entries[share.entry as usize];
        }
    }
}

impl Collector {
    fn new(expected: usize) -> Self {
        Self { at: Vec::with_capacity(expected), start: vec![0], shares: Vec::with_capacity(expected) }
    }

    /// An entry that couples two expressions times `factor`, or an expression with itself.
    fn expand(&mut self, entry: u32, row: &[(u32, f64)], column: &[(u32, f64)], same: bool, factor: f64) {
        for (a, &(x, c)) in row.iter().enumerate() {
            // An expression with itself meets each pair of variables twice, of which one is stored; of two
            // expressions, one variable meets itself twice.
            let from = if same { a } else { 0 };
            for &(y, d) in &column[from..] {
                let twice = if !same && x == y { 2.0 } else { 1.0 };
                self.at.push((x, y));
                self.shares.push(Share { slot: 0, entry, factor: twice * factor * c * d });
            }
        }
    }

    /// Ends a small matrix.
    fn close(&mut self) {
        self.start.push(self.shares.len() as u32);
    }

    fn finish(mut self, n: usize) -> Scatter {
        let (zero, slot) = SparseHermitian::zero(n, self.at.len(), || self.at.iter().copied());
        for (share, slot) in self.shares.iter_mut().zip(slot) {
            share.slot = slot;
        }
        Scatter { zero, start: self.start, shares: self.shares }
    }
}
