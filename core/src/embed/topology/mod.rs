//! The topology of an embedding: nodes as vertices of the working mesh, and the homotopy class of each arc on it.
//!
//! The working mesh has a vertex for every node. Arcs are chains of triangles; period jumps tie the directions of cross
//! fields to the layout. Nodes move from vertex to vertex with their arcs, and the mesh is refined around irregular
//! ones. The module may use `mesh`, `surface`, `solve`, `dual` and `layout`; it does not know maps.

pub(in crate::embed) mod corner_nodes;
pub(in crate::embed) mod embedding_topology;
mod node_insertion;
mod node_move;
mod period_jumps;
mod refinement;
pub(in crate::embed) mod through_arcs;

#[cfg(test)]
mod partial_layout_tests;
#[cfg(test)]
pub(in crate::embed) mod testing;
