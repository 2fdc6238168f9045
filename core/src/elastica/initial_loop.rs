//! A first loop through a vertex, made from a loop found nearby.
//!
//! In interactive use, consecutive queries are at nearby vertices and have almost the same result. The last loop, with a
//! short detour through the new vertex, is a valid loop of the graph. It can be shown at once, and its cost bounds the
//! search from the start. The search decides whether it is the cheapest.

use std::collections::HashMap;

use super::graph::{ElasticaGraph, State};
use super::mask::DirectionMask;
use super::route::Route;
use crate::mesh::VertexId;

/// Largest number of states of the loop that the detour replaces on either side of the vertex nearest to the new one: about
/// the width of a strip.
const DETOUR: usize = 8;

/// A path from the vertex to the loop, of one or two states.
struct Link {
    states: [Option<State>; 2],
    /// Number of states from the start of the loop to the vertex where the path joins it.
    joins_at: usize,
    /// Cost of the path, minus that of the part of the loop that it replaces.
    extra_cost: f64,
}

/// A closed loop, from a start vertex on, in one of its directions.
struct DirectedLoop<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    /// The states, from the one that leaves the start.
    states: Vec<State>,
    /// Per state: cost of the step into it from the one before.
    step_costs: Vec<f64>,
    /// The vertices at which a link may join: number of states from the start to them.
    joints: HashMap<u32, usize>,
}

impl<'a> DirectedLoop<'a> {
    /// `None` if the states are not a loop of the graph or one of them is closed.
    fn new(graph: &'a ElasticaGraph, mask: &'a DirectionMask, states: Vec<State>) -> Option<Self> {
        let n = states.len();
        let before = |k: usize| states[(k + n - 1) % n];
        let step_costs = (0..n).map(|k| step_cost(graph, before(k), states[k])).collect::<Option<_>>()?;
        let reach = DETOUR.min(n.saturating_sub(1) / 2);
        let joints = (0..=reach).rev().map(|k| (graph.origin(states[k]).0, k)).collect();
        states.iter().all(|&e| mask.is_open(e)).then_some(Self { graph, mask, states, step_costs, joints })
    }

    /// The same loop in the other direction, with the same start vertex.
    fn reversed(&self) -> Option<Self> {
        let states = self.states.iter().rev().map(|&e| self.graph.reversed(e)).collect();
        Self::new(self.graph, self.mask, states)
    }

    /// For each state that leaves `vertex`, the cheapest link to the loop that begins with it.
    fn links_from(&self, vertex: VertexId) -> HashMap<State, Link> {
        let graph = self.graph;
        let join = |e: State, cost: f64| {
            let &joins_at = self.joints.get(&graph.target(e).0)?;
            let replaced: f64 = self.step_costs[1..=joins_at].iter().sum();
            Some((joins_at, cost + step_cost(graph, e, self.states[joins_at])? - replaced))
        };
        let mut links = HashMap::new();
        for a in graph.outgoing(vertex).filter(|&a| self.mask.is_open(a)) {
            let mut best =
                join(a, 0.0).map(|(joins_at, cost)| Link { states: [Some(a), None], joins_at, extra_cost: cost });
            for b in graph.successors(a).filter(|&b| self.mask.is_open(b)) {
                let Some((joins_at, cost)) = join(b, f64::from(graph.step_cost(a, b))) else { continue };
                if best.as_ref().is_none_or(|link| cost < link.extra_cost) {
                    best = Some(Link { states: [Some(a), Some(b)], joins_at, extra_cost: cost });
                }
            }
            links.extend(best.map(|link| (a, link)));
        }
        links
    }
}

impl ElasticaGraph {
    /// The cheapest loop that passes `vertex` and elsewhere follows the closed loop through the vertices of `path`. `None`
    /// if no detour of the allowed size joins them through open directions.
    pub(super) fn initial_loop(&self, mask: &DirectionMask, vertex: VertexId, path: &[VertexId]) -> Option<Route> {
        let n = path.len();
        let here = self.mesh.position(vertex);
        let distance = |k: &usize| self.mesh.position(path[*k]).distance_squared(here);
        let start = (0..n).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let state = |k: usize| {
            let (from, to) = (path[(start + k) % n], path[(start + k + 1) % n]);
            self.outgoing(from).find(|&e| self.target(e) == to)
        };
        let onward = DirectedLoop::new(self, mask, (0..n).map(state).collect::<Option<_>>()?)?;
        let whole: f64 = onward.step_costs.iter().sum();
        if path[start] == vertex {
            return Some(Route { cost: whole as f32, states: onward.states, closed: true });
        }
        let back = onward.reversed()?;
        let (onward_links, back_links) = (onward.links_from(vertex), back.links_from(vertex));
        // The step past the start vertex itself is replaced too.
        let joined = |(&a, on): (&State, &Link), (&c, off): (&State, &Link)| {
            let turn = step_cost(self, self.reversed(c), a)?;
            (on.joins_at + off.joins_at < n).then_some((
                whole - onward.step_costs[0] + on.extra_cost + turn + off.extra_cost,
                a,
                c,
            ))
        };
        let pairs = onward_links.iter().flat_map(|a| back_links.iter().map(move |c| (a, c)));
        // By the states where costs are equal, as the order of the maps varies.
        let cheaper =
            |x: &(f64, State, State), y: &(f64, State, State)| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2)));
        let (cost, a, c) = pairs.filter_map(|(a, c)| joined(a, c)).min_by(cheaper)?;
        let (on, off) = (&onward_links[&a], &back_links[&c]);
        let kept = onward.states[on.joins_at..n - off.joins_at].iter().copied();
        let last = off.states.iter().rev().flatten().map(|&e| self.reversed(e));
        let states = on.states.iter().flatten().copied().chain(kept).chain(last).collect();
        Some(Route { cost: cost as f32, states, closed: true })
    }
}

/// Cost of the step from one state into another; `None` if the other may not follow.
fn step_cost(graph: &ElasticaGraph, e: State, f: State) -> Option<f64> {
    graph.follows(e, f).then(|| f64::from(graph.step_cost(e, f)))
}
