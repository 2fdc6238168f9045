//! Cross fields: the intrinsic metric they live in, their smooth interpolation and their singularities.
//!
//! The room for four-fold symmetric direction fields on meshes. It may use `mesh`, `surface`, `solve` and `progress`.

mod alignment;
mod cross;
mod curves;
mod guided;
mod jumps;
#[cfg(test)]
pub(crate) mod samples;
mod shape;
mod singular;
mod sizing;
mod smooth;
#[cfg(test)]
mod tests;

use thiserror::Error;

pub(crate) use alignment::is_creased;
pub use alignment::{feature_guides, shape_guides};
pub use cross::{CrossField, interpolate};
pub use curves::{EdgePath, Step, trace_curves};
pub use guided::{Guide, GuidedField, GuidedSystem, RELIABLE, cross_field, indices, turning_number};
pub use shape::{Guides, shape_field};
pub use singular::{Singularity, pronounced};
pub use sizing::{SizingSystem, rest_turns};

use crate::mesh::{EdgeId, VertexId};
use crate::progress::Cancelled;
use crate::solve::SolveError;

/// Why a cross field could not be computed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FieldError {
    /// An array has not one entry per element of the mesh.
    #[error("{what} has {got} entries, the mesh needs {want}")]
    WrongLength {
        /// The array.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The right length.
        want: usize,
    },
    /// An odd number of edges of one curve meet at a vertex inside the surface.
    #[error("curve {curve} ends at {vertex:?} inside the surface, near {edge:?}")]
    OpenCurve {
        /// The curve.
        curve: u32,
        /// The vertex.
        vertex: VertexId,
        /// One of its edges there.
        edge: EdgeId,
    },
    /// The smoothing system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Checks that an array has one entry per element.
fn expect_length(what: &'static str, got: usize, want: usize) -> Result<(), FieldError> {
    if got == want { Ok(()) } else { Err(FieldError::WrongLength { what, got, want }) }
}
