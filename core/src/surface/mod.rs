//! A checked mesh made ready for geometry processing, and the curves that are drawn on it.

mod curve;
mod path;
mod index;
mod point;
mod relax;

pub use curve::{Crossing, CurveError, SurfaceCurve};
pub use path::{VertexPath, geodesic_in};
pub use index::SurfaceIndex;
pub use point::SurfacePoint;
pub use relax::{Alignment, Anchor, CurveCost, RelaxError, RelaxOptions, Relaxed, curve_cost, relax};
