//! The energy density of a triangle as a function of the Jacobian of the map; the formula is in [`super`].

/// Weights of the energy of locally injective maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistortionWeights {
    /// `ρ`: weight of gradient components across the field relative to those along it; at least 1.
    pub anisotropy: f64,
    /// `λ`: weight of errors of size relative to the conformal distortion; positive.
    pub size: f64,
}

impl DistortionWeights {
    /// The weights with the excess of the anisotropy over 1 scaled by `anisotropy_share`: 0 is isotropic, 1 unchanged.
    pub(crate) fn with_anisotropy_share(self, anisotropy_share: f64) -> Self {
        Self { anisotropy: 1.0 + anisotropy_share * (self.anisotropy - 1.0), ..self }
    }
}

/// Parameters of the energy density of a triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EnergyDensity {
    /// `ρ`.
    anisotropy: f64,
    /// `λ`.
    size: f64,
    /// `m`: the target determinant.
    determinant: f64,
    /// `ε`: regularisation in multiples of `m`, see [`EnergyDensity::regularised_determinant`]; 0: none, the energy of
    /// a flipped triangle is infinite.
    epsilon: f64,
}

/// A function of the determinant: value, first and second derivative.
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

/// Largest energy density; beyond it the image is degenerate up to rounding errors.
const MAX_DENSITY: f64 = 1e14;
/// Sweeps of Jacobi's eigenvalue method. For 4 × 4 matrices it converges to rounding errors in five.
const JACOBI_SWEEPS: usize = 6;

impl EnergyDensity {
    /// The energy density for target lengths `a` and `b` of the gradients of u and v.
    pub(crate) fn new(weights: DistortionWeights, [a, b]: [f64; 2]) -> Self {
        Self { anisotropy: weights.anisotropy, size: weights.size, determinant: a * b, epsilon: 0.0 }
    }

    /// The density regularised with `ε`: flipped triangles have a finite energy, larger for smaller `ε`.
    pub(super) fn regularised(self, epsilon: f64) -> Self {
        Self { epsilon, ..self }
    }

    /// Weights of the squared entries of the Jacobian.
    fn weights(&self) -> [f64; 4] {
        [1.0, self.anisotropy, self.anisotropy, 1.0]
    }

    /// `χ(D)`, used in place of the determinant `D` in denominators: `D` itself for `ε = 0`, else
    /// `½ (D + √(ε² m² + D²))`, which is positive for every `D` (Garanzha et al. 2021).
    fn regularised_determinant(&self, det: f64) -> Jet {
        if self.epsilon == 0.0 {
            return Jet([det, 1.0, 0.0]);
        }
        let least = self.epsilon * self.determinant;
        let root = least.hypot(det);
        // The second form avoids cancellation for negative determinants.
        let value = if det > 0.0 { 0.5 * (det + root) } else { 0.5 * least * least / (root - det) };
        Jet([value, value / root, 0.5 * least * least / root.powi(3)])
    }

    /// `1 / χ(D)`, the factor of the conformal term, and the size term `λ (D²/m² + m²/χ(D)²)`.
    fn parts(&self, det: f64) -> (Jet, Jet) {
        let inverse = self.regularised_determinant(det).inverse();
        let square = self.determinant * self.determinant;
        (inverse, Jet([det, 1.0, 0.0]).squared().sum(self.size / square, inverse.squared(), self.size * square))
    }

    /// The energy density of the Jacobian `[a b; c d]`, given row by row. `None` if it is flipped or degenerate and the
    /// density is not regularised.
    pub(crate) fn value(&self, j: &[f64; 4]) -> Option<f64> {
        let det = j[0] * j[3] - j[1] * j[2];
        let (inverse, size) = self.parts(det);
        let e = 0.5 * (self.norm(j) * inverse.0[0] + size.0[0]);
        ((det > 0.0 || self.epsilon > 0.0) && e < MAX_DENSITY).then_some(e)
    }

    /// The determinant of a Jacobian in multiples of the target.
    pub(super) fn determinant(&self, j: &[f64; 4]) -> f64 {
        (j[0] * j[3] - j[1] * j[2]) / self.determinant
    }

    /// `jᵀ W j`.
    fn norm(&self, j: &[f64; 4]) -> f64 {
        self.weights().iter().zip(j).map(|(w, x)| w * x * x).sum()
    }

    /// The derivatives by the entries of the Jacobian; its determinant must be positive unless regularised.
    pub(crate) fn gradient(&self, j: &[f64; 4]) -> [f64; 4] {
        self.derivatives(j).0
    }

    /// Gradient and Hessian by the entries of the Jacobian, the Hessian projected to positive semidefinite.
    pub(super) fn derivatives(&self, j: &[f64; 4]) -> ([f64; 4], [[f64; 4]; 4]) {
        let det = j[0] * j[3] - j[1] * j[2];
        let turned = [j[3], -j[2], -j[1], j[0]];
        let weights = self.weights();
        // e = ½ (N g(D) + h(D)) with N = jᵀ W j, g = 1/χ, h the size term: first and second derivatives by D.
        let (shape, size) = self.parts(det);
        let Jet([_, first, second]) = shape.sum(0.5 * self.norm(j), size, 0.5);
        let [factor, slope, _] = shape.0;
        let mut gradient = [0.0; 4];
        let mut hessian = [[0.0; 4]; 4];
        for r in 0..4 {
            let half_slope = weights[r] * j[r];
            gradient[r] = half_slope * factor + first * turned[r];
            hessian[r][r] += weights[r] * factor;
            for c in 0..4 {
                hessian[r][c] += second * turned[r] * turned[c];
                hessian[r][c] += slope * (half_slope * turned[c] + turned[r] * weights[c] * j[c]);
            }
        }
        for (r, sign) in [1.0, -1.0, -1.0, 1.0].into_iter().enumerate() {
            hessian[r][3 - r] += sign * first;
        }
        (gradient, semidefinite(hessian))
    }
}

/// The nearest positive semidefinite matrix: sets negative eigenvalues to zero (Jacobi's method).
fn semidefinite(matrix: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
    if is_definite(&matrix) {
        return matrix;
    }
    let mut a = matrix;
    let mut v = [[0.0; 4]; 4];
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for _ in 0..JACOBI_SWEEPS {
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

/// Whether a symmetric matrix is positive definite, by Cholesky factorisation. This is true in most cases and cheaper
/// to test than computing eigenvalues.
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

/// Jacobi rotation: makes entry `(p, q)` of a symmetric matrix vanish; `v` accumulates the rotations.
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

    const DENSITY: EnergyDensity = EnergyDensity { anisotropy: 3.0, size: 0.4, determinant: 2.0, epsilon: 0.0 };

    #[test]
    fn gradient_matches_finite_differences() {
        let flipped = [1.1, 0.3, 2.4, -0.9];
        for (density, at) in [(DENSITY, [1.1, 0.3, -0.4, 0.9]), (DENSITY.regularised(0.3), flipped)] {
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
    fn hessian_matches_finite_differences_where_convex() {
        // At the minimum no eigenvalue is negative.
        let at = [2f64.sqrt(), 0.0, 0.0, 2f64.sqrt()];
        for density in [DENSITY, DENSITY.regularised(0.1)] {
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
    fn projection_sets_only_negative_eigenvalues_to_zero() {
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
    fn degenerate_and_flipped_jacobians_have_no_energy() {
        assert_eq!(DENSITY.value(&[1.0, 1.0, 1.0, 1.0]), None);
        assert_eq!(DENSITY.value(&[1.0, 0.0, 0.0, -1.0]), None);
    }

    #[test]
    fn density_is_least_at_the_target() {
        let weights = DistortionWeights { anisotropy: 1.0, size: 0.4 };
        let density = EnergyDensity::new(weights, [2.0, 0.5]);
        assert!((density.value(&[1.0, 0.0, 0.0, 1.0]).unwrap() - 1.4).abs() < 1e-12);
        for other in [[1.1, 0.0, 0.0, 1.1], [1.0, 0.1, 0.0, 1.0], [0.9, 0.0, 0.0, 1.1]] {
            assert!(density.value(&other).unwrap() > 1.4 + 1e-6, "{other:?}");
        }
    }

    #[test]
    fn anisotropy_share_interpolates_from_the_isotropic_energy() {
        let weights = DistortionWeights { anisotropy: 5.0, size: 0.4 };
        let shares = [0.0, 0.5, 1.0].map(|share| weights.with_anisotropy_share(share).anisotropy);
        assert_eq!(shares, [1.0, 3.0, 5.0]);
    }
}
