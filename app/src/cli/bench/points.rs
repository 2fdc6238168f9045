//! Random points of a surface, uniform by area, reproducible by seed.

use std::f64::consts::TAU;

use plait_core::mesh::{FaceId, TriMesh};
use plait_core::surface::{Metric, SurfacePoint, trace_geodesic};

/// A sequence of random points.
#[derive(Debug)]
pub(super) struct Points {
    /// Cumulative area of the triangles.
    sums: Vec<f64>,
    state: u64,
}

impl Points {
    /// The sequence on `mesh` with this seed.
    pub(super) fn new(mesh: &TriMesh, seed: u64) -> Self {
        let sums = mesh.faces().scan(0.0, |sum, f| {
            *sum += mesh.face_area(f);
            Some(*sum)
        });
        Self { sums: sums.collect(), state: seed }
    }

    /// The next random number in `0..1`, by SplitMix64.
    fn unit(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// The next point.
    pub(super) fn point(&mut self) -> SurfacePoint {
        let at = self.unit() * self.sums.last().copied().unwrap_or(0.0);
        let face = self.sums.partition_point(|&s| s <= at).min(self.sums.len().saturating_sub(1));
        let (mut a, mut b) = (self.unit(), self.unit());
        if a + b > 1.0 {
            (a, b) = (1.0 - a, 1.0 - b);
        }
        SurfacePoint { face: FaceId::new(face), weights: [1.0 - a - b, a, b] }
    }

    /// Points `step` apart along a geodesic in a random direction, like those under a moving pointer.
    pub(super) fn stroke(&mut self, mesh: &TriMesh, metric: &Metric, count: usize, step: f64) -> Vec<SurfacePoint> {
        let start = self.point().nearest_vertex(mesh);
        let angle = self.unit() * TAU;
        (1..=count).map(|i| trace_geodesic(mesh, metric, start, angle, i as f64 * step).end).collect()
    }
}

#[cfg(test)]
mod tests {
    use plait_core::mesh::builtin;

    use super::*;

    #[test]
    fn points_follow_the_area_and_the_seed() {
        let mesh = builtin("sleeve").unwrap().mesh;
        let mut points = Points::new(&mesh, 7);
        let mut again = Points::new(&mesh, 7);
        let (mut sum, n) = (glam::DVec3::ZERO, 4000);
        for _ in 0..n {
            let point = points.point();
            assert_eq!(point, again.point());
            assert!(point.weights.iter().all(|w| (0.0..=1.0).contains(w)));
            sum += point.position(&mesh);
        }
        let area: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
        let middle = |f| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<glam::DVec3>() / 3.0;
        let centre = mesh.faces().map(|f| middle(f) * mesh.face_area(f)).sum::<glam::DVec3>() / area;
        assert!(centre.distance(sum / f64::from(n)) < 0.02, "{centre} {}", sum / f64::from(n));
        assert_ne!(Points::new(&mesh, 8).point(), Points::new(&mesh, 7).point());
    }
}
