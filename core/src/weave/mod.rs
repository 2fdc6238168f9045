//! Interactive and unattended weaving: the document, proposals, suggestions, scripts and export.
//!
//! Everything above the geometry and below the window. A [`Model`] is a mesh made ready once; a [`Design`] is
//! the document, a plain value; a [`Session`] holds both together with what is derived from them.

mod design;
mod embedding;
mod error;
mod export;
mod loop_contacts;
mod mesh_role;
mod model;
mod opened_layout;
mod preview;
mod proposal;
mod recent;
mod script;
mod search;
mod session;
#[cfg(test)]
mod tests;
mod woven;

pub use design::{Design, DesignError, Pin, Strip, StripId};
pub use embedding::{InitialLayout, PinnedParts, initial_layout, optimise};
pub use error::{NoSuggestion, WeaveError};
pub use export::files::{
    CollapseLength, EmbeddingInput, Export, ExportOptions, QuadSize, Watch, export, finish, write_all,
};
pub use export::report::{Before, Times};
pub use mesh_role::MeshRole;
pub use model::{Model, Options};
pub use opened_layout::OpenedLayout;
pub use preview::arc_polylines::{embedding_polylines, move_ends, smoothed_polyline};
pub use preview::design_overlay::{FacePieces, refined_corners};
pub use preview::face_distortion::{FaceDistortion, face_distortion, largest_aspect};
pub use proposal::{ElasticEnergy, Proposal};
pub use script::{Script, ScriptError, Step, replay};
pub use search::fit::Fit;
pub use search::improve::{IMPROVEMENT_ROUNDS, Improvement};
pub use search::suggest::Goal;
pub use session::Session;
pub use woven::Woven;

pub use crate::mesh::MeshSource;
