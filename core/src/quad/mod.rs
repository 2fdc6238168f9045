//! Quad meshes: refining a layout, smoothing on the surface, quality.

mod refine;

pub use refine::{QuadMesh, chord_counts, refine};
