//! From a seamless map to arcs and patches: isolines are traced, matched with the arcs of the layout and overlaid with
//! the mesh; patches are cut out as rectangles.
//!
//! The room takes a mesh, a map and a layout. It does not know how the map was computed.

pub(in crate::embed) mod arcs;
pub(in crate::embed) mod completion;
pub(in crate::embed) mod error;
mod isoline_points;
mod isolines;
mod overlay;
pub(in crate::embed) mod rectangles;
pub(in crate::embed) mod separatrix_matching;
pub(in crate::embed) mod traced_layout;

#[cfg(test)]
mod isoline_tests;
#[cfg(test)]
mod samples;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
