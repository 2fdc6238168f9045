//! Quad layouts: their structure, read off an arrangement of dual curves, and a first embedding.
//!
//! Data flows [`structure`] → [`embed`] (nodes and arcs on the surface) → [`patch`] (each patch mapped to a
//! rectangle). A [`file`] holds the structure and a rough embedding, complete or not. [`collapse`] deletes chords of a
//! layout, [`redraw`] draws what is left, [`carry`] draws a layout on another mesh of the surface. The room knows arrangements, not how their curves came about.

mod carry;
mod collapse;
mod disc;
mod dual;
mod file;
mod initial_embedding;
mod matching;
mod patch;
mod piece;
mod redraw;
mod structure;
#[cfg(test)]
mod tests;

pub use carry::carry;
pub use collapse::{CollapseError, CollapsedLayout};
pub(crate) use disc::flipped;
pub use dual::DualCurve;
pub use file::{
    ArcEnd, FileArc, FileNode, LayoutFile, LayoutFileError, Part, PartialCorner, PartialEmbedding,
    PartialEmbeddingError, PartialRegion, PathPoint,
};
pub use initial_embedding::{Embedding, InitialEmbeddingError, embed};
pub(crate) use patch::{ArcLookup, patch_faces, patch_sides};
pub use patch::{PatchError, PatchMap, map_patches};
pub(crate) use piece::Submesh;
pub use redraw::{Reembedded, ReembeddingError, redraw};
pub use structure::{Arc, LayoutError, Node, Patch, QuadLayout};
