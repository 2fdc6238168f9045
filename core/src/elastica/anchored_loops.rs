//! Loops through several anchors, in order, each with or without a direction (Campen, chapter 8).
//!
//! A search state gains the leg it is on: leg `i` leads from anchor `i` to the next, and ends with the first state
//! that leaves the next anchor.
//!
//! 1. *Legs*: the cheapest way over each leg alone, in any direction allowed at its ends, from both ends at once.
//!    Their sum is a lower bound of the round.
//! 2. *Rounds*: for a limit a bit above it, a field over all legs, backwards from the start anchor, holds the exact
//!    cheapest way to finish the round, in any direction at the start. What the legs before cost at least keeps it
//!    in the corridor of rounds below the limit.
//! 3. With it as potential, an A* search per start direction closes the loop with that direction. If the best
//!    loop is not below the limit, the limit grows.
//!
//! The start is the anchor with the fewest directions. If all anchors have one, step 1 already knows the cost.

use glam::DVec3;

use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::open_curves::{Exit, Exits};
use super::proposals::Proposals;
use super::search::{Field, Meter, ROUNDING, Route, SearchWorkspace, Stop};
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};

/// First limit, relative to the lower bound; the rest is for turns at anchors without direction.
const FIRST_LIMIT: f32 = 1.1;

/// How much the limit grows when no loop was found below it.
const GROWTH: f32 = 1.3;

/// A place a loop has to pass, and the direction it has to pass it in, if any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// The place.
    pub vertex: VertexId,
    /// The direction; the geodesic nearest to it is taken.
    pub direction: Option<DVec3>,
}

/// A loop wanted through anchors.
#[derive(Debug, Clone, Copy)]
pub struct AnchorQuery<'a> {
    /// The anchors in the order in which the loop passes them.
    pub anchors: &'a [Anchor],
    /// Directions that are closed.
    pub mask: &'a DirectionMask,
    /// Most search states to settle before the best so far is returned unproved.
    pub budget: u64,
}

impl ElasticaGraph {
    /// The cheapest loop through all anchors in order; on open surfaces it may instead be a curve from boundary to
    /// boundary that passes them in order.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn loop_through(
        &self,
        query: &AnchorQuery,
        work: &mut SearchWorkspace,
        progress: &Progress,
    ) -> Result<Proposals, Cancelled> {
        let mut meter = Meter { progress, budget: query.budget, settled: 0 };
        let mut best = None;
        let outcome = Round::new(self, query, work, &mut meter)
            .and_then(|round| round.map_or(Ok(()), |mut r| r.solve(&mut meter, &mut best)));
        if outcome == Err(Stop::Cancelled) {
            return Err(Cancelled);
        }
        if let (Some(route), Some(first)) = (best.as_mut().filter(|r| r.closed), query.anchors.first()) {
            // The search started at another anchor.
            let start = route.states.iter().position(|&e| self.origin(e) == first.vertex);
            route.states.rotate_left(start.unwrap_or(0));
        }
        let loops = best.and_then(|route| self.found(&route)).into_iter().collect();
        Ok(Proposals { loops, proved: outcome.is_ok(), settled: meter.settled })
    }

    /// The open state leaving `v` that is nearest to a direction.
    pub(super) fn nearest(&self, mask: &DirectionMask, v: VertexId, direction: DVec3) -> Option<State> {
        let nearness = |a: &State| self.departure(*a).dot(direction);
        let out = self.leaving(v).filter(|&a| mask.is_open(a));
        out.max_by(|a, b| nearness(a).total_cmp(&nearness(b)).then(b.cmp(a)))
    }
}

/// One search for a loop through anchors, which are stored from the start anchor on.
struct Round<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    /// States that may leave each anchor.
    gates: Vec<Vec<State>>,
    /// Per leg: its lower bound.
    bounds: Vec<f32>,
    /// Per leg: distances from its start, final up to a radius.
    out: &'a mut [Field],
    radii: Vec<f32>,
    /// Per leg: distances backwards over all legs to come, on reversed states.
    home: &'a mut [Field],
    /// Per leg: distances of the A* search.
    ahead: &'a mut [Field],
    /// Per state of the start gate: cheapest round from it.
    rounds: Vec<f32>,
    open: Option<Route>,
}

impl<'a> Round<'a> {
    fn new(
        graph: &'a ElasticaGraph,
        query: &AnchorQuery<'a>,
        work: &'a mut SearchWorkspace,
        meter: &mut Meter,
    ) -> Result<Option<Self>, Stop> {
        let mask = query.mask;
        let mut gates: Vec<Vec<State>> = query
            .anchors
            .iter()
            .map(|a| match a.direction {
                Some(d) => graph.nearest(mask, a.vertex, d).into_iter().collect(),
                None => graph.leaving(a.vertex).filter(|&e| mask.is_open(e)).collect(),
            })
            .collect();
        let start = (0..gates.len()).min_by_key(|&i| gates[i].len());
        let Some(start) = start.filter(|&i| !gates[i].is_empty()) else { return Ok(None) };
        let SearchWorkspace { out, home, ahead, exits, .. } = work;
        let n = gates.len();
        for legs in [&mut *out, &mut *home, &mut *ahead] {
            legs.resize_with(n.max(legs.len()), Field::default);
        }
        let open = match Exits::new(graph, mask, exits, meter.progress)? {
            Some(exits) => Passage { graph, mask, gates: &gates, exits }.cheapest(&mut ahead[..n], meter)?,
            None => None,
        };
        gates.rotate_left(start);
        let rounds = vec![f32::INFINITY; gates[0].len()];
        let (out, home, ahead) = (&mut out[..n], &mut home[..n], &mut ahead[..n]);
        let (bounds, radii) = (vec![0.0; n], vec![0.0; n]);
        Ok(Some(Self { graph, mask, gates, bounds, out, radii, home, ahead, rounds, open }))
    }

    fn solve(&mut self, meter: &mut Meter, best: &mut Option<Route>) -> Result<(), Stop> {
        best.clone_from(&self.open);
        for leg in 0..self.gates.len() {
            self.bounds[leg] = self.cross(leg, meter)?;
        }
        let least: f32 = self.bounds.iter().sum();
        if !least.is_finite() {
            return Ok(());
        }
        let cost = |best: &Option<Route>| best.as_ref().map_or(f32::INFINITY, |r| r.cost);
        let directed = self.gates.iter().all(|g| g.len() == 1);
        let mut limit = least * if directed { ROUNDING } else { FIRST_LIMIT };
        while least < cost(best) {
            let below = limit.min(cost(best));
            let complete = self.finish(below, least, meter)?;
            let mut starts: Vec<usize> = (0..self.rounds.len()).collect();
            starts.sort_by(|&i, &j| self.rounds[i].total_cmp(&self.rounds[j]).then(i.cmp(&j)));
            for i in starts {
                let below = limit.min(cost(best));
                if self.rounds[i] >= below {
                    break;
                }
                if let Some(route) = self.close(self.gates[0][i], below, meter)? {
                    *best = Some(route);
                }
            }
            if complete || cost(best) <= limit {
                break;
            }
            limit *= GROWTH;
        }
        Ok(())
    }

    /// The cheapest way over a leg, by a search from both ends; its near half stays in `out`.
    fn cross(&mut self, leg: usize, meter: &mut Meter) -> Result<f32, Stop> {
        let graph = self.graph;
        let (out, back) = (&mut self.out[leg], &mut self.ahead[leg]);
        out.restart(graph.n_states());
        back.restart(graph.n_states());
        for &a in &self.gates[leg] {
            out.set(a, 0.0, NO_STATE, 0);
            out.push(0.0, a);
        }
        for &b in &self.gates[(leg + 1) % self.gates.len()] {
            let source = graph.reverse[b as usize];
            back.set(source, 0.0, NO_STATE, 0);
            back.push(0.0, source);
        }
        let mut cost = f32::INFINITY;
        while out.top() + back.top() < cost {
            let outwards = out.top() <= back.top();
            let (near, far) = if outwards { (&mut *out, &*back) } else { (&mut *back, &*out) };
            expand(graph, self.mask, near, meter, |f, reached| {
                cost = cost.min(reached + far.dist(graph.reverse[f as usize]));
            })?;
        }
        // Whatever is not settled is at least as far as the queue.
        self.radii[leg] = out.top();
        Ok(cost)
    }

    /// Finds for each start direction the cheapest round below `limit`, which may come back in another direction.
    /// Returns whether the limit left nothing out.
    fn finish(&mut self, limit: f32, least: f32, meter: &mut Meter) -> Result<bool, Stop> {
        let graph = self.graph;
        let last = self.gates.len() - 1;
        for leg in 0..=last {
            let radius = 0.5 * (limit - (least - self.bounds[leg]));
            while self.out[leg].top() < radius {
                expand(graph, self.mask, &mut self.out[leg], meter, |_, _| {})?;
            }
            self.radii[leg] = self.out[leg].top();
            self.home[leg].restart(graph.n_states());
        }
        self.rounds.fill(f32::INFINITY);
        let mut complete = true;
        for &b in &self.gates[0] {
            let source = graph.reverse[b as usize];
            self.home[last].set(source, 0.0, NO_STATE, 0);
            self.home[last].push(0.0, source);
        }
        while let Some(leg) = earliest(self.home) {
            let Some((d, y)) = self.home[leg].settle(graph) else { continue };
            meter.tick()?;
            for z in graph.successors(y).filter(|&z| self.mask.is_open(z)) {
                let reached = d + graph.step(y, z);
                complete &= self.reach(leg, z, reached, limit);
                // `rev z` leaves the anchor this leg starts at: the leg before may end with it.
                if let Some(i) = position(&self.gates[leg], graph.reverse[z as usize]) {
                    if leg == 0 {
                        self.rounds[i] = self.rounds[i].min(reached);
                    } else {
                        complete &= self.reach(leg - 1, z, reached, limit);
                    }
                }
            }
        }
        Ok(complete)
    }

    /// Notes that the round can be finished from `rev z` on `leg` for `reached`; false if that is beyond the limit.
    fn reach(&mut self, leg: usize, z: State, reached: f32, limit: f32) -> bool {
        let e = self.graph.reverse[z as usize];
        let before: f32 = self.bounds[..leg].iter().sum::<f32>() + self.out[leg].settled(e).min(self.radii[leg]);
        if reached + before >= limit {
            return false;
        }
        if self.home[leg].improves(z, reached) {
            self.home[leg].set(z, reached, NO_STATE, 0);
            self.home[leg].push(reached, z);
        }
        true
    }

    /// The cheapest loop that leaves the start anchor by `x` and comes back into it, if it costs less than `limit`.
    fn close(&mut self, x: State, limit: f32, meter: &mut Meter) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let n = self.gates.len();
        let ahead = &mut *self.ahead;
        ahead.iter_mut().for_each(|leg| leg.restart(graph.n_states()));
        let (mut cost, mut end) = (limit, None);
        let (mut leg, mut e, mut d, mut parent) = (0, x, 0.0, NO_STATE);
        loop {
            for f in graph.successors(e).filter(|&f| self.mask.is_open(f)) {
                let reached = d + graph.step(e, f);
                if leg + 1 == n && f == x {
                    if reached < cost {
                        (cost, end) = (reached, Some((leg, e)));
                    }
                    continue;
                }
                // Once the next anchor can be left, it is never cheaper to stay on this leg.
                let to = if leg + 1 < n && position(&self.gates[leg + 1], f).is_some() { leg + 1 } else { leg };
                let key = reached + self.home[to].settled(graph.reverse[f as usize]);
                if key < cost && ahead[to].improves(f, reached) {
                    ahead[to].set(f, reached, parent, leg as u16);
                    ahead[to].push(key, f);
                }
            }
            let Some(next) = earliest(ahead) else { break };
            let Some((key, s)) = ahead[next].settle(graph) else { continue };
            if key >= cost {
                break;
            }
            meter.tick()?;
            (leg, e, d, parent) = (next, s, ahead[next].dist(s), s);
        }
        let Some((leg, last)) = end else { return Ok(None) };
        let mut states = vec![x];
        states.extend(chain(ahead, leg, last));
        Ok(Some(Route { cost, states, closed: true }))
    }
}

/// Settles the next state of a field and shows all its successors to `reach`.
fn expand(
    graph: &ElasticaGraph,
    mask: &DirectionMask,
    field: &mut Field,
    meter: &mut Meter,
    mut reach: impl FnMut(State, f32),
) -> Result<(), Stop> {
    let Some((d, e)) = field.settle(graph) else { return Ok(()) };
    meter.tick()?;
    graph.expand(e, |f, step| {
        let reached = d + step;
        if mask.is_open(f) {
            reach(f, reached);
            if field.improves(f, reached) {
                field.set(f, reached, e, 0);
                field.push(reached, f);
            }
        }
    });
    Ok(())
}

/// The leg with the smallest key in its queue.
fn earliest(legs: &mut [Field]) -> Option<usize> {
    let tops = legs.iter_mut().map(Field::top).enumerate().filter(|(_, top)| top.is_finite());
    tops.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

/// Where a state is in a gate, which is sorted.
fn position(gate: &[State], e: State) -> Option<usize> {
    match (gate.first(), gate.last()) {
        (Some(&first), Some(&last)) if (first..=last).contains(&e) => gate.binary_search(&e).ok(),
        _ => None,
    }
}

/// The states that lead to `e` on `leg`, over all legs; a label remembers the leg of its parent.
fn chain(legs: &[Field], mut leg: usize, mut e: State) -> Vec<State> {
    let mut states = Vec::new();
    while e != NO_STATE {
        states.push(e);
        let (parent, before) = legs[leg].parent(e);
        (leg, e) = (usize::from(before), parent);
    }
    states.reverse();
    states
}

/// Open curves through anchors: from the boundary to the first, on to the last, and to the boundary.
struct Passage<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    gates: &'a [Vec<State>],
    exits: Exits<'a>,
}

impl Passage<'_> {
    fn cheapest(&mut self, legs: &mut [Field], meter: &mut Meter) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let last = legs.len() - 1;
        legs.iter_mut().for_each(|leg| leg.restart(graph.n_states()));
        let mut ins: Vec<Option<Exit>> = Vec::new();
        for &b in &self.gates[0] {
            let way = self.exits.way(graph.reverse[b as usize], f32::INFINITY, meter)?;
            if let Some((cost, _)) = way {
                legs[0].set(b, cost, NO_STATE, 0);
                legs[0].push(cost, b);
            }
            ins.push(way);
        }
        let (mut cost, mut end) = (f32::INFINITY, None);
        while let Some(leg) = earliest(legs) {
            let Some((d, e)) = legs[leg].settle(graph) else { continue };
            if d >= cost {
                break;
            }
            if leg == last {
                if let Some((more, out)) = self.exits.way(e, cost - d, meter)? {
                    (cost, end) = (d + more, Some((e, out)));
                }
                continue;
            }
            meter.tick()?;
            graph.expand(e, |f, step| {
                let reached = d + step;
                let to = if position(&self.gates[leg + 1], f).is_some() { leg + 1 } else { leg };
                if legs[to].improves(f, reached) && self.mask.is_open(f) {
                    legs[to].set(f, reached, e, leg as u16);
                    legs[to].push(reached, f);
                }
            });
        }
        let Some((a, out)) = end else { return Ok(None) };
        let passed = chain(legs, last, a);
        let first = passed.first().and_then(|&b| position(&self.gates[0], b));
        let Some((_, back)) = first.and_then(|i| ins[i].take()) else { return Ok(None) };
        let mut states: Vec<State> = back.iter().rev().map(|&s| graph.reverse[s as usize]).collect();
        states.extend(&passed[1..]);
        states.extend(&out[1..]);
        Ok(Some(Route { cost, states, closed: false }))
    }
}
