//! Quad layouts: structure, embedding on a surface, and files.
//!
//! - [`structure`]: nodes, arcs, patches and chords; dual to an arrangement of loops.
//! - [`initial_embedding`]: nodes as vertices and arcs as edge paths on a refinement of the surface.
//! - [`patch_map`]: maps of the embedded patches to rectangles.
//! - [`collapse`] deletes chords; [`reembedding`] embeds the remaining layout; [`transfer`] moves an embedded layout to
//!   another mesh of the surface, by the curves dual to its chords.
//! - [`file`](mod@file): layouts, complete or partial, with a rough embedding, as files.
//!
//! Dependencies: `mesh`, `surface`, `dual`, `solve` and `progress`. The module takes arrangements as given.

mod collapse;
mod disc_map;
mod dual_curves;
mod embedding;
mod file;
mod initial_embedding;
mod isomorphism;
mod patch_disc;
mod patch_map;
mod reembedding;
mod structure;
mod submesh;
#[cfg(test)]
mod tests;
mod transfer;

pub use collapse::{CollapseError, CollapsedLayout};
pub(crate) use disc_map::count_flipped;
pub use dual_curves::{DualCurve, DualCurvesError};
pub use embedding::Embedding;
#[cfg(test)]
pub(crate) use file::testing as file_testing;
pub use file::{
    ArcEnd, FileArc, FileNode, LayoutElement, LayoutFile, LayoutFileError, PartialCorner, PartialEmbedding,
    PartialEmbeddingError, PartialRegion, PathPoint,
};
pub use initial_embedding::{InitialEmbeddingError, initial_embedding};
pub use patch_disc::PatchShapeError;
pub(crate) use patch_disc::{ArcLookup, PatchDisc};
pub use patch_map::{PatchError, PatchMap, map_patches};
pub use reembedding::{Reembedded, ReembeddingError, reembed};
pub use structure::{Arc, LayoutError, Node, Patch, QuadLayout};
pub use transfer::transfer_embedding;
