//! Tests of the relaxation as a whole.

use glam::DVec3;

use super::options::{RelaxError, RelaxOptions, Relaxed};
use super::relaxation::{curve_cost, relax};
use super::triangle_strip::TriangleStrip;
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::surface::curve::SurfaceCurve;
use crate::surface::point::SurfacePoint;
use crate::surface::testing::{
    Random, cylinder, dual_cycle, geodesic_polygon, homology_numbers, real_mesh, ring, torus, upright,
};
use crate::surface::vertex_fan::Side;

fn relaxed(mesh: &TriMesh, curve: &SurfaceCurve, options: &RelaxOptions<'_>) -> Relaxed {
    let result = relax(mesh, curve, options, &Progress::new()).unwrap();
    assert_eq!(result.curve.check(mesh), Ok(()));
    assert!(result.after.total <= result.before.total);
    let edges: f64 = curve.crossings.iter().map(|c| mesh.vector(c.halfedge).length()).sum();
    let tube = options.tube * edges / curve.crossings.len() as f64;
    assert!(result.max_displacement <= tube * (1.0 + 1e-6), "{} {tube}", result.max_displacement);
    let cost = curve_cost(mesh, &result.curve, options).unwrap();
    assert!((cost.total - result.after.total).abs() < 1e-9 * cost.total, "{cost:?} {:?}", result.after);
    result
}

#[test]
fn a_noisy_ring_of_a_cylinder_becomes_straight() {
    let mesh = cylinder(40, 22, 0.25);
    let curve = ring(&mesh, 40, 10, 0.4);
    let result = relaxed(&mesh, &curve, &RelaxOptions::default());
    assert!(result.after.bending < 1e-2 * result.before.bending, "{result:?}");
    // A straight ring has the circumference of the polygonal cylinder.
    assert!(result.after.length < 1.002 * 0.5 * std::f64::consts::PI, "{result:?}");
    assert_eq!(homology_numbers(&mesh, &curve, 60), homology_numbers(&mesh, &result.curve, 60));
}

#[test]
fn a_noisy_ring_of_a_torus_keeps_its_class_and_place() {
    let mesh = torus(48, 20, 0.2);
    for row in 0..20 {
        let curve = ring(&mesh, 48, row, 0.45);
        let result = relaxed(&mesh, &curve, &RelaxOptions::default());
        assert!(result.after.bending < 0.2 * result.before.bending, "row {row}: {result:?}");
        assert_eq!(homology_numbers(&mesh, &curve, 60), homology_numbers(&mesh, &result.curve, 60));
    }
}

#[test]
fn an_open_curve_meets_the_boundary_orthogonally() {
    let mesh = cylinder(30, 20, 0.2);
    let curve = upright(&mesh, 30, 20, 9);
    let result = relaxed(&mesh, &curve, &RelaxOptions::default());
    assert!(result.after.bending < 1e-2 * result.before.bending, "{result:?}");
    let points = result.curve.points(&mesh);
    for d in [points[1] - points[0], points[points.len() - 1] - points[points.len() - 2]] {
        assert!(d.normalize().z > 0.99, "{d}");
    }
}

#[test]
fn the_ends_of_a_slanted_curve_slide_over_boundary_vertices() {
    let mesh = cylinder(60, 12, 0.1);
    let strip = upright(&mesh, 60, 12, 9);
    // The same curve with each end passed over a boundary vertex, to opposite sides.
    let mut slanted = TriangleStrip::new(&strip);
    for (i, side) in [(0, Side::Left), (slanted.len() - 1, Side::Right)] {
        let run = slanted.run(&mesh, i, side).unwrap();
        assert!(slanted.pass_vertex(&mesh, run, side, 0.3));
    }
    let curve = slanted.curve();
    let options = RelaxOptions { tube: 4.0, ..RelaxOptions::default() };
    let result = relaxed(&mesh, &curve, &options);
    assert!(result.after.bending < 0.01 * result.before.bending, "{result:?}");
    assert!(result.after.length < 0.805, "{result:?}");
}

#[test]
fn a_curve_passes_its_waypoints() {
    let mesh = cylinder(40, 22, 0.25);
    let curve = ring(&mesh, 40, 10, 0.4);
    let free = relaxed(&mesh, &curve, &RelaxOptions::default());
    let distance = |c: &SurfaceCurve, p: DVec3| {
        let points = c.points(&mesh);
        points.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min)
    };
    for i in [17, 50] {
        // A point off the curve, in the tube.
        let face = mesh.face(curve.crossings[i].halfedge);
        let at = SurfacePoint { face, weights: [0.05, 0.05, 0.9] };
        let p = at.position(&mesh);
        let guided = relaxed(&mesh, &curve, &RelaxOptions { waypoints: vec![at.into()], ..RelaxOptions::default() });
        let (before, after) = (distance(&free.curve, p), distance(&guided.curve, p));
        assert!(after < 0.5 * before, "{before} {after}");
        assert!(guided.after.total < 1.2 * free.after.total, "{} {}", guided.after.total, free.after.total);
    }
}

#[test]
fn a_curve_is_relaxed_towards_its_alignment() {
    let mesh = cylinder(40, 22, 0.25);
    let curve = ring(&mesh, 40, 10, 0.4);
    let q = |_: FaceId, d: DVec3| 10.0 * (1.0 - d.z.abs());
    let options = RelaxOptions { alignment: Some(&q), ..RelaxOptions::default() };
    let result = relaxed(&mesh, &curve, &options);
    assert!(result.improved && result.after.alignment > 0.0);
}

#[test]
fn relaxation_can_be_cancelled() {
    let mesh = cylinder(12, 6, 0.0);
    let progress = Progress::new();
    progress.cancel();
    let error = relax(&mesh, &ring(&mesh, 12, 3, 0.3), &RelaxOptions::default(), &progress).unwrap_err();
    assert_eq!(error, RelaxError::Cancelled(Cancelled));
}

#[test]
fn random_curves_on_real_meshes_keep_their_class() {
    for file in
        ["rockerarm_5k.obj", "fertility_13k.off", "cino_3holes.obj", "half_torus.obj", "cad_upright_slivers.off"]
    {
        let Some(mesh) = real_mesh(file) else { continue };
        let mut random = Random(42);
        for curve in (0..12).filter_map(|_| dual_cycle(&mesh, &mut random)) {
            let result = relaxed(&mesh, &curve, &RelaxOptions::default());
            assert!(result.after.bending < 0.7 * result.before.bending, "{file}: {result:?}");
            assert_eq!(homology_numbers(&mesh, &curve, 40), homology_numbers(&mesh, &result.curve, 40));
        }
    }
}

#[test]
fn relaxation_is_deterministic_and_nearly_idempotent() {
    let mesh = torus(48, 20, 0.2);
    let curve = geodesic_polygon(&mesh, &zigzag(48, 20, 3));
    let first = relaxed(&mesh, &curve, &RelaxOptions::default());
    let again = relaxed(&mesh, &curve, &RelaxOptions::default());
    assert_eq!(first.curve, again.curve);
    let second = relaxed(&mesh, &first.curve, &RelaxOptions::default());
    assert!(second.after.total > 0.9 * first.after.total, "{:?} {:?}", first.after, second.after);
}

#[test]
fn a_vertex_distance_out_of_range_is_refused() {
    let mesh = cylinder(12, 6, 0.0);
    for t_min in [0.0, 0.5, f64::NAN] {
        let options = RelaxOptions { t_min, ..RelaxOptions::default() };
        let error = relax(&mesh, &ring(&mesh, 12, 3, 0.3), &options, &Progress::new()).unwrap_err();
        assert!(matches!(error, RelaxError::VertexDistance { .. }));
    }
}

/// Every fourth vertex of a torus, alternating between two neighbouring rows.
fn zigzag(nu: usize, nv: usize, row: usize) -> Vec<VertexId> {
    (0..nu / 4).map(|k| VertexId::new((row + nv + k % 2) % nv * nu + 4 * k)).collect()
}

#[test]
fn a_polygon_of_geodesics_becomes_smooth() {
    let mesh = torus(48, 20, 0.2);
    for row in 0..20 {
        let curve = geodesic_polygon(&mesh, &zigzag(48, 20, row));
        let result = relaxed(&mesh, &curve, &RelaxOptions::default());
        // Rows other than the innermost and the outermost have geodesic curvature themselves.
        assert!(result.after.bending < 0.1 * result.before.bending, "row {row}: {result:?}");
        assert_eq!(homology_numbers(&mesh, &curve, 60), homology_numbers(&mesh, &result.curve, 60));
    }
}
