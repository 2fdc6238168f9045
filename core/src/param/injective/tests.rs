//! Checks of maps without folds on shapes whose best maps are known.

use glam::{DVec2, DVec3};

use super::*;
use crate::field::{CrossField, cross_field};
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::param::CoordinateConstraint;
use crate::surface::SurfacePoint;
use crate::testing::square;

const SHAPE: DistortionWeights = DistortionWeights { anisotropy: 4.0, size: 0.2 };

/// A unit square with the field along its sides.
fn flat() -> (TriMesh, Metric, CrossField) {
    let mesh = square(8);
    let metric = Metric::new(&mesh);
    let angle: Vec<f64> = mesh.faces().map(|f| metric.angle_of(&mesh, f, DVec3::X).unwrap()).collect();
    let field = cross_field(&mesh, &metric, &angle, &vec![0; mesh.n_edges()]);
    (mesh, metric, field)
}

/// Coordinates that a function of the place gives to the corners of all triangles.
fn mapped(mesh: &TriMesh, map: impl Fn(DVec2) -> DVec2) -> Vec<[DVec2; 3]> {
    mesh.faces().map(|f| mesh.face_vertices(f).map(|v| map(mesh.position(v).truncate()))).collect()
}

/// The system of a square, and the free variables of the map nearest to coordinates given.
fn fitted(mesh: &TriMesh, metric: &Metric, field: &CrossField, uv: &[[DVec2; 3]]) -> (SeamlessSystem, Vec<f64>) {
    let mut system = SeamlessSystem::new(mesh, field, &[], &[]).unwrap();
    let free = system.fit(metric, &field.angle, &gradients(metric, &field.angle, uv), &[]).unwrap();
    (system, free)
}

fn bent(p: DVec2) -> DVec2 {
    1.5 * p + 0.15 * DVec2::new((7.0 * p.y).sin(), (5.0 * p.x).cos())
}

#[test]
fn fitted_to_its_own_gradients_a_map_comes_back() {
    let (mesh, metric, field) = flat();
    let uv = mapped(&mesh, bent);
    let (system, free) = fitted(&mesh, &metric, &field, &uv);
    let got = system.map(&free).uv;
    let origin = got[0][0] - uv[0][0];
    for (a, b) in got.iter().flatten().zip(uv.iter().flatten()) {
        assert!((*a - *b - origin).length() < 1e-12);
    }
}

#[test]
fn a_bent_square_becomes_straight_without_ever_folding() {
    let (mesh, metric, field) = flat();
    let uv = mapped(&mesh, bent);
    let (mut system, free) = fitted(&mesh, &metric, &field, &uv);
    let objective = Objective::default();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[]));
    let mut at = system.injective(&energy, free).unwrap();
    let newton = system.newton().unwrap();
    let best = 1.0 + SHAPE.size;
    let mut before = at.energy;
    assert!(before > 1.5 * best);
    for _ in 0..40 {
        system.descend(&newton, &energy, &mut at, 1, &Progress::new()).unwrap();
        assert!(at.energy <= before && folds(&at.map.uv).is_empty());
        before = at.energy;
    }
    assert!((at.energy - best).abs() < 1e-9, "{}", at.energy - best);
    for (f, g) in mesh.faces().zip(gradients(&metric, &field.angle, &at.map.uv)) {
        let want = [1.0, 0.0, 0.0, 1.0];
        assert!((0..4).all(|k| (g[k] - want[k]).abs() < 1e-4), "{f:?} {g:?}");
    }
}

#[test]
fn a_map_that_folds_has_no_energy() {
    let (mesh, metric, field) = flat();
    let system = SeamlessSystem::new(&mesh, &field, &[], &[]).unwrap();
    let objective = Objective::default();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[]));
    let mut uv = mapped(&mesh, |p| p);
    assert!((energy.of(&uv).unwrap() - (1.0 + SHAPE.size)).abs() < 1e-12);
    uv[5].swap(1, 2);
    assert_eq!(folds(&uv), [FaceId(5)]);
    assert_eq!(energy.of(&uv), None);
    // All variables alike: every triangle is a point.
    assert!(system.injective(&energy, vec![0.0; system.n_free()]).is_none());
}

#[test]
fn a_map_with_folds_is_untangled_and_satisfies_all_that_it_did() {
    let (mesh, metric, field) = flat();
    // Between the sides the square is pulled across itself.
    let tangled = |p: DVec2| p + 0.5 * DVec2::X * (-40.0 * (p - 0.4).length_squared()).exp();
    let (mut system, free) = fitted(&mesh, &metric, &field, &mapped(&mesh, tangled));
    let objective = Objective::default();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[]));
    assert!(folds(&system.map(&free).uv).len() > 5);
    assert!(system.injective(&energy, free.clone()).is_none());
    let newton = system.newton().unwrap();
    let border = |v: VertexId| mesh.is_boundary_vertex(v);
    let quarters: Vec<u32> = mesh.vertices().map(|v| if border(v) { 0 } else { 4 }).collect();
    let around = |quarters: &[u32]| {
        system.untangle(&newton, &energy, free.clone(), (&mesh, quarters), &Progress::new()).unwrap()
    };
    let found = around(&quarters).unwrap();
    assert!(folds(&found.map.uv).is_empty());
    assert_eq!(found.energy, energy.of(&found.map.uv).unwrap());
    assert_eq!(found.map.uv, system.map(&found.free).uv);
    // No map without folds winds around a regular vertex twice.
    let twice: Vec<u32> = quarters.iter().map(|q| 2 * q).collect();
    assert!(around(&twice).is_none());
}

#[test]
fn the_derivatives_are_those_of_the_energy() {
    let (mesh, metric, field) = flat();
    let objective = Objective { lengths: vec![[1.2, 0.8]; mesh.n_faces()], ..Objective::default() };
    let anisotropy_share: Vec<f64> = mesh.faces().map(|f| 0.1 * f64::from(f.0 % 10)).collect();
    let pulled: Vec<_> = (0..20).map(|k| (HalfedgeId::new(11 * k), (k % 2) as u8, 1.0 + (k % 3) as f64)).collect();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &anisotropy_share))
        .with_isoline_penalties(&pulled);
    let uv = mapped(&mesh, bent);
    for f in [0, 11, 40, 77] {
        let exact = energy.derivatives(f, &uv[f]).gradient;
        for (k, exact) in exact.into_iter().enumerate() {
            let at = |d: f64| {
                let mut moved = uv.clone();
                moved[f][k % 3][k / 3] += d;
                energy.of(&moved).unwrap()
            };
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((slope - exact).abs() < 1e-6 * (1.0 + exact.abs()), "{f} {k}: {slope} {exact}");
        }
    }
}

#[test]
fn features_are_pulled_towards_isolines() {
    let (mesh, metric, field) = flat();
    // The diagonals of a column of quads: no isoline by themselves.
    let slanted = |h: &HalfedgeId| {
        let d = mesh.vector(*h);
        d.x.abs() > 0.1 && d.y.abs() > 0.1 && mesh.position(mesh.origin(*h)).x < 0.3
    };
    let pulled: Vec<_> = mesh.halfedges().filter(slanted).map(|h| (h, 0, 1.0)).collect();
    assert!(!pulled.is_empty());
    let objective = Objective::default();
    let (mut system, free) = fitted(&mesh, &metric, &field, &mapped(&mesh, |p| p));
    let off = |map: &SeamlessMap| -> f64 {
        let across =
            |h: HalfedgeId| map.uv[h.index() / 3][(h.index() % 3 + 1) % 3].x - map.uv[h.index() / 3][h.index() % 3].x;
        pulled.iter().map(|&(h, ..)| across(h).abs()).fold(0.0, f64::max)
    };
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[])).with_isoline_penalties(&pulled);
    let mut at = system.injective(&energy, free).unwrap();
    let before = off(&at.map);
    let newton = system.newton().unwrap();
    system.descend(&newton, &energy, &mut at, 60, &Progress::new()).unwrap();
    let gently = off(&at.map);
    assert!(gently < 0.2 * before, "{gently} {before}");
    let hard: Vec<_> = pulled.iter().map(|&(h, axis, _)| (h, axis, 1e4)).collect();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[])).with_isoline_penalties(&hard);
    let mut at = system.injective(&energy, at.free).unwrap();
    system.descend(&newton, &energy, &mut at, 60, &Progress::new()).unwrap();
    assert!(off(&at.map) < 1e-3 * gently, "{} {gently}", off(&at.map));
}

#[test]
fn relations_are_reached_without_folding_or_what_stands_against_them_is_told() {
    let (mesh, metric, field) = flat();
    let uv = mapped(&mesh, |p| p);
    let face = FaceId(40);
    let corner = |i: usize| SurfacePoint { face, weights: [0, 1, 2].map(|k| f64::from(u8::from(k == i))) };
    let alike = |i: usize, axis: u8| CoordinateConstraint {
        from: corner(i),
        crossed: Vec::new(),
        to: corner((i + 1) % 3),
        axis,
        difference: 0.0,
    };
    let objective = Objective::default();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[]));
    let origin = uv[0][0];
    let uv: Vec<_> = uv.iter().map(|w| w.map(|p| p - origin)).collect();
    let reached = |relations: &[CoordinateConstraint]| {
        let mut system = SeamlessSystem::new(&mesh, &field, &[], relations).unwrap();
        let newton = system.newton().unwrap();
        let from = (&field.angle[..], &uv[..]);
        system.approach((&mesh, &metric), (&newton, &energy), from, &Progress::new()).unwrap()
    };
    for i in 0..3 {
        let w = reached(&[alike(i, 0)]).unwrap().map.uv;
        assert!(folds(&w).is_empty());
        assert!((w[40][i].x - w[40][(i + 1) % 3].x).abs() < 1e-9);
    }
    // A side that is a point flattens its triangle.
    assert!(reached(&[alike(0, 0), alike(0, 1)]).unwrap_err().contains(&face));
}
