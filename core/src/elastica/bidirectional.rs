//! The cheapest loop in one start direction, by a bidirectional search without any bound.
//!
//! The reverse of a path into a state is a path out of its reverse, at the same cost, so both fronts run on the same graph.

use std::convert::Infallible;

use super::budget::Stop;
use super::distance_field::DistanceField;
use super::graph::{ElasticaGraph, State};
use super::route::Route;
use super::search::LoopSearch;
use crate::mesh::VertexId;

impl ElasticaGraph {
    /// Cost from `v` to the farthest state that it reaches, by plain Dijkstra over all states: a reference that benchmarks
    /// compare searches with.
    pub fn eccentricity(&self, v: VertexId) -> f64 {
        let mut field = DistanceField::default();
        field.restart(self.n_states());
        self.outgoing(v).for_each(|a| field.add_source(a, 0.0));
        let mut farthest = 0.0;
        let Ok(()) = field.settle_all(self, |d| {
            farthest = d;
            Ok::<(), Infallible>(())
        });
        f64::from(farthest)
    }
}

impl LoopSearch<'_> {
    /// The cheapest loop that starts with state `a`, if it costs less than `limit`.
    pub(super) fn bidirectional(&mut self, a: State, limit: f32) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let (forward, backward) = (&mut self.work.root, &mut self.work.backward);
        let sources = [a, graph.reversed(a)];
        for (field, source) in [&mut *forward, &mut *backward].into_iter().zip(sources) {
            field.restart(graph.n_states());
            field.add_source(source, 0.0);
        }
        let (mut cost, mut meeting) = (limit, None);
        while forward.min_key() + backward.min_key() < cost {
            let forwards = forward.min_key() <= backward.min_key();
            let (near, far) = if forwards { (&mut *forward, &*backward) } else { (&mut *backward, &*forward) };
            let Some((d, e)) = near.settle(graph) else { break };
            self.budget.count()?;
            graph.expand(e, |f, step| {
                let reached = d + step;
                if !near.improves(f, reached) || !self.mask.is_open(f) {
                    return;
                }
                near.set(f, reached, e, 0);
                near.push(reached, f);
                let back = graph.reversed(f);
                let total = reached + far.distance(back);
                if total < cost {
                    (cost, meeting) = (total, Some(if forwards { (e, back) } else { (back, e) }));
                }
            });
        }
        let Some((e, back)) = meeting else { return Ok(None) };
        let mut states = forward.path_to(e);
        states.extend(backward.path_to(back).iter().rev().map(|&s| graph.reversed(s)));
        // Both paths contain the start state.
        states.pop();
        Ok(Some(Route { cost, states, closed: true }))
    }
}
