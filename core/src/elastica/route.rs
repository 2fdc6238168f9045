//! Routes: the paths in the search graph that the searches find.

use super::graph::{ElasticaGraph, State};
use crate::mesh::VertexId;

/// Sums of the same costs in different orders differ by rounding: bounds are multiplied by this. A loop has some tens of
/// steps, each rounded by at most 6e-8 of the sum.
pub(super) const ROUNDING: f32 = 1.0 + 1e-5;

/// A cycle of states, or an open path of states from boundary to boundary, with its cost.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Route {
    pub(super) cost: f32,
    pub(super) states: Vec<State>,
    pub(super) closed: bool,
}

impl ElasticaGraph {
    /// The weighted terms of the cost of a route: length, alignment and bending.
    pub(super) fn route_terms(&self, route: &Route) -> [f64; 3] {
        let s = &route.states;
        let mut sum = [0.0; 3];
        let mut add = |terms: [f32; 3]| sum.iter_mut().zip(terms).for_each(|(s, p)| *s += f64::from(p));
        for pair in s.windows(2) {
            add(self.step_terms(pair[0], pair[1]));
        }
        if let (Some(&start), Some(&end)) = (s.first(), s.last()) {
            if route.closed {
                add(self.step_terms(end, start));
            } else {
                add(self.half_terms(start));
                add(self.half_terms(end));
            }
        }
        sum
    }

    /// The vertices that a route passes, in order. An open route has one more vertex than states.
    pub(super) fn route_vertices(&self, route: &Route) -> Vec<VertexId> {
        let mut vertices: Vec<VertexId> = route.states.iter().map(|&e| self.origin(e)).collect();
        if let Some(&last) = route.states.last().filter(|_| !route.closed) {
            vertices.push(self.target(last));
        }
        vertices
    }
}
