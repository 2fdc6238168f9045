//! A checked mesh made ready for geometry processing, and the curves that are drawn on it.

mod barycentric;
mod curvature;
mod curve;
mod index;
mod metric;
mod path;
mod point;
mod relax;
mod shape_operator;
mod trace_geodesic;

pub use barycentric::{barycentric, barycentric_inside};
pub use curvature::{PrincipalCurvature, principal_curvature};
pub use curve::{Crossing, CurveError, SurfaceCurve};
pub use index::SurfaceIndex;
pub(crate) use index::nearest_in_triangle;
pub use metric::Metric;
pub use path::{VertexPath, geodesic_in};
pub use point::SurfacePoint;
#[cfg(test)]
pub(crate) use relax::testing;
pub use relax::{Alignment, CurveCost, RelaxError, RelaxOptions, Relaxed, curve_cost, relax};
pub use shape_operator::{face_curvature, second_fundamental_form};
pub use trace_geodesic::{GeodesicTrace, PolarMap, trace_geodesic};
