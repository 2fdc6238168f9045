//! Errors of cross fields.

use thiserror::Error;

use crate::mesh::{EdgeId, VertexId};
use crate::progress::Cancelled;
use crate::solve::SolveError;

/// Why a cross field could not be computed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FieldError {
    /// An array does not have one entry per element of the mesh.
    #[error("{what} has {got} entries, the mesh needs {want}")]
    WrongLength {
        /// The array.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The right length.
        want: usize,
    },
    /// A curve ends at an inner vertex.
    #[error("curve {curve} ends at inner vertex {vertex:?}, at {edge:?}")]
    OpenCurve {
        /// The curve.
        curve: u32,
        /// The vertex.
        vertex: VertexId,
        /// The edge of the curve there.
        edge: EdgeId,
    },
    /// A linear system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Checks that an array has one entry per element.
///
/// # Errors
///
/// [`FieldError::WrongLength`].
pub(super) fn expect_length(what: &'static str, got: usize, want: usize) -> Result<(), FieldError> {
    if got == want { Ok(()) } else { Err(FieldError::WrongLength { what, got, want }) }
}
