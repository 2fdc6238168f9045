//! Moving nodes to where the map's distortion is least, with features on isolines and no flipped triangles.
//!
//! The room may use `topology` and `parameterise`. One [`optimiser`] holds the state; the other files are its steps.

pub(in crate::embed) mod attachment;
pub(in crate::embed) mod feature_continuation;
pub(in crate::embed) mod finalise;
pub(in crate::embed) mod initial_map;
pub(in crate::embed) mod integer_rounding;
pub(in crate::embed) mod isoline_crossing;
pub(in crate::embed) mod nearest_node;
pub(in crate::embed) mod node_steps;
pub(in crate::embed) mod optimiser;
pub(in crate::embed) mod regular_nodes;
pub(in crate::embed) mod relocation;
pub(in crate::embed) mod setup;
