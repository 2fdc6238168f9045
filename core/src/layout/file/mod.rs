//! Layout files: the structure of a layout, complete or partial, with a rough embedding of its nodes and arcs.
//!
//! A node is a point of the surface with a valence, the number of quarter sectors around it. Its slots number the
//! directions in which an arc may leave it. An arc is given by the slots at its ends and the mesh edges that it
//! crosses. A layout with slots without an arc is partial. Patches are not stored: [`LayoutFile::partial_embedding`]
//! inserts the arcs into the mesh and determines the regions between them. The format is documented in
//! `docs/layout-file.md`.

mod error;
mod export;
mod format;
mod insertion;
mod partial_embedding;
mod places;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub use error::{LayoutElement, PartialEmbeddingError};
pub use format::{ArcEnd, FileArc, FileNode, LayoutFile, LayoutFileError, PathPoint};
pub use partial_embedding::{PartialCorner, PartialEmbedding, PartialRegion};

use crate::mesh::TriMesh;

impl LayoutFile {
    /// Embeds nodes and arcs on `mesh` and determines the regions between them.
    ///
    /// # Errors
    ///
    /// See [`PartialEmbeddingError`].
    pub fn partial_embedding(&self, mesh: &TriMesh) -> Result<PartialEmbedding, PartialEmbeddingError> {
        PartialEmbedding::new(self, insertion::insert(self, mesh)?)
    }
}
