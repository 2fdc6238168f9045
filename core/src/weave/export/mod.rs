//! From a layout to files: the optimised embedding, its quads, the report.
//!
//! [`refine::embed_and_refine`] embeds and refines the layout of a session ([`session_export`]) or of a layout file;
//! [`quads`] brings the refinement to the surface; [`files`] and [`report`] write the result.

pub(in crate::weave) mod files;
pub(in crate::weave) mod input;
pub(in crate::weave) mod quads;
pub(in crate::weave) mod refine;
pub(in crate::weave) mod report;
pub(in crate::weave) mod result;
pub(in crate::weave) mod session_export;
