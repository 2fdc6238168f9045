//! Loops that are short, straight and aligned: the elastica graph, and the search for its cheapest cycles.
//!
//! After Campen, *Quad Layouts*, chapter 8. The graph `g` joins each vertex to those of its `k`-ring by straight
//! geodesics; its directed edges are the nodes of the search graph `g′`, so a search state is a place with a
//! direction and turning has a price. This room may use the mesh and the surface, and knows neither strips nor
//! the user.

mod anchors;
mod boundary;
mod classes;
mod direction;
mod geodesics;
mod graph;
mod mask;
mod proposals;
mod queue;
mod search;
mod seed;
mod stars;
mod steps;
#[cfg(test)]
mod tests;
mod trace;
mod unfold;
mod vicinity;
mod weights;

pub use anchors::{Anchor, AnchorQuery};
pub use classes::LoopClasses;
pub use graph::{ElasticaError, ElasticaGraph, ElasticaOptions};
pub use mask::DirectionMask;
pub use proposals::{Certainty, FoundLoop, ProposalQuery, Proposals};
pub use search::SearchWorkspace;
