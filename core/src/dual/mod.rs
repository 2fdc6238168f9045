//! Dual curves on a surface: their arrangement, its regions, and what is still missing for a quad layout.
//!
//! The room knows curves and meshes, not how the curves were found nor what is made of the arrangement.

mod arrangement;
mod assess;
mod insert;
mod refined;
mod slots;
mod untangle;

pub use arrangement::{Arrangement, ArrangementError, Crossing, End, Region, Segment, Side, SideKind};
pub use assess::{Colour, Finding, RegionReport, assess, vertex_curvatures};
pub(crate) use refined::Cost;
pub use refined::{Mark, NoRoute, RefinedMesh, next, prev};
pub use untangle::untangle;
