//! Seamless maps of surfaces to the plane.
//!
//! A seamless map gives every triangle corner two coordinates. Across an edge the coordinates change by a transition:
//! a number of quarter turns and a translation (Campen, section 6.4; Bommes, section 6.4). The map follows a cross
//! field in the least-squares sense ([`Objective`]) or minimises an energy that is infinite for flipped triangles
//! ([`InjectiveEnergy`]); linear constraints on coordinates ([`CoordinateConstraint`]) hold exactly in both.
//! [`SeamlessSystem`] sets up and solves; [`remove_flips`] repairs flipped triangles of a least-squares map.
//!
//! Dependencies: `mesh`, `surface`, `field`, `solve` and `progress`. The module knows nothing of layouts.

mod assembly;
mod constraints;
mod cut_graph;
mod flip_removal;
mod injective;
mod newton_system;
mod objective;
mod seamless;
mod seamless_system;
mod stiffening;
#[cfg(test)]
mod tests;

use thiserror::Error;

pub use cut_graph::{CutGraph, CutPath};
pub use flip_removal::{
    Effort, FlipReason, FlipRemoval, FlippedTriangle, OrientationProblem, OrientedTriangle, remove_flips,
};
pub(crate) use injective::EnergyDensity;
pub use injective::{DistortionWeights, InjectiveEnergy, InjectiveMap, flipped_triangles, gradients};
pub use newton_system::NewtonSystem;
pub use objective::{Objective, Residual, residuals};
pub use seamless::{CoordinateConstraint, SeamlessMap, Transition, turn};
pub use seamless_system::{Coordinate, SeamlessSystem, Solution};
pub use stiffening::Stiffening;

use crate::mesh::EdgeId;
use crate::progress::Cancelled;
use crate::solve::{EliminationError, SolveError};

/// Why a seamless map could not be set up or solved.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ParamError {
    /// An array does not have one entry per element of the mesh.
    #[error("{what} has {got} entries instead of {want}")]
    WrongLength {
        /// The array.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The expected length.
        want: usize,
    },
    /// The cross field has a singularity at a vertex that is not in the list of nodes.
    #[error("the cross field has a singularity near {edge:?} that is not a node")]
    Topology {
        /// An edge near the singularity.
        edge: EdgeId,
    },
    /// A period jump of the field differs from that of the field the system was set up for.
    #[error("the period jump of {edge:?} differs from that of the system")]
    OtherJump {
        /// The edge.
        edge: EdgeId,
    },
    /// The chain of a constraint does not lead from its first point to its last, or a number is out of range.
    #[error("constraint {constraint} is malformed")]
    Malformed {
        /// Its position in the list.
        constraint: usize,
    },
    /// A constraint contradicts the others.
    #[error("constraint {constraint} contradicts the others (residual {residual:e})")]
    Conflict {
        /// Its position in the list.
        constraint: usize,
        /// The coordinate difference that remains.
        residual: f64,
    },
    /// The seam constraints could not be eliminated.
    #[error(transparent)]
    Elimination(#[from] EliminationError),
    /// The linear system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Cancelled from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Checks the length of an array.
fn expect_length(what: &'static str, got: usize, want: usize) -> Result<(), ParamError> {
    if got == want { Ok(()) } else { Err(ParamError::WrongLength { what, got, want }) }
}
