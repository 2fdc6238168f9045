//! Loops in given start directions: sector fields, and the A* search in one direction.
//!
//! An A* search with the distance to `v` as potential is fast where the cheapest way back ends in a direction that may
//! turn into the start direction. Elsewhere the potential is far too low almost everywhere. Then start directions close to
//! each other share a sector field: distances from only those states that may turn into one of them, within the corridor.
//! As a potential it accounts for the turn at `v`, and it rules out most directions at once.

use super::budget::{SearchBudget, Stop};
use super::distance_field::DistanceField;
use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::route::Route;

/// Memory for the search in one sector.
#[derive(Debug, Default)]
pub(super) struct SectorMemory {
    sector_field: DistanceField,
    /// Distances of the A* search in one direction.
    pub(super) star: DistanceField,
}

/// What the searches in all sectors share.
pub(super) struct Sectors<'a> {
    pub(super) graph: &'a ElasticaGraph,
    pub(super) mask: &'a DirectionMask,
    /// Final distances from `v` in the ball and the corridor.
    pub(super) root: &'a DistanceField,
}

impl Sectors<'_> {
    /// The cheapest loop of cost below `limit` in each start direction of `group`; with `only_better`, only those that are
    /// cheaper than the ones found before.
    pub(super) fn loops_in_sector(
        &self,
        memory: &mut SectorMemory,
        group: &[State],
        limit: f32,
        only_better: bool,
        budget: &mut SearchBudget,
    ) -> Result<Vec<Route>, Stop> {
        self.compute_sector_field(&mut memory.sector_field, group, limit, budget)?;
        let graph = self.graph;
        let bound = |a: State| {
            let next = graph.successors(a).filter(|&f| self.mask.is_open(f));
            let onward = |f: State| memory.sector_field.settled_distance(graph.reversed(f));
            next.map(|f| graph.step_cost(a, f) + onward(f)).fold(f32::INFINITY, f32::min)
        };
        let mut order: Vec<(f32, State)> = group.iter().map(|&a| (bound(a), a)).collect();
        order.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let (mut routes, mut limit) = (Vec::new(), limit);
        for (bound, a) in order {
            if bound >= limit {
                break;
            }
            if let Some(route) = self.loop_from(&mut memory.star, Some(&memory.sector_field), a, limit, budget)? {
                if only_better {
                    limit = route.cost;
                }
                routes.push(route);
            }
        }
        Ok(routes)
    }

    /// Distances from the states that may turn into one of `group`, the cost of that turn included, as far as they can be
    /// part of a loop below `limit`.
    fn compute_sector_field(
        &self,
        field: &mut DistanceField,
        group: &[State],
        limit: f32,
        budget: &mut SearchBudget,
    ) -> Result<(), Stop> {
        let graph = self.graph;
        field.restart(graph.n_states());
        let Some(&first) = group.first() else { return Ok(()) };
        for b in graph.outgoing(graph.origin(first)).filter(|&b| self.mask.is_open(b)) {
            let last = graph.reversed(b);
            let turns = group.iter().filter(|&&a| graph.follows(last, a)).map(|&a| graph.step_cost(last, a));
            let turn = turns.fold(f32::INFINITY, f32::min);
            if turn + self.root.settled_distance(last) < limit {
                field.add_source(b, turn);
            }
        }
        while let Some((d, e)) = field.settle(graph) {
            budget.count()?;
            graph.expand(e, |f, step| {
                let reached = d + step;
                if field.improves(f, reached)
                    && reached + self.root.settled_distance(graph.reversed(f)) < limit
                    && self.mask.is_open(f)
                {
                    field.set(f, reached, e, 0);
                    field.push(reached, f);
                }
            });
        }
        Ok(())
    }

    /// The cheapest loop that starts with state `a`, if it costs less than `limit`, by an A* search. The potential is the
    /// distance from a sector that contains all states that may turn into `a`, or from all states leaving `v`.
    pub(super) fn loop_from(
        &self,
        star: &mut DistanceField,
        sector_field: Option<&DistanceField>,
        a: State,
        limit: f32,
        budget: &mut SearchBudget,
    ) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let potential = sector_field.unwrap_or(self.root);
        star.restart(graph.n_states());
        let (mut cost, mut last) = (limit, NO_STATE);
        // The successors of `a` are the sources, so that the empty path is not a loop.
        let (mut from, mut d, mut parent) = (a, 0.0, NO_STATE);
        loop {
            graph.expand(from, |f, step| {
                let reached = d + step;
                if !star.improves(f, reached) {
                    return;
                }
                let key = reached + potential.settled_distance(graph.reversed(f));
                if key >= cost || !self.mask.is_open(f) {
                    return;
                }
                star.set(f, reached, parent, 0);
                star.push(key, f);
                if graph.follows(f, a) {
                    let closed = reached + graph.step_cost(f, a);
                    if closed < cost {
                        (cost, last) = (closed, f);
                    }
                }
            });
            let Some((_, e)) = star.settle(graph).filter(|&(key, _)| key < cost) else { break };
            budget.count()?;
            (from, d, parent) = (e, star.distance(e), e);
        }
        if last == NO_STATE {
            return Ok(None);
        }
        let mut states = vec![a];
        states.extend(star.path_to(last));
        Ok(Some(Route { cost, states, closed: true }))
    }
}
