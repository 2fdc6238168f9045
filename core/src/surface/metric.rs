//! The intrinsic metric of a mesh: every triangle laid out in its own plane.
//!
//! Directions in a triangle are angles from its half-edge 0, counter-clockwise, in radians. Unfolding two triangles
//! about their common edge transports a direction from one to the other. Edge lengths are those of the mesh, all
//! increased by the same tiny amount where that is needed to keep every triangle inequality strict (intrinsic
//! mollification: Sharp and Crane, A Laplacian for Nonmanifold Triangle Meshes, section 4.5). So slivers and degenerate
//! triangles have angles and finite cotangents.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// Least excess of two sides of a triangle over the third, relative to the mean edge length. Small enough to be
/// invisible, large enough for cotangents below 100 in a degenerate triangle of mean size.
const SLACK: f64 = 1e-4;

/// Squared length of a projected vector, relative to that of the vector, up to which it has no direction.
const NO_DIRECTION: f64 = 1e-24;

/// Planar layouts of all triangles.
#[derive(Debug, Clone)]
pub struct Metric {
    /// Corners of each triangle: 0 at the origin, 1 on the positive first axis, 2 above it.
    layout: Vec<[DVec2; 3]>,
    /// Direction of each half-edge in its triangle, in radians.
    direction: Vec<f64>,
}

impl Metric {
    /// Lays out the triangles of `mesh`.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut length: Vec<f64> = mesh.edges().map(|e| mesh.edge_length(e)).collect();
        let mean = length.iter().sum::<f64>() / length.len().max(1) as f64;
        let sides = |length: &[f64], f: FaceId| mesh.face_halfedges(f).map(|h| length[mesh.edge(h).index()]);
        let lack = |l: [f64; 3]| 2.0 * l[0].max(l[1]).max(l[2]) - (l[0] + l[1] + l[2]);
        let grow = mesh.faces().map(|f| lack(sides(&length, f)) + SLACK * mean).fold(0.0, f64::max);
        for l in &mut length {
            *l += grow;
        }
        let layout: Vec<[DVec2; 3]> = mesh.faces().map(|f| lay_out(sides(&length, f))).collect();
        let direction = mesh.halfedges().map(|h| side(&layout[h.index() / 3], h.index() % 3).to_angle()).collect();
        Self { layout, direction }
    }

    /// The corners of a triangle in its plane.
    #[inline]
    pub fn layout(&self, f: FaceId) -> &[DVec2; 3] {
        &self.layout[f.index()]
    }

    /// The direction of a half-edge in the plane of its triangle, in radians.
    #[inline]
    pub fn direction(&self, h: HalfedgeId) -> f64 {
        self.direction[h.index()]
    }

    /// The length of a half-edge, in units of the mesh.
    #[inline]
    pub fn length(&self, h: HalfedgeId) -> f64 {
        side(&self.layout[h.index() / 3], h.index() % 3).length()
    }

    /// The area of a triangle.
    #[inline]
    pub fn area(&self, f: FaceId) -> f64 {
        let [a, b, c] = self.layout[f.index()];
        0.5 * (b - a).perp_dot(c - a)
    }

    /// The interior angle at the origin of a half-edge, in radians.
    #[inline]
    pub fn corner_angle(&self, h: HalfedgeId) -> f64 {
        let corners = &self.layout[h.index() / 3];
        let i = h.index() % 3;
        side(corners, i).angle_to(-side(corners, (i + 2) % 3))
    }

    /// The angle, in radians, that added to a direction in the triangle of `h` gives the same direction in the triangle of
    /// its twin, unfolded.
    #[inline]
    pub fn transport(&self, h: HalfedgeId, twin: HalfedgeId) -> f64 {
        self.direction(twin) + PI - self.direction(h)
    }

    /// Discrete Gaussian curvature (angle defect): `2π` minus the sum of angles at an inner vertex, `π` minus it at a
    /// boundary vertex.
    pub fn curvature(&self, mesh: &TriMesh, v: VertexId) -> f64 {
        let flat = if mesh.is_boundary_vertex(v) { PI } else { 2.0 * PI };
        flat - mesh.outgoing(v).map(|h| self.corner_angle(h)).sum::<f64>()
    }

    /// The unit vector in space of a direction in a triangle; zero where the triangle has no normal.
    pub fn tangent(&self, mesh: &TriMesh, f: FaceId, angle: f64) -> DVec3 {
        let x = mesh.vector(mesh.face_halfedges(f)[0]).normalize_or_zero();
        let y = mesh.face_normal(f).cross(x);
        x * angle.cos() + y * angle.sin()
    }

    /// The direction in a triangle of a vector projected onto its plane; `None` where the projection vanishes.
    pub fn angle_of(&self, mesh: &TriMesh, f: FaceId, vector: DVec3) -> Option<f64> {
        let x = mesh.vector(mesh.face_halfedges(f)[0]).normalize_or_zero();
        let y = mesh.face_normal(f).cross(x);
        let flat = DVec2::new(vector.dot(x), vector.dot(y));
        (flat.length_squared() > NO_DIRECTION * vector.length_squared()).then(|| flat.to_angle())
    }
}

/// The vector along side `i` of a triangle.
#[inline]
fn side(corners: &[DVec2; 3], i: usize) -> DVec2 {
    corners[(i + 1) % 3] - corners[i]
}

/// The planar triangle with these side lengths, which satisfy the triangle inequalities strictly.
fn lay_out([a, b, c]: [f64; 3]) -> [DVec2; 3] {
    // Kahan's form of Heron's formula with sorted sides, which is accurate for thin triangles.
    let mut s = [a, b, c];
    s.sort_by(|p, q| q.total_cmp(p));
    let [l, m, n] = s;
    let area = 0.25 * ((l + (m + n)) * (n - (l - m)) * (n + (l - m)) * (l + (m - n))).max(0.0).sqrt();
    let x = (a * a + c * c - b * b) / (2.0 * a);
    [DVec2::ZERO, DVec2::new(a, 0.0), DVec2::new(x, 2.0 * area / a)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{square, torus};

    #[test]
    fn angle_defects_sum_to_the_euler_characteristic() {
        for (mesh, euler) in [(torus(12, 8), 0.0), (square(4), 1.0)] {
            let metric = Metric::new(&mesh);
            let total: f64 = mesh.vertices().map(|v| metric.curvature(&mesh, v)).sum();
            assert!((total - 2.0 * PI * euler).abs() < 1e-9, "{total}");
        }
    }

    #[test]
    fn transport_to_the_next_triangle_and_back_is_the_identity() {
        let mesh = torus(12, 8);
        let metric = Metric::new(&mesh);
        for h in mesh.halfedges() {
            let t = mesh.twin(h).unwrap();
            let turns = (metric.transport(h, t) + metric.transport(t, h)) / (2.0 * PI);
            assert!((turns - turns.round()).abs() < 1e-12);
        }
    }

    #[test]
    fn directions_are_those_of_tangents_in_space() {
        let mesh = torus(12, 8);
        let metric = Metric::new(&mesh);
        for f in mesh.faces() {
            let tangent = metric.tangent(&mesh, f, 0.7);
            assert!((tangent.length() - 1.0).abs() < 1e-12);
            assert!((metric.angle_of(&mesh, f, 3.0 * tangent).unwrap() - 0.7).abs() < 1e-12);
            assert_eq!(metric.angle_of(&mesh, f, mesh.face_normal(f)), None);
        }
    }

    #[test]
    fn a_degenerate_triangle_has_an_area_and_finite_angles() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0, DVec3::Y];
        let mesh = TriMesh::from_faces(corners.to_vec(), &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let metric = Metric::new(&mesh);
        assert!(metric.area(FaceId(0)) > 0.0);
        let angles = mesh.face_halfedges(FaceId(0)).map(|h| metric.corner_angle(h));
        assert!(angles.iter().all(|a| *a > 0.0) && (angles.iter().sum::<f64>() - PI).abs() < 1e-9, "{angles:?}");
    }
}
