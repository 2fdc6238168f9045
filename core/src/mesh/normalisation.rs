//! Normalised coordinates: centred, of bounding-box diagonal 1.

use glam::DVec3;

/// The similarity between file coordinates and normalised ones.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Normalisation {
    /// Centre of the bounding box, in file units.
    #[serde(rename = "center")]
    pub centre: DVec3,
    /// Diagonal of the bounding box: file units per normalised unit.
    pub scale: f64,
}

impl Normalisation {
    /// The one that centres the bounding box of `positions` and scales it to diagonal 1; `None` if there are none, they
    /// coincide, or the diagonal overflows or underflows.
    pub fn of(positions: &[DVec3]) -> Option<Self> {
        let min = positions.iter().copied().reduce(DVec3::min)?;
        let max = positions.iter().copied().reduce(DVec3::max)?;
        let scale = (max - min).length();
        let centre = min + 0.5 * (max - min);
        (scale.is_normal() && centre.is_finite()).then_some(Self { centre, scale })
    }

    /// From normalised to file coordinates.
    pub fn to_file(&self, p: DVec3) -> DVec3 {
        p * self.scale + self.centre
    }

    /// From file to normalised coordinates.
    pub fn from_file(&self, p: DVec3) -> DVec3 {
        (p - self.centre) / self.scale
    }
}
