//! Loops and curves through several anchors.

use glam::DVec3;

use super::reference::{cheapest_round, same_cost};
use super::samples::{ellipsoid, graph, tube};
use crate::elastica::graph::State;
use crate::elastica::{Anchor, AnchorQuery, DirectionMask, SearchWorkspace};
use crate::mesh::VertexId;
use crate::progress::Progress;

#[test]
fn loops_through_anchors_are_exact() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let mask = DirectionMask::all_open();
    let mut work = SearchWorkspace::new();
    let directed = |v: u32, d: DVec3| Anchor { vertex: VertexId(v), direction: Some(d) };
    let free = |v: u32| Anchor { vertex: VertexId(v), direction: None };
    let cases: [&[Anchor]; 5] = [
        &[free(10)],
        &[free(3), free(120)],
        &[free(40), directed(200, DVec3::X)],
        &[directed(40, DVec3::Y), directed(200, DVec3::Z), directed(77, DVec3::X)],
        &[free(5), free(5)],
    ];
    for anchors in cases {
        let departures: Vec<Vec<State>> = anchors.iter().map(|a| g.departures(&mask, a)).collect();
        let expected = cheapest_round(&g, &mask, &departures);
        let query = AnchorQuery { budget: u64::MAX, ..AnchorQuery::cheapest(anchors, &mask) };
        let found = g.loops_through(&query, &mut work, &Progress::new(), |_| {}).unwrap();
        assert!(found.proved);
        let l = &found.loops[0];
        assert!(same_cost(l.cost as f32, expected), "{anchors:?}: {}, expected {expected}", l.cost);
        assert!(anchors.iter().all(|a| l.path.contains(&a.vertex)));
        assert_eq!(l.path[0], anchors[0].vertex);
        assert_eq!(l.curve.check(g.mesh()), Ok(()));
    }
}

#[test]
fn a_direction_and_its_opposite_mean_the_same_line() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let mask = DirectionMask::all_open();
    let mut work = SearchWorkspace::new();
    let mut cost = |signs: [f64; 2]| {
        let vertices = [VertexId(40), VertexId(200)];
        let anchors = [0, 1].map(|i| Anchor { vertex: vertices[i], direction: Some(DVec3::X * signs[i]) });
        let found = g.loops_through(&AnchorQuery::cheapest(&anchors, &mask), &mut work, &Progress::new(), |_| {});
        found.unwrap().loops[0].cost
    };
    let expected = cost([1.0, 1.0]);
    for signs in [[1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
        assert!((cost(signs) - expected).abs() < 1e-6 * expected, "{signs:?}");
    }
}

#[test]
fn anchors_on_an_open_surface_can_be_passed_from_boundary_to_boundary() {
    let g = graph(tube(24, 40));
    let mask = DirectionMask::all_open();
    let mut work = SearchWorkspace::new();
    let anchors = [10, 20, 30].map(|i| Anchor { vertex: VertexId(i), direction: Some(DVec3::Z) });
    let query = AnchorQuery { budget: u64::MAX, ..AnchorQuery::cheapest(&anchors, &mask) };
    let l = &g.loops_through(&query, &mut work, &Progress::new(), |_| {}).unwrap().loops[0];
    assert!(!l.curve.closed && anchors.iter().all(|a| l.path.contains(&a.vertex)));
    assert_eq!(l.curve.check(g.mesh()), Ok(()));
    // Straight along the tube, so there is hardly any alignment or bending cost.
    assert!((l.cost - l.length).abs() < 0.05 * l.length, "{} of length {}", l.cost, l.length);
}
