//! The intrinsic metric of a mesh: every triangle laid out in its own plane.
//!
//! Directions in a triangle are angles from its half-edge 0, counter-clockwise; unfolding two triangles about
//! their common edge transports a direction from one to the other. Lengths are those of the mesh, all enlarged
//! by the same tiny amount if that is needed to keep every triangle inequality strict ("mollified": Sharp and
//! Crane, A Laplacian for Nonmanifold Triangle Meshes, section 4.5), so that slivers and collapsed triangles have
//! finite cotangents and every angle exists.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// By how much, relative to the mean edge length, two sides of a triangle outlast the third: small enough not to
/// be seen, large enough for cotangents below 100 in a collapsed triangle of mean size.
const SLACK: f64 = 1e-4;

/// Planar layouts of all triangles.
#[derive(Debug, Clone)]
pub struct Metric {
    /// Corners of each triangle: 0 in the origin, 1 on the positive first axis, 2 above it.
    layout: Vec<[DVec2; 3]>,
    /// Direction of each half-edge in its triangle.
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

    /// The direction of a half-edge in the plane of its triangle.
    #[inline]
    pub fn direction(&self, h: HalfedgeId) -> f64 {
        self.direction[h.index()]
    }

    /// The length of a half-edge.
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

    /// The interior angle at the origin of a half-edge.
    #[inline]
    pub fn corner_angle(&self, h: HalfedgeId) -> f64 {
        let corners = &self.layout[h.index() / 3];
        let i = h.index() % 3;
        side(corners, i).angle_to(-side(corners, (i + 2) % 3))
    }

    /// What is to be added to a direction in the triangle of `h` to have it in the triangle of its twin.
    #[inline]
    pub fn transport(&self, h: HalfedgeId, twin: HalfedgeId) -> f64 {
        self.direction(twin) + PI - self.direction(h)
    }

    /// `2π` minus the angles at an inner vertex, `π` minus those at a boundary vertex.
    pub fn curvature(&self, mesh: &TriMesh, v: VertexId) -> f64 {
        let flat = if mesh.is_boundary_vertex(v) { PI } else { 2.0 * PI };
        flat - mesh.outgoing(v).map(|h| self.corner_angle(h)).sum::<f64>()
    }

    /// The unit tangent vector in space of a direction in a triangle; zero where the triangle has no normal.
    pub fn tangent(&self, mesh: &TriMesh, f: FaceId, angle: f64) -> DVec3 {
        let x = mesh.vector(mesh.face_halfedges(f)[0]).normalize_or_zero();
        let y = mesh.face_normal(f).cross(x);
        x * angle.cos() + y * angle.sin()
    }

    /// The direction in a triangle of the projection of a vector; `None` where that vanishes.
    pub fn angle_of(&self, mesh: &TriMesh, f: FaceId, vector: DVec3) -> Option<f64> {
        let x = mesh.vector(mesh.face_halfedges(f)[0]).normalize_or_zero();
        let y = mesh.face_normal(f).cross(x);
        let flat = DVec2::new(vector.dot(x), vector.dot(y));
        (flat.length_squared() > 1e-24 * vector.length_squared()).then(|| flat.to_angle())
    }
}

/// The vector along side `i` of a triangle.
#[inline]
fn side(corners: &[DVec2; 3], i: usize) -> DVec2 {
    corners[(i + 1) % 3] - corners[i]
}

/// The planar triangle of given side lengths, all triangle inequalities strict.
fn lay_out([a, b, c]: [f64; 3]) -> [DVec2; 3] {
    // Area by the sorted form of Heron's formula, which keeps its digits for thin triangles (Kahan).
    let mut s = [a, b, c];
    s.sort_by(|p, q| q.total_cmp(p));
    let [l, m, n] = s;
    let area = 0.25 * ((l + (m + n)) * (n - (l - m)) * (n + (l - m)) * (l + (m - n))).max(0.0).sqrt();
    let x = (a * a + c * c - b * b) / (2.0 * a);
    [DVec2::ZERO, DVec2::new(a, 0.0), DVec2::new(x, 2.0 * area / a)]
}
