//! Smooth distances from the spine: gradients at the vertices of sheets, and isolines without kinks.
//!
//! The strip map is linear on each triangle, so its isolines have a kink at every edge. Here each vertex gets the mean
//! gradient of its triangles. Distances are adjusted to the gradients, and along each edge the two gradients give a
//! quadratic function, which the shader evaluates per pixel.

use glam::DVec3;
use plait_core::mesh::{FaceId, TriMesh};
use rayon::prelude::*;

use super::sheet::{NONE, Sheets, following, preceding};

/// Rounds of smoothing. More would move lines off the map; none leaves the noise of coarse meshes. Chosen by hand.
const ROUNDS: usize = 8;
/// Part of the way to the predicted distance in each round; 1 would oscillate. Chosen by hand.
const STEP: f64 = 0.6;

/// The gradients of the distance, on triangles and at vertices of sheets.
pub struct Gradients<'a> {
    mesh: &'a TriMesh,
    /// Unit normal and twice the area of each triangle.
    normals: Vec<(DVec3, f64)>,
    /// The mean gradient of the triangles around each vertex, in the tangent plane of the vertex.
    pub at_vertex: Vec<DVec3>,
    /// The length of the mean gradient divided by the mean length: 1 where all agree, near 0 where they contradict.
    pub coherence: Vec<f64>,
    vertex_normals: Vec<DVec3>,
}

impl<'a> Gradients<'a> {
    /// The gradients of the distances of `sheets` on `mesh`.
    pub fn new(mesh: &'a TriMesh, sheets: &Sheets) -> Self {
        let scaled = |f: FaceId| {
            let [a, b, c] = mesh.face_vertices(f).map(|v| mesh.position(v));
            (b - a).cross(c - a)
        };
        let normals: Vec<_> = mesh.faces().map(|f| (scaled(f).normalize_or_zero(), scaled(f).length())).collect();
        let normal = |v: usize| {
            let sum: DVec3 = sheets.corners(v).iter().map(|&c| normals[c as usize / 6]).map(|(n, a)| n * a).sum();
            sum.try_normalize().unwrap_or(DVec3::Z)
        };
        let vertex_normals = (0..sheets.len()).into_par_iter().map(normal).collect();
        let mut gradients = Self { mesh, normals, vertex_normals, at_vertex: Vec::new(), coherence: Vec::new() };
        gradients.update(sheets);
        gradients
    }

    /// Computes the gradients anew from the present distances.
    fn update(&mut self, sheets: &Sheets) {
        let slots = sheets.vertex_of_corner.len() / 3;
        let slot = |s: usize| match sheets.vertex_of_corner[3 * s] {
            NONE => DVec3::ZERO,
            _ => self.on_triangle(sheets, 3 * s as u32),
        };
        let gradients: Vec<DVec3> = (0..slots).into_par_iter().map(slot).collect();
        let mean = |v: usize| {
            let (mut sum, mut lengths, mut weights) = (DVec3::ZERO, 0.0, 0.0);
            let up = self.vertex_normals[v];
            for &c in sheets.corners(v) {
                let (normal, area) = self.normals[c as usize / 6];
                let gradient = gradients[c as usize / 3];
                // Unfolded into the tangent plane, so that a sharp edge of the surface is no bend: the least rotation that
                // takes the normal up. The gradient is perpendicular to the normal.
                let turned = gradient - (normal + up) * (up.dot(gradient) / (1.0 + normal.dot(up)).max(1e-3));
                sum += turned * area;
                lengths += gradient.length() * area;
                weights += area;
            }
            (sum / f64::max(weights, 1e-300), sum.length() / f64::max(lengths, 1e-300))
        };
        let means: Vec<_> = (0..sheets.len()).into_par_iter().map(mean).collect();
        (self.at_vertex, self.coherence) = means.into_iter().unzip();
    }

    /// The gradient on the triangle of a corner; zero on a degenerate one.
    fn on_triangle(&self, sheets: &Sheets, c: u32) -> DVec3 {
        let (normal, double_area) = self.normals[c as usize / 6];
        if double_area < 1e-14 {
            return DVec3::ZERO;
        }
        let corners = [c, following(c), preceding(c)];
        let term = |i: usize| {
            let opposite = self.side(corners[(i + 1) % 3], corners[(i + 2) % 3]);
            normal.cross(opposite) * sheets.distance[sheets.vertex_of_corner[corners[i] as usize] as usize]
        };
        (term(0) + term(1) + term(2)) / double_area
    }

    /// The position of a corner.
    pub fn position(&self, c: u32) -> DVec3 {
        self.mesh.position(self.mesh.face_vertices(FaceId(c / 6))[c as usize % 3])
    }

    /// The vector from one corner of a triangle to another.
    pub fn side(&self, from: u32, to: u32) -> DVec3 {
        self.position(to) - self.position(from)
    }

    /// The change of the distance along `side` by the gradient at a vertex. The side is unfolded into the tangent plane.
    fn change(&self, vertex: usize, side: DVec3) -> f64 {
        let normal = self.vertex_normals[vertex];
        let tangent = (side - normal * normal.dot(side)).normalize_or_zero() * side.length();
        self.at_vertex[vertex].dot(tangent)
    }

    /// By how much the distance in the middle of a side, a control point of a quadratic Bézier triangle, exceeds the mean of
    /// its ends.
    pub fn bulge(&self, sheets: &Sheets, from: u32, to: u32) -> f64 {
        let side = self.side(from, to);
        let [a, b] = [from, to].map(|c| sheets.vertex_of_corner[c as usize] as usize);
        0.25 * (self.change(a, side) - self.change(b, side))
    }
}

/// Smooths the distances of `sheets`, and returns their gradients. The spines stay where they are.
pub fn smooth<'a>(mesh: &'a TriMesh, sheets: &mut Sheets) -> Gradients<'a> {
    let mut gradients = Gradients::new(mesh, sheets);
    for _ in 0..ROUNDS {
        // For each corner, the change of the distance to the following one by the gradients at both, and the weight of that.
        let side = |c: usize| match sheets.vertex_of_corner[c] {
            NONE => (0.0, 0.0),
            v => {
                let next = following(c as u32);
                let (side, w) = (gradients.side(c as u32, next), sheets.vertex_of_corner[next as usize]);
                let change = gradients.change(v as usize, side) + gradients.change(w as usize, side);
                (0.5 * change, 1.0 / side.length().max(1e-9))
            }
        };
        let sides: Vec<(f64, f64)> = (0..sheets.vertex_of_corner.len()).into_par_iter().map(side).collect();
        let adjusted = |v: usize| {
            let present = sheets.distance[v];
            if sheets.is_on_spine(v) {
                return present;
            }
            let (mut sum, mut weights) = (0.0, 0.0);
            for &c in sheets.corners(v) {
                let (next, last) = (following(c), preceding(c));
                for (other, (change, weight), sign) in
                    [(next, sides[c as usize], -1.0), (last, sides[last as usize], 1.0)]
                {
                    let distance = sheets.distance[sheets.vertex_of_corner[other as usize] as usize];
                    sum += weight * (distance + sign * change);
                    weights += weight;
                }
            }
            present + STEP * (sum / weights - present)
        };
        sheets.distance = (0..sheets.len()).into_par_iter().map(adjusted).collect();
        gradients.update(sheets);
    }
    gradients
}
