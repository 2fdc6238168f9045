//! Searching for strips: the suggestion that helps most, and better strips for a valid layout.
//!
//! [`suggest`] takes the candidate that brings the arrangement furthest; [`improve`] tries changes ([`trial`]) by how well
//! their layouts would fit ([`fit`]).

pub(in crate::weave) mod alignment_loops;
pub(in crate::weave) mod candidates;
pub(in crate::weave) mod detour;
pub(in crate::weave) mod fit;
pub(in crate::weave) mod improve;
pub(in crate::weave) mod suggest;
pub(in crate::weave) mod trial;
