//! A simplified mesh in place of a large one (a proxy), with a map between both.
//!
//! Loops are searched, woven and mapped on the proxy; they are shown and embedded on the original. The proxy has the
//! topology and the features of the original, near-isotropic triangles of even size, and its vertices are vertices of
//! the original. During the simplification every removed vertex keeps barycentric coordinates on the current mesh
//! (successive self-parameterisation). So the map takes neighbours to neighbours and never jumps to another sheet of
//! the surface, however close. Uses `mesh` and `surface` only.

mod build;
mod collapse;
mod connectivity;
mod curve_transfer;
mod curve_walk;
mod face_path;
mod flat_star;
mod guide;
mod improvement;
mod map;
mod quadric;
mod smooth;
#[cfg(test)]
mod tests;
mod tracked_vertices;
mod triangle_shape;
mod vertex_kinds;

pub use build::ProxyError;
pub use curve_walk::CurveTransferError;
pub use map::Proxy;
