//! Smoothing of a curve on the surface towards an elastica, within its homotopy class.
//!
//! A curve found on a coarse graph turns in steps. Its crossings slide along their edges and minimise the sum of the cost
//! (8.1) of Campen's thesis, length plus bending, and a weak fidelity term. The curve stays in a tube around the
//! original: length alone would slide a loop off the limb that it surrounds. Undulations much shorter than
//! `2π (β R²)^¼` (`R` the radius of the tube) are smoothed out; the place of the curve is kept.
//!
//! A crossing that reaches the end of its edge is blocked by a vertex. The curve then passes over the vertex: the run of
//! spokes crossed on one side of it is replaced by the spokes on the other side. So the homotopy class on the surface is
//! kept, but not the one on the surface punctured at its vertices. Sliding and passing alternate. In the end each vertex
//! that still blocks the curve is tried, by sliding the crossings around it on either side. The result is the best curve
//! found on the way.

mod banded;
mod energy;
mod options;
mod relaxation;
#[cfg(test)]
mod tests;
mod triangle_strip;
mod tube;
mod vertex_passing;

pub use options::{Alignment, CurveCost, RelaxError, RelaxOptions, Relaxed, Waypoint};
pub use relaxation::{curve_cost, relax};
