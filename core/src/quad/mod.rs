//! Quad meshes: refining a layout, smoothing on the surface, quality.

mod ground;
mod optimise;
mod rail;
mod refine;
mod shape;
mod smooth;

pub use refine::{QuadMesh, chord_counts, refine, whole_counts};
pub use smooth::{land, quality, scaled_jacobians, smooth};
