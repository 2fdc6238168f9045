//! Numerics: sparse Hermitian positive definite systems, elimination of linear equalities, second-order cone programs.
//!
//! Nothing here knows meshes. Of this crate the room uses `progress` only.

mod cone;
mod eliminate;
mod spd;

pub use cone::{Affine, ConeProgram};
pub use eliminate::{Constraint, EliminationError, Reduction, eliminate};
pub use spd::{Scalar, SolveError, SparseHermitian, SpdFactor, SpdSymbolic, c64};
