//! The sizing field: the gradient lengths of a map, chosen so that the sized cross field has little curl.
//!
//! A unit cross field that turns is not a gradient. Scaled by `e^φ`, the directions û and v̂ of a cross of angle θ are free
//! of curl if `∇φ = J∇θ`, with J the counter-clockwise quarter turn: the curl of `e^φ û` is `e^φ (∇θ·û − ∇φ·v̂)`, that of
//! `e^φ v̂` is `e^φ (∇θ·v̂ + ∇φ·û)`. Hence `∫ |∇φ − J∇θ|² + φ²/ℓ²` is minimised, with φ linear in triangles (Campen,
//! section 6.4.3, after Ray et al., Periodic Global Parameterization).
//!
//! Along an edge, J∇θ is the residual rotation across the edge over the distance of the two centres, and the cotangent
//! weight is that distance over the edge's length. So the right-hand side at a vertex is the sum of the residual rotations
//! around it; at an inner vertex this is its angle defect less its index. φ therefore depends on the singularities only,
//! not on the angles between them. The second term keeps φ near 0; without it φ diverges towards singularities and along
//! cones.

use std::f64::consts::FRAC_PI_2;

use crate::mesh::{EdgeId, TriMesh};
use crate::solve::{SolveError, SparseHermitian, SpdFactor, SpdSymbolic};
use crate::surface::Metric;

/// Length ℓ over which φ decays to 0, in model sizes. In maps along guiding fields sizing lowers the residual from
/// 0.073 to 0.023 (Fertility), 0.147 to 0.025 (elephant), 0.124 to 0.070 (rocker arm), 0.070 to 0.035 (fan disk) and 0.101
/// to 0.077 (bunny), within 8 percent of the values without decay; with ℓ = 0.2 the elephant keeps 0.054.
const DECAY_LENGTH: f64 = 1.0;
/// Largest length, and reciprocal of the smallest, relative to the mean. Without the bound only the elephant (0.29 to 3.3)
/// and the rocker arm (2.7) would exceed it, with a residual at most 5 percent smaller; quads would be as uneven as lengths.
const MAX_LENGTH: f64 = 2.5;
/// Rounds of restoring the area and clamping lengths; after each a small part of the area removed by clamping is missing.
const CLAMPING_ROUNDS: usize = 3;

/// The residual rotation of each edge, from the triangle of [`TriMesh::halfedge`] to that of its twin: the rotation of
/// the angle beyond the period jump, in radians; 0 on the boundary. Neither `jump` nor the result is reduced modulo full
/// turns.
pub fn residual_rotations(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i32]) -> Vec<f64> {
    let residual = |e: EdgeId| {
        let h = mesh.halfedge(e);
        let Some(t) = mesh.twin(h) else { return 0.0 };
        let turn = angle[mesh.face(t).index()] - angle[mesh.face(h).index()] - metric.transport(h, t);
        turn - f64::from(jump[e.index()]) * FRAC_PI_2
    };
    mesh.edges().map(residual).collect()
}

/// The factored system for the sizing field on a mesh; independent of the cross field.
#[derive(Debug, Clone)]
pub struct SizingSystem {
    matrix: SparseHermitian<f64>,
    symbolic: SpdSymbolic,
    factor: SpdFactor<f64>,
}

impl SizingSystem {
    /// Assembles and factors the system. `symbolic` is that of an earlier system on a mesh of the same triangles, if any.
    ///
    /// # Errors
    ///
    /// See [`SolveError`].
    pub fn new(mesh: &TriMesh, metric: &Metric, symbolic: Option<SpdSymbolic>) -> Result<Self, SolveError> {
        let mut triplets = Vec::with_capacity(3 * mesh.n_halfedges());
        for f in mesh.faces() {
            let mass = metric.area(f) / 3.0 / (DECAY_LENGTH * DECAY_LENGTH);
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

    /// The symbolic analysis, to be reused for a mesh of the same triangles at other positions.
    pub fn symbolic(&self) -> SpdSymbolic {
        self.symbolic.clone()
    }

    /// The lengths of the gradients of u and v in each triangle, for which the map keeps the total area. `rotation` is as
    /// from [`residual_rotations`]. Both lengths are equal: two scales, each free of curl along one direction, would be
    /// exchanged across odd period jumps and so depend on the topology of the field.
    ///
    /// # Errors
    ///
    /// See [`SolveError`].
    pub fn lengths(&self, mesh: &TriMesh, metric: &Metric, rotation: &[f64]) -> Result<Vec<[f64; 2]>, SolveError> {
        let mut rhs = vec![0.0; mesh.n_vertices()];
        for e in mesh.edges() {
            let h = mesh.halfedge(e);
            rhs[mesh.target(h).index()] += rotation[e.index()];
            rhs[mesh.origin(h).index()] -= rotation[e.index()];
        }
        let phi = self.factor.solve(&self.matrix, &rhs)?;
        let mean = |f| mesh.face_vertices(f).iter().map(|v| phi[v.index()]).sum::<f64>() / 3.0;
        let mut log: Vec<f64> = mesh.faces().map(mean).collect();
        for _ in 0..CLAMPING_ROUNDS {
            keep_area(mesh, metric, &mut log);
        }
        Ok(log.into_iter().map(|l| [l.exp(); 2]).collect())
    }
}

/// Shifts the logarithms of lengths so that the total area of the image is that of the mesh, then clamps them.
fn keep_area(mesh: &TriMesh, metric: &Metric, log: &mut [f64]) {
    let (mut area, mut image) = (0.0, 0.0);
    for (f, l) in mesh.faces().zip(log.iter()) {
        area += metric.area(f);
        image += metric.area(f) * (2.0 * l).exp();
    }
    let shift = if image > 0.0 { 0.5 * (area / image).ln() } else { 0.0 };
    let bound = MAX_LENGTH.ln();
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

    /// The jumps, not reduced, of smallest residual rotation.
    fn whole_jumps(mesh: &TriMesh, metric: &Metric, angle: &[f64]) -> Vec<i32> {
        let turns = residual_rotations(mesh, metric, angle, &vec![0; mesh.n_edges()]);
        turns.iter().map(|t| (t / FRAC_PI_2).round() as i32).collect()
    }

    /// The factor by which sizing lowers the curl of a field of circles and rays, on a flat ring or, with a `slope`, on a cone.
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
        let rotation = residual_rotations(&mesh, &metric, &field.angle, &whole_jumps(&mesh, &metric, &field.angle));
        let size = SizingSystem::new(&mesh, &metric, None).unwrap().lengths(&mesh, &metric, &rotation).unwrap();
        let before = curl(&mesh, &metric, &field, &vec![[1.0; 2]; mesh.n_faces()]);
        (before / curl(&mesh, &metric, &field, &size), size, mesh)
    }

    #[test]
    fn circles_and_rays_are_sized_to_a_gradient() {
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
    fn lengths_are_one_on_a_cube_and_larger_at_the_corners_of_a_sphere() {
        let lengths = |mesh: &TriMesh, sharp: &[bool]| {
            let metric = Metric::new(mesh);
            let field = feature_aligned_field(mesh, &metric, None, sharp, &Progress::new()).unwrap();
            let rotation = residual_rotations(mesh, &metric, &field.angle, &whole_jumps(mesh, &metric, &field.angle));
            (SizingSystem::new(mesh, &metric, None).unwrap().lengths(mesh, &metric, &rotation).unwrap(), metric, field)
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
    fn a_symbolic_analysis_serves_other_positions() {
        let (first, second) =
            (octasphere(6), octasphere(6).positions().iter().map(|&p| p * DVec3::new(1.0, 0.5, 1.0)).collect());
        let faces: Vec<[u32; 3]> = first.faces().map(|f| first.face_vertices(f).map(|v| v.0)).collect();
        let second = TriMesh::from_faces(second, &faces).unwrap();
        let metric = Metric::new(&second);
        let field = feature_aligned_field(&second, &metric, None, &[], &Progress::new()).unwrap();
        let rotation = residual_rotations(&second, &metric, &field.angle, &whole_jumps(&second, &metric, &field.angle));
        let reused = SizingSystem::new(&first, &Metric::new(&first), None).unwrap().symbolic();
        let lengths =
            |symbolic| SizingSystem::new(&second, &metric, symbolic).unwrap().lengths(&second, &metric, &rotation);
        assert_eq!(lengths(Some(reused)).unwrap(), lengths(None).unwrap());
    }
}
