//! A checked mesh made ready for geometry processing, and the curves that are drawn on it.

mod curvature;
mod curve;
mod index;
mod path;
mod point;
mod relax;
mod straightest;

pub use curvature::{PrincipalCurvature, principal_curvature};
pub use curve::{Crossing, CurveError, SurfaceCurve};
pub use index::SurfaceIndex;
pub(crate) use index::nearest_in_triangle;
pub use path::{VertexPath, geodesic_in};
pub use point::SurfacePoint;
#[cfg(test)]
pub(crate) use relax::testing;
pub use relax::{Alignment, CurveCost, RelaxError, RelaxOptions, Relaxed, curve_cost, relax};
pub use straightest::{PolarMap, Trace, straightest};
