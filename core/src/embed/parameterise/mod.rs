//! Cross field and seamless map for nodes at given vertices: the solves, their constraints, quality measures, and the
//! gradient of the energy at the nodes.
//!
//! The module may use `topology`; it does not move nodes. [`solve`] is the entry.

pub(super) mod chord_lengths;
pub(super) mod constraints;
pub(super) mod feature_axes;
pub(super) mod injective;
pub(super) mod node_gradient;
pub(super) mod quality;
pub(super) mod solve;
pub(super) mod state;
pub(super) mod stiffen;
