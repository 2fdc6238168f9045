//! Fields of prescribed topology: indices, turning numbers, penalties.

use glam::DVec3;

use super::super::samples::*;
use super::super::singularities::inner_singularities;
use super::*;
use crate::mesh::BreadthFirst;
use crate::testing::square;

/// Jumps of the given indices: those of least rotation of an arbitrary field, changed along a spanning tree.
fn jumps_of(mesh: &TriMesh, metric: &Metric, index: impl Fn(VertexId) -> i32) -> Vec<i32> {
    let angle = vec![0.0; mesh.n_faces()];
    let mut jump: Vec<i32> =
        inner_edges(mesh).map(|(h, t)| (-metric.transport(h, t) / FRAC_PI_2).round() as i32).collect();
    let mut tree = BreadthFirst::new(mesh.n_vertices());
    tree.start(VertexId(0));
    while let Some(v) = tree.visit() {
        for h in mesh.outgoing(v) {
            tree.reach(mesh.target(h), h);
        }
    }
    let mut has = indices(mesh, metric, &angle, &jump);
    for &v in tree.reached().iter().rev() {
        let Some(h) = tree.via(v) else { continue };
        let excess = has[v.index()] - index(v);
        let e = mesh.edge(h);
        jump[e.index()] += if mesh.halfedge(e) == h { excess } else { -excess };
        has[v.index()] -= excess;
        has[mesh.origin(h).index()] += excess;
    }
    jump
}

fn solve(
    mesh: &TriMesh,
    metric: &Metric,
    jump: &[i32],
    penalties: &[DirectionPenalty],
    previous: Option<&[f64]>,
) -> GuidingField {
    let system = GuidingFieldSystem::new(mesh).unwrap();
    system.solve(mesh, metric, jump, penalties, previous, &Progress::new()).unwrap()
}

/// The vertex nearest to a point.
fn nearest(mesh: &TriMesh, to: DVec3) -> VertexId {
    mesh.vertices()
        .min_by(|&a, &b| mesh.position(a).distance_squared(to).total_cmp(&mesh.position(b).distance_squared(to)))
        .unwrap()
}

/// Places on a sphere and the indices wanted there.
fn layouts() -> Vec<Vec<(DVec3, i32)>> {
    let corner = |k: i32| DVec3::new((k & 1) as f64 - 0.5, (k & 2) as f64 / 2.0 - 0.5, (k & 4) as f64 / 4.0 - 0.5);
    let cube = (0..8).map(|k| (corner(k), 1)).collect();
    // An additional pair, two poles of a whole turn each, and a negative one: no smoothest field has these singularities.
    let pair = (0..8).map(|k| (corner(k), 1)).chain([(DVec3::X, -1), (DVec3::new(0.3, 0.1, 0.0), 1)]).collect();
    vec![cube, pair, vec![(DVec3::Z, 4), (-DVec3::Z, 4)], vec![(DVec3::Z, 12), (-DVec3::X, -4)]]
}

#[test]
fn a_field_has_the_singularities_of_its_jumps() {
    let mesh = octasphere(12);
    let metric = Metric::new(&mesh);
    for list in layouts() {
        let at: Vec<(VertexId, i32)> = list.iter().map(|&(p, i)| (nearest(&mesh, p.normalize()), i)).collect();
        let want = |v: VertexId| at.iter().find(|a| a.0 == v).map_or(0, |a| a.1);
        let jump = jumps_of(&mesh, &metric, want);
        let field = solve(&mesh, &metric, &jump, &[], None);
        let all: Vec<i32> = mesh.vertices().map(want).collect();
        assert_eq!(indices(&mesh, &metric, &field.angle, &jump), all);
        let cross = cross_field(&mesh, &metric, &field.angle, &jump);
        assert_eq!(cross.singularities.len(), at.len());
        // Counted by rotations reduced to half a turn, those near singularities of low index included.
        if at.iter().all(|a| a.1.abs() == 1) {
            assert_eq!(inner_singularities(&mesh, &metric, &field.angle, &cross.jump), cross.singularities);
        }
        for v in mesh.vertices() {
            let clockwise: Vec<HalfedgeId> = {
                let mut fan: Vec<_> = mesh.outgoing(v).collect();
                fan.reverse();
                fan
            };
            assert_eq!(turning_number(&mesh, &metric, &jump, &clockwise), Some(-(4 - want(v))));
        }
    }
}

#[test]
fn a_cycle_around_the_tube_of_a_torus_has_turning_number_zero() {
    let mesh = torus(24, 12);
    let metric = Metric::new(&mesh);
    let centre = |f| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>();
    let angle: Vec<f64> = mesh.faces().map(|f| metric.angle_of(&mesh, f, DVec3::Z.cross(centre(f))).unwrap()).collect();
    let turn = |(h, t): (HalfedgeId, HalfedgeId)| {
        ((angle[t.index() / 3] - angle[h.index() / 3] - metric.transport(h, t)) / FRAC_PI_2).round() as i32
    };
    let mut jump: Vec<i32> = inner_edges(&mesh).map(turn).collect();
    // Around the tube, quad by quad: across the diagonal, then across the side opposite to the one entered by.
    let cycle: Vec<HalfedgeId> = (0..12u32).flat_map(|j| [HalfedgeId(6 * j + 2), HalfedgeId(6 * j + 4)]).collect();
    assert_eq!(turning_number(&mesh, &metric, &jump, &cycle), Some(0));
    let back: Vec<HalfedgeId> = cycle.iter().rev().map(|&h| mesh.twin(h).unwrap()).collect();
    jump[mesh.edge(cycle[0]).index()] += if mesh.halfedge(mesh.edge(cycle[0])) == cycle[0] { 1 } else { -1 };
    assert_eq!(turning_number(&mesh, &metric, &jump, &cycle), Some(1));
    assert_eq!(turning_number(&mesh, &metric, &jump, &back), Some(-1));
    assert_eq!(turning_number(&mesh, &metric, &jump, &cycle[1..]), None);
}

#[test]
fn penalties_of_open_and_of_known_direction_are_followed() {
    let mesh = square(8);
    let metric = Metric::new(&mesh);
    let along_x: Vec<f64> = mesh.faces().map(|f| metric.angle_of(&mesh, f, DVec3::X).unwrap()).collect();
    let zero = inner_edges(&mesh)
        .map(|(h, t)| (mesh.edge(h), along_x[t.index() / 3] - along_x[h.index() / 3] - metric.transport(h, t)));
    let mut jump = vec![0; mesh.n_edges()];
    for (e, turn) in zero {
        jump[e.index()] = (turn / FRAC_PI_2).round() as i32;
    }
    let penalty = |k: usize, known: bool| {
        let (f, quarters) = (FaceId::new(5 * k), (7 * k % 4) as i32);
        let angle = along_x[f.index()] + 0.6 + f64::from(quarters) * FRAC_PI_2 + TAU * (k % 3) as f64;
        DirectionPenalty { face: f, angle, weight: RELIABLE_PENALTY, branch: known.then_some(quarters) }
    };
    for known in [0, 1, 20] {
        let penalties: Vec<DirectionPenalty> = (0..20).map(|k| penalty(k, k < known)).collect();
        let field = solve(&mesh, &metric, &jump, &penalties, None);
        assert!(field.energy < 1e-18);
        for (k, (g, b)) in penalties.iter().zip(&field.branch).enumerate() {
            let off = (field.angle[g.face.index()] + f64::from(*b) * FRAC_PI_2 - g.angle) / TAU;
            assert!((off - off.round()).abs() < 1e-9);
            assert!(known == 0 || *b == (7 * k % 4) as i32);
        }
    }
}

#[test]
fn a_warm_start_keeps_the_rounding() {
    let mesh = octasphere(8);
    let metric = Metric::new(&mesh);
    let jump = jumps_of(&mesh, &metric, |v| layouts()[0].iter().any(|l| nearest(&mesh, l.0.normalize()) == v).into());
    let penalties: Vec<DirectionPenalty> = (0..mesh.n_faces())
        .step_by(7)
        .map(|f| DirectionPenalty { face: FaceId::new(f), angle: 0.01 * f as f64, weight: 3.0, branch: None })
        .collect();
    let cold = solve(&mesh, &metric, &jump, &penalties, None);
    let warm = solve(&mesh, &metric, &jump, &penalties, Some(&cold.angle));
    assert_eq!((&cold.angle, &cold.branch), (&warm.angle, &warm.branch));
    // Rounding from the turned field gives an objective hardly smaller.
    let sum = |field: &GuidingField| {
        let off = |(g, b): (&DirectionPenalty, &i32)| {
            let a = (field.angle[g.face.index()] + f64::from(*b) * FRAC_PI_2 - g.angle) / TAU;
            g.weight * ((a - a.round()) * TAU).powi(2)
        };
        field.energy + penalties.iter().zip(&field.branch).map(off).sum::<f64>()
    };
    let free = solve(&mesh, &metric, &jump, &[], None);
    assert!(free.energy < cold.energy);
    let turned: Vec<f64> = free.angle.iter().map(|a| a + 0.3).collect();
    let other = solve(&mesh, &metric, &jump, &penalties, Some(&turned));
    assert!(sum(&cold) < 1.2 * sum(&other), "{} {}", sum(&cold), sum(&other));
}

#[test]
fn components_are_independent_and_malformed_input_is_refused() {
    let mesh = cells(&[[0, 0, 0], [3, 0, 0]], 3);
    let metric = Metric::new(&mesh);
    let system = GuidingFieldSystem::new(&mesh).unwrap();
    let corner = |v: VertexId| {
        let p = mesh.position(v) / 0.2;
        i32::from(p.y.fract() == 0.0 && p.z.fract() == 0.0 && (p.x.round() - p.x).abs() < 1e-9)
    };
    // Jumps by the smallest rotations of the lattice's own field.
    let along = |f: FaceId| {
        let n = mesh.face_normal(f).abs();
        metric.angle_of(&mesh, f, if n.x > 0.5 { DVec3::Y } else { DVec3::X }).unwrap()
    };
    let jump: Vec<i32> = inner_edges(&mesh)
        .map(|(h, t)| ((along(mesh.face(t)) - along(mesh.face(h)) - metric.transport(h, t)) / FRAC_PI_2).round() as i32)
        .collect();
    let penalty = DirectionPenalty { face: FaceId(0), angle: along(FaceId(0)), weight: 1.0, branch: Some(0) };
    let solve = |jump: &[i32], penalties: &[DirectionPenalty]| {
        system.solve(&mesh, &metric, jump, penalties, None, &Progress::new())
    };
    let field = solve(&jump, &[penalty]).unwrap();
    assert!(field.energy < 1e-18);
    assert!((field.angle[0] - penalty.angle).abs() < 1e-9);
    let index = indices(&mesh, &metric, &field.angle, &jump);
    assert!(mesh.vertices().all(|v| index[v.index()] == corner(v)));
    assert!(matches!(solve(&jump[1..], &[]), Err(FieldError::WrongLength { .. })));
    let nan = DirectionPenalty { angle: f64::NAN, ..penalty };
    assert!(matches!(solve(&jump, &[nan]), Err(FieldError::Solve(_))));
}
