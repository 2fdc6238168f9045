//! Arrangements of dual curves on a surface: crossings, segments and regions, and what a region lacks to be a node of a quad
//! layout.
//!
//! After Campen, *Quad Layouts*, sections 2.1, 5.1 and 7.2. Curves are inserted into a refined mesh as paths of edges, so
//! that the arrangement is combinatorial. Dependencies: [`crate::mesh`] and [`crate::surface`]. The module knows neither
//! how curves are found nor layouts.

mod arrangement;
mod assessment;
mod bigon_removal;
mod crossings;
mod curve_insertion;
mod error;
mod path_insertion;
mod refined_mesh;
mod regions;
mod segments;
mod slot_choice;
#[cfg(test)]
mod tests;

pub use arrangement::Arrangement;
pub use assessment::{Colour, Finding, RegionReport, assess, vertex_curvatures};
pub use bigon_removal::remove_bigons;
pub use crossings::{Crossing, End};
pub use error::ArrangementError;
pub use path_insertion::NoPath;
pub use refined_mesh::{Mark, RefinedMesh, next, prev};
pub use regions::{Region, Side, SideKind};
pub use segments::Segment;
