//! Strip maps of shapes whose curves run along edges.

use super::*;
use crate::field::FieldError;
use crate::field::samples::*;
use crate::mesh::TriMesh;
use crate::progress::Progress;

fn map(mesh: &TriMesh, curves: &[Option<u32>]) -> StripMap {
    StripMap::new(mesh, curves, &Progress::new()).unwrap()
}

/// Seams are rotations by quarter turns and translations: edge vectors in uv agree up to a quarter turn.
fn check_seamless(mesh: &TriMesh, map: &StripMap) {
    for h in mesh.halfedges() {
        let Some(t) = mesh.twin(h) else { continue };
        let side = |h: crate::mesh::HalfedgeId| {
            let c = &map.uv[h.index() / 3];
            c[mesh.next(h).index() % 3] - c[h.index() % 3]
        };
        let (a, b) = (side(h), -side(t));
        let least = [a, a.perp(), -a, -a.perp()].iter().map(|r| (*r - b).length()).fold(f64::INFINITY, f64::min);
        assert!(least < 1e-9, "{h:?}: {a} {b}");
    }
}

#[test]
fn meridian_and_equator_of_a_torus_are_isolines() {
    let mesh = torus(24, 12);
    let mut curves = Vec::new();
    mark(&mesh, &mut curves, 0, |p| p.x > 0.0 && p.y.abs() < 1e-9);
    mark(&mesh, &mut curves, 1, |p| (p.truncate().length() - 0.46).abs() < 1e-9);
    let map = map(&mesh, &curves);
    assert!(map.residual < 1e-9);
    check_seamless(&mesh, &map);
    assert!(!map.flipped.contains(&true));
    assert_eq!(map.field.singularities, vec![]);
    // Without singularities each strip goes all the way around: every triangle is doubly covered.
    for c in &map.covered {
        let mut both = [c[0].unwrap(), c[1].unwrap()];
        both.sort_unstable();
        assert_eq!(both, [0, 1]);
    }
    assert_eq!(map.strips.iter().map(|s| s.curve).collect::<Vec<_>>(), vec![0, 1]);
}

#[test]
fn three_great_circles_of_a_sphere() {
    let mesh = octasphere(12);
    let mut curves = Vec::new();
    for axis in 0..3 {
        mark(&mesh, &mut curves, axis as u32, |p| p[axis].abs() < 1e-9);
    }
    let map = map(&mesh, &curves);
    assert!(map.residual < 1e-9);
    check_seamless(&mesh, &map);
    // One valence-3 node in each octant, away from the circles.
    assert_eq!(map.field.singularities.len(), 8);
    for s in &map.field.singularities {
        assert_eq!(s.index, 1);
        assert!(mesh.position(s.vertex).abs().min_element() > 0.1);
    }
    let flipped = map.flipped.iter().filter(|&&f| f).count();
    assert!(flipped * 50 < mesh.n_faces(), "{flipped} of {}", mesh.n_faces());
    // By symmetry all strips are alike on both sides, and end at the singularities.
    for s in &map.strips {
        for b in s.widths {
            assert!(b > 0.1 && b < 0.25, "{:?}", s.widths);
            assert!((b - s.widths[0]).abs() < 0.02);
        }
    }
    let doubly = map.covered.iter().filter(|c| c[0].is_some() && c[1].is_some()).count();
    assert!(doubly * 10 > mesh.n_faces() * 8, "{doubly} of {}", mesh.n_faces());
}

#[test]
fn spine_distances_vanish_on_the_curve_only() {
    let mesh = octasphere(10);
    let mut curves = Vec::new();
    for axis in 0..3 {
        mark(&mesh, &mut curves, axis as u32, |p| p[axis].abs() < 1e-9);
    }
    let map = map(&mesh, &curves);
    let mut met = 0;
    for f in mesh.faces() {
        for family in 0..2 {
            let Some(strip) = map.covered[f.index()][family] else { continue };
            for (v, d) in mesh.face_vertices(f).into_iter().zip(map.spine_distance[f.index()][family]) {
                let height = mesh.position(v)[map.strips[strip as usize].curve as usize];
                if height.abs() < 1e-9 {
                    met += 1;
                    assert!(d.abs() < 1e-6);
                    // Along the circle its isolines are parallel to its plane, up to the size of a triangle.
                    let along = map.iso_direction(&mesh, f, family);
                    assert!(along[map.strips[strip as usize].curve as usize].abs() < 0.3, "{along}");
                } else {
                    // The sides of a strip are those of its plane.
                    assert!(f64::from(d).abs() > 1e-6);
                }
            }
        }
    }
    assert!(met > 100);
}

#[test]
fn a_curve_between_the_borders_of_a_ring() {
    let mesh = ring(40, 8);
    let mut curves = Vec::new();
    mark(&mesh, &mut curves, 0, |p| p.x > 0.0 && p.y.abs() < 1e-9);
    let map = map(&mesh, &curves);
    assert!(map.residual < 1e-9);
    check_seamless(&mesh, &map);
    assert_eq!(map.strips.len(), 1);
    assert!(map.strips[0].faces > 100);
    // Along the curve, isolines of its family run as it does.
    for f in mesh.faces() {
        for family in 0..2 {
            if map.covered[f.index()][family].is_some() {
                assert!((map.iso_direction(&mesh, f, family).length() - 1.0).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn slivers_leave_everything_finite_and_exact() {
    let sphere = octasphere(8);
    let mut curves = Vec::new();
    for axis in 0..3 {
        mark(&sphere, &mut curves, axis as u32, |p| p[axis].abs() < 1e-9);
    }
    let (mesh, curves) = slivers(&sphere, &curves, 600);
    let map = map(&mesh, &curves);
    assert!(map.uv.iter().flatten().all(|w| w.is_finite()));
    assert!(map.residual < 1e-9);
    check_seamless(&mesh, &map);
    let sum: i32 = map.field.singularities.iter().map(|s| i32::from(s.index)).sum();
    assert_eq!(sum, 8);
}

#[test]
fn without_curves_there_is_a_map_but_no_strip() {
    let mesh = plate(1, 3);
    let map = map(&mesh, &vec![None; mesh.n_edges()]);
    check_seamless(&mesh, &map);
    assert!(map.strips.is_empty());
    assert!(map.covered.iter().all(|c| *c == [None, None]));
}

#[test]
fn curves_may_cross_themselves_and_coincide_with_cuts() {
    // The meridian and the outer equator as one curve, and both sides of a cube of which every edge is a curve.
    let torus = torus(48, 12);
    let mut curves = Vec::new();
    mark(&torus, &mut curves, 5, |p| p.x > 0.0 && p.y.abs() < 1e-9);
    mark(&torus, &mut curves, 5, |p| (p.truncate().length() - 0.46).abs() < 1e-9);
    let one = map(&torus, &curves);
    assert_eq!(one.strips.iter().map(|s| s.curve).collect::<Vec<_>>(), vec![5, 5]);
    assert!(one.residual < 1e-9);
    assert!(one.covered.iter().all(|c| c[0].is_some() && c[1].is_some()));

    let cube = cells(&[[0, 0, 0]], 8);
    let mut curves = Vec::new();
    for axis in 0..3 {
        mark(&cube, &mut curves, axis as u32, |p| (p[axis] - 0.1).abs() < 1e-9);
    }
    let cube_map = map(&cube, &curves);
    check_seamless(&cube, &cube_map);
    // The cube is the product of its three loops: the map is an isometry and covers it twice.
    assert!(!cube_map.flipped.contains(&true));
    for s in &cube_map.strips {
        assert!(s.widths.iter().all(|b| (b - 0.1).abs() < 1e-6), "{:?}", s.widths);
    }
    assert!(cube_map.covered.iter().all(|c| c[0].is_some() && c[1].is_some()));
    for f in cube.faces() {
        let [a, b, c] = cube_map.uv[f.index()];
        assert!((0.5 * (b - a).perp_dot(c - a) - cube.face_area(f)).abs() < 1e-9);
    }
}

#[test]
fn two_components_one_without_curves() {
    let a = cells(&[[0, 0, 0], [3, 0, 0]], 4);
    let mut curves = Vec::new();
    mark(&a, &mut curves, 0, |p| (p.x - 0.1).abs() < 1e-9);
    let map = map(&a, &curves);
    check_seamless(&a, &map);
    assert_eq!(map.field.singularities.len(), 16);
    for f in a.faces() {
        if a.face_vertices(f).iter().any(|&v| a.position(v).x > 0.5) {
            assert_eq!(map.covered[f.index()], [None, None]);
        }
    }
}

#[test]
fn one_thread_and_two_agree_to_the_bit() {
    let sphere = octasphere(8);
    let mut curves = Vec::new();
    for axis in 0..3 {
        mark(&sphere, &mut curves, axis as u32, |p| p[axis].abs() < 1e-9);
    }
    let with = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| map(&sphere, &curves));
    let (one, two) = (with(1), with(2));
    assert_eq!(one.uv, two.uv);
    assert_eq!(one.spine_distance, two.spine_distance);
    assert_eq!(one.covered, two.covered);
}

#[test]
fn cancelled_work_stops() {
    let mesh = octasphere(4);
    let progress = Progress::new();
    progress.cancel();
    let result = StripMap::new(&mesh, &vec![None; mesh.n_edges()], &progress);
    assert!(matches!(result, Err(StripError::Field(FieldError::Cancelled(_)))));
    let wrong = StripMap::new(&mesh, &[], &Progress::new());
    assert!(matches!(wrong, Err(StripError::Field(FieldError::WrongLength { .. }))));
}
