//! Properties of arrangements, on sample and on random curves.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use proptest::prelude::*;

use super::{Arrangement, ArrangementError, Mark, RefinedMesh, SideKind};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve};
use crate::testing::{column, row, square, torus};

/// Arranges curves and checks what holds for all arrangements.
fn checked(mesh: &TriMesh, curves: &[SurfaceCurve]) -> Arrangement {
    let a = Arrangement::new(mesh, curves).unwrap();
    check_partition(mesh, &a);
    check_sides(&a);
    check_crossings(mesh, &Arrangement::unsubdivided(mesh, curves).unwrap(), curves.len());
    a
}

/// The regions partition the surface: its triangles, and its Euler characteristic.
fn check_partition(mesh: &TriMesh, a: &Arrangement) {
    let refined = a.refined.to_mesh().unwrap();
    assert_eq!(refined.euler_characteristic(), mesh.euler_characteristic());
    let mut faces: Vec<u32> = a.regions.iter().flat_map(|r| r.faces.iter().copied()).collect();
    faces.sort_unstable();
    assert!(faces.into_iter().eq(0..a.refined.n_faces() as u32));
    for (i, region) in a.regions.iter().enumerate() {
        assert!(region.faces.iter().all(|&f| a.region_of_face[f as usize] as usize == i));
    }
    // Open regions, open segments and crossings. The ends and stretches of a boundary loop cancel.
    let open: i64 = a.regions.iter().map(|r| r.euler).sum();
    let segments = a.segments.iter().filter(|s| !s.ring).count() as i64;
    assert_eq!(open - segments + a.crossings.len() as i64, mesh.euler_characteristic());
}

/// Each segment is a side of regions twice, once in each direction, and each side lies along its region.
fn check_sides(a: &Arrangement) {
    let mut sides: Vec<Vec<bool>> = vec![Vec::new(); a.segments.len()];
    for (i, region) in a.regions.iter().enumerate() {
        for side in region.borders.iter().flatten() {
            assert!(side.halfedges.iter().all(|&h| a.region_left_of(h) as usize == i));
            let (SideKind::Segment { segment, .. } | SideKind::Ring { segment }) = side.kind else { continue };
            let forward = a.segment_at(side.halfedges[0]).unwrap().1;
            if let SideKind::Segment { forward: stored, .. } = side.kind {
                assert_eq!(stored, forward);
            }
            assert_eq!(side.halfedges.len(), a.segments[segment as usize].halfedges.len());
            sides[segment as usize].push(forward);
        }
    }
    for directions in &mut sides {
        directions.sort_unstable();
        assert_eq!(*directions, [false, true]);
    }
}

/// Two chords in a triangle cross, once, if and only if their ends alternate around it.
fn check_crossings(mesh: &TriMesh, a: &Arrangement, n_curves: usize) {
    // Per vertex on a mesh edge: the half-edges of that edge with the position along them.
    let mut on_edge: BTreeMap<u32, Vec<(HalfedgeId, usize)>> = BTreeMap::new();
    for g in mesh.halfedges() {
        let along = (0..3 * a.refined.n_faces() as u32).filter(|&h| a.refined.base_halfedge(h) == Some(g.0));
        let next: BTreeMap<u32, u32> = along.map(|h| (a.refined.origin(h), a.refined.target(h))).collect();
        let mut v = mesh.origin(g).0;
        for rank in 0..next.len() - 1 {
            v = next[&v];
            on_edge.entry(v).or_default().push((g, rank));
        }
    }
    let mut chords: BTreeMap<u32, Vec<[(u32, usize); 2]>> = BTreeMap::new();
    for curve in 0..n_curves as u32 {
        let halfedges = a.curve_halfedges(curve);
        let n = halfedges.len();
        let begins = |i: &usize| on_edge.contains_key(&a.refined.origin(halfedges[*i]));
        let starts: Vec<usize> = (0..n).filter(begins).collect();
        for &start in &starts {
            let face = a.refined.base_face(halfedges[start] / 3);
            let last = (0..n).map(|k| halfedges[(start + k) % n]).find(|&h| on_edge.contains_key(&a.refined.target(h)));
            let place = |v: u32| {
                let here = on_edge[&v].iter().find(|(g, _)| mesh.face(*g).0 == face).unwrap();
                (here.0.0 % 3, here.1)
            };
            let ends = [a.refined.origin(halfedges[start]), a.refined.target(last.unwrap())].map(place);
            chords.entry(face).or_default().push(ends);
        }
    }
    let alternate = |[a, b]: [(u32, usize); 2], c: [(u32, usize); 2]| {
        let inside = |x| x > a.min(b) && x < a.max(b);
        inside(c[0]) != inside(c[1])
    };
    let mut count = 0;
    for list in chords.values() {
        for (i, &c) in list.iter().enumerate() {
            count += list[i + 1..].iter().filter(|&&d| alternate(c, d)).count();
        }
    }
    assert_eq!(count, a.crossings.len());
}

/// The number of crossings of each pair of curves.
fn crossing_numbers(a: &Arrangement) -> BTreeMap<[u32; 2], usize> {
    let mut numbers = BTreeMap::new();
    for c in &a.crossings {
        let curve = |i: usize| match a.refined.mark(c.spokes[i]) {
            Mark::Curve(curve) => curve,
            mark => panic!("{mark:?} at a crossing"),
        };
        assert!(curve(0) == curve(2) && curve(1) == curve(3));
        let (i, j) = (curve(0), curve(1));
        *numbers.entry([i.min(j), i.max(j)]).or_insert(0) += 1;
    }
    numbers
}

/// What of an arrangement does not depend on how the surface is triangulated.
#[derive(Debug, PartialEq)]
struct Combinatorics {
    crossings: BTreeMap<[u32; 2], usize>,
    ends: usize,
    segments: usize,
    /// For each region the vertices of the surface in it, Euler characteristic, number of borders and of corners.
    regions: Vec<(BTreeSet<u32>, i64, usize, usize)>,
}

fn combinatorics(a: &Arrangement) -> Combinatorics {
    let mut inside = vec![BTreeSet::new(); a.regions.len()];
    for v in 0..a.n_base_vertices() as u32 {
        inside[a.region_left_of(a.refined.vertex_halfedge(v)) as usize].insert(v);
    }
    let mut regions: Vec<_> =
        a.regions.iter().zip(inside).map(|(r, v)| (v, r.euler, r.borders.len(), r.corners())).collect();
    regions.sort();
    Combinatorics { crossings: crossing_numbers(a), ends: a.ends.len(), segments: a.segments.len(), regions }
}

/// Steps from a half-edge into the triangle behind it and out by one of its other sides, or `None` at the boundary.
fn onwards(mesh: &TriMesh, h: HalfedgeId, left: bool) -> Option<HalfedgeId> {
    let entered = mesh.twin(h)?;
    Some(if left { mesh.next(entered) } else { mesh.prev(entered) })
}

/// A random curve: some random steps from triangle to triangle, then the fewest steps back to the start, or, from the
/// boundary on, to the boundary. Each step is a side of the triangle and a fraction of its edge.
fn random_curve(mesh: &TriMesh, start: usize, steps: &[(bool, f64)]) -> SurfaceCurve {
    let boundary: Vec<HalfedgeId> = mesh.halfedges().filter(|&h| mesh.twin(h).is_none()).collect();
    let closed = boundary.is_empty();
    let mut list = if closed {
        vec![HalfedgeId((start % mesh.n_halfedges()) as u32)]
    } else {
        let first = boundary[start % boundary.len()];
        vec![first, if steps[0].0 { mesh.next(first) } else { mesh.prev(first) }]
    };
    for &(left, _) in steps {
        let Some(next) = onwards(mesh, list[list.len() - 1], left) else { break };
        list.push(next);
    }
    let is_end = |h: HalfedgeId| if closed { h == list[0] } else { mesh.twin(h).is_none() };
    let mut from: BTreeMap<HalfedgeId, HalfedgeId> = BTreeMap::new();
    let mut queue = VecDeque::from([list[list.len() - 1]]);
    let mut end = Some(queue[0]).filter(|&h| !closed && is_end(h));
    while let Some(h) = queue.pop_front().filter(|_| end.is_none()) {
        for next in [true, false].into_iter().filter_map(|left| onwards(mesh, h, left)) {
            if let Entry::Vacant(entry) = from.entry(next) {
                entry.insert(h);
                queue.push_back(next);
                end = end.or(Some(next).filter(|&next| is_end(next)));
            }
        }
    }
    let mut back = Vec::new();
    let mut at = end.expect("the surface is connected");
    while at != list[list.len() - 1] || (closed && back.is_empty()) {
        back.push(at);
        at = from[&at];
    }
    if closed {
        // The start is there already.
        back.remove(0);
    }
    list.extend(back.into_iter().rev());
    let crossing = |(i, &halfedge): (usize, &HalfedgeId)| Crossing { halfedge, t: steps[i % steps.len()].1 };
    SurfaceCurve { crossings: list.iter().enumerate().map(crossing).collect(), closed }
}

#[test]
fn a_torus_needs_two_loops() {
    let mesh = torus(12, 8);
    let none = checked(&mesh, &[]);
    assert_eq!((none.regions.len(), none.regions[0].euler), (1, 0));

    let one = checked(&mesh, &[row(12, 3, true, 0.4)]);
    assert_eq!((one.regions.len(), one.crossings.len()), (1, 0));
    assert_eq!(one.regions[0].borders.len(), 2);
    assert_eq!(one.regions[0].corners(), 0);

    let two = checked(&mesh, &[row(12, 3, true, 0.4), column(12, 8, 5, true, 0.7)]);
    assert_eq!((two.regions.len(), two.crossings.len(), two.segments.len()), (1, 1, 2));
    assert!(two.regions[0].is_disc());
    assert_eq!(two.regions[0].corners(), 4);
}

#[test]
fn curves_at_equal_positions_on_an_edge_keep_their_order() {
    let mesh = torus(12, 8);
    let parallel = [row(12, 3, true, 0.4), row(12, 3, true, 0.4), row(12, 3, true, 0.4)];
    let a = checked(&mesh, &parallel);
    assert_eq!((a.regions.len(), a.crossings.len()), (3, 0));
}

#[test]
fn many_curves_cross_once_each() {
    let mesh = torus(10, 10);
    let mut curves = Vec::new();
    for k in 0..6 {
        curves.push(row(10, 4, true, 0.1 + 0.13 * f64::from(k)));
        curves.push(column(10, 10, 4, true, 0.15 + 0.13 * f64::from(k)));
    }
    let a = checked(&mesh, &curves);
    assert_eq!((a.crossings.len(), a.regions.len()), (36, 36));
    assert!(a.regions.iter().all(|r| r.is_disc() && r.corners() == 4));
}

#[test]
fn open_curves_end_on_the_boundary() {
    let mesh = square(6);
    let a = checked(&mesh, &[row(6, 2, false, 0.5), column(6, 6, 3, false, 0.5)]);
    assert_eq!((a.crossings.len(), a.ends.len(), a.segments.len(), a.regions.len()), (1, 4, 4, 4));
    for r in &a.regions {
        assert!(r.is_disc());
        assert_eq!((r.corners(), r.boundary_stretches()), (1, 1));
    }
}

#[test]
fn a_curve_off_the_mesh_is_reported_by_its_index() {
    let mesh = torus(8, 6);
    let mut wrong = row(8, 2, true, 0.4);
    wrong.crossings.swap(1, 2);
    let error = Arrangement::new(&mesh, &[row(8, 4, true, 0.4), wrong]).unwrap_err();
    assert!(matches!(error, ArrangementError::Curve { curve: 1, .. }), "{error}");
}

#[test]
fn marked_edges_that_branch_are_no_curves() {
    let mesh = square(4);
    let mut refined = RefinedMesh::new(&mesh);
    for end in [7, 11, 13] {
        let h = refined.find(12, end).unwrap();
        refined.set_mark(h, Mark::Curve(0));
    }
    let error = Arrangement::from_marked_mesh(refined, mesh.n_vertices()).unwrap_err();
    assert!(matches!(error, ArrangementError::Degree { .. }), "{error}");
}

#[test]
fn a_curve_runs_from_end_to_end_through_its_crossings() {
    let mesh = square(6);
    let a = Arrangement::new(&mesh, &[row(6, 2, false, 0.5), column(6, 6, 3, false, 0.5)]).unwrap();
    for curve in 0..2 {
        let halfedges = a.curve_halfedges(curve);
        assert!(halfedges.windows(2).all(|w| a.refined.target(w[0]) == a.refined.origin(w[1])));
        assert!(halfedges.iter().all(|&h| a.refined.mark(h) == Mark::Curve(curve)));
        let [first, last] = [halfedges[0], halfedges[halfedges.len() - 1]];
        for v in [a.refined.origin(first), a.refined.target(last)] {
            assert!(a.ends.iter().any(|e| e.vertex == v));
        }
    }
    assert!(a.curve_halfedges(2).is_empty());
}

#[test]
fn segments_and_stretches_get_inner_vertices() {
    let mesh = square(1);
    let curves = [row(1, 0, false, 0.5), column(1, 1, 0, false, 0.5)];
    let a = Arrangement::new(&mesh, &curves).unwrap();
    let stretches = a.regions.iter().flat_map(|r| &r.borders).flatten().filter(|s| s.kind == SideKind::Boundary);
    assert!(stretches.map(|s| s.halfedges.len()).chain(a.segments.iter().map(|s| s.halfedges.len())).all(|n| n > 1));
    let plain = Arrangement::unsubdivided(&mesh, &curves).unwrap();
    assert_eq!((plain.crossings.len(), plain.regions.len()), (a.crossings.len(), a.regions.len()));
    assert!(plain.refined.n_vertices() < a.refined.n_vertices());
}

/// Random curves: where each starts, and its steps.
fn curves() -> impl Strategy<Value = Vec<(usize, Vec<(bool, f64)>)>> {
    let steps = prop::collection::vec((any::<bool>(), 0.001f64..0.999), 1..14);
    prop::collection::vec((0usize..1000, steps), 1..5)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Rows and columns of a torus in any order, at any positions: each pair crosses once, and the regions are the cells of
    /// a grid.
    #[test]
    fn rows_and_columns_form_a_grid(
        curves in prop::collection::vec((any::<bool>(), 0u32..8, 0.001f64..0.999), 2..9)
    ) {
        let mesh = torus(8, 8);
        let rows = curves.iter().filter(|c| c.0).count();
        let columns = curves.len() - rows;
        let list: Vec<SurfaceCurve> = curves
            .iter()
            .map(|&(is_row, at, t)| if is_row { row(8, at, true, t) } else { column(8, 8, at, true, t) })
            .collect();
        let a = checked(&mesh, &list);
        prop_assert_eq!(a.crossings.len(), rows * columns);
        if rows > 0 && columns > 0 {
            prop_assert_eq!(a.regions.len(), rows * columns);
            prop_assert!(a.regions.iter().all(|r| r.is_disc() && r.corners() == 4));
        }
    }

    /// Without the last curve the arrangement is the one before that curve was placed.
    #[test]
    fn removing_the_last_curve_restores_the_arrangement(curves in curves(), closed in any::<bool>()) {
        let mesh = if closed { torus(6, 5) } else { square(5) };
        let list: Vec<SurfaceCurve> = curves.iter().map(|(start, steps)| random_curve(&mesh, *start, steps)).collect();
        let last = list.len() - 1;
        let before = checked(&mesh, &list[..last]);
        let after = checked(&mesh, &list);
        let open = list.iter().filter(|c| !c.closed).count();
        prop_assert_eq!(after.ends.len(), 2 * open);
        let mut refined = after.refined;
        for h in 0..3 * refined.n_faces() as u32 {
            if refined.mark(h) == Mark::Curve(last as u32) {
                refined.set_mark(h, Mark::Free);
            }
        }
        let removed = Arrangement::from_marked_mesh(refined, mesh.n_vertices()).unwrap();
        check_partition(&mesh, &removed);
        check_sides(&removed);
        prop_assert_eq!(combinatorics(&removed), combinatorics(&before));
    }

    /// A curve is removed and placed again, after the others: the parities of crossing numbers stay, as they depend on the
    /// homology classes only.
    #[test]
    fn placing_a_curve_again_keeps_parities(curves in curves(), which in any::<prop::sample::Index>()) {
        let mesh = torus(6, 5);
        let mut list: Vec<SurfaceCurve> =
            curves.iter().map(|(start, steps)| random_curve(&mesh, *start, steps)).collect();
        let n = list.len();
        let first = checked(&mesh, &list);
        let moved = which.index(n);
        let curve = list.remove(moved);
        checked(&mesh, &list);
        list.push(curve);
        let again = checked(&mesh, &list);
        let numbers = [crossing_numbers(&first), crossing_numbers(&again)];
        let number = |k: usize, i: usize, j: usize| {
            numbers[k].get(&[i.min(j) as u32, i.max(j) as u32]).copied().unwrap_or(0)
        };
        // Index of each curve after the move.
        let now = |i: usize| if i == moved { n - 1 } else { i - usize::from(i > moved) };
        for i in 0..n {
            for j in i..n {
                prop_assert_eq!(number(0, i, j) % 2, number(1, now(i), now(j)) % 2);
            }
        }
    }
}
