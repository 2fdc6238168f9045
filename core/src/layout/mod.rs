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
pub use collapse::{CollapseError, Collapsed};
pub(crate) use disc::flipped;
pub use dual::Line;
pub use file::{
    ArcEnd, DrawError, Drawing, DrawnCorner, DrawnRegion, FileArc, FileNode, LayoutFile, LayoutFileError, Part,
    PathPoint,
};
pub use initial_embedding::{EmbedError, Embedding, embed};
pub(crate) use patch::{Lookup, border_sides, flood};
pub use patch::{PatchError, PatchMap, map_patches};
pub(crate) use piece::Piece;
pub use redraw::{RedrawError, Redrawn, redraw};
pub use structure::{Arc, LayoutError, Node, Patch, QuadLayout};
