//! Cross fields: smooth interpolation, prescribed topology, singularities, alignment and sizing.
//!
//! A cross is an angle per triangle modulo a quarter turn; a period jump per edge says which direction of one triangle
//! continues which of its neighbour's. Two kinds of fields are computed. Smooth fields (`cross_field`, `feature_aligned`)
//! are solved for by their representation vectors; their singularities come out. Guiding fields (`guiding_field`) have
//! prescribed period jumps, hence prescribed singularities; only the angles are solved for. The module uses `mesh`,
//! `surface`, `solve` and `progress`.

mod alignment;
mod cross_field;
mod edge_paths;
mod error;
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

pub(crate) use alignment::is_feature_dominated;
pub use alignment::{feature_direction_penalties, principal_direction_penalties};
pub use cross_field::{CrossField, interpolate};
pub use edge_paths::{EdgePath, Step, trace_curves};
pub use error::FieldError;
pub use feature_aligned::{AlignmentDirections, feature_aligned_field};
pub use guiding_field::{
    DirectionPenalty, GuidingField, GuidingFieldSystem, RELIABLE_PENALTY, cross_field, indices, turning_number,
};
pub use singularities::{Singularity, cancel_opposite_pairs};
pub use sizing::{SizingSystem, residual_rotations};
