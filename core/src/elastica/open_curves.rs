//! Curves from boundary to boundary through a vertex.
//!
//! All boundaries are one node of the graph (Campen, section 8.1.6). The least costs to reach it from all states are
//! computed once per graph, with no direction closed. Closed directions only make paths more expensive, so these costs stay
//! lower bounds when strips are placed. The exact path from a state is found by an A* search with them as potential. It
//! leaves the path without closed directions hardly anywhere, unless a strip lies on it. Searches from one vertex raise the
//! potential for the later ones: a state that was settled at distance `d`, in a search whose path cost `c`, costs at least
//! `c − d` (Koenig and Likhachev, Adaptive A*).

use super::budget::{SearchBudget, Stop};
use super::distance_field::DistanceField;
use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::route::Route;
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};

/// Raised bound of a state from which no path leads to the boundary. Infinity cannot be stored: it means "not raised".
const NO_PATH: f32 = f32::MAX;

/// Part of the limit by which a path not found below its limit is assumed to exceed it, so that rounding does not repeat the
/// search. Chosen by hand.
const LIMIT_MARGIN: f32 = 1e-6;

/// Number of states settled between two checks for cancellation while the boundary costs are computed.
const CHECK_EVERY: u32 = 4096;

/// Memory of searches for paths to the boundary.
#[derive(Debug, Default)]
pub(super) struct BoundarySearchMemory {
    field: DistanceField,
    settled: Vec<State>,
    /// Lower bounds raised by the searches from the current vertex, as distances.
    raised: DistanceField,
}

impl ElasticaGraph {
    /// Computes the boundary costs that all searches on an open surface need. The first search does it otherwise; on a large
    /// mesh it takes about a second. Does nothing on a closed surface.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn prepare_boundary_costs(&self, progress: &Progress) -> Result<(), Cancelled> {
        self.boundary_costs(progress).map(|_| ())
    }

    /// Per state the least cost from its midpoint to the boundary, with no direction closed; `None` on a closed surface.
    fn boundary_costs(&self, progress: &Progress) -> Result<Option<&[f32]>, Cancelled> {
        if !self.has_boundary {
            return Ok(None);
        }
        if let Some(known) = self.boundary_costs.get() {
            return Ok(Some(known));
        }
        // The reverse of a path from the boundary is a path to it.
        let mut field = DistanceField::default();
        field.restart(self.n_states());
        for v in self.mesh.vertices().filter(|&v| self.mesh.is_boundary_vertex(v)) {
            self.outgoing(v).for_each(|e| field.add_source(e, self.half_cost(e)));
        }
        let mut settled = 0u32;
        field.settle_all(self, |_| {
            settled += 1;
            if settled.is_multiple_of(CHECK_EVERY) { progress.check() } else { Ok(()) }
        })?;
        let costs = self.reverse.iter().map(|&back| field.distance(back)).collect();
        Ok(Some(self.boundary_costs.get_or_init(|| costs)))
    }
}

/// The cheapest paths to the boundary when some directions are closed.
pub(super) struct BoundarySearch<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    /// Per state the cost with no direction closed.
    least: &'a [f32],
    memory: &'a mut BoundarySearchMemory,
}

/// A path to the boundary: its cost from the midpoint of its first state, and its states.
pub(super) type BoundaryPath = (f32, Vec<State>);

impl<'a> BoundarySearch<'a> {
    /// For searches from one vertex; `None` on a closed surface.
    pub(super) fn new(
        graph: &'a ElasticaGraph,
        mask: &'a DirectionMask,
        memory: &'a mut BoundarySearchMemory,
        progress: &Progress,
    ) -> Result<Option<Self>, Cancelled> {
        let Some(least) = graph.boundary_costs(progress)? else { return Ok(None) };
        memory.raised.restart(graph.n_states());
        Ok(Some(Self { graph, mask, least, memory }))
    }

    /// A lower bound of the cost from `e` to the boundary.
    fn lower_bound(&self, e: State) -> f32 {
        lower_bound(self.least, &self.memory.raised, e)
    }

    /// The cheapest path from `a` to the boundary, if it costs less than `limit`.
    pub(super) fn cheapest_path(
        &mut self,
        a: State,
        limit: f32,
        budget: &mut SearchBudget,
    ) -> Result<Option<BoundaryPath>, Stop> {
        let (graph, mask, least) = (self.graph, self.mask, self.least);
        let BoundarySearchMemory { field, settled, raised } = &mut *self.memory;
        field.restart(graph.n_states());
        settled.clear();
        let (mut cost, mut end) = (limit, None);
        let start = lower_bound(least, raised, a);
        if start < limit {
            field.set(a, 0.0, NO_STATE, 0);
            field.push(start, a);
        }
        while let Some((_, e)) = field.settle(graph).filter(|&(key, _)| key < cost) {
            budget.count()?;
            settled.push(e);
            let d = field.distance(e);
            if graph.mesh.is_boundary_vertex(graph.target(e)) {
                let total = d + graph.half_cost(e);
                if total < cost {
                    (cost, end) = (total, Some(e));
                }
            }
            graph.expand(e, |f, step| {
                let reached = d + step;
                if !field.improves(f, reached) {
                    return;
                }
                let key = reached + lower_bound(least, raised, f);
                if key < cost && mask.is_open(f) {
                    field.set(f, reached, e, 0);
                    field.push(key, f);
                }
            });
        }
        // Adaptive A*: what was settled at distance `d` costs at least `cost − d`.
        for &e in settled.iter() {
            let known = (cost - field.distance(e)).min(NO_PATH);
            if known > lower_bound(least, raised, e) {
                raised.set(e, known, NO_STATE, 0);
            }
        }
        Ok(end.map(|e| (cost, field.path_to(e))))
    }

    /// The cheapest curve from boundary to boundary that leaves `v` by each of `starts`, if it costs less than `limit`; with
    /// `only_better`, only those that are cheaper than the ones found before. A curve reaches `v` by a state that may turn
    /// into the start, or begins at `v` if that is on the boundary.
    pub(super) fn curves_through(
        &mut self,
        v: VertexId,
        starts: impl Iterator<Item = State>,
        mut limit: f32,
        only_better: bool,
        budget: &mut SearchBudget,
    ) -> Result<Vec<Route>, Stop> {
        let out = self.graph.outgoing(v);
        let first = out.start;
        let lower_bounds: Vec<f32> = out.map(|a| self.lower_bound(a)).collect();
        let mut paths = PathsFromVertex { first, exact: vec![None; lower_bounds.len()], lower_bounds };
        let mut order: Vec<(f32, State)> = starts
            .map(|a| (self.best_arrival(&paths, v, a).map_or(f32::INFINITY, |arrival| arrival.bound), a))
            .collect();
        order.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let mut routes = Vec::new();
        for (bound, a) in order {
            if bound >= limit {
                break;
            }
            if let Some(route) = self.curve_leaving_by(&mut paths, v, a, limit, budget)? {
                if only_better {
                    limit = route.cost;
                }
                routes.push(route);
            }
        }
        Ok(routes)
    }

    /// The way to reach `v` and leave it by `a` with the least lower bound.
    fn best_arrival(&self, paths: &PathsFromVertex, v: VertexId, a: State) -> Option<Arrival> {
        let graph = self.graph;
        let turns =
            graph.outgoing(v).filter(|&b| graph.follows(graph.reversed(b), a) && self.mask.is_open(b)).map(|b| {
                let turn = graph.step_cost(graph.reversed(b), a);
                Arrival { bound: paths.lower_bound(a) + paths.lower_bound(b) + turn, turn, back: Some(b) }
            });
        let begins = graph.mesh.is_boundary_vertex(v).then(|| {
            let half = graph.half_cost(a);
            Arrival { bound: paths.lower_bound(a) + half, turn: half, back: None }
        });
        turns.chain(begins).filter(|x| x.bound.is_finite()).min_by(|x, y| x.bound.total_cmp(&y.bound))
    }

    /// The cheapest curve that leaves `v` by `a`, if it costs less than `limit`.
    fn curve_leaving_by(
        &mut self,
        paths: &mut PathsFromVertex,
        v: VertexId,
        a: State,
        limit: f32,
        budget: &mut SearchBudget,
    ) -> Result<Option<Route>, Stop> {
        // Each iteration makes a bound exact, or raises it above what this curve may cost.
        while let Some(Arrival { bound: cost, turn, back }) =
            self.best_arrival(paths, v, a).filter(|arrival| arrival.bound < limit)
        {
            let both = [Some(a), back];
            let unknown = both.into_iter().flatten().find(|&s| paths.exact[paths.index(s)].is_none());
            let Some(unknown) = unknown else {
                let exact = |s: State| paths.exact[paths.index(s)].iter().flatten().copied();
                let mut states: Vec<State> = back.map_or_else(Vec::new, |b| exact(b).collect());
                states.reverse();
                states.iter_mut().for_each(|s| *s = self.graph.reversed(*s));
                states.extend(exact(a));
                return Ok(Some(Route { cost, states, closed: false }));
            };
            let others: f32 = both.into_iter().flatten().filter(|&s| s != unknown).map(|s| paths.lower_bound(s)).sum();
            let path_limit = limit - others - turn;
            let index = paths.index(unknown);
            match self.cheapest_path(unknown, path_limit, budget)? {
                Some((cost, states)) => {
                    paths.lower_bounds[index] = cost;
                    paths.exact[index] = Some(states);
                }
                None => paths.lower_bounds[index] = path_limit + limit * LIMIT_MARGIN,
            }
        }
        Ok(None)
    }
}

/// How a curve reaches the vertex through which it is wanted.
struct Arrival {
    /// Lower bound of the cost of the curve.
    bound: f32,
    /// Cost of the turn at the vertex, or of the first half state if the curve begins there.
    turn: f32,
    /// The reverse of the state by which the curve arrives; `None` if it begins at the vertex.
    back: Option<State>,
}

/// What is known about the paths to the boundary from the states around a vertex.
struct PathsFromVertex {
    /// The first of these states.
    first: State,
    /// Lower bounds of the costs; the cost, where the path is known.
    lower_bounds: Vec<f32>,
    /// The cheapest paths found so far.
    exact: Vec<Option<Vec<State>>>,
}

impl PathsFromVertex {
    fn index(&self, a: State) -> usize {
        (a - self.first) as usize
    }

    fn lower_bound(&self, a: State) -> f32 {
        self.lower_bounds[self.index(a)]
    }
}

/// A lower bound of the cost from a state to the boundary: the raised one, if there is one.
fn lower_bound(least: &[f32], raised: &DistanceField, e: State) -> f32 {
    match raised.distance(e) {
        f32::INFINITY => least[e as usize],
        NO_PATH => f32::INFINITY,
        raised => raised,
    }
}
