//! A loop through one vertex, made of a loop nearby.
//!
//! A pointer that moves a little asks for almost the same loop again. The one found last, led through the new vertex by a
//! short detour, is a loop of the graph like any other: it can be shown at once, and bounds the search from its first
//! state on. Whether it is the cheapest is for the search to tell.

use std::collections::HashMap;

use super::graph::{ElasticaGraph, State};
use super::mask::DirectionMask;
use super::search::Route;
use crate::mesh::VertexId;

/// Most states of the loop nearby that a detour replaces on either side of the place next to the vertex: about as many as
/// a strip is wide.
const DETOUR: usize = 8;

/// A way between the vertex and the loop nearby.
struct Way {
    /// The states, away from the vertex.
    states: [Option<State>; 2],
    /// How many vertices away from the place next to the vertex it meets the loop.
    at: usize,
    /// Its price less that of the part of the loop that it replaces.
    price: f64,
}

/// A closed loop as seen from a place on it in one direction.
struct Loop<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    /// The states, that first which leaves the place.
    states: Vec<State>,
    /// The price of the step into each from the one before.
    into: Vec<f64>,
    /// For the vertices that can be met how far they are.
    ahead: HashMap<u32, usize>,
}

impl<'a> Loop<'a> {
    /// `None` if the states are no loop of the graph or one is closed.
    fn new(graph: &'a ElasticaGraph, mask: &'a DirectionMask, states: Vec<State>) -> Option<Self> {
        let n = states.len();
        let before = |k: usize| states[(k + n - 1) % n];
        let into = (0..n).map(|k| price(graph, before(k), states[k])).collect::<Option<_>>()?;
        let reach = DETOUR.min(n.saturating_sub(1) / 2);
        let ahead = (0..=reach).rev().map(|k| (graph.origin(states[k]).0, k)).collect();
        states.iter().all(|&e| mask.is_open(e)).then_some(Self { graph, mask, states, into, ahead })
    }

    /// The same run through the other way.
    fn reversed(&self) -> Option<Self> {
        // From the place back: first the reverse of the state that reaches it.
        let states = self.states.iter().rev().map(|&e| self.graph.reverse[e as usize]).collect();
        Self::new(self.graph, self.mask, states)
    }

    /// The cheapest way on from each state that leaves `vertex`, of one state or two.
    fn ways(&self, vertex: VertexId) -> HashMap<State, Way> {
        let graph = self.graph;
        let meet = |e: State, spent: f64| {
            let &at = self.ahead.get(&graph.target[e as usize])?;
            let spared: f64 = self.into[1..=at].iter().sum();
            Some((at, spent + price(graph, e, self.states[at])? - spared))
        };
        let mut ways = HashMap::new();
        for a in graph.leaving(vertex).filter(|&a| self.mask.is_open(a)) {
            let mut best = meet(a, 0.0).map(|(at, price)| Way { states: [Some(a), None], at, price });
            for b in graph.successors(a).filter(|&b| self.mask.is_open(b)) {
                let Some((at, price)) = meet(b, f64::from(graph.step(a, b))) else { continue };
                if best.as_ref().is_none_or(|w| price < w.price) {
                    best = Some(Way { states: [Some(a), Some(b)], at, price });
                }
            }
            ways.extend(best.map(|way| (a, way)));
        }
        ways
    }
}

impl ElasticaGraph {
    /// The cheapest loop that passes `vertex` and else keeps to the closed loop through the vertices of `path`; `None` if
    /// none is found, or none through open directions.
    pub(super) fn seed(&self, mask: &DirectionMask, vertex: VertexId, path: &[VertexId]) -> Option<Route> {
        let n = path.len();
        let here = self.mesh.position(vertex);
        let far = |k: &usize| self.mesh.position(path[*k]).distance_squared(here);
        let place = (0..n).min_by(|a, b| far(a).total_cmp(&far(b)))?;
        let state = |k: usize| {
            let (from, to) = (path[(place + k) % n], path[(place + k + 1) % n]);
            self.leaving(from).find(|&e| self.target[e as usize] == to.0)
        };
        let onward = Loop::new(self, mask, (0..n).map(state).collect::<Option<_>>()?)?;
        let whole: f64 = onward.into.iter().sum();
        if path[place] == vertex {
            return Some(Route { cost: whole as f32, states: onward.states, closed: true });
        }
        let back = onward.reversed()?;
        let (on, home) = (onward.ways(vertex), back.ways(vertex));
        // Left out besides is the step past the place itself.
        let joined = |(&a, way): (&State, &Way), (&c, other): (&State, &Way)| {
            let turn = price(self, self.reverse[c as usize], a)?;
            (way.at + other.at < n).then_some((whole - onward.into[0] + way.price + turn + other.price, a, c))
        };
        let all = on.iter().flat_map(|a| home.iter().map(move |c| (a, c)));
        let cheaper =
            |x: &(f64, State, State), y: &(f64, State, State)| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2)));
        let (cost, a, c) = all.filter_map(|(a, c)| joined(a, c)).min_by(cheaper)?;
        let (way, other) = (&on[&a], &home[&c]);
        let kept = onward.states[way.at..n - other.at].iter().copied();
        let last = other.states.iter().rev().flatten().map(|&e| self.reverse[e as usize]);
        let states = way.states.iter().flatten().copied().chain(kept).chain(last).collect();
        Some(Route { cost: cost as f32, states, closed: true })
    }
}

/// The price of the step from one state into another, if that may follow.
fn price(graph: &ElasticaGraph, e: State, f: State) -> Option<f64> {
    graph.follows(e, f).then(|| f64::from(graph.step(e, f)))
}
