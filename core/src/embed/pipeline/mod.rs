//! An optimisation from the initial embedding to the result: its phases, by way of a smaller mesh where the mesh is
//! large, with short chords collapsed where that is asked for; and the prediction of how well a layout will fit.
//!
//! [`coarse_to_fine`] is the entry. The module may use all other modules of `embed`.

pub(super) mod chord_collapse;
pub(super) mod coarse_to_fine;
pub(super) mod extraction;
pub(super) mod fit_prediction;
pub(super) mod optimise;
pub(super) mod phases;
pub(super) mod reduced_problem;
pub(super) mod report;
