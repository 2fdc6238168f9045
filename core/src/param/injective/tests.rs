//! Locally injective maps of a square whose optimal maps are known.

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

/// Corner coordinates of all triangles given by a function of the position.
fn mapped(mesh: &TriMesh, map: impl Fn(DVec2) -> DVec2) -> Vec<[DVec2; 3]> {
    mesh.faces().map(|f| mesh.face_vertices(f).map(|v| map(mesh.position(v).truncate()))).collect()
}

/// The system of a square, and the free variables of the map fitted to the gradients of given coordinates.
fn fitted(mesh: &TriMesh, metric: &Metric, field: &CrossField, uv: &[[DVec2; 3]]) -> (SeamlessSystem, Vec<f64>) {
    let mut system = SeamlessSystem::new(mesh, field, &[], &[]).unwrap();
    let free = system.fit(metric, &field.angle, &gradients(metric, &field.angle, uv), &[]).unwrap();
    (system, free)
}

/// A smooth deformation of the square without flips.
fn bent(p: DVec2) -> DVec2 {
    1.5 * p + 0.15 * DVec2::new((7.0 * p.y).sin(), (5.0 * p.x).cos())
}

#[test]
fn fit_to_own_gradients_reproduces_the_map() {
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
fn descent_straightens_a_bent_square_without_flips() {
    let (mesh, metric, field) = flat();
    let uv = mapped(&mesh, bent);
    let (mut system, free) = fitted(&mesh, &metric, &field, &uv);
    let objective = Objective::default();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[]));
    let mut at = system.injective_map(&energy, free).unwrap();
    let newton = system.newton_system().unwrap();
    let best = 1.0 + SHAPE.size;
    let mut before = at.energy;
    assert!(before > 1.5 * best);
    for _ in 0..40 {
        system.descend(&newton, &energy, &mut at, 1, &Progress::new()).unwrap();
        assert!(at.energy <= before && flipped_triangles(&at.map.uv).is_empty());
        before = at.energy;
    }
    assert!((at.energy - best).abs() < 1e-9, "{}", at.energy - best);
    for (f, g) in mesh.faces().zip(gradients(&metric, &field.angle, &at.map.uv)) {
        let want = [1.0, 0.0, 0.0, 1.0];
        assert!((0..4).all(|k| (g[k] - want[k]).abs() < 1e-4), "{f:?} {g:?}");
    }
}

#[test]
fn map_with_flipped_triangles_has_no_energy() {
    let (mesh, metric, field) = flat();
    let system = SeamlessSystem::new(&mesh, &field, &[], &[]).unwrap();
    let objective = Objective::default();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[]));
    let mut uv = mapped(&mesh, |p| p);
    assert!((energy.of(&uv).unwrap() - (1.0 + SHAPE.size)).abs() < 1e-12);
    uv[5].swap(1, 2);
    assert_eq!(flipped_triangles(&uv), [FaceId(5)]);
    assert_eq!(energy.of(&uv), None);
    // All variables equal: every image is a point.
    assert!(system.injective_map(&energy, vec![0.0; system.n_free()]).is_none());
}

#[test]
fn untangling_removes_flips_and_keeps_constraints() {
    let (mesh, metric, field) = flat();
    // The middle of the square is moved across its surroundings.
    let tangled = |p: DVec2| p + 0.5 * DVec2::X * (-40.0 * (p - 0.4).length_squared()).exp();
    let (mut system, free) = fitted(&mesh, &metric, &field, &mapped(&mesh, tangled));
    let objective = Objective::default();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[]));
    assert!(flipped_triangles(&system.map(&free).uv).len() > 5);
    assert!(system.injective_map(&energy, free.clone()).is_none());
    let newton = system.newton_system().unwrap();
    let border = |v: VertexId| mesh.is_boundary_vertex(v);
    let quarters: Vec<u32> = mesh.vertices().map(|v| if border(v) { 0 } else { 4 }).collect();
    let around = |quarters: &[u32]| {
        system.untangle(&newton, &energy, free.clone(), (&mesh, quarters), &Progress::new()).unwrap()
    };
    let found = around(&quarters).unwrap();
    assert!(flipped_triangles(&found.map.uv).is_empty());
    assert_eq!(found.energy, energy.of(&found.map.uv).unwrap());
    assert_eq!(found.map.uv, system.map(&found.free).uv);
    // No locally injective map has the angle 4π around a regular vertex.
    let twice: Vec<u32> = quarters.iter().map(|q| 2 * q).collect();
    assert!(around(&twice).is_none());
}

#[test]
fn derivatives_match_finite_differences() {
    let (mesh, metric, field) = flat();
    let objective = Objective { lengths: vec![[1.2, 0.8]; mesh.n_faces()], ..Objective::default() };
    let anisotropy_share: Vec<f64> = mesh.faces().map(|f| 0.1 * f64::from(f.0 % 10)).collect();
    let penalised: Vec<_> = (0..20).map(|k| (HalfedgeId::new(11 * k), (k % 2) as u8, 1.0 + (k % 3) as f64)).collect();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &anisotropy_share))
        .with_isoline_penalties(&penalised);
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
fn isoline_penalties_align_features() {
    let (mesh, metric, field) = flat();
    // The diagonals of a column of quads, which are no isolines without penalties.
    let slanted = |h: &HalfedgeId| {
        let d = mesh.vector(*h);
        d.x.abs() > 0.1 && d.y.abs() > 0.1 && mesh.position(mesh.origin(*h)).x < 0.3
    };
    let penalised: Vec<_> = mesh.halfedges().filter(slanted).map(|h| (h, 0, 1.0)).collect();
    assert!(!penalised.is_empty());
    let objective = Objective::default();
    let (mut system, free) = fitted(&mesh, &metric, &field, &mapped(&mesh, |p| p));
    let off = |map: &SeamlessMap| -> f64 {
        let across =
            |h: HalfedgeId| map.uv[h.index() / 3][(h.index() % 3 + 1) % 3].x - map.uv[h.index() / 3][h.index() % 3].x;
        penalised.iter().map(|&(h, ..)| across(h).abs()).fold(0.0, f64::max)
    };
    let energy =
        InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[])).with_isoline_penalties(&penalised);
    let mut at = system.injective_map(&energy, free).unwrap();
    let before = off(&at.map);
    let newton = system.newton_system().unwrap();
    system.descend(&newton, &energy, &mut at, 60, &Progress::new()).unwrap();
    let gently = off(&at.map);
    assert!(gently < 0.2 * before, "{gently} {before}");
    let hard: Vec<_> = penalised.iter().map(|&(h, axis, _)| (h, axis, 1e4)).collect();
    let energy = InjectiveEnergy::new(&metric, &field.angle, &objective, (SHAPE, &[])).with_isoline_penalties(&hard);
    let mut at = system.injective_map(&energy, at.free).unwrap();
    system.descend(&newton, &energy, &mut at, 60, &Progress::new()).unwrap();
    assert!(off(&at.map) < 1e-3 * gently, "{} {gently}", off(&at.map));
}

#[test]
fn constraint_homotopy_reaches_constraints_or_reports_obstructing_triangles() {
    let (mesh, metric, field) = flat();
    let uv = mapped(&mesh, |p| p);
    let face = FaceId(40);
    let corner = |i: usize| SurfacePoint { face, weights: [0, 1, 2].map(|k| f64::from(u8::from(k == i))) };
    let equal = |i: usize, axis: u8| CoordinateConstraint {
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
    let reached = |constraints: &[CoordinateConstraint]| {
        let mut system = SeamlessSystem::new(&mesh, &field, &[], constraints).unwrap();
        let newton = system.newton_system().unwrap();
        let from = (&field.angle[..], &uv[..]);
        system.enforce_constraints((&mesh, &metric), (&newton, &energy), from, &Progress::new()).unwrap()
    };
    for i in 0..3 {
        let w = reached(&[equal(i, 0)]).unwrap().map.uv;
        assert!(flipped_triangles(&w).is_empty());
        assert!((w[40][i].x - w[40][(i + 1) % 3].x).abs() < 1e-9);
    }
    // A side of length zero makes its triangle degenerate.
    assert!(reached(&[equal(0, 0), equal(0, 1)]).unwrap_err().contains(&face));
}
