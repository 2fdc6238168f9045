//! Everything Plait computes: from a triangle mesh, over woven dual strips, to a quad layout and its files.
//!
//! The library knows no window and no GPU and holds no global state. Data flows one way, from mesh to layout
//! to file: a module knows the modules before it, never those after it.

pub mod dual;
pub mod elastica;
pub mod embed;
pub mod field;
pub mod layout;
pub mod mesh;
pub mod param;
pub mod progress;
pub mod proxy;
pub mod quad;
pub mod solve;
pub mod strip;
pub mod surface;
#[cfg(test)]
pub(crate) mod testing;
mod union_find;
pub mod weave;
