//! A checked mesh made ready for geometry processing, and the curves that are drawn on it.

mod curve;
mod index;
mod point;

pub use curve::{Crossing, CurveError, SurfaceCurve};
pub use index::SurfaceIndex;
pub use point::SurfacePoint;
