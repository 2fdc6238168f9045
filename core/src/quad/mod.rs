//! Quad meshes: refining a layout, projection onto the surface, smoothing, local repair, quality.

mod adaptive_spacing;
mod boundary;
mod corner_energy;
mod local_repair;
mod optimise;
mod projection;
mod quad_mesh;
mod quality;
mod refine;
mod smooth;
mod spacing;

pub use adaptive_spacing::{adaptive_spacing, resampling_error};
pub use local_repair::{FeatureConstraint, repair_locally};
pub use quad_mesh::QuadMesh;
pub use quality::{quality, scaled_jacobians};
pub use refine::refine;
pub use smooth::{project, smooth};
pub use spacing::{Spacing, integer_grid_counts};
