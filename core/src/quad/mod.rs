//! Quad meshes: refining a layout, smoothing on the surface, quality.

mod ground;
mod near;
mod optimise;
mod rail;
mod refine;
mod shape;
mod smooth;
mod stops;
mod worst;

pub use near::{farthest, near};
pub use refine::{QuadMesh, refine};
pub use smooth::{land, quality, scaled_jacobians, smooth};
pub use stops::{Stops, whole_counts};
pub use worst::{Held, mend};
