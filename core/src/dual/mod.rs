//! Dual curves on a surface: their arrangement, its regions, and what is still missing for a quad layout.
//!
//! The room knows curves and meshes, not how the curves were found nor what is made of the arrangement.

mod arrangement;
mod assessment;
mod bigon_removal;
mod curve_insertion;
mod refined_mesh;
mod slot_choice;

pub use arrangement::{Arrangement, ArrangementError, Crossing, End, Region, Segment, Side, SideKind};
pub use assessment::{Colour, Finding, RegionReport, assess, vertex_curvatures};
pub use bigon_removal::remove_bigons;
pub(crate) use refined_mesh::Cost;
pub use refined_mesh::{Mark, NoPath, RefinedMesh, next, prev};
