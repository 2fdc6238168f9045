//! Why a layout could not be embedded.

use thiserror::Error;

use super::trace::arcs::TraceError;
use super::trace::completion::CompletionError;
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
    /// An edge of the surface is missing from the drawing.
    #[error("{edge:?} is missing from the drawing of the layout")]
    Edge {
        /// The edge.
        edge: EdgeId,
    },
    /// The layout's turning numbers do not add up at a vertex.
    #[error("the layout turns by {quarters} quarters too much around {vertex:?}")]
    Turning {
        /// The vertex.
        vertex: VertexId,
        /// How many quarters too much.
        quarters: i32,
    },
    /// The mesh with the nodes inserted is not a manifold.
    #[error("the layout's nodes do not fit into the mesh: {0}")]
    Mesh(#[from] TriMeshError),
    /// No map without folds was found.
    #[error("no map without folds was found")]
    Folded,
    /// The arcs could not be traced in the map.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The arcs missing from a partial layout do not emerge from the map.
    #[error("the missing arcs do not emerge: {0}")]
    Emerge(#[from] CompletionError),
    /// The patches are not the rectangles the layout says.
    #[error(transparent)]
    Rectangle(#[from] RectangleError),
    /// What is left without collapsed chords could not be drawn.
    #[error(transparent)]
    Redraw(#[from] crate::layout::ReembeddingError),
    /// The mesh could not be simplified to embed the layout on that first.
    #[error(transparent)]
    Proxy(#[from] crate::proxy::ProxyError),
    /// The patches of the drawing could not be mapped.
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
