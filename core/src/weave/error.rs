//! Errors of weaving.

use std::path::PathBuf;

use thiserror::Error;

use crate::dual::ArrangementError;
use crate::elastica::ElasticaError;
use crate::embed::EmbeddingError;
use crate::field::FieldError;
use crate::layout::{
    InitialEmbeddingError, LayoutElement, LayoutError, LayoutFileError, PartialEmbeddingError, PatchError,
};
use crate::mesh::LoadError;
use crate::output::OutputError;
use crate::progress::Cancelled;
use crate::proxy::CurveTransferError;
use crate::weave::design::{DesignError, StripId};

/// Why weaving failed.
#[derive(Debug, Error)]
pub enum WeaveError {
    /// Cancelled by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The search graph could not be built.
    #[error(transparent)]
    Elastica(#[from] ElasticaError),
    /// A field could not be computed.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// Strips could not be arranged.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// The mesh could not be read.
    #[error(transparent)]
    Mesh(#[from] LoadError),
    /// The design could not be read, written or replayed.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A strip on the proxy has no counterpart on the design mesh.
    #[error("the strip cannot be placed here: {0}")]
    Transfer(#[from] CurveTransferError),
    /// The strips have no valid layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The layout has no initial embedding.
    #[error(transparent)]
    InitialEmbedding(#[from] InitialEmbeddingError),
    /// The embedding could not be optimised.
    #[error(transparent)]
    Embedding(#[from] EmbeddingError),
    /// The patches could not be mapped.
    #[error(transparent)]
    Patch(#[from] PatchError),
    /// A layout file could not be read or written.
    #[error(transparent)]
    LayoutFile(#[from] LayoutFileError),
    /// The partial embedding of a layout file does not fit its mesh.
    #[error(transparent)]
    PartialEmbedding(#[from] PartialEmbeddingError),
    /// The layout lacks arcs. Only the optimised map completes it.
    #[error("the layout lacks arcs; optimising its embedding completes it")]
    Incomplete,
    /// There is no such node or arc.
    #[error("the layout has no {0}")]
    NoElement(LayoutElement),
    /// No strip can be suggested.
    #[error(transparent)]
    NoSuggestion(#[from] NoSuggestion),
    /// Under other options the strips have another layout on the woven mesh.
    #[error("the placed strips have another layout at this level of detail; remove strips on small relief first")]
    Options,
    /// There is no such strip.
    #[error("there is no strip {}", .0.0)]
    NoStrip(StripId),
    /// No strip passes the anchors.
    #[error(transparent)]
    NoLoop(#[from] NoLoop),
    /// A folder could not be made.
    #[error("the folder {path} cannot be made: {source}")]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] OutputError),
    /// The export would replace the mesh that it was made from.
    #[error("{path} is the mesh of this layout, so it is not replaced; export to another folder")]
    OwnMesh {
        /// The mesh.
        path: PathBuf,
    },
}

/// Why no strip passes all anchors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum NoLoop {
    /// It would run along a placed strip, given by its place in the list of strips, from 0.
    #[error("strip {} runs there already; edit or remove it, or move an anchor", .0 + 1)]
    Blocked(usize),
    /// It would run along several placed strips.
    #[error("placed strips run there already; edit or remove them, or move an anchor")]
    BlockedBySeveral,
    /// The anchors lie on different pieces of the surface.
    #[error("the anchors lie on different pieces of the surface")]
    Apart,
    /// The anchors cannot be joined by a smooth curve that closes or ends on the boundary.
    #[error("no smooth curve through the anchors closes; turn or move an anchor")]
    Turns,
}

/// Why no strip is suggested.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NoSuggestion {
    /// The goal is reached.
    #[error("no region needs another strip")]
    Done,
    /// No candidate improves any region that needs strips.
    #[error("no strip was found that resolves the problem of region {region} ({reason})")]
    NoHelp {
        /// The most urgent region.
        region: u32,
        /// Its most urgent finding.
        reason: String,
    },
}
