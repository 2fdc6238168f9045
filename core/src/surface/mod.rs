//! Geometry on a triangle mesh: points, curves, geodesics, curvature, nearest points and rays.
//!
//! A curve is the list of mesh edges that it crosses ([`SurfaceCurve`]); [`relax`](fn@relax) smooths it within its
//! homotopy class.

mod barycentric;
mod curvature;
mod curve;
mod funnel;
mod geodesic;
mod index;
mod metric;
mod point;
mod relax;
mod shape_operator;
mod tangent_tensor;
#[cfg(test)]
pub(crate) mod testing;
mod trace_geodesic;
mod vertex_fan;
mod vertex_path;

pub use barycentric::{barycentric, barycentric_inside};
pub use curvature::{PrincipalCurvature, principal_curvature};
pub use curve::{Crossing, CurveError, SurfaceCurve};
pub use geodesic::geodesic_in;
pub use index::SurfaceIndex;
pub(crate) use index::nearest_in_triangle;
pub use metric::Metric;
pub use point::SurfacePoint;
pub use relax::{Alignment, CurveCost, RelaxError, RelaxOptions, Relaxed, Waypoint, curve_cost, relax};
pub use shape_operator::{face_curvature, second_fundamental_form};
pub use trace_geodesic::{GeodesicTrace, PolarMap, trace_geodesic};
pub use vertex_path::VertexPath;
