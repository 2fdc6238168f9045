//! The energy of a triangle per area, as a function of the matrix of its map.

use super::DistortionWeights;

/// What the energy depends on besides the matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EnergyDensity {
    /// `ρ`.
    anisotropy: f64,
    /// `λ`.
    size: f64,
    /// The determinant wanted, `m`.
    determinant: f64,
    /// `ε`: how far below zero, in multiples of that, determinants still have an energy worth making less; 0: none has.
    slack: f64,
}

/// A function of the determinant with its first and second derivative.
#[derive(Debug, Clone, Copy)]
struct Jet([f64; 3]);

impl Jet {
    /// `1 / f`.
    fn inverse(self) -> Self {
        let [f, d, e] = self.0;
        Self([1.0 / f, -d / (f * f), (2.0 * d * d / f - e) / (f * f)])
    }

    /// `f²`.
    fn squared(self) -> Self {
        let [f, d, e] = self.0;
        Self([f * f, 2.0 * f * d, 2.0 * (d * d + f * e)])
    }

    /// `a f + b g`.
    fn sum(self, a: f64, other: Self, b: f64) -> Self {
        Self(std::array::from_fn(|k| a * self.0[k] + b * other.0[k]))
    }
}

/// The energy from which on an image is as good as flat: shape cannot be told from rounding any more.
const FLAT: f64 = 1e14;
/// Sweeps of the Jacobi method: of 4 by 4 matrices it has converged to rounding after five.
const SWEEPS: usize = 6;

impl EnergyDensity {
    /// The energy of a triangle in which the gradients are to have the lengths given.
    pub(crate) fn new(shape: DistortionWeights, [a, b]: [f64; 2]) -> Self {
        Self { anisotropy: shape.anisotropy, size: shape.size, determinant: a * b, slack: 0.0 }
    }

    /// The same with `ε`: triangles that are turned over have a finite energy, the greater the less `ε` is.
    pub(super) fn with_slack(self, slack: f64) -> Self {
        Self { slack, ..self }
    }

    fn weights(&self) -> [f64; 4] {
        [1.0, self.anisotropy, self.anisotropy, 1.0]
    }

    /// What stands for a determinant: itself, or with slack `½ (D + √(ε² m² + D²))`, which is positive whatever `D` is.
    fn positive(&self, det: f64) -> Jet {
        if self.slack == 0.0 {
            return Jet([det, 1.0, 0.0]);
        }
        let least = self.slack * self.determinant;
        let root = least.hypot(det);
        // Of a negative determinant the sum would lose all digits.
        let value = if det > 0.0 { 0.5 * (det + root) } else { 0.5 * least * least / (root - det) };
        Jet([value, value / root, 0.5 * least * least / root.powi(3)])
    }

    /// `1 / D`, by which shape is multiplied, and what size costs, `λ (D²/m² + m²/D²)`.
    fn parts(&self, det: f64) -> (Jet, Jet) {
        let inverse = self.positive(det).inverse();
        let square = self.determinant * self.determinant;
        (inverse, Jet([det, 1.0, 0.0]).squared().sum(self.size / square, inverse.squared(), self.size * square))
    }

    /// The energy of the matrix `[a b; c d]`, given row by row; `None` unless its determinant is positive beyond rounding or
    /// there is slack.
    pub(crate) fn value(&self, j: &[f64; 4]) -> Option<f64> {
        let det = j[0] * j[3] - j[1] * j[2];
        let (inverse, size) = self.parts(det);
        let e = 0.5 * (self.norm(j) * inverse.0[0] + size.0[0]);
        ((det > 0.0 || self.slack > 0.0) && e < FLAT).then_some(e)
    }

    /// The determinant of a matrix in multiples of that wanted.
    pub(super) fn determinant(&self, j: &[f64; 4]) -> f64 {
        (j[0] * j[3] - j[1] * j[2]) / self.determinant
    }

    /// `jᵀ W j`.
    fn norm(&self, j: &[f64; 4]) -> f64 {
        self.weights().iter().zip(j).map(|(w, x)| w * x * x).sum()
    }

    /// The derivatives of the energy by the entries of the matrix; of one with positive determinant, or with slack.
    pub(crate) fn gradient(&self, j: &[f64; 4]) -> [f64; 4] {
        self.derivatives(j).0
    }

    /// Its gradient and its Hessian made positive semidefinite.
    pub(super) fn derivatives(&self, j: &[f64; 4]) -> ([f64; 4], [[f64; 4]; 4]) {
        let det = j[0] * j[3] - j[1] * j[2];
        let turned = [j[3], -j[2], -j[1], j[0]];
        let weights = self.weights();
        // e = ½ (N g(D) + h(D)): first and second derivatives with respect to D.
        let (shape, size) = self.parts(det);
        let Jet([_, first, second]) = shape.sum(0.5 * self.norm(j), size, 0.5);
        let [factor, slope, _] = shape.0;
        let mut gradient = [0.0; 4];
        let mut hessian = [[0.0; 4]; 4];
        for r in 0..4 {
            let pull = weights[r] * j[r];
            gradient[r] = pull * factor + first * turned[r];
            hessian[r][r] += weights[r] * factor;
            for c in 0..4 {
                hessian[r][c] += second * turned[r] * turned[c];
                hessian[r][c] += slope * (pull * turned[c] + turned[r] * weights[c] * j[c]);
            }
        }
        for (r, sign) in [1.0, -1.0, -1.0, 1.0].into_iter().enumerate() {
            hessian[r][3 - r] += sign * first;
        }
        (gradient, semidefinite(hessian))
    }
}

/// The nearest positive semidefinite matrix: negative eigenvalues become zero (Jacobi's method).
fn semidefinite(matrix: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
    if is_definite(&matrix) {
        return matrix;
    }
    let mut a = matrix;
    let mut v = [[0.0; 4]; 4];
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for _ in 0..SWEEPS {
        for p in 0..3 {
            for q in p + 1..4 {
                rotate(&mut a, &mut v, p, q);
            }
        }
    }
    if (0..4).all(|i| a[i][i] >= 0.0) {
        return matrix;
    }
    let mut out = [[0.0; 4]; 4];
    for r in 0..4 {
        for c in 0..4 {
            out[r][c] = (0..4).map(|k| a[k][k].max(0.0) * v[r][k] * v[c][k]).sum();
        }
    }
    out
}

/// Whether a symmetric matrix has a Cholesky factor: most have, and this is quicker than to find eigenvalues.
fn is_definite(matrix: &[[f64; 4]; 4]) -> bool {
    let mut l = [[0.0; 4]; 4];
    for r in 0..4 {
        for c in 0..=r {
            let rest = matrix[r][c] - (0..c).map(|k| l[r][k] * l[c][k]).sum::<f64>();
            if r == c {
                if rest <= 0.0 || rest.is_nan() {
                    return false;
                }
                l[r][r] = rest.sqrt();
            } else {
                l[r][c] = rest / l[c][c];
            }
        }
    }
    true
}

/// Makes entry `(p, q)` of a symmetric matrix vanish; `v` collects the rotations.
fn rotate(a: &mut [[f64; 4]; 4], v: &mut [[f64; 4]; 4], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let rows = (a[p], a[q]);
    a[p] = std::array::from_fn(|k| c * rows.0[k] - s * rows.1[k]);
    a[q] = std::array::from_fn(|k| s * rows.0[k] + c * rows.1[k]);
    for row in v.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DENSITY: EnergyDensity = EnergyDensity { anisotropy: 3.0, size: 0.4, determinant: 2.0, slack: 0.0 };

    #[test]
    fn the_gradient_is_that_of_the_energy() {
        let folded = [1.1, 0.3, 2.4, -0.9];
        for (density, at) in [(DENSITY, [1.1, 0.3, -0.4, 0.9]), (DENSITY.with_slack(0.3), folded)] {
            let (gradient, _) = density.derivatives(&at);
            for k in 0..4 {
                let moved = |d: f64| {
                    let mut j = at;
                    j[k] += d;
                    density.value(&j).unwrap()
                };
                let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((slope - gradient[k]).abs() < 1e-6 * slope.abs().max(1.0), "{k}: {slope} {}", gradient[k]);
            }
        }
    }

    #[test]
    fn the_hessian_is_that_of_the_energy_where_it_is_convex() {
        // At the best matrix conceivable nothing is cut off.
        let at = [2f64.sqrt(), 0.0, 0.0, 2f64.sqrt()];
        for density in [DENSITY, DENSITY.with_slack(0.1)] {
            let (_, hessian) = density.derivatives(&at);
            for c in 0..4 {
                let moved = |d: f64| {
                    let mut j = at;
                    j[c] += d;
                    density.derivatives(&j).0
                };
                let (up, down) = (moved(1e-5), moved(-1e-5));
                for (r, row) in hessian.iter().enumerate() {
                    let slope = (up[r] - down[r]) / 2e-5;
                    assert!((slope - row[c]).abs() < 1e-8, "{r} {c}: {slope} {}", row[c]);
                }
            }
        }
    }

    #[test]
    fn negative_eigenvalues_become_zero_and_others_stay() {
        let indefinite = [[1.0, 2.0, 0.0, 0.0], [2.0, 1.0, 0.0, 0.0], [0.0, 0.0, 5.0, 0.0], [0.0, 0.0, 0.0, -1.0]];
        let want = [[1.5, 1.5, 0.0, 0.0], [1.5, 1.5, 0.0, 0.0], [0.0, 0.0, 5.0, 0.0], [0.0; 4]];
        let got = semidefinite(indefinite);
        for r in 0..4 {
            for c in 0..4 {
                assert!((got[r][c] - want[r][c]).abs() < 1e-12, "{got:?}");
            }
        }
    }

    #[test]
    fn flat_and_folded_matrices_have_no_energy() {
        assert_eq!(DENSITY.value(&[1.0, 1.0, 1.0, 1.0]), None);
        assert_eq!(DENSITY.value(&[1.0, 0.0, 0.0, -1.0]), None);
    }
}
