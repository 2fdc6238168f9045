//! Quad meshes: refining a layout, smoothing on the surface, quality.

mod adaptive_spacing;
mod ground;
mod local_repair;
mod optimise;
mod rail;
mod refine;
mod shape;
mod smooth;
mod spacing;

pub use adaptive_spacing::{adaptive_spacing, resampling_error};
pub use local_repair::{FeatureConstraint, repair_locally};
pub use refine::{QuadMesh, refine};
pub use smooth::{project, quality, scaled_jacobians, smooth};
pub use spacing::{Spacing, integer_grid_counts};
