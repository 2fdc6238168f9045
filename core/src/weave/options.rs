//! The options of a design.

use serde::{Deserialize, Serialize};

use crate::mesh::{NormalisedBy, SHARP_DIHEDRAL};

/// The settings of a design.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// What the model size is taken from. All lengths of a design are fractions of it, its pins are in the coordinates
    /// normalised by it.
    #[serde(default = "NormalisedBy::unnamed", skip_serializing_if = "NormalisedBy::is_unnamed")]
    pub normalised_by: NormalisedBy,
    /// Radius of the ball over which curvature is averaged, as a fraction of the model size. Relief smaller than this does
    /// not align strips.
    pub curvature_radius: f64,
    /// Dihedral angle above which an edge is sharp, in radians.
    pub sharp_dihedral: f64,
    /// Whether strips end at right angles on the boundary.
    pub aligned_boundary: bool,
    /// Number of triangles of the proxy. A mesh of more than twice as many is woven on a proxy; 0: none is.
    #[serde(skip_serializing_if = "is_default_proxy")]
    pub proxy: u32,
    /// Radius over which the surface is smoothed for weaving, as a fraction of the model size; strips ignore smaller
    /// relief. 0: no smoothing. A smoothed mesh is a proxy, whatever its size.
    #[serde(skip_serializing_if = "is_zero")]
    pub smoothing: f64,
}

/// [`RelaxOptions::tie`](crate::surface::RelaxOptions::tie) of new designs: far above the rounding of files of seven digits, far
/// below what matters for a curve.
const RELAXATION_TIE: f64 = 1e-5;

/// Number of triangles of a proxy. `docs/decisions.md` has the measurements.
const PROXY: u32 = 30_000;

fn is_default_proxy(n: &u32) -> bool {
    *n == PROXY
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl Options {
    /// See [`RelaxOptions::tie`](crate::surface::RelaxOptions::tie). Designs of before keep the curves that rounding decided.
    pub(in crate::weave) fn relaxation_tie(&self) -> f64 {
        match self.normalised_by {
            NormalisedBy::BoundingBox => 0.0,
            NormalisedBy::Surface => RELAXATION_TIE,
        }
    }

    /// The options of a file that names none. They differ from those of a new design where files of before would change.
    pub fn unnamed() -> Self {
        Self { normalised_by: NormalisedBy::unnamed(), ..Self::default() }
    }
}

/// The options of a new design.
impl Default for Options {
    fn default() -> Self {
        Self {
            normalised_by: NormalisedBy::Surface,
            curvature_radius: 0.03,
            sharp_dihedral: SHARP_DIHEDRAL,
            aligned_boundary: true,
            proxy: PROXY,
            smoothing: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_left_out_have_their_defaults() {
        let options: Options = serde_json::from_str(r#"{"curvature_radius": 0.05}"#).unwrap();
        assert_eq!(options, Options { curvature_radius: 0.05, ..Options::unnamed() });
    }

    #[test]
    fn a_file_that_names_no_normalisation_means_the_bounding_box() {
        let read = |text| serde_json::from_str::<Options>(text).unwrap();
        assert_eq!(read("{}"), Options { normalised_by: NormalisedBy::BoundingBox, ..Options::default() });
        assert!(!serde_json::to_string(&read("{}")).unwrap().contains("normalised_by"));
        let text = serde_json::to_string(&Options::default()).unwrap();
        assert!(text.contains(r#""normalised_by":"surface""#), "{text}");
        assert_eq!(read(&text), Options::default());
    }

    #[test]
    fn a_design_without_a_choice_of_proxy_or_smoothing_does_not_name_them() {
        let text = serde_json::to_string(&Options::default()).unwrap();
        assert!(!text.contains("proxy") && !text.contains("smoothing"), "{text}");
        let text = serde_json::to_string(&Options { proxy: 0, smoothing: 0.01, ..Options::default() }).unwrap();
        assert!(text.contains(r#""proxy":0"#) && text.contains(r#""smoothing":0.01"#), "{text}");
    }
}
