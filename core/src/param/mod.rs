//! Seamless maps of surfaces to the plane: two coordinates per triangle corner that continue across every edge up
//! to quarter turns and translations, made to follow a cross field and to satisfy linear relations exactly.
//!
//! The room may use `mesh`, `field`, `solve` and `progress`; it does not know what the maps are for.

mod seamless;
mod unfold;

pub use seamless::{Relation, SeamlessMap, Transition, turn};
pub use unfold::{Fold, FoldReason, OrientationProblem, OrientedTriangle, Unfolded, unfold};
