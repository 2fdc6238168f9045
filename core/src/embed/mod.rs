//! The optimised embedding of a quad layout: what guides it, what it is sized by and how good it is.

mod bending;
mod guides;
mod measures;
mod sizing;

pub use bending::face_curvature;
pub use guides::{Guide, feature_guides, shape_guides};
pub use measures::{Measures, PatchMeasures, TriangleMeasure, measure_map, measure_patches};
pub use sizing::{SizingSystem, rest_turns};
