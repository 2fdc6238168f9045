//! The implementation of [`crate::engine`] by a session of the library.
//!
//! [`opener`] opens sessions, [`engine`] carries out what the window asks for, [`snapshot`] makes the scenes that the
//! window shows. Layout and embedding are computed after a change of the strips, see [`layout_state`].

mod embedding;
mod engine;
mod errors;
mod layout_state;
mod opener;
mod proxy_display;
mod remarks;
mod snapshot;
mod stripes;

pub use opener::SessionOpener;
