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
