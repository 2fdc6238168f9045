//! Curves from boundary to boundary through a vertex.
//!
//! As in Campen, chapter 8, all boundaries are one node of the graph.
//!
//! One field of distances from the boundary serves every vertex: reversed, it holds the cheapest way from each state
//! to the boundary. It is computed once for each set of closed directions.

use std::sync::Arc;

use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::search::{Field, Route, SearchWorkspace};
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};

/// Cheapest ways from the boundary to the middle of each state.
#[derive(Debug)]
pub(super) struct BoundaryField {
    mask: DirectionMask,
    n_states: usize,
    pub(super) field: Field,
}

impl SearchWorkspace {
    /// Makes sure that the boundary field fits a graph and a mask. The first search after a change does it too; on a
    /// large open mesh it takes about a second, which may be spent beforehand. Does nothing on a closed surface.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn prepare(
        &mut self,
        graph: &ElasticaGraph,
        mask: &DirectionMask,
        progress: &Progress,
    ) -> Result<(), Cancelled> {
        if !graph.has_boundary {
            self.boundary = None;
        } else if !self.boundary.as_ref().is_some_and(|b| b.n_states == graph.n_states() && b.mask == *mask) {
            self.boundary = Some(Arc::new(BoundaryField::new(graph, mask, progress)?));
        }
        Ok(())
    }
}

impl BoundaryField {
    fn new(graph: &ElasticaGraph, mask: &DirectionMask, progress: &Progress) -> Result<Self, Cancelled> {
        let mut field = Field::default();
        field.restart(graph.n_states());
        for v in graph.mesh.vertices().filter(|&v| graph.mesh.is_boundary_vertex(v)) {
            for e in graph.leaving(v).filter(|&e| mask.is_open(e)) {
                let cost = graph.half_parts(e).iter().sum();
                field.set(e, cost, NO_STATE, 0);
                field.push(cost, e);
            }
        }
        let mut settled = 0u32;
        while let Some((d, e)) = field.settle() {
            settled += 1;
            if settled.is_multiple_of(4096) {
                progress.check()?;
            }
            graph.expand(e, |f, step| {
                let reached = d + step;
                if field.improves(f, reached) && mask.is_open(f) {
                    field.set(f, reached, e, 0);
                    field.push(reached, f);
                }
            });
        }
        Ok(Self { mask: mask.clone(), n_states: graph.n_states(), field })
    }

    /// Cheapest way from the middle of `a` to the boundary.
    pub(super) fn home(&self, graph: &ElasticaGraph, a: State) -> f32 {
        self.field.dist(graph.reverse[a as usize])
    }

    /// The cheapest curve from boundary to boundary that leaves `v` by `a`, and comes to `v` along a state that
    /// turns into it; or that starts at `v`, if that is on the boundary.
    pub(super) fn through(&self, graph: &ElasticaGraph, v: VertexId, a: State) -> Option<Route> {
        let onwards = self.home(graph, a);
        let reverse = |s: State| graph.reverse[s as usize];
        let ways = graph.leaving(v).filter(|&b| graph.follows(reverse(b), a));
        let back = ways
            .map(|b| (onwards + self.home(graph, b) + graph.step(reverse(b), a), Some(b)))
            .chain(graph.mesh.is_boundary_vertex(v).then(|| (onwards + graph.half_parts(a).iter().sum::<f32>(), None)))
            .filter(|(cost, _)| cost.is_finite())
            .min_by(|x, y| x.0.total_cmp(&y.0))?;
        // The chain to `rev b` runs from the boundary to `v`; the one to `rev a` reversed goes on from there.
        let mut states = back.1.map_or_else(Vec::new, |b| self.field.chain(reverse(b)));
        states.extend(self.field.chain(reverse(a)).iter().rev().map(|&s| reverse(s)));
        Some(Route { cost: back.0, states, closed: false })
    }
}
