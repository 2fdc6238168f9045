//! The exact search for the cheapest loops through a vertex `v`.
//!
//! 1. *Ball*: Dijkstra's algorithm from all states leaving `v` at once, each label remembering its start state. Where a
//!    path meets the reverse of another path, both form a loop, with a corner at `v`. If the turn at the corner is allowed,
//!    the loop is valid and its cost an upper bound. A loop of cost `C` splits into two parts of cost at most `C / 2`, so
//!    the ball needs half the upper bound as radius. It stops there, and can grow later for more expensive loops.
//! 2. *Corridor*: beyond that radius only states are continued whose distance plus the settled distance of their reverse
//!    is below the upper bound. After that the distance of `rev e` is the exact least cost from `e` back to `v`, in any
//!    direction, for each state `e` that can lie on a loop below the bound.
//! 3. *Start directions* ([`super::start_directions`]): for each start direction that may still have a loop below the bound,
//!    an A* search with that cost as potential finds the cheapest loop in that direction.
//!
//! Steps 1 and 2 need step costs that are symmetric under reversal: then one distance field from `v` serves both ways.

use super::budget::{SearchBudget, Stop};
use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::route::{ROUNDING, Route};
use super::workspace::SearchWorkspace;
use crate::mesh::VertexId;

/// One search for loops through one vertex.
pub(super) struct LoopSearch<'a> {
    pub(super) graph: &'a ElasticaGraph,
    pub(super) mask: &'a DirectionMask,
    pub(super) work: &'a mut SearchWorkspace,
    pub(super) budget: SearchBudget<'a>,
    pub(super) vertex: VertexId,
    /// Loops are wanted up to this multiple of the cost of the cheapest; at least 1.
    pub(super) factor: f32,
}

/// Whether the ball has reached its radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ball {
    Complete,
    /// A loop is found and can be shown; the ball has to grow on.
    Growing,
}

impl LoopSearch<'_> {
    /// Prepares step 1.
    pub(super) fn start(&mut self) {
        let out = self.graph.outgoing(self.vertex);
        let first = out.start;
        let SearchWorkspace { root, ball, corridor, .. } = &mut *self.work;
        root.restart(self.graph.n_states());
        ball.clear();
        corridor.clear();
        for a in out.filter(|&a| self.mask.is_open(a)) {
            root.set(a, 0.0, NO_STATE, (a - first) as u16);
            root.push(0.0, a);
        }
    }

    /// Step 1: grows the ball to the radius for loops of up to `factor` times the cost of `best`, and improves `best`. With
    /// `pause` it returns early, that many states after the first loop is known.
    ///
    /// The tag of a label is the index of its start state among the states leaving the vertex.
    pub(super) fn grow_ball(
        &mut self,
        best: &mut Option<Route>,
        factor: f32,
        pause: Option<u64>,
    ) -> Result<Ball, Stop> {
        let graph = self.graph;
        let first = graph.outgoing(self.vertex).start;
        let mut cost = best.as_ref().map_or(f32::INFINITY, |r| r.cost);
        let limit_factor = self.limit_factor();
        let mut meeting = None;
        let mut states_left = if best.is_some() { pause } else { None };
        let SearchWorkspace { root, ball, .. } = &mut *self.work;
        let mut outcome = Ok(Ball::Complete);
        while root.min_key() < 0.5 * cost * factor {
            if states_left == Some(0) {
                outcome = Ok(Ball::Growing);
                break;
            }
            let Some((d, e)) = root.settle(graph) else { break };
            if let Err(stop) = self.budget.count() {
                outcome = Err(stop);
                break;
            }
            states_left = states_left.map(|n| n - 1);
            ball.push(e);
            let (before, start_index) = root.parent(e);
            // A loop is found when the second of two states on it that are each other's reverse is settled.
            let back = graph.reversed(e);
            let total = d + root.distance(back);
            if total < cost {
                let (after, end_index) = root.parent(back);
                let (start, last) = (first + u32::from(start_index), graph.reversed(first + u32::from(end_index)));
                if graph.follows(last, start) && total + graph.step_cost(last, start) < cost {
                    states_left = states_left.or(pause);
                    (cost, meeting) = (total + graph.step_cost(last, start), Some((before, e, after)));
                }
            }
            graph.expand(e, |f, step| {
                let reached = d + step;
                if !root.improves(f, reached) || !self.mask.is_open(f) {
                    return;
                }
                root.set(f, reached, e, start_index);
                // States beyond the radius keep their label, from which the corridor may continue.
                if reached < 0.5 * cost * limit_factor {
                    root.push(reached, f);
                }
            });
        }
        if let Some((before, e, after)) = meeting {
            // The parent of the reverse of `e` was noted at the meeting: it may have changed since. Those of settled states
            // have not.
            let path_to = |s: State| if s == NO_STATE { Vec::new() } else { root.path_to(s) };
            let mut states = path_to(before);
            states.push(e);
            states.extend(path_to(after).iter().rev().map(|&s| graph.reversed(s)));
            *best = Some(Route { cost, states, closed: true });
        }
        outcome
    }

    /// Step 2, for loops of cost below `limit`; the radius of the ball must be half of that.
    pub(super) fn search_corridor(&mut self, limit: f32) -> Result<(), Stop> {
        let graph = self.graph;
        let SearchWorkspace { root, ball, corridor, ball_queue, .. } = &mut *self.work;
        root.swap_queue(ball_queue);
        root.clear_queue();
        for &back in ball.iter() {
            let x = graph.reversed(back);
            if !root.is_settled(x) && root.distance(x) + root.distance(back) < limit {
                root.push(root.distance(x), x);
            }
        }
        while let Some((d, e)) = root.settle(graph) {
            self.budget.count()?;
            corridor.push(e);
            let start_index = root.parent(e).1;
            graph.expand(e, |f, step| {
                let reached = d + step;
                if root.improves(f, reached)
                    && reached + root.settled_distance(graph.reversed(f)) < limit
                    && self.mask.is_open(f)
                {
                    root.set(f, reached, e, start_index);
                    root.push(reached, f);
                }
            });
        }
        root.swap_queue(ball_queue);
        Ok(())
    }

    /// Returns from step 2 to step 1. The distances in the corridor are exact, but the ball has not grown from there: its
    /// states are unsettled again.
    pub(super) fn resume_ball(&mut self) {
        let SearchWorkspace { root, corridor, .. } = &mut *self.work;
        for e in corridor.drain(..) {
            let (distance, (parent, start_index)) = (root.distance(e), root.parent(e));
            root.set(e, distance, parent, start_index);
            root.push(distance, e);
        }
    }

    /// The start directions that can have a loop of cost below `limit`, each with a lower bound of that cost; in increasing
    /// order of the bound.
    pub(super) fn start_directions(&self, limit: f32) -> Vec<(f32, State)> {
        let graph = self.graph;
        let root = &self.work.root;
        let out = graph.outgoing(self.vertex);
        let cost_to_return = |a: State| root.settled_distance(graph.reversed(a));
        let mut list: Vec<(f32, State)> = out
            .clone()
            .filter(|&a| self.mask.is_open(a))
            .map(|a| {
                // The loop returns by some `rev b` that turns into `a`, so it is also a loop that starts with `b`.
                let bound = out
                    .clone()
                    .filter(|&b| graph.follows(graph.reversed(b), a))
                    .map(|b| cost_to_return(a).max(cost_to_return(b)) + graph.step_cost(graph.reversed(b), a))
                    .fold(f32::INFINITY, f32::min);
                (bound, a)
            })
            .filter(|&(bound, _)| bound < limit)
            .collect();
        list.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        list
    }

    /// The factor by which the cost of the cheapest loop is multiplied to give the limit, with room for rounding if more
    /// expensive loops are wanted.
    pub(super) fn limit_factor(&self) -> f32 {
        if self.factor > 1.0 { self.factor * ROUNDING } else { 1.0 }
    }
}
