//! Cross field and seamless map for nodes at given vertices: linear solves, their constraints, and how good the map is.
//!
//! The room may use `topology`; it does not move nodes.

pub(in crate::embed) mod chord_lengths;
pub(in crate::embed) mod constraints;
pub(in crate::embed) mod feature_axes;
pub(in crate::embed) mod node_gradient;
pub(in crate::embed) mod quality;
pub(in crate::embed) mod solve;
pub(in crate::embed) mod state;
