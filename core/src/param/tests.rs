//! Checks of seamless maps on shapes whose maps are known.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use super::*;
use crate::field::samples::*;
use crate::field::{CrossField, cross_field, feature_aligned_field, indices};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::Metric;
use crate::surface::SurfacePoint;
use crate::testing::square;

/// The field that takes in each triangle the given direction, with the smallest jumps.
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

/// The field along the edges of a lattice, different directions first in different triangles.
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

/// Both ends of every edge go over by one transition, of the turns that the jumps tell.
fn check_seamless(mesh: &TriMesh, map: &SeamlessMap) {
    for h in mesh.halfedges() {
        let (Some(across), Some(t)) = (map.transition(mesh, h), mesh.twin(h)) else { continue };
        let at = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
        assert!((across.apply(at(h)) - at(mesh.next(t))).length() < 1e-9);
        assert!((across.apply(at(mesh.next(h))) - at(t)).length() < 1e-9);
    }
}

/// How far a map is from a relation.
fn miss(mesh: &TriMesh, map: &SeamlessMap, r: &CoordinateConstraint) -> f64 {
    let at = |p: &SurfacePoint| (0..3).map(|i| map.uv[p.face.index()][i] * p.weights[i]).sum::<DVec2>();
    let chain = r.crossed.iter().fold(Transition::IDENTITY, |t, &h| t.then(&map.transition(mesh, h).unwrap()));
    (chain.inverse().apply(at(&r.to)) - at(&r.from))[usize::from(r.axis)] - r.difference
}

/// A shortest chain of half-edges crossed between two triangles.
fn chain(mesh: &TriMesh, from: FaceId, to: FaceId) -> Vec<HalfedgeId> {
    let mut by: Vec<Option<HalfedgeId>> = vec![None; mesh.n_faces()];
    let mut queue = std::collections::VecDeque::from([from]);
    while let Some(f) = queue.pop_front() {
        for h in mesh.face_halfedges(f) {
            if let Some(g) = mesh.twin(h).map(|t| mesh.face(t))
                && g != from
                && by[g.index()].is_none()
            {
                by[g.index()] = Some(h);
                queue.push_back(g);
            }
        }
    }
    let mut out = Vec::new();
    let mut f = to;
    while f != from {
        let h = by[f.index()].unwrap();
        out.push(h);
        f = mesh.face(h);
    }
    out.reverse();
    out
}

/// Relations between triangles far apart, all with different weights, that `map` misses by 0.01 to 0.05.
fn relations(mesh: &TriMesh, map: &SeamlessMap, count: usize) -> Vec<CoordinateConstraint> {
    let far = mesh.n_faces() / 2;
    let one = |i: usize| {
        let [f, g] = [17 * i + 3, far + 29 * i].map(|k| FaceId::new(k % mesh.n_faces()));
        let crossed = chain(mesh, f, g);
        let from = SurfacePoint { face: f, weights: [0.2, 0.3, 0.5] };
        let to =
            SurfacePoint { face: g, weights: if i.is_multiple_of(2) { [0.0, 1.0, 0.0] } else { [0.5, 0.25, 0.25] } };
        let mut r = CoordinateConstraint { from, crossed, to, axis: (i % 2) as u8, difference: 0.0 };
        r.difference = miss(mesh, map, &r) + 0.01 * (1 + i % 5) as f64;
        r
    };
    (0..count).map(one).collect()
}

#[test]
fn a_square_is_its_own_map() {
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
fn lattices_are_mapped_without_error() {
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
fn relations_hold_across_cuts_and_around_handles() {
    for mesh in [cells(&[[0, 0, 0]], 5), plate(1, 3), plate(2, 3)] {
        let metric = Metric::new(&mesh);
        let field = lattice(&mesh, &metric);
        let list = nodes(&field);
        let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
        let plain = solved(&mut system, &metric, &field);
        let relations = relations(&mesh, &plain.map, 12);
        let cuts =
            |r: &CoordinateConstraint| r.crossed.iter().filter(|&&h| system.cut().crossing(&mesh, h).is_some()).count();
        assert!(relations.iter().map(cuts).max() > Some(1));
        system.set_relations(&mesh, &relations).unwrap();
        let bent = solved(&mut system, &metric, &field);
        check_seamless(&mesh, &bent.map);
        for r in &relations {
            assert!(miss(&mesh, &plain.map, r).abs() > 0.005);
            assert!(miss(&mesh, &bent.map, r).abs() < 1e-9);
        }
        assert!(bent.energy > 1e-6);
    }
}

#[test]
fn a_torus_takes_the_periods_asked_for() {
    let mesh = torus(24, 12);
    let metric = Metric::new(&mesh);
    let centre = |f| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>();
    let field = along(&mesh, &metric, |f| DVec3::Z.cross(centre(f)));
    assert_eq!(field.singularities, vec![]);
    // Around the torus through the quads 0, 12, 24 ...: each crosses its diagonal and then its far side.
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
        assert!(miss(&mesh, &map, r).abs() < 1e-9);
    }
    system.set_differences(&[2.5, 0.0]).unwrap();
    let map = solved(&mut system, &metric, &field).map;
    assert!(miss(&mesh, &map, &around(0, 2.5)).abs() < 1e-9 && miss(&mesh, &map, &around(1, 0.0)).abs() < 1e-9);
}

#[test]
fn contradictions_and_malformed_relations_are_named() {
    let mesh = plate(1, 3);
    let metric = Metric::new(&mesh);
    let field = lattice(&mesh, &metric);
    let list = nodes(&field);
    let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
    let map = solved(&mut system, &metric, &field).map;
    let good = relations(&mesh, &map, 6);
    let with = |more: CoordinateConstraint| {
        let all: Vec<CoordinateConstraint> = good.iter().cloned().chain([more]).collect();
        SeamlessSystem::new(&mesh, &field, &list, &all).err()
    };
    assert_eq!(with(good[2].clone()), None);
    let off = CoordinateConstraint { difference: good[2].difference + 0.1, ..good[2].clone() };
    assert!(matches!(with(off), Some(ParamError::Conflict { relation: 2 | 6, .. })));
    // A point cannot be apart from itself; seen from another triangle of the chain it is the same point.
    let apart = CoordinateConstraint { crossed: vec![], to: good[0].from, difference: 0.1, ..good[0].clone() };
    assert!(matches!(with(apart), Some(ParamError::Conflict { relation: 6, .. })));
    let broken = CoordinateConstraint { crossed: good[0].crossed[1..].to_vec(), ..good[0].clone() };
    assert_eq!(with(broken), Some(ParamError::Malformed { relation: 6 }));
    let nan = CoordinateConstraint { difference: f64::NAN, ..good[0].clone() };
    assert_eq!(with(nan), Some(ParamError::Malformed { relation: 6 }));
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
fn anisotropy_makes_isolines_follow_the_field() {
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
fn the_solution_is_the_minimum_of_the_energy() {
    let mesh = octasphere(5);
    let metric = Metric::new(&mesh);
    let field = feature_aligned_field(&mesh, &metric, None, &[], &Progress::new()).unwrap();
    let list = nodes(&field);
    let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
    let relations = relations(&mesh, &solved(&mut system, &metric, &field).map, 4);
    system.set_relations(&mesh, &relations).unwrap();
    let lengths = mesh.faces().map(|f| [1.0 + 0.1 * f64::from(f.0 % 3), 0.8]).collect();
    let objective = Objective { lengths, ..Objective::default() };
    let solution = system.solve(&metric, &field, &objective, &Progress::new()).unwrap();
    let (matrix, _) = system.assemble(&metric, &field, &objective).unwrap();
    let energy = |y: &[f64]| {
        residuals(&metric, &field.angle, &system.map(y).uv, &objective).iter().map(|r| r.energy).sum::<f64>()
    };
    // About the minimum the energy is the quadratic form of the matrix.
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
fn a_reused_analysis_gives_the_same_bits() {
    let mesh = plate(1, 3);
    let metric = Metric::new(&mesh);
    let field = lattice(&mesh, &metric);
    let list = nodes(&field);
    let mut system = SeamlessSystem::new(&mesh, &field, &list, &[]).unwrap();
    let relations = relations(&mesh, &solved(&mut system, &metric, &field).map, 5);
    let mut fresh = SeamlessSystem::new(&mesh, &field, &list, &relations).unwrap();
    let want = solved(&mut fresh, &metric, &field);
    // There and back by differences, by relations and as a whole.
    fresh.set_differences(&[0.1; 5]).unwrap();
    assert_ne!(solved(&mut fresh, &metric, &field).free, want.free);
    fresh.set_differences(&relations.iter().map(|r| r.difference).collect::<Vec<_>>()).unwrap();
    assert_eq!(solved(&mut fresh, &metric, &field).free, want.free);
    system.set_relations(&mesh, &relations).unwrap();
    assert_eq!(solved(&mut system, &metric, &field).free, want.free);
    fresh.rebuild(&mesh, &field, &list, &relations).unwrap();

    let again = solved(&mut fresh, &metric, &field);
    assert_eq!((again.free, again.map.uv), (want.free, want.map.uv));
}
