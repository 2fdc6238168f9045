//! Local projection onto the surface, and its interpolated normals.
//!
//! The nearest point of the whole surface may be on the other side of a thin wall. A point near a known triangle is
//! instead projected by walking from triangle to neighbouring triangle as long as the distance decreases.

use glam::DVec3;

use crate::mesh::{FaceId, TriMesh};

/// Most triangles of a walk. A vertex moves by about a quad at once, and quads extend over a few triangles; a walk cut
/// short still ends on the surface.
const MAX_WALK: usize = 64;

/// A surface with its angle-weighted vertex normals.
pub(super) struct Projection<'a> {
    mesh: &'a TriMesh,
    normals: Vec<DVec3>,
}

impl<'a> Projection<'a> {
    pub(super) fn new(mesh: &'a TriMesh) -> Self {
        let normal =
            |v| -> DVec3 { mesh.outgoing(v).map(|h| mesh.face_normal(mesh.face(h)) * mesh.corner_angle(h)).sum() };
        Self { mesh, normals: mesh.vertices().map(|v| normal(v).normalize_or_zero()).collect() }
    }

    /// The unit normal at a point of triangle `f`, interpolated from its corners.
    pub(super) fn normal(&self, p: DVec3, f: u32) -> DVec3 {
        let corners = self.mesh.face_vertices(FaceId(f));
        let [a, b, c] = corners.map(|v| self.mesh.position(v));
        let whole = self.mesh.face_area_vector(FaceId(f));
        let w = [(b - p).cross(c - p), (c - p).cross(a - p), (a - p).cross(b - p)].map(|x| x.dot(whole).max(0.0));
        let sum: DVec3 = corners.iter().zip(w).map(|(v, w)| self.normals[v.index()] * w).sum();
        sum.normalize_or(self.mesh.face_normal(FaceId(f)).normalize_or(DVec3::Z))
    }

    /// The local projection of `p`, walking from triangle `start`: the point and its triangle.
    pub(super) fn project(&self, p: DVec3, start: u32) -> (DVec3, u32) {
        project(self.mesh, p, start)
    }
}

/// The local projection of `p`, walking from triangle `start`.
fn project(mesh: &TriMesh, p: DVec3, start: u32) -> (DVec3, u32) {
    let mut face = FaceId(start);
    let mut at = closest_in_face(mesh, face, p);
    let mut distance = at.distance_squared(p);
    for _ in 0..MAX_WALK {
        let mut best = None;
        for v in mesh.face_vertices(face) {
            for h in mesh.outgoing(v) {
                let g = mesh.face(h);
                let q = closest_in_face(mesh, g, p);
                let d = q.distance_squared(p);
                if d < distance * (1.0 - 1e-9) {
                    distance = d;
                    best = Some((g, q));
                }
            }
        }
        let Some((g, q)) = best else { break };
        (face, at) = (g, q);
    }
    (at, face.0)
}

/// The point of a triangle nearest to `p` (Ericson, Real-Time Collision Detection, 5.1.5).
fn closest_in_face(mesh: &TriMesh, f: FaceId, p: DVec3) -> DVec3 {
    let [a, b, c] = mesh.face_vertices(f).map(|v| mesh.position(v));
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let total = va + vb + vc;
    if total > 0.0 { a + ab * (vb / total) + ac * (vc / total) } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::torus;

    #[test]
    fn a_walk_ends_at_the_nearest_point() {
        let mesh = torus(40, 20);
        for (k, f) in mesh.faces().enumerate().step_by(37) {
            let [a, b, _] = mesh.face_vertices(f).map(|v| mesh.position(v));
            let p = a + (b - a) * 1.7 + 0.01 * mesh.face_normal(f) * if k % 2 == 0 { 1.0 } else { -1.0 };
            let (at, g) = project(&mesh, p, f.0);
            let best = mesh.faces().map(|g| closest_in_face(&mesh, g, p).distance(p)).fold(f64::MAX, f64::min);
            assert!((at.distance(p) - best).abs() < 1e-12);
            assert!(closest_in_face(&mesh, FaceId(g), p).distance(at) < 1e-12);
        }
    }
}
