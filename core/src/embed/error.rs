//! Why a layout could not be embedded.

use thiserror::Error;

use super::trace::completion::CompletionError;
use super::trace::error::TraceError;
use super::trace::rectangles::RectangleError;
use crate::field::FieldError;
use crate::layout::PatchError;
use crate::mesh::{EdgeId, TriMeshError, VertexId};
use crate::param::ParamError;
use crate::progress::Cancelled;
use crate::solve::SolveError;

/// Why a layout could not be embedded.
#[derive(Debug, Error)]
pub enum EmbeddingError {
    /// A node could not be made a vertex of the mesh.
    #[error("node {node} could not be made a vertex of the mesh")]
    Node {
        /// The node.
        node: usize,
    },
    /// An arc is not a path from node to node.
    #[error("arc {arc} is not a path from node to node")]
    Arc {
        /// The arc.
        arc: usize,
    },
    /// No edge of the initial embedding crosses or covers an edge of the surface.
    #[error("the initial embedding does not cover {edge:?} of the surface")]
    Edge {
        /// The edge.
        edge: EdgeId,
    },
    /// The turning numbers of the layout contradict each other at a vertex.
    #[error("the turning number of the layout around {vertex:?} is {quarters} quarters too large")]
    Turning {
        /// The vertex.
        vertex: VertexId,
        /// Its excess, in quarter turns.
        quarters: i32,
    },
    /// The mesh with the nodes inserted is not a manifold.
    #[error("the nodes of the layout cannot be inserted into the mesh: {0}")]
    Mesh(#[from] TriMeshError),
    /// No injective map was found.
    #[error("no injective map was found: triangles remain flipped")]
    NoInjectiveMap,
    /// The arcs could not be traced in the map.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The map does not complete a partial layout.
    #[error("the map does not complete the layout: {0}")]
    Completion(#[from] CompletionError),
    /// The patches are not rectangles of the map.
    #[error(transparent)]
    Rectangle(#[from] RectangleError),
    /// The layout that remains after chords were collapsed has no initial embedding.
    #[error(transparent)]
    Reembedding(#[from] crate::layout::ReembeddingError),
    /// The mesh could not be simplified to a proxy.
    #[error(transparent)]
    Proxy(#[from] crate::proxy::ProxyError),
    /// The patches of the initial embedding could not be mapped.
    #[error(transparent)]
    Patch(#[from] PatchError),
    /// A linear system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The guiding field could not be computed.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The map could not be computed.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
