//! The shape of the corner of a quad, as an energy.
//!
//! Both sides at a corner are measured in the lengths and the angle that they should have; `D` is the signed
//! area they span in the quad's plane, `A` the sum of their squares: 1 and 2 for the ideal corner. The energy is
//! `(A + λ (1 + D²)) / χ(D)` where `χ` is `D` where that is positive, but bends to stay positive below: finite
//! for folded corners, with a way out (Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov: Foldover-free
//! maps in 50 lines of code, 2021; Escobar et al. 2003). The first term asks for shape, the second for size.

use glam::{DMat2, DVec2, DVec3};

/// Weight of size beside shape.
const SIZE: f64 = 0.25;

/// What a corner should be like.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ideal {
    /// Lengths of the sides to the next and to the previous corner.
    pub lengths: [f64; 2],
    /// Cosine and sine of the angle between them.
    pub angle: DVec2,
}

/// Which of its three points a corner is seen to depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moving {
    /// The corner itself.
    Own,
    /// The end of the side to the next corner.
    Next,
    /// The end of the side to the previous corner.
    Previous,
}

/// The corner at `o` with neighbours `next` and `previous`, seen along the quad's normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    u: DVec3,
    w: DVec3,
    normal: DVec3,
    ideal: Ideal,
    /// Signed area over that of the ideal corner.
    pub area: f64,
}

impl Corner {
    pub(super) fn new([o, next, previous]: [DVec3; 3], normal: DVec3, ideal: Ideal) -> Self {
        let (u, w) = ((next - o) / ideal.lengths[0], (previous - o) / ideal.lengths[1]);
        Self { u, w, normal, ideal, area: u.cross(w).dot(normal) / ideal.angle.y }
    }

    fn squares(&self) -> f64 {
        let (c, s) = (self.ideal.angle.x, self.ideal.angle.y);
        (self.u.length_squared() + self.w.length_squared() - 2.0 * c * self.u.dot(self.w)) / (s * s)
    }

    /// The energy; `bend` is how far from zero the denominator begins to bend.
    pub(super) fn energy(&self, bend: f64) -> f64 {
        let d = self.area;
        (self.squares() + SIZE * (1.0 + d * d)) / bent(d, bend)
    }

    /// Gradient and Hessian of the energy in the plane of `frame`, by the place of the point that moves.
    pub(super) fn derivatives(&self, bend: f64, moving: Moving, frame: [DVec3; 2]) -> (DVec2, DMat2) {
        let (c, s) = (self.ideal.angle.x, self.ideal.angle.y);
        let [lu, lw] = self.ideal.lengths.map(|l| 1.0 / l);
        let (du, dw) = match moving {
            Moving::Own => (-lu, -lw),
            Moving::Next => (lu, 0.0),
            Moving::Previous => (0.0, lw),
        };
        let flat = |x: DVec3| DVec2::new(x.dot(frame[0]), x.dot(frame[1]));
        let (u, w) = (self.u, self.w);
        let squares_1 = flat((u - w * c) * du + (w - u * c) * dw) * (2.0 / (s * s));
        let squares_2 = (du * du + dw * dw - 2.0 * c * du * dw) * (2.0 / (s * s));
        let area_1 = flat(w.cross(self.normal) * du + self.normal.cross(u) * dw) / s;

        let d = self.area;
        let r = d.hypot(bend);
        let (x, x1, x2) = (bent(d, bend), 0.5 * (1.0 + d / r), 0.5 * bend * bend / (r * r * r));
        let top = self.squares() + SIZE * (1.0 + d * d);
        let top_1 = squares_1 + area_1 * (2.0 * SIZE * d);
        let gradient = top_1 / x - area_1 * (top * x1 / (x * x));
        let mixed = outer(top_1, area_1);
        let hessian = DMat2::from_diagonal(DVec2::splat(squares_2 / x)) + outer(area_1, area_1) * (2.0 * SIZE / x)
            - (mixed + mixed.transpose()) * (x1 / (x * x))
            + outer(area_1, area_1) * (top * (2.0 * x1 * x1 / x - x2) / (x * x));
        (gradient, hessian)
    }
}

/// A positive stand-in for `d`; the second form does not cancel.
fn bent(d: f64, bend: f64) -> f64 {
    let r = d.hypot(bend);
    (if d >= 0.0 { 0.5 * (d + r) } else { 0.5 * bend * bend / (r - d) }).max(f64::MIN_POSITIVE)
}

fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(a * b.x, a * b.y)
}

/// The step of Newton's method, with the absolute values of the curvatures: always downhill.
pub(super) fn newton(gradient: DVec2, hessian: DMat2) -> DVec2 {
    let (a, b, c) = (hessian.x_axis.x, 0.5 * (hessian.x_axis.y + hessian.y_axis.x), hessian.y_axis.y);
    let (mean, half) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
    let axis = DVec2::from_angle(0.5 * (2.0 * b).atan2(a - c));
    let least = 1e-6 * (mean.abs() + half) + f64::MIN_POSITIVE;
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
    fn newton_goes_downhill_even_where_the_energy_is_concave() {
        let (g, h) = (DVec2::new(1.0, 2.0), DMat2::from_cols(DVec2::new(-3.0, 1.0), DVec2::new(1.0, 0.5)));
        assert!(newton(g, h).dot(g) < 0.0);
        let h = DMat2::from_cols(DVec2::new(3.0, 1.0), DVec2::new(1.0, 2.0));
        assert!((h * newton(g, h) + g).length() < 1e-12);
    }
}
