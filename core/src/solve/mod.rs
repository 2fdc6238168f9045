//! Linear solving: sparse positive definite systems, the elimination of linear equalities, quadratic programs over
//! cones.
//!
//! The room for numerics that know nothing of meshes. Of this crate it may use nothing but `progress`.

mod cone;
mod eliminate;
mod spd;

pub use cone::{Affine, ConeProgram};
pub use eliminate::{Constraint, EliminationError, Reduction, eliminate};
pub use spd::{Scalar, SolveError, SparseHermitian, SpdFactor, SpdSymbolic, c64};
