//! Loops that are short, straight and aligned: the elastica graph, and the search for its cheapest cycles.
//!
//! After Campen, *Quad Layouts*, chapter 8. The graph `g` joins each vertex to those of its `k`-ring by straight
//! geodesics; its directed edges are the nodes of the search graph `g′`, so a search state is a place with a
//! direction and turning has a price. This room may use the mesh and the surface, and knows neither strips nor
//! the user.

mod alignment_cost;
mod anchored_loops;
mod bidirectional;
mod bucket_queue;
mod curve_neighbourhood;
mod geodesics;
mod graph;
mod homology;
mod initial_loop;
mod mask;
mod open_curves;
mod proposals;
mod search;
mod start_directions;
mod step_costs;
#[cfg(test)]
mod tests;
mod trace;
mod unfold;

pub use anchored_loops::{Anchor, AnchorQuery};
pub use graph::{ElasticaError, ElasticaGraph, ElasticaOptions};
pub use homology::HomologyClasses;
pub use mask::DirectionMask;
pub use proposals::{Certainty, FoundLoop, ProposalQuery, Proposals};
pub use search::SearchWorkspace;
