//! Interactive and unattended weaving: the document, proposals, suggestions, scripts and export.
//!
//! Everything above the geometry and below the window. A [`Model`] is a mesh made ready once; a [`Design`] is
//! the document, a plain value; a [`Session`] holds both together with what is derived from them.

mod candidates;
mod design;
mod detour;
mod embedding;
mod export;
mod fit;
mod ground;
mod guidance;
mod improve;
mod layout;
mod met;
mod model;
mod proposal;
mod quads;
mod recent;
mod report;
mod script;
mod session;
mod suggest;
#[cfg(test)]
mod tests;
mod trial;
mod woven;

pub use design::{Design, DesignError, Pin, Strip, StripId};
pub use embedding::{Drawn, PinnedParts, draw, optimise};
pub use export::{Export, ExportOptions, QuadSize, Shortest, Sketch, Watch, export, finish, write_all};
pub use fit::Fit;
pub use ground::Ground;
pub use improve::{Improvement, ROUNDS};
pub use layout::OpenedLayout;
pub use model::{Model, Options};
pub use proposal::{ElasticEnergy, Proposal};
pub use report::{Before, Times};
pub use script::{Script, ScriptError, Step, replay};
pub use session::{Session, WeaveError};
pub use suggest::{Goal, Stuck};
pub use woven::Woven;

pub use crate::mesh::MeshSource;
