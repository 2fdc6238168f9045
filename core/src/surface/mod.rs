//! A checked mesh made ready for geometry processing, and the curves that are drawn on it.

mod curvature;
mod curve;
mod point;

pub use curvature::{PrincipalCurvature, principal_curvature};
pub use curve::{Crossing, CurveError, SurfaceCurve};
pub use point::SurfacePoint;
