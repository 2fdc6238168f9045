//! Options of the elastica graph, and the errors of building it.

use std::f64::consts::FRAC_PI_2;

use thiserror::Error;

use crate::progress::Cancelled;

/// Weights and size of the elastica graph. The equations and sections are those of Campen, *Quad Layouts*.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticaOptions {
    /// Number of rings `k`: each vertex is joined to the vertices of its `k`-ring. 3 to 5 are useful, 1 to 8 are
    /// accepted. More rings give finer directions and a slower search.
    pub rings: usize,
    /// Weight α of alignment with the principal directions in (8.1). 0: no alignment.
    pub alpha: f64,
    /// Weight β of the squared geodesic curvature in (8.1), for a surface of model size 1. 0: turning costs
    /// nothing.
    pub beta: f64,
    /// Largest turning angle between consecutive geodesics, in radians, from 0 to a right angle. The default is the 30°
    /// of section 8.1.3.
    pub max_turn: f64,
    /// Factor of the alignment cost at sharp edges, in place of `(|κ₁| − |κ₂|)²`. The default is the value that the most
    /// curved tenth of ordinary models has.
    pub feature_weight: f64,
    /// Upper bound of the deviation `1 / sin θ − 1` at a sharp edge crossed at angle θ. The default 20 is reached below 3°.
    pub feature_cap: f64,
    /// Whether boundary edges count as sharp, so that curves end there at a right angle (section 8.1.6).
    pub aligned_boundary: bool,
}

impl Default for ElasticaOptions {
    fn default() -> Self {
        Self {
            rings: 4,
            alpha: 1.0,
            beta: 0.25,
            max_turn: std::f64::consts::FRAC_PI_6,
            feature_weight: 1000.0,
            feature_cap: 20.0,
            aligned_boundary: true,
        }
    }
}

impl ElasticaOptions {
    /// Fails with [`ElasticaError::BadOptions`] if a value is out of range.
    pub(super) fn check(&self) -> Result<(), ElasticaError> {
        let in_range = (1..=8).contains(&self.rings)
            && self.alpha >= 0.0
            && self.beta >= 0.0
            && (0.0..=FRAC_PI_2).contains(&self.max_turn)
            && self.feature_weight >= 0.0
            && self.feature_cap >= 0.0;
        if in_range { Ok(()) } else { Err(ElasticaError::BadOptions) }
    }
}

/// Why an elastica graph was not built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ElasticaError {
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Curvatures or sharp-edge flags of another mesh.
    #[error("{given} values given for {expected} vertices or edges of the mesh")]
    WrongLength {
        /// Number of values given.
        given: usize,
        /// Number of vertices or edges.
        expected: usize,
    },
    /// A number of rings, a weight or an angle outside its range.
    #[error("an option of the elastica graph is out of range")]
    BadOptions,
    /// More geodesics or steps than 32-bit indices can name.
    #[error("the mesh is too large for the elastica graph")]
    TooLarge,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range_are_refused() {
        let default = ElasticaOptions::default();
        assert_eq!(default.check(), Ok(()));
        let bad = [
            ElasticaOptions { rings: 0, ..default },
            ElasticaOptions { rings: 9, ..default },
            ElasticaOptions { alpha: -1.0, ..default },
            ElasticaOptions { beta: f64::NAN, ..default },
            ElasticaOptions { max_turn: FRAC_PI_2 + 1e-9, ..default },
            ElasticaOptions { feature_cap: -1.0, ..default },
        ];
        for options in bad {
            assert_eq!(options.check(), Err(ElasticaError::BadOptions), "{options:?}");
        }
    }
}
