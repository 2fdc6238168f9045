//! A point on the surface: a triangle and barycentric coordinates in it.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::mesh::{FaceId, TriMesh, VertexId};

/// A point on a triangle mesh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// The triangle.
    pub face: FaceId,
    /// Barycentric coordinates in the triangle, in the order of its corners; not negative, sum 1.
    pub weights: [f64; 3],
}

impl SurfacePoint {
    /// Position in space, in units of the mesh.
    pub fn position(&self, mesh: &TriMesh) -> DVec3 {
        let corners = mesh.face_vertices(self.face);
        corners.iter().zip(self.weights).map(|(&v, w)| mesh.position(v) * w).sum()
    }

    /// The corner of the triangle with the largest weight; of equal ones the first.
    pub fn nearest_vertex(&self, mesh: &TriMesh) -> VertexId {
        let corners = mesh.face_vertices(self.face);
        let mut best = 0;
        for i in 1..3 {
            if self.weights[i] > self.weights[best] {
                best = i;
            }
        }
        corners[best]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::square;

    #[test]
    fn a_point_is_nearest_to_the_corner_of_largest_weight() {
        let mesh = square(2);
        let face = FaceId(1);
        let [a, b, c] = mesh.face_vertices(face);
        let at = |weights| SurfacePoint { face, weights };
        assert_eq!(at([0.2, 0.5, 0.3]).nearest_vertex(&mesh), b);
        assert_eq!(at([0.1, 0.2, 0.7]).nearest_vertex(&mesh), c);
        // Of equal ones the first.
        assert_eq!(at([0.4, 0.2, 0.4]).nearest_vertex(&mesh), a);
        assert_eq!(at([0.0, 1.0, 0.0]).position(&mesh), mesh.position(b));
    }
}
