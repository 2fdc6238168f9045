//! Options of local stiffening: the weights of flipped triangles grow, and those around them less.

use crate::param::Stiffening;

/// Stiffening that raises the weight of a flipped triangle by a factor `1 + growth` in each round.
///
/// The growth fades over five rings of triangles by a factor of 0.7 from ring to ring, so that no flip moves to the
/// neighbour. Weights beyond 10⁴, where 1 is usual, would make the system ill-conditioned.
pub(in crate::embed) const fn stiffening(growth: f64) -> Stiffening {
    Stiffening { growth, fading: 0.7, rings: 5, limit: 1e4 }
}
