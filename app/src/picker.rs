//! What lies under the pointer: rays against the triangles, through a bounding volume hierarchy.
//!
//! Single precision is enough to find a triangle on a model of diagonal 1; the weights of the hit are computed from
//! the mesh again in double precision.

use std::sync::Arc;
use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::triangle::Triangle;
use plait_core::mesh::{FaceId, TriMesh};
use plait_core::surface::SurfacePoint;

use crate::camera::Ray;

/// Finds points of one mesh.
pub struct Picker {
    mesh: Arc<TriMesh>,
    hierarchy: CwBvh,
    /// In the order of the hierarchy's primitives.
    triangles: Vec<Triangle>,
}

impl std::fmt::Debug for Picker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Picker").field("triangles", &self.triangles.len()).finish_non_exhaustive()
    }
}

impl Picker {
    /// Builds the hierarchy.
    pub fn new(mesh: Arc<TriMesh>) -> Self {
        let corner = |v| {
            let p: DVec3 = mesh.position(v);
            Vec3A::from(p.as_vec3())
        };
        let triangles: Vec<Triangle> = mesh
            .faces()
            .map(|f| {
                let [v0, v1, v2] = mesh.face_vertices(f).map(corner);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let hierarchy = build_cwbvh_from_tris(&triangles, BvhBuildParams::fast_build(), &mut Duration::default());
        let triangles = hierarchy.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        Self { mesh, hierarchy, triangles }
    }

    /// The mesh that is picked.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    /// The first point that `ray` meets.
    pub fn pick(&self, ray: Ray) -> Option<SurfacePoint> {
        if self.triangles.is_empty() {
            return None;
        }
        let search = obvhs::ray::Ray::new_inf(ray.origin.into(), ray.direction.into());
        let mut hit = obvhs::ray::RayHit::none();
        let met = self.hierarchy.ray_traverse(search, &mut hit, |ray, id| self.triangles[id].intersect(ray));
        if !met {
            return None;
        }
        let face = FaceId::new(self.hierarchy.primitive_indices[hit.primitive_id as usize] as usize);
        let point = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(hit.t);
        Some(SurfacePoint { face, weights: self.weights(face, point) })
    }

    /// The weights of the face's point nearest to `point`, which lies almost in its plane.
    fn weights(&self, face: FaceId, point: DVec3) -> [f64; 3] {
        let corners = self.mesh.face_vertices(face).map(|v| self.mesh.position(v));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let part = |i: usize| {
            let (a, b) = (corners[(i + 1) % 3] - point, corners[(i + 2) % 3] - point);
            a.cross(b).dot(normal).max(0.0)
        };
        let parts = [part(0), part(1), part(2)];
        let sum: f64 = parts.iter().sum();
        if sum > 0.0 { parts.map(|p| p / sum) } else { [1.0 / 3.0; 3] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn tetrahedron() -> Picker {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].to_vec();
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        Picker::new(Arc::new(TriMesh::from_faces(p, &faces).unwrap()))
    }

    #[test]
    fn the_nearer_side_is_hit() {
        let picker = tetrahedron();
        let origin = Vec3::new(0.2, 0.3, 5.0);
        let hit = picker.pick(Ray { origin, direction: -Vec3::Z }).unwrap();
        assert_eq!(hit.face, FaceId::new(3));
        assert!(hit.position(picker.mesh()).distance(DVec3::new(0.2, 0.3, 0.5)) < 1e-6);
        let below = picker.pick(Ray { origin: -origin, direction: Vec3::Z });
        assert_eq!(below, None);
    }
}
