//! Interactive and unattended weaving: designs, proposals, suggestions, scripts and export.
//!
//! A [`Model`] is a mesh prepared once. A [`Design`] is the document, a plain value with the placed strips. A [`Session`]
//! holds a model, a design and its history, together with the arrangement of the strips ([`Woven`]). Searches for strips
//! are in `search`, the files of a result in `export`, data that only a window shows in `preview`.

mod anchor;
mod anchored;
mod design;
mod embedding;
mod error;
mod export;
mod loop_contacts;
mod mesh_role;
mod model;
mod opened_layout;
mod options;
mod preview;
mod proposal;
mod recent;
mod script;
mod search;
mod session;
#[cfg(test)]
mod tests;
mod woven;

pub use anchor::Anchor;
pub use design::{Design, DesignError, ElasticEnergy, Pin, Strip, StripId};
pub use embedding::{InitialLayout, PinnedElements, initial_layout, optimise};
pub use error::{NoLoop, NoSuggestion, WeaveError};
pub use export::files::existing_files;
pub use export::input::{CollapseLength, EmbeddingInput, ExportOptions, QuadSize, Watch};
pub use export::refine::embed_and_refine;
pub use export::result::{Export, InitialState, Times};
pub use export::session_export::{export, write_all};
pub use mesh_role::MeshRole;
pub use model::Model;
pub use opened_layout::OpenedLayout;
pub use options::Options;
pub use preview::arc_polylines::{embedding_polylines, move_ends, smoothed_polyline};
pub use preview::design_overlay::{FacePieces, refined_corners};
pub use preview::face_distortion::{FaceDistortion, face_distortion, largest_aspect};
pub use proposal::Proposal;
pub use script::{Script, ScriptAnchor, ScriptError, Step, replay};
pub use search::fit::Fit;
pub use search::improve::{IMPROVEMENT_ROUNDS, Improvement};
pub use search::suggest::Goal;
pub use session::Session;
pub use woven::Woven;

pub use crate::mesh::MeshSource;
