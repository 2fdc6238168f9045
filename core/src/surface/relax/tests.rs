use super::testing::{Random, class_numbers, cylinder, dual_cycle, real_mesh, ring, torus, upright};
use super::*;

fn relaxed(mesh: &TriMesh, curve: &SurfaceCurve, options: &RelaxOptions<'_>) -> Relaxed {
    let result = relax(mesh, curve, options, &Progress::new()).unwrap();
    assert_eq!(result.curve.check(mesh), Ok(()));
    assert!(result.after.total <= result.before.total);
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
    // A straight ring is as long as the polygonal cylinder is round.
    assert!(result.after.length < 1.002 * 0.5 * std::f64::consts::PI, "{result:?}");
    assert_eq!(class_numbers(&mesh, &curve, 60), class_numbers(&mesh, &result.curve, 60));
}

#[test]
fn a_noisy_ring_of_a_torus_keeps_class_and_place() {
    let mesh = torus(48, 20, 0.2);
    for row in 0..20 {
        let curve = ring(&mesh, 48, row, 0.45);
        let result = relaxed(&mesh, &curve, &RelaxOptions::default());
        assert!(result.after.bending < 0.2 * result.before.bending, "row {row}: {result:?}");
        assert_eq!(class_numbers(&mesh, &curve, 60), class_numbers(&mesh, &result.curve, 60));
        assert!(result.max_displacement < 0.12);
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
fn an_anchor_stays() {
    let mesh = cylinder(40, 22, 0.25);
    let curve = ring(&mesh, 40, 10, 0.4);
    let options = RelaxOptions { anchors: vec![Anchor::Crossing(17), Anchor::Crossing(50)], ..RelaxOptions::default() };
    let result = relaxed(&mesh, &curve, &options);
    assert!(result.improved);
    for (&now, then) in result.anchors.iter().zip([17, 50]) {
        assert!(result.curve.point(&mesh, now).distance(curve.point(&mesh, then)) < 1e-12);
    }
    let bad = RelaxOptions { anchors: vec![Anchor::Crossing(80)], ..RelaxOptions::default() };
    let error = relax(&mesh, &curve, &bad, &Progress::new()).unwrap_err();
    assert_eq!(error, RelaxError::UnknownAnchor { anchor: 0 });
}

#[test]
fn alignment_turns_the_curve() {
    let mesh = cylinder(40, 22, 0.25);
    let curve = ring(&mesh, 40, 10, 0.4);
    let q = |_: FaceId, d: DVec3| 10.0 * (1.0 - d.z.abs());
    let options = RelaxOptions { alignment: Some(&q), ..RelaxOptions::default() };
    let result = relaxed(&mesh, &curve, &options);
    assert!(result.improved && result.after.alignment > 0.0);
}

#[test]
fn cancelling_is_heard() {
    let mesh = cylinder(12, 6, 0.0);
    let progress = Progress::new();
    progress.cancel();
    let error = relax(&mesh, &ring(&mesh, 12, 3, 0.3), &RelaxOptions::default(), &progress).unwrap_err();
    assert_eq!(error, RelaxError::Cancelled(Cancelled));
}

#[test]
fn random_curves_on_real_meshes() {
    for file in
        ["rockerarm_5k.obj", "fertility_13k.off", "cino_3holes.obj", "half_torus.obj", "cad_upright_slivers.off"]
    {
        let Some(mesh) = real_mesh(file) else {
            eprintln!("no mesh {file}: skipped");
            continue;
        };
        let mut random = Random(42);
        for _ in 0..12 {
            let Some(curve) = dual_cycle(&mesh, &mut random) else { continue };
            let start = std::time::Instant::now();
            let result = relaxed(&mesh, &curve, &RelaxOptions::default());
            eprintln!(
                "{file} n {} -> {} L {:.3}->{:.3} B {:.1}->{:.2} disp {:.4} passed {} {:.2}ms",
                curve.crossings.len(),
                result.curve.crossings.len(),
                result.before.length,
                result.after.length,
                result.before.bending,
                result.after.bending,
                result.max_displacement,
                result.passed,
                start.elapsed().as_secs_f64() * 1e3
            );
            assert_eq!(class_numbers(&mesh, &curve, 40), class_numbers(&mesh, &result.curve, 40));
        }
    }
}
