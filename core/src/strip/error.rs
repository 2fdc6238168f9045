//! Errors of strips.

use thiserror::Error;

use crate::field::FieldError;
use crate::param::ParamError;
use crate::progress::Cancelled;

/// Why strips could not be computed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StripError {
    /// The cross field could not be computed.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The map could not be computed.
    #[error(transparent)]
    Map(#[from] ParamError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
