//! Checks of cross fields on shapes whose fields are known.

use super::samples::*;
use super::*;
use crate::mesh::TriMesh;
use crate::progress::Progress;
use crate::surface::Metric;
use crate::testing::research_mesh;

fn sum(s: &[Singularity]) -> i64 {
    s.iter().map(|s| i64::from(s.index)).sum()
}

fn shape(mesh: &TriMesh) -> CrossField {
    feature_aligned_field(mesh, &Metric::new(mesh), None, &[], &Progress::new()).unwrap()
}

#[test]
fn transport_around_a_vertex_is_its_curvature() {
    let mesh = octasphere(4);
    let metric = Metric::new(&mesh);
    let total: f64 = mesh.vertices().map(|v| metric.curvature(&mesh, v)).sum();
    assert!((total - 4.0 * std::f64::consts::PI).abs() < 1e-9);
    for v in mesh.vertices() {
        let around: f64 =
            mesh.outgoing(v).map(|h| mesh.prev(h)).map(|h| metric.transport(h, mesh.twin(h).unwrap())).sum();
        assert!(super::period_jumps::wrap(around - metric.curvature(&mesh, v)).abs() < 1e-9);
    }
}

#[test]
fn a_loop_on_a_torus_and_a_circle_on_a_ring_need_no_singularities() {
    let torus = torus(96, 12);
    let mut curves = Vec::new();
    mark(&torus, &mut curves, 0, |p| p.x > 0.0 && p.y.abs() < 1e-9);
    let ring = ring(40, 8);
    let mut circle = Vec::new();
    mark(&ring, &mut circle, 7, |p| (p.length() - 0.35).abs() < 1e-9);
    for (mesh, curves, steps) in [(torus, curves, 12), (ring, circle, 40)] {
        let paths = trace_curves(&mesh, &Metric::new(&mesh), &curves).unwrap();
        assert_eq!((paths.len(), paths[0].closed, paths[0].steps.len()), (1, true, steps));
        let metric = Metric::new(&mesh);
        let field = interpolate(&mesh, &metric, &paths, &[], &Progress::new()).unwrap();
        assert_eq!(field.singularities, vec![]);
        for s in &paths[0].steps {
            let h = s.left(&mesh).unwrap();
            let along = mesh.vector(h).normalize();
            let best = field.direction(&mesh, &metric, mesh.face(h), field.branch_along(&metric, h, 0.0));
            assert!(along.dot(best) > 1.0 - 1e-9);
        }
    }
}

#[test]
fn indices_sum_to_four_times_the_euler_characteristic() {
    for holes in 0..=3 {
        let mesh = plate(holes, 3);
        assert_eq!(mesh.euler_characteristic(), i64::from(2 - 2 * holes));
        assert_eq!(sum(&shape(&mesh).singularities), 4 * mesh.euler_characteristic());
    }
    let ring = ring(30, 6);
    assert_eq!(sum(&shape(&ring).singularities), 0);
    let square = TriMesh::from_faces(
        vec![glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::ONE - glam::DVec3::Z, glam::DVec3::Y],
        &[[0, 1, 2], [0, 2, 3]],
    )
    .unwrap();
    let corners = shape(&square).singularities;
    assert_eq!((corners.len(), sum(&corners)), (4, 4));
}

#[test]
fn a_cube_keeps_its_eight_corners() {
    let mesh = cells(&[[0, 0, 0]], 8);
    let kept = cancel_opposite_pairs(&mesh, &shape(&mesh).singularities, 0.05);
    assert_eq!(kept.len(), 8);
    for s in kept {
        assert_eq!(s.index, 1);
        assert!(mesh.position(s.vertex).to_array().iter().all(|x| x.abs() < 1e-9 || (x - 0.2).abs() < 1e-9));
    }
}

#[test]
fn close_opposite_singularities_cancel() {
    let mesh = torus(24, 12);
    let at = |v: u32, index: i8| Singularity { vertex: crate::mesh::VertexId(v), index };
    let list = [at(0, 1), at(1, -1), at(100, 2), at(101, -1), at(200, 1)];
    assert_eq!(cancel_opposite_pairs(&mesh, &list, 0.1), vec![at(100, 1), at(200, 1)]);
    assert_eq!(cancel_opposite_pairs(&mesh, &list, 1e-3), list.to_vec());
}

#[test]
fn a_curve_may_cross_itself_but_not_end_inside() {
    let mesh = torus(24, 12);
    let mut curves = Vec::new();
    // A meridian and the outer equator of one curve: a figure eight on the torus.
    mark(&mesh, &mut curves, 3, |p| p.x > 0.0 && p.y.abs() < 1e-9);
    mark(&mesh, &mut curves, 3, |p| (p.truncate().length() - 0.46).abs() < 1e-9);
    let paths = trace_curves(&mesh, &Metric::new(&mesh), &curves).unwrap();
    let mut lengths: Vec<usize> = paths.iter().map(|p| p.steps.len()).collect();
    lengths.sort_unstable();
    assert_eq!(lengths, vec![12, 24]);
    curves[edge_between(&mesh, 0, 1).index()] = None;
    assert!(matches!(trace_curves(&mesh, &Metric::new(&mesh), &curves), Err(FieldError::OpenCurve { curve: 3, .. })));
}

#[test]
fn penalties_turn_the_field() {
    let mesh = torus(48, 12);
    let metric = Metric::new(&mesh);
    let centre = |f| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<glam::DVec3>() / 3.0;
    let directions: Vec<_> = mesh
        .faces()
        .map(|f| {
            let around = glam::DVec3::Z.cross(centre(f)).normalize();
            // Waving about the parallels.
            let slant = 0.4 * (4.0 * centre(f).y.atan2(centre(f).x)).sin();
            glam::DQuat::from_axis_angle(mesh.face_normal(f), slant) * around
        })
        .collect();
    let weights = vec![1.0; mesh.n_faces()];
    for (radius, most) in [(0.01, true), (10.0, false)] {
        let towards = AlignmentDirections { directions: &directions, weights: &weights, radius };
        let field = feature_aligned_field(&mesh, &metric, Some(towards), &[], &Progress::new()).unwrap();
        let near = |f: &crate::mesh::FaceId| {
            (0..4).any(|b| field.direction(&mesh, &metric, *f, b).dot(directions[f.index()]) > 0.99)
        };
        assert_eq!(mesh.faces().filter(near).count() * 10 > mesh.n_faces() * 9, most);
        assert_eq!(sum(&field.singularities), 0);
    }
}

#[test]
fn sharp_edges_are_followed() {
    let mesh = cells(&[[0, 0, 0]], 6);
    let metric = Metric::new(&mesh);
    let sharp: Vec<bool> = mesh
        .edges()
        .map(|e| {
            let h = mesh.halfedge(e);
            let n = [h, mesh.twin(h).unwrap()].map(|h| mesh.face_normal(mesh.face(h)));
            n[0].dot(n[1]) < 0.5
        })
        .collect();
    let field = feature_aligned_field(&mesh, &metric, None, &sharp, &Progress::new()).unwrap();
    assert_eq!(field.singularities.len(), 8);
    for e in mesh.edges().filter(|e| sharp[e.index()]) {
        let h = mesh.halfedge(e);
        let best = field.direction(&mesh, &metric, mesh.face(h), field.branch_along(&metric, h, 0.0));
        assert!(best.dot(mesh.vector(h).normalize()) > 1.0 - 1e-9);
    }
    assert!(feature_aligned_field(&mesh, &metric, None, &sharp[1..], &Progress::new()).is_err());
}

#[test]
fn the_smoothed_tangent_of_a_zigzag_deviates_from_its_edges() {
    // Along a ring's circle, every second vertex moved in and out: edges tilt, the smoothed direction does not.
    let flat = ring(60, 8);
    let mut positions = flat.positions().to_vec();
    for i in (0..60).step_by(2) {
        let v = i * 9 + 4;
        positions[v] *= 1.04;
    }
    let faces: Vec<[u32; 3]> = flat.faces().map(|f| flat.face_vertices(f).map(|v| v.0)).collect();
    let mesh = TriMesh::from_faces(positions, &faces).unwrap();
    let mut curves = vec![None; mesh.n_edges()];
    for i in 0..60 {
        curves[edge_between(&mesh, i * 9 + 4, (i + 1) % 60 * 9 + 4).index()] = Some(0);
    }
    let metric = Metric::new(&mesh);
    let path = &trace_curves(&mesh, &metric, &curves).unwrap()[0];
    for (s, offset) in path.steps.iter().zip(&path.tangent_offset) {
        assert!(offset.abs() > 0.2);
        let h = s.left(&mesh).unwrap();
        let tangent = metric.tangent(&mesh, mesh.face(h), metric.direction(h) + offset);
        let middle = (mesh.position(s.from(&mesh)) + mesh.position(s.to(&mesh))).normalize();
        assert!(tangent.dot(middle).abs() < 0.12, "{}", tangent.dot(middle));
    }
}

#[test]
fn real_shapes_keep_tens_of_singularities() {
    for name in ["bunny_7k.off", "rockerarm_5k.obj"] {
        let Some(mesh) = research_mesh(name).map(|loaded| loaded.mesh) else { continue };
        let field = shape(&mesh);
        assert_eq!(sum(&field.singularities), 4 * mesh.euler_characteristic());
        let kept = cancel_opposite_pairs(&mesh, &field.singularities, 0.05);
        assert_eq!(sum(&kept), 4 * mesh.euler_characteristic());
        assert!((8..60).contains(&kept.len()), "{name}: {} of {}", kept.len(), field.singularities.len());
    }
}
