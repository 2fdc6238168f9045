//! The sizing field: by how much the map is to stretch at each triangle, so that the crosses so sized come from a
//! map as nearly as possible.
//!
//! Unit crosses that turn are no gradients. Scaled by `e^φ`, the direction fields û and v̂ of a cross of angle θ are
//! free of curl where `∇φ = J∇θ`, with J the quarter turn counter-clockwise: the curl of `e^φ û` is
//! `e^φ (∇θ·û − ∇φ·v̂)`, that of `e^φ v̂` is `e^φ (∇θ·v̂ + ∇φ·û)`. Hence `∫ |∇φ − J∇θ|² + φ²/ℓ²` is minimised, with φ
//! linear between vertices (Campen, section 6.4.3, after Ray et al., Periodic Global Parameterization). The
//! derivative of J∇θ along an edge is what θ turns across it over the distance of the two centres, and the cotangent
//! weight is that distance over the edge's length; so the right-hand side at a vertex is the sum of the turns about
//! it. Inside the surface this is the curvature of the vertex less that of its singularity: φ depends on the
//! singularities alone, not on the angles between them. The second term keeps φ near 0; without it φ grows towards
//! singularities and along cones beyond use.

use std::f64::consts::FRAC_PI_2;

use crate::mesh::{EdgeId, TriMesh};
use crate::solve::{SolveError, SparseHermitian, SpdFactor, SpdSymbolic};
use crate::surface::Metric;

/// Distance ℓ over which lengths go back to the mean, in bounding-box diagonals. In maps along guided fields this
/// lowers the residual of unit lengths from 0.073 to 0.023 (Fertility), 0.147 to 0.025 (elephant), 0.124 to 0.070
/// (rocker arm), 0.070 to 0.035 (fan disk) and 0.101 to 0.077 (bunny), within 8 percent of what no return would give;
/// at 0.2 the elephant keeps 0.054.
const REACH: f64 = 1.0;
/// Largest length, and reciprocal of the smallest, relative to the mean. Beyond it only the elephant (0.29 to 3.3) and
/// the rocker arm (2.7) would go, for a gain of at most 5 percent, and quads would be as uneven as lengths.
const MOST: f64 = 2.5;
/// Rounds of clamping lengths and restoring their mean, each of which leaves a small part of what the clamps took.
const ROUNDS: usize = 3;

/// For each edge what the cross turns from the triangle of [`TriMesh::halfedge`] to that of its twin beyond the
/// period jump; 0 on the boundary. `jump` has whole numbers, not reduced modulo four, and what is left is not
/// reduced either.
pub fn residual_rotations(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i32]) -> Vec<f64> {
    let rest = |e: EdgeId| {
        let h = mesh.halfedge(e);
        let Some(t) = mesh.twin(h) else { return 0.0 };
        let turn = angle[mesh.face(t).index()] - angle[mesh.face(h).index()] - metric.transport(h, t);
        turn - f64::from(jump[e.index()]) * FRAC_PI_2
    };
    mesh.edges().map(rest).collect()
}

/// The factored system for sizes on one mesh; serves any cross field on it.
#[derive(Debug, Clone)]
pub struct SizingSystem {
    matrix: SparseHermitian<f64>,
    symbolic: SpdSymbolic,
    factor: SpdFactor<f64>,
}

impl SizingSystem {
    /// Sets up the system; `symbolic` from an earlier one on a mesh of the same triangles.
    ///
    /// # Errors
    ///
    /// See [`SolveError`].
    pub fn new(mesh: &TriMesh, metric: &Metric, symbolic: Option<SpdSymbolic>) -> Result<Self, SolveError> {
        let mut triplets = Vec::with_capacity(3 * mesh.n_halfedges());
        for f in mesh.faces() {
            let mass = metric.area(f) / 3.0 / (REACH * REACH);
            for h in mesh.face_halfedges(f) {
                let weight = 0.5 / metric.corner_angle(mesh.prev(h)).tan();
                let (a, b) = (mesh.origin(h).0, mesh.target(h).0);
                triplets.extend([(a, a, weight + mass), (b, b, weight), (a, b, -weight)]);
            }
        }
        let matrix = SparseHermitian::from_triplets(mesh.n_vertices(), &triplets);
        let symbolic = symbolic.map_or_else(|| SpdSymbolic::new(&matrix), Ok)?;
        let factor = symbolic.factor(&matrix)?;
        Ok(Self { matrix, symbolic, factor })
    }

    /// What the next system on the same triangles can reuse.
    pub fn symbolic(&self) -> SpdSymbolic {
        self.symbolic.clone()
    }

    /// The lengths that the gradients of u and of v should have in each triangle; such that the map keeps the area of
    /// the whole. Both are the same: with two scales, free of curl each along one direction only, they would be tied
    /// to the field's topology by their exchange across odd jumps. `rest` as from [`residual_rotations`].
    ///
    /// # Errors
    ///
    /// See [`SolveError`].
    pub fn lengths(&self, mesh: &TriMesh, metric: &Metric, rest: &[f64]) -> Result<Vec<[f64; 2]>, SolveError> {
        let mut rhs = vec![0.0; mesh.n_vertices()];
        for e in mesh.edges() {
            let h = mesh.halfedge(e);
            rhs[mesh.target(h).index()] += rest[e.index()];
            rhs[mesh.origin(h).index()] -= rest[e.index()];
        }
        let phi = self.factor.solve(&self.matrix, &rhs)?;
        let mean = |f| mesh.face_vertices(f).iter().map(|v| phi[v.index()]).sum::<f64>() / 3.0;
        let mut log: Vec<f64> = mesh.faces().map(mean).collect();
        for _ in 0..ROUNDS {
            keep_area(mesh, metric, &mut log);
        }
        Ok(log.into_iter().map(|l| [l.exp(); 2]).collect())
    }
}

/// Shifts logarithms of lengths such that the area stays the same, then clamps them.
fn keep_area(mesh: &TriMesh, metric: &Metric, log: &mut [f64]) {
    let (mut area, mut image) = (0.0, 0.0);
    for (f, l) in mesh.faces().zip(log.iter()) {
        area += metric.area(f);
        image += metric.area(f) * (2.0 * l).exp();
    }
    let shift = if image > 0.0 { 0.5 * (area / image).ln() } else { 0.0 };
    let bound = MOST.ln();
    for l in log {
        *l = (*l + shift).clamp(-bound, bound);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::{DVec2, DVec3};

    use super::*;
    use crate::field::samples::{cells, octasphere};
    use crate::field::{CrossField, feature_aligned_field, interpolate};
    use crate::mesh::sharp_edges;
    use crate::progress::Progress;
    use crate::testing::grid;

    /// Sum over inner regular vertices of the squared curl of both sized directions, over the area it is spread on.
    fn curl(mesh: &TriMesh, metric: &Metric, field: &CrossField, size: &[[f64; 2]]) -> f64 {
        let mut total = 0.0;
        for v in mesh.vertices().filter(|&v| !mesh.is_boundary_vertex(v)) {
            if field.singularities.iter().any(|s| s.vertex == v) {
                continue;
            }
            let (mut curl, mut area, mut branch) = (DVec2::ZERO, 0.0, 0);
            for h in mesh.outgoing(v) {
                let f = mesh.face(h);
                let opposite = metric.layout(f)[(h.index() + 2) % 3] - metric.layout(f)[(h.index() + 1) % 3];
                let u = DVec2::from_angle(field.angle[f.index()] + f64::from(branch) * FRAC_PI_2) * size[f.index()][0];
                curl += 0.5 * DVec2::new(u.dot(opposite), u.perp().dot(opposite));
                area += metric.area(f) / 3.0;
                // The next triangle about the vertex lies across the edge that comes in.
                branch -= field.jump_across(mesh, mesh.prev(h));
            }
            total += curl.length_squared() / area;
        }
        total
    }

    /// The jumps, not reduced, that leave the smallest rests.
    fn whole_jumps(mesh: &TriMesh, metric: &Metric, angle: &[f64]) -> Vec<i32> {
        let turns = residual_rotations(mesh, metric, angle, &vec![0; mesh.n_edges()]);
        turns.iter().map(|t| (t / FRAC_PI_2).round() as i32).collect()
    }

    /// How much the lengths for a field of circles and rays lower its curl, on a ring lifted to a cone by `slope`.
    fn gain(slope: f64) -> (f64, Vec<[f64; 2]>, TriMesh) {
        let mesh = grid(80, 12, [true, false], |u, v| {
            let r = 0.25 + 0.1 * v;
            DVec3::new(r * (TAU * u).cos(), -r * (TAU * u).sin(), slope * r)
        });
        let metric = Metric::new(&mesh);
        let circles: Vec<bool> = mesh
            .edges()
            .map(|e| {
                let [a, b] = mesh.edge_vertices(e).map(|v| mesh.position(v).truncate().length());
                (a - b).abs() < 1e-9
            })
            .collect();
        let field = interpolate(&mesh, &metric, &[], &circles, &Progress::new()).unwrap();
        let rest = residual_rotations(&mesh, &metric, &field.angle, &whole_jumps(&mesh, &metric, &field.angle));
        let size = SizingSystem::new(&mesh, &metric, None).unwrap().lengths(&mesh, &metric, &rest).unwrap();
        let before = curl(&mesh, &metric, &field, &vec![[1.0; 2]; mesh.n_faces()]);
        (before / curl(&mesh, &metric, &field, &size), size, mesh)
    }

    #[test]
    fn circles_and_rays_become_a_gradient() {
        for slope in [0.0, 1.0] {
            let (gain, size, mesh) = gain(slope);
            assert!(gain > 10.0, "{slope} {gain}");
            // The gradient of ln r.
            for f in mesh.faces() {
                let r = mesh.face_vertices(f).map(|v| mesh.position(v).truncate().length()).iter().sum::<f64>() / 3.0;
                assert!((size[f.index()][0] * r / 0.3 - 1.0).abs() < 0.05, "{r} {}", size[f.index()][0]);
            }
        }
    }

    #[test]
    fn a_cube_needs_no_other_lengths_and_a_sphere_needs_longer_ones_at_its_corners() {
        let lengths = |mesh: &TriMesh, sharp: &[bool]| {
            let metric = Metric::new(mesh);
            let field = feature_aligned_field(mesh, &metric, None, sharp, &Progress::new()).unwrap();
            let rest = residual_rotations(mesh, &metric, &field.angle, &whole_jumps(mesh, &metric, &field.angle));
            (SizingSystem::new(mesh, &metric, None).unwrap().lengths(mesh, &metric, &rest).unwrap(), metric, field)
        };
        let cube = cells(&[[0, 0, 0]], 6);
        let (even, ..) = lengths(&cube, &sharp_edges(&cube, 0.5));
        assert!(even.iter().all(|l| (l[0] - 1.0).abs() < 1e-3));
        let sphere = octasphere(16);
        let (lengths, metric, field) = lengths(&sphere, &[]);
        let mean = |v| {
            let faces: Vec<usize> = sphere.outgoing(v).map(|h| sphere.face(h).index()).collect();
            faces.iter().map(|&f| lengths[f][0]).sum::<f64>() / faces.len() as f64
        };
        assert!(!field.singularities.is_empty());
        assert!(field.singularities.iter().all(|s| (mean(s.vertex) > 1.1) == (s.index > 0)));
        let kept: f64 = sphere.faces().map(|f| metric.area(f) * (lengths[f.index()][0].powi(2) - 1.0)).sum();
        assert!(kept.abs() < 1e-9);
    }

    #[test]
    fn an_analysis_serves_other_positions() {
        let (first, second) =
            (octasphere(6), octasphere(6).positions().iter().map(|&p| p * DVec3::new(1.0, 0.5, 1.0)).collect());
        let faces: Vec<[u32; 3]> = first.faces().map(|f| first.face_vertices(f).map(|v| v.0)).collect();
        let second = TriMesh::from_faces(second, &faces).unwrap();
        let metric = Metric::new(&second);
        let field = feature_aligned_field(&second, &metric, None, &[], &Progress::new()).unwrap();
        let rest = residual_rotations(&second, &metric, &field.angle, &whole_jumps(&second, &metric, &field.angle));
        let reused = SizingSystem::new(&first, &Metric::new(&first), None).unwrap().symbolic();
        let lengths =
            |symbolic| SizingSystem::new(&second, &metric, symbolic).unwrap().lengths(&second, &metric, &rest);
        assert_eq!(lengths(Some(reused)).unwrap(), lengths(None).unwrap());
    }
}
