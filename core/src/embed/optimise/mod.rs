//! Optimisation of node positions and features, in two phases: with a least-squares map, and with an injective map.
//!
//! The module may use `topology` and `parameterise`. [`optimiser`] holds the state; the other files are operations on
//! it: [`descent`] and [`node_steps`] move nodes, [`initial_map`] starts the injective phase, [`finalise`] ends a
//! phase.

pub(super) mod attachment;
pub(super) mod descent;
pub(super) mod feature_continuation;
pub(super) mod finalise;
pub(super) mod initial_map;
pub(super) mod integer_rounding;
pub(super) mod isoline_crossing;
pub(super) mod nearest_node;
pub(super) mod node_steps;
pub(super) mod optimiser;
pub(super) mod regular_nodes;
pub(super) mod relocation;
pub(super) mod setup;
