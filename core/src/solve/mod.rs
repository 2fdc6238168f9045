//! Linear solving: sparse positive definite systems and the elimination of linear equalities.
//!
//! The room for numerics that know nothing of meshes. It may use nothing else of this crate.

mod eliminate;
mod spd;

pub use eliminate::{Constraint, EliminationError, Reduction, eliminate};
pub use spd::{Scalar, SolveError, SparseHermitian, SpdFactor, SpdSymbolic, c64};
