//! Strips: the seamless map with placed curves as isolines, and the triangles each curve's strip covers.
//!
//! The strip of a curve (its spine) is the part of the surface that isolines beside the curve pass. The curves lie along mesh
//! edges. The room uses `mesh`, `surface`, `field`, `param` and `progress`.

mod coverage;
mod error;
mod seamless;
mod strip_map;
#[cfg(test)]
mod tests;

pub use coverage::StripCoverage;
pub use error::StripError;
pub use strip_map::StripMap;
