//! The energy of a corner of a quad, a distortion relative to an ideal corner.
//!
//! Let the map from the ideal corner to the actual one have Jacobian determinant `D` and squared Frobenius norm `A` (1
//! and 2 for the ideal corner). The energy is `(A + λ (1 + D²)) / χ_ε(D)` with the regularisation
//! `χ_ε(D) = (D + √(D² + ε²)) / 2`, which is positive also for `D < 0`: the energy of folded corners is finite, and its
//! minimisation unfolds them (Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov: Foldover-free maps in 50 lines of
//! code, 2021; Escobar et al. 2003). The first term penalises the shape, the second the size.

use glam::{DMat2, DVec2, DVec3};

/// Weight `λ` of the size relative to the shape.
const SIZE_WEIGHT: f64 = 0.25;

/// Least absolute eigenvalue of the Hessian in [`newton`], relative to the greatest one; smaller ones are raised to it.
const LEAST_EIGENVALUE: f64 = 1e-6;

/// The ideal corner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ideal {
    /// Lengths of the sides to the next and to the previous corner.
    pub lengths: [f64; 2],
    /// Cosine and sine of the angle between them.
    pub angle: DVec2,
}

/// Which of the three points of a corner moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moving {
    /// The corner's own vertex.
    Own,
    /// The end of the side to the next corner.
    Next,
    /// The end of the side to the previous corner.
    Previous,
}

/// A corner of a quad.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// Sides to the next and to the previous corner, over their ideal lengths.
    u: DVec3,
    w: DVec3,
    /// Normal by which the area is signed.
    normal: DVec3,
    ideal: Ideal,
    /// `D`: signed area over that of the ideal corner.
    pub area: f64,
}

impl Corner {
    /// The corner at `o` with neighbours `next` and `previous`.
    pub(super) fn new([o, next, previous]: [DVec3; 3], normal: DVec3, ideal: Ideal) -> Self {
        let (u, w) = ((next - o) / ideal.lengths[0], (previous - o) / ideal.lengths[1]);
        Self { u, w, normal, ideal, area: u.cross(w).dot(normal) / ideal.angle.y }
    }

    /// `A`: the squared Frobenius norm of the map from the ideal corner.
    fn frobenius(&self) -> f64 {
        let (c, s) = (self.ideal.angle.x, self.ideal.angle.y);
        (self.u.length_squared() + self.w.length_squared() - 2.0 * c * self.u.dot(self.w)) / (s * s)
    }

    /// The energy with regularisation `epsilon`.
    pub(super) fn energy(&self, epsilon: f64) -> f64 {
        let d = self.area;
        (self.frobenius() + SIZE_WEIGHT * (1.0 + d * d)) / chi(d, epsilon)
    }

    /// Gradient and Hessian of the energy by the position of the moving point in the plane of `frame`.
    pub(super) fn derivatives(&self, epsilon: f64, moving: Moving, frame: [DVec3; 2]) -> (DVec2, DMat2) {
        let (c, s) = (self.ideal.angle.x, self.ideal.angle.y);
        let [lu, lw] = self.ideal.lengths.map(|l| 1.0 / l);
        let (du, dw) = match moving {
            Moving::Own => (-lu, -lw),
            Moving::Next => (lu, 0.0),
            Moving::Previous => (0.0, lw),
        };
        let flat = |x: DVec3| DVec2::new(x.dot(frame[0]), x.dot(frame[1]));
        let (u, w) = (self.u, self.w);
        let frobenius_1 = flat((u - w * c) * du + (w - u * c) * dw) * (2.0 / (s * s));
        let frobenius_2 = (du * du + dw * dw - 2.0 * c * du * dw) * (2.0 / (s * s));
        let area_1 = flat(w.cross(self.normal) * du + self.normal.cross(u) * dw) / s;

        let d = self.area;
        let r = d.hypot(epsilon);
        // χ and its first two derivatives.
        let (x, x1, x2) = (chi(d, epsilon), 0.5 * (1.0 + d / r), 0.5 * epsilon * epsilon / (r * r * r));
        let top = self.frobenius() + SIZE_WEIGHT * (1.0 + d * d);
        let top_1 = frobenius_1 + area_1 * (2.0 * SIZE_WEIGHT * d);
        let gradient = top_1 / x - area_1 * (top * x1 / (x * x));
        let mixed = outer(top_1, area_1);
        let hessian = DMat2::from_diagonal(DVec2::splat(frobenius_2 / x))
            + outer(area_1, area_1) * (2.0 * SIZE_WEIGHT / x)
            - (mixed + mixed.transpose()) * (x1 / (x * x))
            + outer(area_1, area_1) * (top * (2.0 * x1 * x1 / x - x2) / (x * x));
        (gradient, hessian)
    }
}

/// The regularisation `χ_ε(d)`; for negative `d` in a form without cancellation.
fn chi(d: f64, epsilon: f64) -> f64 {
    let r = d.hypot(epsilon);
    (if d >= 0.0 { 0.5 * (d + r) } else { 0.5 * epsilon * epsilon / (r - d) }).max(f64::MIN_POSITIVE)
}

fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(a * b.x, a * b.y)
}

/// Newton's step with the absolute eigenvalues of the Hessian, always a descent direction.
pub(super) fn newton(gradient: DVec2, hessian: DMat2) -> DVec2 {
    let (a, b, c) = (hessian.x_axis.x, 0.5 * (hessian.x_axis.y + hessian.y_axis.x), hessian.y_axis.y);
    let (mean, half) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
    let axis = DVec2::from_angle(0.5 * (2.0 * b).atan2(a - c));
    let least = LEAST_EIGENVALUE * (mean.abs() + half) + f64::MIN_POSITIVE;
    let (high, low) = ((mean + half).abs().max(least), (mean - half).abs().max(least));
    let across = axis.perp();
    -(axis * (gradient.dot(axis) / high) + across * (gradient.dot(across) / low))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: [DVec3; 2] = [DVec3::X, DVec3::Y];

    fn corner(points: [DVec3; 3]) -> Corner {
        let ideal = Ideal { lengths: [0.7, 1.3], angle: DVec2::from_angle(1.2) };
        Corner::new(points, DVec3::new(0.1, -0.2, 1.0).normalize(), ideal)
    }

    #[test]
    fn the_ideal_corner_has_the_least_energy() {
        let ideal = [DVec3::ZERO, DVec3::X * 0.7, DVec2::from_angle(1.2).extend(0.0) * 1.3];
        let shape = Ideal { lengths: [0.7, 1.3], angle: DVec2::from_angle(1.2) };
        let at = Corner::new(ideal, DVec3::Z, shape);
        assert!((at.area - 1.0).abs() < 1e-12);
        let (gradient, _) = at.derivatives(1e-9, Moving::Own, FRAME);
        assert!(gradient.length() < 1e-9, "{gradient}");
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let points = [DVec3::new(0.1, 0.2, 0.0), DVec3::new(0.8, 0.1, 0.1), DVec3::new(0.3, -0.5, 0.2)];
        for (i, moving) in [Moving::Own, Moving::Next, Moving::Previous].into_iter().enumerate() {
            let at = |step: DVec2| {
                let mut p = points;
                p[i] += FRAME[0] * step.x + FRAME[1] * step.y;
                corner(p)
            };
            let (gradient, hessian) = at(DVec2::ZERO).derivatives(0.3, moving, FRAME);
            let h = 1e-5;
            for (k, e) in [DVec2::X, DVec2::Y].into_iter().enumerate() {
                let [up, down] = [e * h, -e * h].map(at);
                let slope = (up.energy(0.3) - down.energy(0.3)) / (2.0 * h);
                assert!((slope - gradient[k]).abs() < 1e-4 * gradient.length(), "{slope} {gradient}");
                let slopes =
                    (up.derivatives(0.3, moving, FRAME).0 - down.derivatives(0.3, moving, FRAME).0) / (2.0 * h);
                assert!((slopes - hessian.col(k)).length() < 1e-4 * hessian.col(k).length(), "{slopes} {hessian}");
            }
        }
    }

    #[test]
    fn newton_is_a_descent_direction_also_where_the_energy_is_concave() {
        let (g, h) = (DVec2::new(1.0, 2.0), DMat2::from_cols(DVec2::new(-3.0, 1.0), DVec2::new(1.0, 0.5)));
        assert!(newton(g, h).dot(g) < 0.0);
        let h = DMat2::from_cols(DVec2::new(3.0, 1.0), DVec2::new(1.0, 2.0));
        assert!((h * newton(g, h) + g).length() < 1e-12);
    }
}
