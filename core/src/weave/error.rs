//! What can go wrong while weaving.

use thiserror::Error;

use crate::dual::ArrangementError;
use crate::elastica::ElasticaError;
use crate::embed::EmbeddingError;
use crate::field::FieldError;
use crate::layout::{InitialEmbeddingError, LayoutError, LayoutFileError, Part, PartialEmbeddingError, PatchError};
use crate::mesh::LoadError;
use crate::progress::Cancelled;
use crate::proxy::CurveTransferError;
use crate::weave::design::{DesignError, StripId};

/// Whatever can go wrong while weaving.
#[derive(Debug, Error)]
pub enum WeaveError {
    /// Stopped from outside.
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
    /// A strip woven on a proxy has no counterpart on the mesh itself.
    #[error("the strip cannot be placed here: {0}")]
    Carry(#[from] CurveTransferError),
    /// There is no valid layout yet.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The layout could not be embedded.
    #[error(transparent)]
    Embed(#[from] InitialEmbeddingError),
    /// The embedding could not be optimised.
    #[error(transparent)]
    Embedding(#[from] EmbeddingError),
    /// The patches could not be mapped.
    #[error(transparent)]
    Patch(#[from] PatchError),
    /// A layout file could not be read or written.
    #[error(transparent)]
    LayoutFile(#[from] LayoutFileError),
    /// The layout of a file cannot be drawn on its mesh.
    #[error(transparent)]
    Draw(#[from] PartialEmbeddingError),
    /// A layout that lacks arcs is completed by the optimisation only.
    #[error("the layout lacks arcs; they only emerge when its embedding is optimised")]
    Incomplete,
    /// There is no such node or arc.
    #[error("the layout has no {0}")]
    NoPart(Part),
    /// No strip can be suggested.
    #[error(transparent)]
    NoSuggestion(#[from] NoSuggestion),
    /// The strips do not fit the mesh that other options would weave on.
    #[error(
        "the strips placed make another layout on the surface with this detail; remove those on small relief first"
    )]
    Options,
    /// There is no such strip.
    #[error("there is no strip {}", .0.0)]
    NoStrip(StripId),
    /// A file could not be written.
    #[error("{path}: {source}")]
    Write {
        /// The file.
        path: std::path::PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// No strip can be suggested.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NoSuggestion {
    /// Nothing is left to do.
    #[error("nothing is left to do")]
    Done,
    /// No loop through any of the points tried helps.
    #[error("no strip was found that helps with region {region} ({reason})")]
    NoHelp {
        /// The region.
        region: u32,
        /// Its most urgent finding.
        reason: String,
    },
}
