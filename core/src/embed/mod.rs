//! The embedding of a layout that a seamless map of the surface gives: arcs are isolines, patches rectangles.

mod emerge;
mod march;
mod patches;
mod rose;
mod trace;
mod weld;

pub use emerge::{EmergeError, Emerged, emerge};
pub use patches::{RectangleError, map_rectangles};
pub use trace::{ArcChain, Folds, TraceError, Traced, preview_arcs, trace_arcs};

#[cfg(test)]
mod samples;
#[cfg(test)]
mod tests;
