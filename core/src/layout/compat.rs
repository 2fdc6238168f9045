//! Former names, until all callers use the present ones.
#![allow(missing_docs)]

use super::{CollapseError, CollapsedLayout, LayoutFile, PartialEmbedding, PartialEmbeddingError, QuadLayout};
use crate::mesh::TriMesh;

impl QuadLayout {
    pub fn without(&self, gone: &[bool]) -> Result<CollapsedLayout, CollapseError> {
        self.without_chords(gone)
    }
}

impl LayoutFile {
    pub fn draw(&self, mesh: &TriMesh) -> Result<PartialEmbedding, PartialEmbeddingError> {
        self.partial_embedding(mesh)
    }
}
