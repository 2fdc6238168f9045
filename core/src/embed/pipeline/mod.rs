//! An optimisation from the initial embedding to the result: its phases, by way of a smaller mesh where the mesh is large, with
//! short chords collapsed where that is asked for; and the prediction of how well a layout will fit.

pub(in crate::embed) mod chord_collapse;
pub(in crate::embed) mod coarse_to_fine;
pub(in crate::embed) mod fit_prediction;
pub(in crate::embed) mod optimise;
pub(in crate::embed) mod phases;
pub(in crate::embed) mod reduced_problem;
