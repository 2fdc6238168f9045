//! From a layout to files: the optimised embedding, its quads, the report.

pub(in crate::weave) mod files;
pub(in crate::weave) mod quads;
pub(in crate::weave) mod report;
