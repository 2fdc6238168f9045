//! Quadric error metrics (Garland and Heckbert 1997): the mean squared distance to the planes around a vertex.

use glam::DVec3;

/// A weighted sum of squared distances from planes, as a symmetric 4×4 form, and the sum of the weights.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    /// Quadratic coefficients `xx, xy, xz, yy, yz, zz`.
    square: [f64; 6],
    linear: DVec3,
    constant: f64,
    weight: f64,
}

impl Quadric {
    /// The plane through `point` with unit `normal`. `weight` multiplies the squared distance; `mean_weight` is what
    /// the plane adds to the denominator of the mean.
    pub fn plane(normal: DVec3, point: DVec3, weight: f64, mean_weight: f64) -> Self {
        let d = -normal.dot(point);
        let DVec3 { x, y, z } = normal;
        Self {
            square: [x * x, x * y, x * z, y * y, y * z, z * z].map(|a| a * weight),
            linear: normal * (d * weight),
            constant: d * d * weight,
            weight: mean_weight,
        }
    }

    /// Adds another quadric.
    pub fn add(&mut self, other: &Self) {
        for (a, b) in self.square.iter_mut().zip(other.square) {
            *a += b;
        }
        self.linear += other.linear;
        self.constant += other.constant;
        self.weight += other.weight;
    }

    /// Weighted sum of squared distances of `p`.
    fn sum(&self, p: DVec3) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.square;
        let DVec3 { x, y, z } = p;
        let square = xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z);
        square + 2.0 * self.linear.dot(p) + self.constant
    }

    /// Mean squared distance of `p` from the planes of two quadrics together, not negative.
    pub fn mean_of_two(&self, other: &Self, p: DVec3) -> f64 {
        ((self.sum(p) + other.sum(p)) / (self.weight + other.weight).max(f64::MIN_POSITIVE)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadric_is_the_mean_squared_distance_from_its_planes() {
        let mut q = Quadric::plane(DVec3::Z, DVec3::new(0.3, 0.1, 0.5), 2.0, 2.0);
        let p = DVec3::new(4.0, -1.0, 0.8);
        assert!((q.mean_of_two(&Quadric::default(), p) - 0.09).abs() < 1e-14);
        q.add(&Quadric::plane(DVec3::X, DVec3::X, 1.0, 1.0));
        let r = Quadric::plane(DVec3::new(0.6, 0.8, 0.0), DVec3::ZERO, 3.0, 3.0);
        let mean = (2.0 * 0.09 + 9.0 + 3.0 * (2.4f64 - 0.8).powi(2)) / 6.0;
        assert!((q.mean_of_two(&r, p) - mean).abs() < 1e-12);
    }
}
