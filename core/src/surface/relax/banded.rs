//! Symmetric positive definite systems with a narrow band, or with a cyclic one.
//!
//! In a cyclic system unknown `i` is coupled to `i ± 1` and `i ± 2` modulo `n`. The unknowns are reordered as 0, n−1,
//! 1, n−2, … so that coupled ones are at most 4 apart: the matrix is banded, without the corner entries of the cyclic
//! order.

/// Entries left of the diagonal: 4 for a reordered cyclic system with couplings up to distance 2.
const BAND: usize = 4;

/// The matrix, as rows of its lower band.
#[derive(Debug)]
pub(super) struct Banded {
    /// `rows[p][k]` is the entry in column `p − k`.
    rows: Vec<[f64; BAND + 1]>,
    cyclic: bool,
}

impl Banded {
    /// A zero matrix over `n` unknowns.
    pub fn new(n: usize, cyclic: bool) -> Self {
        Self { rows: vec![[0.0; BAND + 1]; n], cyclic }
    }

    /// Sets all entries to zero.
    pub fn clear(&mut self) {
        self.rows.fill([0.0; BAND + 1]);
    }

    /// The row of unknown `i`.
    fn row(&self, i: usize) -> usize {
        let n = self.rows.len();
        match self.cyclic {
            false => i,
            true if i < n.div_ceil(2) => 2 * i,
            true => 2 * (n - i) - 1,
        }
    }

    /// Adds `weight · g gᵀ`, where `g` has these entries `(unknown, value)` at unknowns at most 2 apart.
    pub fn add_outer(&mut self, g: &[(usize, f64)], weight: f64) {
        for &(i, a) in g {
            for &(j, b) in g {
                let (p, q) = (self.row(i), self.row(j));
                if p >= q {
                    self.rows[p][p - q] += weight * a * b;
                }
            }
        }
    }

    /// Solves for the unknowns that are `free`; the others are 0. Diagonal entries are multiplied by `1 + damping`.
    /// `None` where the matrix is not positive definite.
    pub fn solve(&self, rhs: &[f64], free: &[bool], damping: f64) -> Option<Vec<f64>> {
        let n = self.rows.len();
        let mut on = vec![false; n];
        let mut x = vec![0.0; n];
        for i in 0..n {
            let p = self.row(i);
            on[p] = free[i];
            x[p] = if free[i] { rhs[i] } else { 0.0 };
        }
        // L D Lᵀ in place: row[0] holds D, row[k] the unit lower factor.
        let mut rows = self.rows.clone();
        for p in 0..n {
            if !on[p] {
                rows[p] = [1.0, 0.0, 0.0, 0.0, 0.0];
                continue;
            }
            let mut d = rows[p][0] * (1.0 + damping) + f64::MIN_POSITIVE;
            for k in (1..=BAND.min(p)).rev() {
                let q = p - k;
                let mut v = if on[q] { rows[p][k] } else { 0.0 };
                for m in k + 1..=BAND.min(p) {
                    v -= rows[p][m] * rows[p - m][0] * rows[q][m - k];
                }
                rows[p][k] = v / rows[q][0];
                d -= rows[p][k] * v;
            }
            // NaN is refused too.
            if d.is_nan() || d <= 0.0 {
                return None;
            }
            rows[p][0] = d;
        }
        for p in 0..n {
            for k in 1..=BAND.min(p) {
                x[p] -= rows[p][k] * x[p - k];
            }
        }
        for p in (0..n).rev() {
            x[p] /= rows[p][0];
            for k in 1..=BAND.min(n - 1 - p) {
                x[p] -= rows[p + k][k] * x[p + k];
            }
        }
        Some((0..n).map(|i| if free[i] { x[self.row(i)] } else { 0.0 }).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_and_cyclic_systems_of_any_size_are_solved() {
        for cyclic in [false, true] {
            for n in 3..12 {
                let mut m = Banded::new(n, cyclic);
                let mut dense = vec![vec![0.0; n]; n];
                for i in 0..n {
                    let reach = if cyclic { 3 } else { 3.min(n - i) };
                    let mut g: Vec<(usize, f64)> = Vec::new();
                    for k in 0..reach {
                        g.push(((i + k) % n, 1.0 + (i * 7 + k * 3) as f64 % 5.0 - 2.0 * k as f64));
                    }
                    let (diagonal, weight) = ([(i, 1.0)], 1.0 + i as f64 * 0.1);
                    for (g, w) in [(&g[..], weight), (&diagonal[..], 0.5)] {
                        m.add_outer(g, w);
                        g.iter().for_each(|a| g.iter().for_each(|b| dense[a.0][b.0] += w * a.1 * b.1));
                    }
                }
                let mut free = vec![true; n];
                free[n / 2] = false;
                let rhs: Vec<f64> = (0..n).map(|i| (i as f64).sin() + 0.3).collect();
                let x = m.solve(&rhs, &free, 0.0).unwrap();
                assert_eq!(x[n / 2], 0.0);
                for i in (0..n).filter(|&i| free[i]) {
                    let row: f64 = (0..n).map(|j| dense[i][j] * x[j]).sum();
                    assert!((row - rhs[i]).abs() < 1e-9, "n {n} cyclic {cyclic} row {i}: {row} {}", rhs[i]);
                }
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut m = Banded::new(2, false);
        m.add_outer(&[(0, 1.0)], -1.0);
        assert!(m.solve(&[1.0, 1.0], &[true, true], 0.0).is_none());
    }
}
