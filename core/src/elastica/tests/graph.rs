//! The elastica graph, its masks, and the searches at their limits.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::DVec3;

use super::reference::same_cost;
use super::samples::{ellipsoid, graph, graph_with, torus, tube};
use crate::elastica::route::Route;
use crate::elastica::{
    Anchor, AnchorQuery, DirectionMask, ElasticaError, ElasticaGraph, ElasticaOptions, ProposalQuery, SearchWorkspace,
    Selection,
};
use crate::mesh::{FaceId, VertexId};
use crate::progress::Progress;
use crate::surface::principal_curvature;

#[test]
fn more_rings_give_more_states() {
    let mesh = torus(16, 10);
    let states = |rings| graph_with(mesh.clone(), &ElasticaOptions { rings, ..ElasticaOptions::default() }).n_states();
    // One ring is the mesh edges, and across each edge the opposite vertex.
    assert!(states(1) >= mesh.n_halfedges() && states(1) < states(2) && states(2) < states(3));
}

#[test]
fn flags_for_too_few_edges_are_refused() {
    let mesh = torus(8, 6);
    let sharp = vec![false; mesh.n_edges() - 1];
    let curvature = principal_curvature(&mesh, 0.03, &vec![false; mesh.n_edges()]);
    let expected = mesh.n_edges();
    let built = ElasticaGraph::build(Arc::new(mesh), &curvature, &sharp, &ElasticaOptions::default(), &Progress::new());
    assert_eq!(built.err(), Some(ElasticaError::WrongLength { given: expected - 1, expected }));
}

#[test]
fn a_cancelled_build_returns_no_graph() {
    let mesh = torus(8, 6);
    let sharp = vec![false; mesh.n_edges()];
    let curvature = principal_curvature(&mesh, 0.03, &sharp);
    let progress = Progress::new();
    progress.cancel();
    let built = ElasticaGraph::build(Arc::new(mesh), &curvature, &sharp, &ElasticaOptions::default(), &progress);
    assert!(matches!(built, Err(ElasticaError::Cancelled(_))));
}

#[test]
fn a_geodesic_is_closed_in_both_directions() {
    let g = graph(torus(16, 10));
    let mut mask = DirectionMask::all_open();
    g.close_near(&mut mask, FaceId(3), DVec3::Z, 0.2);
    assert!(mask.n_closed() > 0);
    let closed: Vec<u32> = (0..g.n_states() as u32).filter(|&e| !mask.is_open(e)).collect();
    assert_eq!(closed.len(), 2 * mask.n_closed());
    assert!(closed.iter().all(|&e| !mask.is_open(g.reversed(e))));
}

#[test]
fn the_nearest_open_direction_skips_closed_ones() {
    let g = graph(torus(16, 10));
    let (v, open) = (VertexId(3), DirectionMask::all_open());
    let a = g.outgoing(v).start + 5;
    assert_eq!(g.nearest_open(&open, v, g.departure(a)), Some(a));
    let mut mask = open.clone();
    for f in g.mesh().outgoing(v).map(|h| g.mesh().face(h)) {
        g.close_near(&mut mask, f, g.departure(a), 0.1);
    }
    let other = g.nearest_open(&mask, v, g.departure(a)).unwrap();
    assert!(!mask.is_open(a) && mask.is_open(other));
}

#[test]
fn a_vertex_without_open_directions_has_no_loops() {
    let g = graph(torus(16, 10));
    let v = VertexId(3);
    let mut mask = DirectionMask::all_open();
    for f in g.mesh().outgoing(v).map(|h| g.mesh().face(h)) {
        g.close_near(&mut mask, f, DVec3::X, FRAC_PI_2 + 1e-6);
    }
    let mut work = SearchWorkspace::new();
    let found = g.proposals(&ProposalQuery::alternatives(v, &mask), &mut work, &Progress::new()).unwrap();
    assert!(found.loops.is_empty() && found.proved);
    let anchors = [Anchor { vertex: VertexId(80), direction: None }, Anchor { vertex: v, direction: None }];
    let query = AnchorQuery::cheapest(&anchors, &mask);
    let found = g.loops_through(&query, &mut work, &Progress::new(), |_| {}).unwrap();
    assert!(found.loops.is_empty() && found.proved);
}

#[test]
fn the_largest_number_of_loops_is_kept() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let mask = DirectionMask::all_open();
    let selection = Selection { factor: 3.0, max: 3, ..Selection::alternatives() };
    let query = ProposalQuery { selection, ..ProposalQuery::alternatives(VertexId(40), &mask) };
    let some = g.proposals(&query, &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    assert_eq!(some.loops.len(), 3);
    let all = ProposalQuery { selection: Selection { max: 100, ..selection }, ..query };
    let all = g.proposals(&all, &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    assert_eq!(some.loops, all.loops[..3]);
}

#[test]
fn a_workspace_serves_one_query_after_the_other() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let mask = DirectionMask::all_open();
    let mut shared = SearchWorkspace::new();
    for v in [3, 50, 3] {
        let query = ProposalQuery::alternatives(VertexId(v), &mask);
        let found = g.proposals(&query, &mut shared, &Progress::new()).unwrap();
        let fresh = g.proposals(&query, &mut SearchWorkspace::new(), &Progress::new()).unwrap();
        assert_eq!(found, fresh);
    }
}

#[test]
fn the_terms_of_a_route_sum_to_its_cost() {
    let g = graph(torus(24, 12));
    let mask = DirectionMask::all_open();
    let found =
        g.proposals(&ProposalQuery::cheapest(VertexId(5), &mask), &mut SearchWorkspace::new(), &Progress::new());
    let l = &found.unwrap().loops[0];
    let n = l.path.len();
    let state = |i: usize| g.outgoing(l.path[i]).find(|&e| g.target(e) == l.path[(i + 1) % n]).unwrap();
    let route = Route { cost: l.cost as f32, states: (0..n).map(state).collect(), closed: true };
    let steps: f32 = (0..n).map(|i| g.step_cost(route.states[i], route.states[(i + 1) % n])).sum();
    assert!(same_cost(steps, route.cost));
    assert_eq!(g.route_terms(&route), [l.length, l.alignment, l.bending]);
    assert_eq!(g.route_vertices(&route), l.path);
}

#[test]
fn an_initial_loop_at_a_vertex_of_the_loop_is_the_loop() {
    let g = graph(torus(24, 12));
    let mask = DirectionMask::all_open();
    let found =
        g.proposals(&ProposalQuery::cheapest(VertexId(5), &mask), &mut SearchWorkspace::new(), &Progress::new());
    let l = &found.unwrap().loops[0];
    let route = g.initial_loop(&mask, l.path[1], &l.path).unwrap();
    assert!(same_cost(route.cost, l.cost as f32) && g.origin(route.states[0]) == l.path[1]);
    // Vertices that no geodesic joins are no loop.
    assert_eq!(g.initial_loop(&mask, VertexId(5), &[VertexId(0), VertexId(150), VertexId(20)]), None);
}

#[test]
fn boundary_costs_are_for_open_surfaces_only() {
    let progress = Progress::new();
    let closed = graph(torus(8, 6));
    closed.prepare_boundary_costs(&progress).unwrap();
    assert!(closed.boundary_costs.get().is_none());
    let open = graph(tube(12, 8));
    open.prepare_boundary_costs(&progress).unwrap();
    let costs = open.boundary_costs.get().unwrap();
    for e in 0..open.n_states() as u32 {
        if open.mesh().is_boundary_vertex(open.target(e)) {
            assert!(costs[e as usize] <= open.half_cost(e));
        }
        // A step onwards cannot save more than it costs.
        for f in open.successors(e) {
            assert!(costs[e as usize] <= open.step_cost(e, f) + costs[f as usize] + 1e-5 * costs[e as usize]);
        }
    }
}

#[test]
fn the_eccentricity_grows_with_the_bending_weight() {
    let mesh = torus(12, 8);
    let farthest = |beta| {
        graph_with(mesh.clone(), &ElasticaOptions { beta, ..ElasticaOptions::default() }).eccentricity(VertexId(0))
    };
    assert!(farthest(0.0) > 0.0 && farthest(0.0) < farthest(0.25) && farthest(0.25) < farthest(1.0));
}
