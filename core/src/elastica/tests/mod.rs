//! The searches against plain Dijkstra, and the curves they return, on sample, random and research meshes.

mod anchored_loops;
mod loop_search;
mod open_curves;
mod proposals;
mod random_meshes;
mod reference;
mod samples;
