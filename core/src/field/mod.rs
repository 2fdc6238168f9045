//! Cross fields: the intrinsic metric they live in, their smooth interpolation and their singularities.
//!
//! The room for four-fold symmetric direction fields on meshes. It may use `mesh`, `surface`, `solve` and `progress`.

mod alignment;
mod cross_field;
mod edge_paths;
mod feature_aligned;
mod guiding_field;
mod period_jumps;
#[cfg(test)]
pub(crate) mod samples;
mod singularities;
mod sizing;
mod smoothing;
#[cfg(test)]
mod tests;

use thiserror::Error;

pub(crate) use alignment::is_feature_dominated;
pub use alignment::{feature_direction_penalties, principal_direction_penalties};
pub use cross_field::{CrossField, interpolate};
pub use edge_paths::{EdgePath, Step, trace_curves};
pub use feature_aligned::{AlignmentDirections, feature_aligned_field};
pub use guiding_field::{
    DirectionPenalty, GuidingField, GuidingFieldSystem, RELIABLE_PENALTY, cross_field, indices, turning_number,
};
pub use singularities::{Singularity, pronounced};
pub use sizing::{SizingSystem, residual_rotations};

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
