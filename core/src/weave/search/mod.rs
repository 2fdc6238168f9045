//! Searches for strips: the next strip to suggest, and better strips for a valid layout.
//!
//! [`suggest`] takes the candidate that brings the arrangement nearest to its goal. [`improve`] is a local search over the
//! strips; its moves are in [`trial`], its objective in [`fit`]. Candidates are loops of the elastica graph
//! ([`candidates`]), loops aligned to the smooth cross field ([`alignment_loops`]), or curves by connectivity alone
//! ([`detour`]).

pub(in crate::weave) mod alignment_loops;
pub(in crate::weave) mod candidates;
pub(in crate::weave) mod detour;
pub(in crate::weave) mod fit;
pub(in crate::weave) mod improve;
pub(in crate::weave) mod suggest;
pub(in crate::weave) mod trial;
