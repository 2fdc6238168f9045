//! The topology of an embedding: where the nodes are vertices of the working mesh, and the homotopy class of each arc.
//!
//! The working mesh has a vertex for every node. Arcs are chains of triangles; period jumps tie the directions of cross
//! fields to the layout. Nodes move from vertex to vertex with their arcs, and the mesh is refined around irregular ones.
//! The room may use `mesh`, `field`, `dual` and `layout`; it knows no map.

pub(in crate::embed) mod corner_nodes;
pub(in crate::embed) mod embedding_topology;
pub(in crate::embed) mod node_insertion;
pub(in crate::embed) mod node_move;
pub(in crate::embed) mod period_jumps;
pub(in crate::embed) mod refinement;
pub(in crate::embed) mod through_arcs;

#[cfg(test)]
mod partial_layout_tests;
#[cfg(test)]
pub(in crate::embed) mod testing;
