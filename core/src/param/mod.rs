//! Seamless maps of surfaces to the plane: two coordinates per triangle corner that continue across every edge up
//! to quarter turns and translations, made to follow a cross field and to satisfy linear relations exactly.
//!
//! The room may use `mesh`, `surface`, `field`, `solve` and `progress`; it does not know what the maps are for.

mod assembly;
mod constraints;
mod cut;
mod injective;
mod objective;
mod seamless;
mod solve;
#[cfg(test)]
mod tests;
mod unfold;

use thiserror::Error;

pub use cut::{Cut, CutPath};
pub(crate) use injective::EnergyDensity;
pub use injective::{DistortionWeights, InjectiveEnergy, InjectiveMap, NewtonSystem, folds, gradients};
pub use objective::{Objective, Residual, residuals};
pub use seamless::{CoordinateConstraint, SeamlessMap, Transition, turn};
pub use solve::{Coordinate, SeamlessSystem, Solution};
pub use unfold::{Effort, FlipReason, FlippedTriangle, OrientationProblem, OrientedTriangle, Unfolded, unfold};

use crate::mesh::EdgeId;
use crate::progress::Cancelled;
use crate::solve::{EliminationError, SolveError};

/// Why there is no seamless map.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ParamError {
    /// An array has not one entry per element of the mesh.
    #[error("{what} has {got} entries instead of {want}")]
    WrongLength {
        /// The array.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The right length.
        want: usize,
    },
    /// The field is singular where no node is.
    #[error("the cross field cannot be combed across {edge:?}")]
    Topology {
        /// An edge nearby.
        edge: EdgeId,
    },
    /// The field has other period jumps than the system was made for.
    #[error("the period jump of {edge:?} has changed")]
    OtherJump {
        /// The edge.
        edge: EdgeId,
    },
    /// The chain of a relation does not lead from its first point to its last, or it has a number out of range.
    #[error("relation {relation} is malformed")]
    Malformed {
        /// Its position in the list.
        relation: usize,
    },
    /// A relation contradicts the others.
    #[error("relation {relation} contradicts the others (by {rest:e})")]
    Conflict {
        /// Its position in the list.
        relation: usize,
        /// The difference that remains.
        rest: f64,
    },
    /// The cuts could not be eliminated.
    #[error(transparent)]
    Elimination(#[from] EliminationError),
    /// The map could not be solved for.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Checks the length of an array.
fn expect_length(what: &'static str, got: usize, want: usize) -> Result<(), ParamError> {
    if got == want { Ok(()) } else { Err(ParamError::WrongLength { what, got, want }) }
}
