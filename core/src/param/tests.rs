//! Seamless maps on shapes whose maps are known, and properties of their transitions.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use crate::field::samples::*;
use crate::field::{CrossField, cross_field, feature_aligned_field, indices};
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::Metric;
use crate::surface::SurfacePoint;
use crate::testing::square;

/// The field with a given direction in each triangle and the smallest period jumps.
fn along(mesh: &TriMesh, metric: &Metric, direction: impl Fn(FaceId) -> DVec3) -> CrossField {
    let angle: Vec<f64> = mesh.faces().map(|f| metric.angle_of(mesh, f, direction(f)).unwrap()).collect();
    let jump = |e| {
        let h = mesh.halfedge(e);
        mesh.twin(h).map_or(0, |t| {
            let turn = angle[t.index() / 3] - angle[h.index() / 3] - metric.transport(h, t);
            (turn / FRAC_PI_2).round() as i32
        })
    };
    let jumps: Vec<i32> = mesh.edges().map(jump).collect();
    cross_field(mesh, metric, &angle, &jumps)
}

/// The field along the edges of a lattice; the first direction differs between triangles.
fn lattice(mesh: &TriMesh, metric: &Metric) -> CrossField {
    along(mesh, metric, |f| {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| if f.0 % 3 == 0 { -a } else { a });
        let skip = (f.0 % 2) as usize;
        let flat: Vec<DVec3> = axes.into_iter().filter(|a| a.dot(mesh.face_normal(f)).abs() < 0.5).collect();
        flat[skip]
    })
}

fn nodes(field: &CrossField) -> Vec<VertexId> {
    field.singularities.iter().map(|s| s.vertex).collect()
}

fn solved(system: &mut SeamlessSystem, metric: &Metric, field: &CrossField) -> Solution {
    system.solve(metric, field, &Objective::default(), &Progress::new()).unwrap()
}

/// Checks that one transition maps both ends of every edge.
fn check_seamless(mesh: &TriMesh, map: &SeamlessMap) {
    for h in mesh.halfedges() {
        let (Some(across), Some(t)) = (map.transition(mesh, h), mesh.twin(h)) else { continue };
        let at = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
        assert!((across.apply(at(h)) - at(mesh.next(t))).length() < 1e-9);
        assert!((across.apply(at(mesh.next(h))) - at(t)).length() < 1e-9);
    }
}

/// The residual of a constraint.
fn residual(mesh: &TriMesh, map: &SeamlessMap, r: &CoordinateConstraint) -> f64 {
    let at = |p: &SurfacePoint| (0..3).map(|i| map.uv[p.face.index()][i] * p.weights[i]).sum::<DVec2>();
    let chain = r.crossed.iter().fold(Transition::IDENTITY, |t, &h| t.then(&map.transition(mesh, h).unwrap()));
    (chain.inverse().apply(at(&r.to)) - at(&r.from))[usize::from(r.axis)] - r.difference
}

/// A shortest chain of crossed half-edges between two triangles.
fn chain(mesh: &TriMesh, from: FaceId, to: FaceId) -> Vec<HalfedgeId> {
    let mut search = BreadthFirst::new(mesh.n_faces());
    search.start(from);
    while let Some(f) = search.visit() {
        for (h, g) in mesh.adjacent_faces(f) {
            search.reach(g, h);
        }
    }
    search.path_to(to, |h| mesh.face(*h)).unwrap()
}

/// Constraints between distant triangles, with residuals of 0.01 to 0.05 in `map`.
fn constraints_off(mesh: &TriMesh, map: &SeamlessMap, count: usize) -> Vec<CoordinateConstraint> {
    let far = mesh.n_faces() / 2;
    let one = |i: usize| {
        let [f, g] = [17 * i + 3, far + 29 * i].map(|k| FaceId::new(k % mesh.n_faces()));
        let crossed = chain(mesh, f, g);
        let from = SurfacePoint { face: f, weights: [0.2, 0.3, 0.5] };
        let to =
            SurfacePoint { face: g, weights: if i.is_multiple_of(2) { [0.0, 1.0, 0.0] } else { [0.5, 0.25, 0.25] } };
        let mut r = CoordinateConstraint { from, crossed, to, axis: (i % 2) as u8, difference: 0.0 };
        r.difference = residual(mesh, map, &r) + 0.01 * (1 + i % 5) as f64;
        r
    };
    (0..count).map(one).collect()
}

#[test]
fn square_is_mapped_to_itself() {
    let mesh = square(6);
    let metric = Metric::new(&mesh);
    let field = along(&mesh, &metric, |_| DVec3::X);
    let mut system = SeamlessSystem::new(&mesh, &field, &[], &[]).unwrap();
    let solution = solved(&mut system, &metric, &field);
    assert!(solution.energy < 1e-18);
    let origin = mesh.position(mesh.face_vertices(FaceId(0))[0]);
    for f in mesh.faces() {
        for (v, w) in mesh.face_vertices(f).into_iter().zip(solution.map.uv[f.index()]) {
            assert!((w - (mesh.position(v) - origin).truncate()).length() < 1e-12);
        }
    }
    let lengths = vec![[2.0, 3.0]; mesh.n_faces()];
    let objective = Objective { lengths, ..Objective::default() };
    let scaled = system.solve(&metric, &field, &objective, &Progress::new()).unwrap();
    assert!(scaled.energy < 1e-18);
    for (a, b) in solution.map.uv.iter().flatten().zip(scaled.map.uv.iter().flatten()) {
        assert!((*b - *a * DVec2::new(2.0, 3.0)).length() < 1e-12);
    }
}

#[test]
fn lattices_are_mapped_isometrically() {
    for (mesh, count) in [(cells(&[[0, 0, 0]], 6), 8), (plate(1, 3), 16), (plate(2, 2), 24)] {
        let metric = Metric::new(&mesh);
        let field = lattice(&mesh, &metric);
        let list = nodes(&field);
        assert_eq!(list.len(), count);
        assert!(
            indices(&mesh, &metric, &field.angle, &field.jump.iter().map(|&p| i32::from(p)).collect::<Vec<_>>())
                .iter()
                .all(|i| i.rem_euclid(4) <= 1 || i.rem_euclid(4) == 3)
        );
        let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
        let solution = solved(&mut system, &metric, &field);
        assert!(solution.energy < 1e-18, "{}", solution.energy);
        check_seamless(&mesh, &solution.map);
        for f in mesh.faces() {
            let [u, v] = solution.map.gradients(&metric, f);
            let axis = DVec2::from_angle(field.angle[f.index()]);
            assert!((u - axis).length() < 1e-9 && (v - axis.perp()).length() < 1e-9);
        }
        assert!(matches!(SeamlessSystem::new(&mesh, &field, &list[1..], &[]), Err(ParamError::Topology { .. })));
    }
}

#[test]
fn constraints_hold_across_cuts_and_around_handles() {
    for mesh in [cells(&[[0, 0, 0]], 5), plate(1, 3), plate(2, 3)] {
        let metric = Metric::new(&mesh);
        let field = lattice(&mesh, &metric);
        let list = nodes(&field);
        let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
        let plain = solved(&mut system, &metric, &field);
        let constraints = constraints_off(&mesh, &plain.map, 12);
        let cuts =
            |r: &CoordinateConstraint| r.crossed.iter().filter(|&&h| system.cut().crossing(&mesh, h).is_some()).count();
        assert!(constraints.iter().map(cuts).max() > Some(1));
        system.set_constraints(&mesh, &constraints).unwrap();
        let bent = solved(&mut system, &metric, &field);
        check_seamless(&mesh, &bent.map);
        for r in &constraints {
            assert!(residual(&mesh, &plain.map, r).abs() > 0.005);
            assert!(residual(&mesh, &bent.map, r).abs() < 1e-9);
        }
        assert!(bent.energy > 1e-6);
    }
}

#[test]
fn torus_has_the_prescribed_periods() {
    let mesh = torus(24, 12);
    let metric = Metric::new(&mesh);
    let centre = |f| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>();
    let field = along(&mesh, &metric, |f| DVec3::Z.cross(centre(f)));
    assert_eq!(field.singularities, vec![]);
    // Around the torus through the quads 0, 12, 24 ...; the chain crosses the diagonal and the far side of each.
    let crossed: Vec<HalfedgeId> = (0..24u32)
        .flat_map(|i| {
            let f = FaceId(2 * (12 * i));
            let across = chain(&mesh, f, FaceId(2 * (12 * ((i + 1) % 24))));
            assert_eq!(across.len(), 2);
            across
        })
        .collect();
    let point = SurfacePoint { face: FaceId(0), weights: [1.0, 0.0, 0.0] };
    let around =
        |axis, difference| CoordinateConstraint { from: point, crossed: crossed.clone(), to: point, axis, difference };
    let list = [around(0, 3.0), around(1, 0.25)];
    let mut system = SeamlessSystem::new(&mesh, &field, &[], &list).unwrap();
    let map = solved(&mut system, &metric, &field).map;
    check_seamless(&mesh, &map);
    for r in &list {
        assert!(residual(&mesh, &map, r).abs() < 1e-9);
    }
    system.set_differences(&[2.5, 0.0]).unwrap();
    let map = solved(&mut system, &metric, &field).map;
    assert!(residual(&mesh, &map, &around(0, 2.5)).abs() < 1e-9 && residual(&mesh, &map, &around(1, 0.0)).abs() < 1e-9);
}

#[test]
fn conflicting_and_malformed_constraints_are_reported() {
    let mesh = plate(1, 3);
    let metric = Metric::new(&mesh);
    let field = lattice(&mesh, &metric);
    let list = nodes(&field);
    let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
    let map = solved(&mut system, &metric, &field).map;
    let good = constraints_off(&mesh, &map, 6);
    let with = |more: CoordinateConstraint| {
        let all: Vec<CoordinateConstraint> = good.iter().cloned().chain([more]).collect();
        SeamlessSystem::new(&mesh, &field, &list, &all).err()
    };
    assert_eq!(with(good[2].clone()), None);
    let off = CoordinateConstraint { difference: good[2].difference + 0.1, ..good[2].clone() };
    assert!(matches!(with(off), Some(ParamError::Conflict { constraint: 2 | 6, .. })));
    // A point cannot differ from itself.
    let apart = CoordinateConstraint { crossed: vec![], to: good[0].from, difference: 0.1, ..good[0].clone() };
    assert!(matches!(with(apart), Some(ParamError::Conflict { constraint: 6, .. })));
    let broken = CoordinateConstraint { crossed: good[0].crossed[1..].to_vec(), ..good[0].clone() };
    assert_eq!(with(broken), Some(ParamError::Malformed { constraint: 6 }));
    let nan = CoordinateConstraint { difference: f64::NAN, ..good[0].clone() };
    assert_eq!(with(nan), Some(ParamError::Malformed { constraint: 6 }));
    let other = feature_aligned_field(&mesh, &metric, None, &[], &Progress::new()).unwrap();
    let refused = system.solve(&metric, &other, &Objective::default(), &Progress::new());
    assert!(matches!(refused, Err(ParamError::OtherJump { .. })));
}

/// Area-weighted mean square of the angle between the gradients and the field.
fn misalignment(metric: &Metric, field: &CrossField, map: &SeamlessMap) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for f in (0..map.uv.len()).map(FaceId::new) {
        let axis = DVec2::from_angle(field.angle[f.index()]);
        for (g, axis) in map.gradients(metric, f).into_iter().zip([axis, axis.perp()]) {
            sum += metric.area(f) * axis.angle_to(g).powi(2);
            total += metric.area(f);
        }
    }
    sum / total
}

#[test]
fn anisotropy_aligns_isolines_with_the_field() {
    let mesh = octasphere(10);
    let metric = Metric::new(&mesh);
    let field = feature_aligned_field(&mesh, &metric, None, &[], &Progress::new()).unwrap();
    let mut system = SeamlessSystem::new(&mesh, &field, &nodes(&field), &[]).unwrap();
    let [plain, strict] = [1.0, 10.0].map(|anisotropy| {
        let objective = Objective { anisotropy, ..Objective::default() };
        let map = system.solve(&metric, &field, &objective, &Progress::new()).unwrap().map;
        misalignment(&metric, &field, &map)
    });
    assert!(strict < 0.5 * plain, "{strict} {plain}");
}

#[test]
fn solution_minimises_the_energy() {
    let mesh = octasphere(5);
    let metric = Metric::new(&mesh);
    let field = feature_aligned_field(&mesh, &metric, None, &[], &Progress::new()).unwrap();
    let list = nodes(&field);
    let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
    let constraints = constraints_off(&mesh, &solved(&mut system, &metric, &field).map, 4);
    system.set_constraints(&mesh, &constraints).unwrap();
    let lengths = mesh.faces().map(|f| [1.0 + 0.1 * f64::from(f.0 % 3), 0.8]).collect();
    let objective = Objective { lengths, ..Objective::default() };
    let solution = system.solve(&metric, &field, &objective, &Progress::new()).unwrap();
    let (matrix, _) = system.assemble(&metric, &field, &objective).unwrap();
    let energy = |y: &[f64]| {
        residuals(&metric, &field.angle, &system.map(y).uv, &objective).iter().map(|r| r.energy).sum::<f64>()
    };
    // Around the minimum the energy is the quadratic form of the matrix.
    let step: Vec<f64> = (0..system.n_free()).map(|i| 0.1 * (1.7 * i as f64).sin()).collect();
    let moved: Vec<f64> = solution.free.iter().zip(&step).map(|(y, d)| y + d).collect();
    let rise: f64 = matrix.multiply(&step).iter().zip(&step).map(|(a, b)| a * b).sum();
    assert!((energy(&moved) - solution.energy - rise).abs() < 1e-9 * rise);
    assert!((energy(&solution.free) - solution.energy).abs() < 1e-12);
    for h in mesh.halfedges() {
        let w = solution.map.uv[h.index() / 3][h.index() % 3];
        for axis in 0..2 {
            assert_eq!(system.coordinate(h, axis).value(&solution.free), w[axis as usize]);
        }
    }
}

#[test]
fn reused_symbolic_factorisation_gives_the_same_bits() {
    let mesh = plate(1, 3);
    let metric = Metric::new(&mesh);
    let field = lattice(&mesh, &metric);
    let list = nodes(&field);
    let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
    let constraints = constraints_off(&mesh, &solved(&mut system, &metric, &field).map, 5);
    let mut fresh = SeamlessSystem::new(&mesh, &field, &list, &constraints).unwrap();
    let want = solved(&mut fresh, &metric, &field);
    // Change and restore the system by differences, by constraints and by a rebuild.
    fresh.set_differences(&[0.1; 5]).unwrap();
    assert_ne!(solved(&mut fresh, &metric, &field).free, want.free);
    fresh.set_differences(&constraints.iter().map(|r| r.difference).collect::<Vec<_>>()).unwrap();
    assert_eq!(solved(&mut fresh, &metric, &field).free, want.free);
    system.set_constraints(&mesh, &constraints).unwrap();
    assert_eq!(solved(&mut system, &metric, &field).free, want.free);
    fresh.rebuild(&mesh, &field, &list, &constraints).unwrap();

    let again = solved(&mut fresh, &metric, &field);
    assert_eq!((again.free, again.map.uv), (want.free, want.map.uv));
}

/// Checks that transitions agree with both ends of every edge, that those of twins are inverse, and that their
/// composition around a vertex is the identity, except for the rotation at singularities.
fn check_transitions(mesh: &TriMesh, field: &CrossField, map: &SeamlessMap) {
    check_seamless(mesh, map);
    for h in mesh.halfedges() {
        let (Some(there), Some(t)) = (map.transition(mesh, h), mesh.twin(h)) else { continue };
        assert_eq!(i32::from(there.turns), (-field.jump_across(mesh, h)).rem_euclid(4));
        let both = there.then(&map.transition(mesh, t).unwrap());
        assert!(both.turns == 0 && both.translation.length() < 1e-12);
    }
    let singular = nodes(field);
    for v in mesh.vertices().filter(|&v| !mesh.is_boundary_vertex(v)) {
        let across = mesh.outgoing(v).map(|h| map.transition(mesh, mesh.prev(h)).unwrap());
        let around = across.fold(Transition::IDENTITY, |t, next| t.then(&next));
        assert_eq!(around.turns != 0, singular.contains(&v));
        if around.turns == 0 {
            assert!(around.translation.length() < 1e-9, "{v:?}: {}", around.translation);
        }
    }
}

/// The mesh with its vertices moved by up to `amount`, pseudo-randomly.
fn perturbed(mesh: &TriMesh, amount: f64, seed: u32) -> TriMesh {
    let noise = |k: usize| amount * (f64::from(seed) + 12.9898 * k as f64).sin();
    let move_vertex = |(i, p): (usize, &DVec3)| *p + DVec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2));
    let positions = mesh.positions().iter().enumerate().map(move_vertex).collect();
    let faces: Vec<[u32; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
    TriMesh::from_faces(positions, &faces).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, ..ProptestConfig::default() })]

    #[test]
    fn transitions_of_maps_of_perturbed_tori_are_seamless(
        n in 10..20u32, m in 6..12u32, amount in 0.0..0.004f64, seed in 0..1000u32
    ) {
        let mesh = perturbed(&torus(n, m), amount, seed);
        let metric = Metric::new(&mesh);
        let centre = |f| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>();
        let field = along(&mesh, &metric, |f| DVec3::Z.cross(centre(f)));
        prop_assume!(field.singularities.is_empty());
        let mut system = SeamlessSystem::new(&mesh, &field, &[], &[]).unwrap();
        check_transitions(&mesh, &field, &solved(&mut system, &metric, &field).map);
    }

    #[test]
    fn transitions_of_maps_of_perturbed_spheres_are_seamless(
        n in 3..7i32, amount in 0.0..0.02f64, seed in 0..1000u32
    ) {
        let mesh = perturbed(&octasphere(n), amount, seed);
        let metric = Metric::new(&mesh);
        let field = feature_aligned_field(&mesh, &metric, None, &[], &Progress::new()).unwrap();
        let mut system = SeamlessSystem::new(&mesh, &field, &nodes(&field), &[]).unwrap();
        let plain = solved(&mut system, &metric, &field).map;
        check_transitions(&mesh, &field, &plain);
        system.set_constraints(&mesh, &constraints_off(&mesh, &plain, 4)).unwrap();
        check_transitions(&mesh, &field, &solved(&mut system, &metric, &field).map);
    }
}

#[test]
fn cut_torus_is_a_disc() {
    let mesh = torus(12, 8);
    let metric = Metric::new(&mesh);
    let centre = |f| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>();
    let field = along(&mesh, &metric, |f| DVec3::Z.cross(centre(f)));
    let cut = CutGraph::new(&mesh, &field, &[]).unwrap();
    let n_cut: usize = cut.paths.iter().map(|p| p.steps.len()).sum();
    // Euler characteristic of the cut surface, in which every cut edge occurs twice.
    assert_eq!(cut.n_wedges as i64 - (mesh.n_edges() + n_cut) as i64 + mesh.n_faces() as i64, 1);
    assert_eq!(cut.roots.len(), 1);
}

#[test]
fn arrays_of_wrong_length_are_refused() {
    let mesh = square(2);
    let metric = Metric::new(&mesh);
    let field = along(&mesh, &metric, |_| DVec3::X);
    let mut system = SeamlessSystem::new(&mesh, &field, &[], &[]).unwrap();
    let short = Objective { lengths: vec![[1.0; 2]; 3], ..Objective::default() };
    let error = system.solve(&metric, &field, &short, &Progress::new()).unwrap_err();
    assert!(matches!(error, ParamError::WrongLength { got: 3, want: 8, .. }), "{error}");
    assert!(matches!(system.set_differences(&[0.0]), Err(ParamError::WrongLength { got: 1, want: 0, .. })));
    assert!(matches!(system.fit(&metric, &field.angle, &[], &[]), Err(ParamError::WrongLength { got: 0, .. })));
}

#[test]
fn stiffness_changes_the_map_but_is_not_part_of_the_energy() {
    let mesh = octasphere(4);
    let metric = Metric::new(&mesh);
    let field = feature_aligned_field(&mesh, &metric, None, &[], &Progress::new()).unwrap();
    let mut system = SeamlessSystem::new(&mesh, &field, &nodes(&field), &[]).unwrap();
    let plain = solved(&mut system, &metric, &field);
    let mut solve = |stiffness: Vec<f64>| {
        let objective = Objective { stiffness, ..Objective::default() };
        system.solve(&metric, &field, &objective, &Progress::new()).unwrap().energy
    };
    assert!((solve(vec![7.0; mesh.n_faces()]) - plain.energy).abs() < 1e-9 * plain.energy);
    let uneven = solve(mesh.faces().map(|f| if f.0 == 0 { 100.0 } else { 1.0 }).collect());
    assert!(uneven > plain.energy);
}
