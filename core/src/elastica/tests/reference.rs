//! Plain Dijkstra over all states, and comparisons of the searches with it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::elastica::budget::SearchBudget;
use crate::elastica::graph::{ElasticaGraph, NO_STATE, State};
use crate::elastica::open_curves::{BoundarySearch, BoundarySearchMemory};
use crate::elastica::route::{ROUNDING, Route};
use crate::elastica::search::LoopSearch;
use crate::elastica::{DirectionMask, SearchWorkspace};
use crate::mesh::VertexId;
use crate::progress::Progress;

/// Relative tolerance of costs: both sides sum the same single-precision costs, but in different orders. About a hundred
/// additions at most round by at most 6e-8 each.
pub(super) const TOLERANCE: f32 = 1e-5;

/// Whether two costs are equal within [`TOLERANCE`]; both may be infinite.
pub(super) fn same_cost(a: f32, b: f32) -> bool {
    a == b || (a - b).abs() <= TOLERANCE * b
}

/// Plain Dijkstra from `a` to every state, by at least one step.
pub(super) fn distances(graph: &ElasticaGraph, mask: &DirectionMask, a: State) -> Vec<f32> {
    dijkstra(graph, mask, a, NO_STATE)
}

/// The cost of the cheapest loop that starts with `a`.
pub(super) fn cheapest_loop(graph: &ElasticaGraph, mask: &DirectionMask, a: State) -> f32 {
    dijkstra(graph, mask, a, a)[a as usize]
}

/// Distances from `a` by at least one step, until `last` is settled.
fn dijkstra(graph: &ElasticaGraph, mask: &DirectionMask, a: State, last: State) -> Vec<f32> {
    let mut distance = vec![f32::INFINITY; graph.n_states()];
    let mut queue = BinaryHeap::new();
    let mut from = (0.0, a);
    loop {
        let (d, e) = from;
        for f in graph.successors(e).filter(|&f| mask.is_open(f)) {
            let reached = d + graph.step_cost(e, f);
            if reached < distance[f as usize] {
                distance[f as usize] = reached;
                queue.push(Reverse((reached.to_bits(), f)));
            }
        }
        from = loop {
            let Some(Reverse((key, e))) = queue.pop() else { return distance };
            if e == last {
                return distance;
            }
            if f32::from_bits(key) <= distance[e as usize] {
                break (f32::from_bits(key), e);
            }
        };
    }
}

/// The cost of a closed route, summed anew. Panics if a step is not one of the graph.
pub(super) fn cost_of_steps(graph: &ElasticaGraph, route: &Route) -> f32 {
    let s = &route.states;
    let closing = (*s.last().unwrap(), s[0]);
    let mut cost = 0.0;
    for (e, f) in s.windows(2).map(|w| (w[0], w[1])).chain([closing]) {
        assert!(graph.follows(e, f));
        cost += graph.step_cost(e, f);
    }
    cost
}

/// Compares all loops of up to `factor` times the cost of the cheapest with the reference in every start direction. Returns
/// how many were compared. The surface must be closed.
pub(super) fn compare_loops(graph: &ElasticaGraph, mask: &DirectionMask, v: VertexId, factor: f32) -> usize {
    let progress = Progress::new();
    let mut work = SearchWorkspace::new();
    let budget = SearchBudget { progress: &progress, limit: u64::MAX, settled: 0 };
    let mut search = LoopSearch { graph, mask, work: &mut work, budget, vertex: v, factor };
    let mut routes = Vec::new();
    search.in_all_directions(None, &mut routes, |_, _| {}).unwrap();
    let out: Vec<State> = graph.outgoing(v).filter(|&a| mask.is_open(a)).collect();
    let expected: Vec<f32> = out.iter().map(|&a| cheapest_loop(graph, mask, a)).collect();
    for r in &routes {
        assert!(r.closed && r.states.iter().all(|&e| mask.is_open(e)) && graph.origin(r.states[0]) == v);
        let cost = cost_of_steps(graph, r);
        assert!(same_cost(cost, r.cost), "{v:?}: {} for {cost}", r.cost);
    }
    let best = routes.iter().map(|r| r.cost).fold(f32::INFINITY, f32::min);
    let best_expected = expected.iter().copied().fold(f32::INFINITY, f32::min);
    assert!(same_cost(best, best_expected), "{v:?}: {best}, expected {best_expected}");
    let mut compared = 1;
    if factor > 1.0 {
        for (&a, &cost) in out.iter().zip(&expected).filter(|(_, c)| **c < best * factor / ROUNDING) {
            let here = routes.iter().filter(|r| r.states[0] == a).map(|r| r.cost).fold(f32::INFINITY, f32::min);
            assert!(same_cost(here, cost), "{v:?} along {a}: {here}, expected {cost}");
            compared += 1;
        }
    }
    compared
}

/// Compares the cheapest curve from boundary to boundary through a vertex inside the surface with the reference.
pub(super) fn compare_open_curves(g: &ElasticaGraph, mask: &DirectionMask, v: VertexId) -> Option<Route> {
    let at_boundary = |e: State| g.mesh().is_boundary_vertex(g.target(e));
    let cost_to_boundary = |a: State| {
        let d = distances(g, mask, a);
        let onwards = (0..g.n_states() as State).filter(|&e| at_boundary(e)).map(|e| d[e as usize] + g.half_cost(e));
        onwards.fold(if at_boundary(a) { g.half_cost(a) } else { f32::INFINITY }, f32::min)
    };
    let out = g.outgoing(v);
    let costs: Vec<f32> =
        out.clone().map(|a| if mask.is_open(a) { cost_to_boundary(a) } else { f32::INFINITY }).collect();
    let pairs = out.clone().flat_map(|a| out.clone().map(move |b| (a, b)));
    let expected = pairs
        .filter(|&(a, b)| g.follows(g.reversed(b), a))
        .map(|(a, b)| {
            let at = |s: State| costs[(s - out.start) as usize];
            at(a) + at(b) + g.step_cost(g.reversed(b), a)
        })
        .fold(f32::INFINITY, f32::min);
    let progress = Progress::new();
    let mut budget = SearchBudget { progress: &progress, limit: u64::MAX, settled: 0 };
    let mut memory = BoundarySearchMemory::default();
    let mut search = BoundarySearch::new(g, mask, &mut memory, &progress).unwrap().expect("an open surface");
    let open = out.filter(|&a| mask.is_open(a));
    let routes = search.curves_through(v, open, f32::INFINITY, true, &mut budget).unwrap();
    let best = routes.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
    let cost = best.as_ref().map_or(f32::INFINITY, |r| r.cost);
    assert!(same_cost(cost, expected), "{v:?}: {cost}, expected {expected}");
    best
}

/// The cost of the cheapest round through anchors: the loop leaves anchor `i` by one of `departures[i]`.
pub(super) fn cheapest_round(graph: &ElasticaGraph, mask: &DirectionMask, departures: &[Vec<State>]) -> f32 {
    cheapest_rounds(graph, mask, departures).into_iter().fold(f32::INFINITY, f32::min)
}

/// The same for each of `departures[0]`, by the graph of distances of the thesis.
pub(super) fn cheapest_rounds(graph: &ElasticaGraph, mask: &DirectionMask, departures: &[Vec<State>]) -> Vec<f32> {
    let n = departures.len();
    let table: Vec<Vec<Vec<f32>>> = (0..n)
        .map(|i| {
            let next = &departures[(i + 1) % n];
            let row = |&a: &State| {
                let d = distances(graph, mask, a);
                next.iter().map(|&b| d[b as usize]).collect()
            };
            departures[i].iter().map(row).collect()
        })
        .collect();
    let round = |x: usize| {
        let mut cost = vec![f32::INFINITY; departures[0].len()];
        cost[x] = 0.0;
        for leg in &table {
            let to = leg[0].len();
            cost = (0..to).map(|b| (0..leg.len()).map(|a| cost[a] + leg[a][b]).fold(f32::INFINITY, f32::min)).collect();
        }
        cost[x]
    };
    (0..departures[0].len()).map(round).collect()
}
