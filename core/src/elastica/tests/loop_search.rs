//! The search for the cheapest loops, on sample meshes.

use glam::DVec3;

use super::reference::{cheapest_loop, compare_loops, same_cost};
use super::samples::{close_along, ellipsoid, graph, research, sample, torus};
use crate::elastica::graph::{ElasticaGraph, State};
use crate::elastica::{DirectionMask, ProposalQuery, SearchWorkspace};
use crate::mesh::{FaceId, VertexId};
use crate::progress::Progress;

/// Compares the loops at some vertices with plain Dijkstra.
fn compare_some(graph: &ElasticaGraph, count: usize) {
    let open = DirectionMask::all_open();
    let mut compared = 0;
    for v in sample(graph, count) {
        compared += compare_loops(graph, &open, v, 1.0) + compare_loops(graph, &open, v, 1.5);
    }
    assert!(compared > count);
}

#[test]
fn the_search_is_exact_on_sample_meshes() {
    compare_some(&graph(torus(24, 12)), 4);
    compare_some(&graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5))), 3);
}

#[test]
fn the_search_is_exact_on_research_meshes() {
    for (name, count) in [("od_cube.obj", 8), ("torus_1k.obj", 3), ("rockerarm_1k.off", 3)] {
        if let Some(mesh) = research(name) {
            compare_some(&graph(mesh), count);
        }
    }
}

#[test]
fn the_search_is_exact_around_closed_directions() {
    let g = graph(torus(24, 12));
    let v = VertexId(13);
    let mut mask = DirectionMask::all_open();
    let before =
        g.proposals(&ProposalQuery::cheapest(v, &mask), &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    close_along(&g, &before.loops[0].curve, &mut mask);
    assert!(mask.n_closed() > 0);
    compare_loops(&g, &mask, v, 1.0);
    compare_loops(&g, &mask, v, 1.5);
    let after = g.proposals(&ProposalQuery::cheapest(v, &mask), &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    assert!(after.loops[0].cost > before.loops[0].cost);
}

#[test]
fn the_search_is_exact_in_one_direction() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let open = DirectionMask::all_open();
    let mut work = SearchWorkspace::new();
    for v in sample(&g, 3) {
        for a in g.outgoing(v).step_by(9) {
            let query = ProposalQuery { direction: Some(g.departure(a)), ..ProposalQuery::cheapest(v, &open) };
            let found = g.proposals(&query, &mut work, &Progress::new()).unwrap();
            let expected = cheapest_loop(&g, &open, a);
            assert!(found.proved && same_cost(found.loops[0].cost as f32, expected));
        }
    }
}

#[test]
fn step_costs_are_symmetric_to_the_last_bit() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    for e in 0..g.n_states() as State {
        let back = g.reversed(e);
        assert_eq!(g.reversed(back), e);
        for f in g.successors(e) {
            let turned = g.reversed(f);
            assert_eq!(g.step_cost(e, f).to_bits(), g.step_cost(turned, back).to_bits());
            assert!(g.successors(turned).any(|s| s == back));
            assert!(g.follows(e, f));
        }
        assert_eq!(g.successors(e).count(), g.outgoing(g.target(e)).filter(|&f| g.follows(e, f)).count());
    }
}

#[test]
fn the_midpoint_of_a_geodesic_lies_in_its_face() {
    let g = graph(ellipsoid(2, DVec3::ONE));
    let mut mask = DirectionMask::all_open();
    for f in 0..g.mesh().n_faces() {
        g.close_near(&mut mask, FaceId::new(f), DVec3::X, std::f64::consts::FRAC_PI_2 + 1e-6);
    }
    assert_eq!(2 * mask.n_closed(), g.n_states());
}
