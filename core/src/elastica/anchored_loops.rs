//! Loops through several anchors in order, each with or without a direction (Campen, section 8.1.4).
//!
//! A search state additionally has a leg. Leg `i` leads from anchor `i` to anchor `i + 1` and ends with the first state that
//! leaves the latter.
//!
//! 1. *Legs*: a bidirectional search finds the least cost of each leg alone, in any allowed direction at its ends. The sum
//!    is a lower bound of the cost of a loop through all anchors, a round.
//! 2. *Cost to go*: for a limit slightly above the bound, a search over all legs, backwards from the start anchor, finds the
//!    exact least cost of the remaining round from each state, in any direction at the start. The bounds of the legs before
//!    restrict it to states that can lie on a round below the limit.
//! 3. With the cost to go as potential, an A* search per start direction closes the loop with that direction. If no loop
//!    is below the limit, the limit is increased.
//!
//! The start is the anchor with the fewest directions.
//!
//! Alternatives are the cheapest loops of each direction in which an anchor can be left: steps 2 and 3 for each anchor as the
//! start.
//!
//! The thesis runs Dijkstra's algorithm per pair of directions instead, and searches a graph of their distances.

use glam::DVec3;

use super::budget::{SearchBudget, Stop};
use super::distance_field::DistanceField;
use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::open_curves::{BoundaryPath, BoundarySearch};
use super::proposals::{FoundLoop, Proposals, Selection};
use super::route::{ROUNDING, Route};
use super::workspace::SearchWorkspace;
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};

/// First limit as a multiple of the lower bound; the excess allows for turns at anchors. Chosen by hand.
const FIRST_LIMIT: f32 = 1.1;

/// Factor by which the limit increases when no loop is below it. Chosen by hand.
const LIMIT_GROWTH: f32 = 1.3;

/// A vertex that a loop has to pass, in a given direction if there is one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// The vertex.
    pub vertex: VertexId,
    /// The direction, of any length; the loop leaves the vertex by the open geodesic nearest to it or to its opposite: a strip
    /// has no orientation. `None`: any direction.
    pub direction: Option<DVec3>,
}

/// A query for a loop through anchors.
#[derive(Debug, Clone, Copy)]
pub struct AnchorQuery<'a> {
    /// The anchors in the order in which the loop passes them.
    pub anchors: &'a [Anchor],
    /// Directions that are closed.
    pub mask: &'a DirectionMask,
    /// Which loops are returned. Alternatives are as in [`ProposalQuery`](super::ProposalQuery).
    pub selection: Selection<'a>,
    /// Largest number of search states to settle; then the best loops found so far are returned without proof.
    pub budget: u64,
}

impl<'a> AnchorQuery<'a> {
    /// The cheapest loop through anchors.
    pub fn cheapest(anchors: &'a [Anchor], mask: &'a DirectionMask) -> Self {
        Self { anchors, mask, selection: Selection::cheapest(), budget: 20_000_000 }
    }

    /// The cheapest loop, and alternatives in other directions at the anchors.
    pub fn alternatives(anchors: &'a [Anchor], mask: &'a DirectionMask) -> Self {
        Self { selection: Selection::alternatives(), budget: 60_000_000, ..Self::cheapest(anchors, mask) }
    }
}

impl ElasticaGraph {
    /// The states by which a loop may leave an anchor (ξᵢ in the thesis, where a direction gives one state), sorted.
    pub(super) fn departures(&self, mask: &DirectionMask, anchor: &Anchor) -> Vec<State> {
        let Some(direction) = anchor.direction else {
            return self.outgoing(anchor.vertex).filter(|&e| mask.is_open(e)).collect();
        };
        let nearest = |d| self.nearest_open(mask, anchor.vertex, d);
        let mut states: Vec<State> = [direction, -direction].into_iter().filter_map(nearest).collect();
        states.sort_unstable();
        states.dedup();
        states
    }

    /// The cheapest loops through all anchors in order. On open surfaces the cheapest may instead be a curve from boundary
    /// to boundary that passes them in order. `watch` is called with the cheapest when it is proved, before alternatives
    /// are searched.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn loops_through(
        &self,
        query: &AnchorQuery,
        work: &mut SearchWorkspace,
        progress: &Progress,
        mut watch: impl FnMut(&FoundLoop),
    ) -> Result<Proposals, Cancelled> {
        let mut budget = SearchBudget { progress, limit: query.budget, settled: 0 };
        let mut show = |route: &Route| {
            if let Some(found) = self.found_loop(route) {
                watch(&found);
            }
        };
        let (routes, proved) = self.routes_through(query, work, &mut budget, &mut show)?;
        let loops = self.distinct(routes, &query.selection, &mut work.neighbourhood);
        Ok(Proposals { loops, proved, settled: budget.settled })
    }

    /// The routes of [`Self::loops_through`], from the first anchor on if they are closed, and whether none is missing.
    pub(super) fn routes_through(
        &self,
        query: &AnchorQuery,
        work: &mut SearchWorkspace,
        budget: &mut SearchBudget,
        show: &mut dyn FnMut(&Route),
    ) -> Result<(Vec<Route>, bool), Cancelled> {
        let mut routes = Vec::new();
        let outcome = AnchoredSearch::new(self, query, work, budget)
            .and_then(|search| search.map_or(Ok(()), |mut s| s.all(query, budget, &mut routes, show)));
        if outcome == Err(Stop::Cancelled) {
            return Err(Cancelled);
        }
        for route in routes.iter_mut().filter(|r| r.closed) {
            // The search may have started at another anchor.
            let first = query.anchors.first().map(|a| a.vertex);
            let start = route.states.iter().position(|&e| Some(self.origin(e)) == first);
            route.states.rotate_left(start.unwrap_or(0));
        }
        Ok((routes, outcome.is_ok()))
    }
}

/// One search for a loop through anchors, which are stored from the start anchor on.
struct AnchoredSearch<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    /// Per anchor: the states by which the loop may leave it (ξᵢ in the thesis), sorted.
    departures: Vec<Vec<State>>,
    /// Per leg: the least cost.
    leg_costs: Vec<f32>,
    /// Per leg: distances from its first anchor, final up to a radius.
    leg_starts: &'a mut [DistanceField],
    radii: Vec<f32>,
    /// Per leg: costs of the remaining round, stored at reversed states.
    cost_to_go: &'a mut [DistanceField],
    /// Per leg: distances of the A* search.
    forward: &'a mut [DistanceField],
    /// Per departure of the start anchor: least cost of a round, which may return in another direction.
    round_costs: Vec<f32>,
    /// The cheapest curve from boundary to boundary, if there is one.
    open_curve: Option<Route>,
}

impl<'a> AnchoredSearch<'a> {
    /// `None` if some anchor cannot be left.
    fn new(
        graph: &'a ElasticaGraph,
        query: &AnchorQuery<'a>,
        work: &'a mut SearchWorkspace,
        budget: &mut SearchBudget,
    ) -> Result<Option<Self>, Stop> {
        let mask = query.mask;
        let mut departures: Vec<Vec<State>> = query.anchors.iter().map(|a| graph.departures(mask, a)).collect();
        let start = (0..departures.len()).min_by_key(|&i| departures[i].len());
        let Some(start) = start.filter(|&i| !departures[i].is_empty()) else { return Ok(None) };
        let SearchWorkspace { leg_starts, cost_to_go, forward, boundary, .. } = work;
        let n = departures.len();
        for legs in [&mut *leg_starts, &mut *cost_to_go, &mut *forward] {
            legs.resize_with(n.max(legs.len()), DistanceField::default);
        }
        let open_curve = match BoundarySearch::new(graph, mask, boundary, budget.progress)? {
            Some(boundary) => OpenCurveSearch { graph, mask, departures: &departures, boundary }
                .cheapest(&mut forward[..n], budget)?,
            None => None,
        };
        departures.rotate_left(start);
        let round_costs = vec![f32::INFINITY; departures[0].len()];
        Ok(Some(Self {
            graph,
            mask,
            departures,
            leg_costs: vec![0.0; n],
            leg_starts: &mut leg_starts[..n],
            radii: vec![0.0; n],
            cost_to_go: &mut cost_to_go[..n],
            forward: &mut forward[..n],
            round_costs,
            open_curve,
        }))
    }

    /// The cheapest route, and the alternatives that the query asks for.
    fn all(
        &mut self,
        query: &AnchorQuery,
        budget: &mut SearchBudget,
        routes: &mut Vec<Route>,
        show: &mut dyn FnMut(&Route),
    ) -> Result<(), Stop> {
        let mut best = None;
        let solved = self.solve(budget, &mut best);
        let Some(best) = best else { return solved };
        show(&best);
        let limit = best.cost * query.selection.factor.max(1.0) as f32;
        routes.push(best);
        solved?;
        if query.selection.factor <= 1.0 || self.leg_costs.iter().any(|c| !c.is_finite()) {
            return Ok(());
        }
        for _ in 0..self.departures.len() {
            if self.departures[0].len() > 1 {
                self.alternatives(limit, budget, routes)?;
            }
            self.rotate();
        }
        Ok(())
    }

    /// Makes the second anchor the start.
    fn rotate(&mut self) {
        self.departures.rotate_left(1);
        self.leg_costs.rotate_left(1);
        self.leg_starts.rotate_left(1);
        self.radii.rotate_left(1);
        self.round_costs = vec![f32::INFINITY; self.departures[0].len()];
    }

    /// The cheapest loop of each direction at the start, up to a cost.
    fn alternatives(&mut self, limit: f32, budget: &mut SearchBudget, routes: &mut Vec<Route>) -> Result<(), Stop> {
        let least = self.leg_costs.iter().sum();
        self.compute_cost_to_go(limit * ROUNDING, least, budget)?;
        for i in 0..self.round_costs.len() {
            if self.round_costs[i] <= limit {
                routes.extend(self.loop_from(self.departures[0][i], limit * ROUNDING, budget)?);
            }
        }
        Ok(())
    }

    fn solve(&mut self, budget: &mut SearchBudget, best: &mut Option<Route>) -> Result<(), Stop> {
        best.clone_from(&self.open_curve);
        for leg in 0..self.departures.len() {
            self.leg_costs[leg] = self.search_leg(leg, budget)?;
        }
        let least: f32 = self.leg_costs.iter().sum();
        if !least.is_finite() {
            return Ok(());
        }
        let cost = |best: &Option<Route>| best.as_ref().map_or(f32::INFINITY, |r| r.cost);
        let mut limit = least * FIRST_LIMIT;
        while least < cost(best) {
            let below = limit.min(cost(best));
            let complete = self.compute_cost_to_go(below, least, budget)?;
            let mut starts: Vec<usize> = (0..self.round_costs.len()).collect();
            starts.sort_by(|&i, &j| self.round_costs[i].total_cmp(&self.round_costs[j]).then(i.cmp(&j)));
            for i in starts {
                let below = limit.min(cost(best));
                if self.round_costs[i] >= below {
                    break;
                }
                if let Some(route) = self.loop_from(self.departures[0][i], below, budget)? {
                    *best = Some(route);
                }
            }
            if complete || cost(best) <= limit {
                break;
            }
            limit *= LIMIT_GROWTH;
        }
        Ok(())
    }

    /// Step 1: the least cost of a leg. The forward front stays in `leg_starts`.
    fn search_leg(&mut self, leg: usize, budget: &mut SearchBudget) -> Result<f32, Stop> {
        let graph = self.graph;
        let (forward, backward) = (&mut self.leg_starts[leg], &mut self.forward[leg]);
        forward.restart(graph.n_states());
        backward.restart(graph.n_states());
        for &a in &self.departures[leg] {
            forward.add_source(a, 0.0);
        }
        for &b in &self.departures[(leg + 1) % self.departures.len()] {
            backward.add_source(graph.reversed(b), 0.0);
        }
        let mut cost = f32::INFINITY;
        while forward.min_key() + backward.min_key() < cost {
            let forwards = forward.min_key() <= backward.min_key();
            let (near, far) = if forwards { (&mut *forward, &*backward) } else { (&mut *backward, &*forward) };
            settle_next(graph, self.mask, near, budget, |f, reached| {
                cost = cost.min(reached + far.distance(graph.reversed(f)));
            })?;
        }
        // The distances of states that are not settled are at least the smallest key.
        self.radii[leg] = forward.min_key();
        Ok(cost)
    }

    /// Step 2: the cost to go of the states on rounds below `limit`, and the least cost of a round per start direction.
    /// Returns whether the limit excluded no state.
    fn compute_cost_to_go(&mut self, limit: f32, least: f32, budget: &mut SearchBudget) -> Result<bool, Stop> {
        let graph = self.graph;
        let last = self.departures.len() - 1;
        for leg in 0..=last {
            let radius = 0.5 * (limit - (least - self.leg_costs[leg]));
            while self.leg_starts[leg].min_key() < radius {
                settle_next(graph, self.mask, &mut self.leg_starts[leg], budget, |_, _| {})?;
            }
            self.radii[leg] = self.leg_starts[leg].min_key();
            self.cost_to_go[leg].restart(graph.n_states());
        }
        self.round_costs.fill(f32::INFINITY);
        let mut complete = true;
        for &b in &self.departures[0] {
            self.cost_to_go[last].add_source(graph.reversed(b), 0.0);
        }
        while let Some(leg) = leg_of_min_key(self.cost_to_go) {
            let Some((d, y)) = self.cost_to_go[leg].settle(graph) else { continue };
            budget.count()?;
            for z in graph.successors(y).filter(|&z| self.mask.is_open(z)) {
                let reached = d + graph.step_cost(y, z);
                complete &= self.relax_cost_to_go(leg, z, reached, limit);
                // If `rev z` leaves the anchor at which this leg starts, the leg before may end with it.
                if let Some(i) = index_in(&self.departures[leg], graph.reversed(z)) {
                    if leg == 0 {
                        self.round_costs[i] = self.round_costs[i].min(reached);
                    } else {
                        complete &= self.relax_cost_to_go(leg - 1, z, reached, limit);
                    }
                }
            }
        }
        Ok(complete)
    }

    /// Lowers the cost to go of `rev z` on `leg` to `reached`. Returns false if no round below the limit passes there.
    fn relax_cost_to_go(&mut self, leg: usize, z: State, reached: f32, limit: f32) -> bool {
        let e = self.graph.reversed(z);
        let before: f32 =
            self.leg_costs[..leg].iter().sum::<f32>() + self.leg_starts[leg].settled_distance(e).min(self.radii[leg]);
        if reached + before >= limit {
            return false;
        }
        self.cost_to_go[leg].relax(z, reached, NO_STATE);
        true
    }

    /// Step 3: the cheapest loop that leaves the start anchor by `x` and returns into it, if it costs less than `limit`.
    ///
    /// The tag of a label is the leg of its parent.
    fn loop_from(&mut self, x: State, limit: f32, budget: &mut SearchBudget) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let n = self.departures.len();
        let forward = &mut *self.forward;
        forward.iter_mut().for_each(|leg| leg.restart(graph.n_states()));
        let (mut cost, mut end) = (limit, None);
        let (mut leg, mut e, mut d, mut parent) = (0, x, 0.0, NO_STATE);
        loop {
            for f in graph.successors(e).filter(|&f| self.mask.is_open(f)) {
                let reached = d + graph.step_cost(e, f);
                if leg + 1 == n && f == x {
                    if reached < cost {
                        (cost, end) = (reached, Some((leg, e)));
                    }
                    continue;
                }
                // Where the next anchor can be left, staying on this leg is never cheaper.
                let to = if leg + 1 < n && index_in(&self.departures[leg + 1], f).is_some() { leg + 1 } else { leg };
                let key = reached + self.cost_to_go[to].settled_distance(graph.reversed(f));
                if key < cost && forward[to].improves(f, reached) {
                    forward[to].set(f, reached, parent, leg as u16);
                    forward[to].push(key, f);
                }
            }
            let Some(next) = leg_of_min_key(forward) else { break };
            let Some((key, s)) = forward[next].settle(graph) else { continue };
            if key >= cost {
                break;
            }
            budget.count()?;
            (leg, e, d, parent) = (next, s, forward[next].distance(s), s);
        }
        let Some((leg, last)) = end else { return Ok(None) };
        let mut states = vec![x];
        states.extend(path_over_legs(forward, leg, last));
        Ok(Some(Route { cost, states, closed: true }))
    }
}

/// Settles the next state of a field and relaxes its open successors; calls `reach` with each of them and its distance over
/// this state.
fn settle_next(
    graph: &ElasticaGraph,
    mask: &DirectionMask,
    field: &mut DistanceField,
    budget: &mut SearchBudget,
    mut reach: impl FnMut(State, f32),
) -> Result<(), Stop> {
    let Some((d, e)) = field.settle(graph) else { return Ok(()) };
    budget.count()?;
    graph.expand(e, |f, step| {
        let reached = d + step;
        if mask.is_open(f) {
            reach(f, reached);
            field.relax(f, reached, e);
        }
    });
    Ok(())
}

/// The leg with the smallest key in its queue; the first of equal ones.
fn leg_of_min_key(legs: &mut [DistanceField]) -> Option<usize> {
    let keys = legs.iter_mut().map(DistanceField::min_key).enumerate().filter(|(_, key)| key.is_finite());
    keys.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

/// Index of a state in a sorted list.
fn index_in(sorted: &[State], e: State) -> Option<usize> {
    match (sorted.first(), sorted.last()) {
        (Some(&first), Some(&last)) if (first..=last).contains(&e) => sorted.binary_search(&e).ok(),
        _ => None,
    }
}

/// The states from the first leg to `e` on `leg`. The tag of a label is the leg of its parent.
fn path_over_legs(legs: &[DistanceField], mut leg: usize, mut e: State) -> Vec<State> {
    let mut states = Vec::new();
    while e != NO_STATE {
        states.push(e);
        let (parent, before) = legs[leg].parent(e);
        (leg, e) = (usize::from(before), parent);
    }
    states.reverse();
    states
}

/// The search for an open curve through anchors: from the boundary to the first, to the others in order, and from the last
/// to the boundary.
struct OpenCurveSearch<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    departures: &'a [Vec<State>],
    boundary: BoundarySearch<'a>,
}

impl OpenCurveSearch<'_> {
    fn cheapest(&mut self, legs: &mut [DistanceField], budget: &mut SearchBudget) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let last = legs.len() - 1;
        legs.iter_mut().for_each(|leg| leg.restart(graph.n_states()));
        let mut arrivals: Vec<Option<BoundaryPath>> = Vec::new();
        for &b in &self.departures[0] {
            let path = self.boundary.cheapest_path(graph.reversed(b), f32::INFINITY, budget)?;
            if let Some((cost, _)) = path {
                legs[0].add_source(b, cost);
            }
            arrivals.push(path);
        }
        let (mut cost, mut end) = (f32::INFINITY, None);
        while let Some(leg) = leg_of_min_key(legs) {
            let Some((d, e)) = legs[leg].settle(graph) else { continue };
            if d >= cost {
                break;
            }
            if leg == last {
                if let Some((more, path)) = self.boundary.cheapest_path(e, cost - d, budget)? {
                    (cost, end) = (d + more, Some((e, path)));
                }
                continue;
            }
            budget.count()?;
            graph.expand(e, |f, step| {
                let reached = d + step;
                let to = if index_in(&self.departures[leg + 1], f).is_some() { leg + 1 } else { leg };
                if legs[to].improves(f, reached) && self.mask.is_open(f) {
                    legs[to].set(f, reached, e, leg as u16);
                    legs[to].push(reached, f);
                }
            });
        }
        let Some((a, departure)) = end else { return Ok(None) };
        let between = path_over_legs(legs, last, a);
        let first = between.first().and_then(|&b| index_in(&self.departures[0], b));
        let Some((_, arrival)) = first.and_then(|i| arrivals[i].take()) else { return Ok(None) };
        // The paths share the states by which the first and the last anchor are left.
        let mut states: Vec<State> = arrival.iter().rev().map(|&s| graph.reversed(s)).collect();
        states.extend(&between[1..]);
        states.extend(&departure[1..]);
        Ok(Some(Route { cost, states, closed: false }))
    }
}
