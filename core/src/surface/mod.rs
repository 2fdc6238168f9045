//! A checked mesh made ready for geometry processing, and the curves that are drawn on it.

mod curve;
mod point;

pub use curve::{Crossing, CurveError, SurfaceCurve};
pub use point::SurfacePoint;
