//! The cheapest loop in one start direction, without any bound: a search from both ends.
//!
//! The way back to a state is the way from its reverse, backwards, so both fronts run on the same graph.

use super::graph::{ElasticaGraph, NO_STATE, State};
use super::search::{Field, LoopSearch, Route, Stop};
use crate::mesh::VertexId;

impl ElasticaGraph {
    /// Cost of the state that is farthest from `v`, by plain Dijkstra over all states: the yardstick for searches.
    pub fn eccentricity(&self, v: VertexId) -> f64 {
        let mut field = Field::default();
        field.restart(self.n_states());
        for a in self.leaving(v) {
            field.set(a, 0.0, NO_STATE, 0);
            field.push(0.0, a);
        }
        let mut eccentricity = 0.0;
        while let Some((d, e)) = field.settle(self) {
            eccentricity = d;
            self.expand(e, |f, step| {
                if field.improves(f, d + step) {
                    field.set(f, d + step, e, 0);
                    field.push(d + step, f);
                }
            });
        }
        f64::from(eccentricity)
    }
}

impl LoopSearch<'_> {
    /// The cheapest loop that starts with state `a`, if there is one cheaper than `limit`.
    pub(super) fn both_ways(&mut self, a: State, limit: f32) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let (root, far) = (&mut self.work.root, &mut self.work.far);
        let sources = [a, graph.reverse[a as usize]];
        for (field, source) in [&mut *root, &mut *far].into_iter().zip(sources) {
            field.restart(graph.n_states());
            field.set(source, 0.0, NO_STATE, 0);
            field.push(0.0, source);
        }
        let (mut cost, mut meet) = (limit, None);
        while root.top() + far.top() < cost {
            let forwards = root.top() <= far.top();
            let (near, other) = if forwards { (&mut *root, &*far) } else { (&mut *far, &*root) };
            let Some((d, e)) = near.settle(graph) else { break };
            self.meter.tick()?;
            graph.expand(e, |f, step| {
                let reached = d + step;
                if !near.improves(f, reached) || !self.mask.is_open(f) {
                    return;
                }
                near.set(f, reached, e, 0);
                near.push(reached, f);
                let back = graph.reverse[f as usize];
                let total = reached + other.dist(back);
                if total < cost {
                    (cost, meet) = (total, Some(if forwards { (e, back) } else { (back, e) }));
                }
            });
        }
        let Some((e, back)) = meet else { return Ok(None) };
        let mut states = root.chain(e);
        states.extend(far.chain(back).iter().rev().map(|&s| graph.reverse[s as usize]));
        // Both chains hold the start.
        states.pop();
        Ok(Some(Route { cost, states, closed: true }))
    }
}
