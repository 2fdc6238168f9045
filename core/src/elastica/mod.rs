//! Short, straight, aligned loops: the elastica graph, and the search for its cheapest cycles.
//!
//! After Campen, *Quad Layouts*, chapter 8. The graph `g` joins each vertex to the vertices of its `k`-ring by straight
//! geodesics. The nodes of the search graph `g′` are the directed edges of `g`; so a search state is a position with a
//! direction, and an edge of `g′` has a cost for its turning angle. The cost of a cycle of `g′` approximates the elastica
//! energy (8.1).
//!
//! Dependencies: [`crate::mesh`], [`crate::surface`] and [`crate::progress`]. The module does not know strips, layouts or
//! the user interface.

mod alignment_cost;
mod anchored_loops;
mod bidirectional;
mod bucket_queue;
mod budget;
mod curve_neighbourhood;
mod distance_field;
mod geodesics;
mod graph;
mod graph_assembly;
mod homology;
mod initial_loop;
mod mask;
mod open_curves;
mod options;
mod proposals;
mod route;
mod search;
mod sectors;
mod start_directions;
mod step_costs;
#[cfg(test)]
mod tests;
mod trace;
mod unfold;
mod workspace;

pub use anchored_loops::{Anchor, AnchorQuery};
pub use graph::ElasticaGraph;
pub use homology::HomologyClasses;
pub use mask::DirectionMask;
pub use options::{ElasticaError, ElasticaOptions};
pub use proposals::{Certainty, FoundLoop, ProposalQuery, Proposals, Selection};
pub use workspace::SearchWorkspace;
